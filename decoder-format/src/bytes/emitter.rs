//! The only code that turns numbers into bytes: the reverse of [`Fields`](super::Fields).

/// Writes little-endian numbers one after the other into a record of `N` bytes.
pub(crate) struct Emitter<const N: usize> {
    record: [u8; N],
    /// Bytes written so far.
    len: usize,
}

impl<const N: usize> Emitter<N> {
    pub(crate) fn new() -> Self {
        Self { record: [0; N], len: 0 }
    }

    pub(crate) fn bytes(&mut self, bytes: impl IntoIterator<Item = u8>) {
        for byte in bytes {
            if let Some(slot) = self.record.get_mut(self.len) {
                *slot = byte;
            }
            self.len = self.len.saturating_add(1);
        }
    }

    pub(crate) fn u16s(&mut self, numbers: impl IntoIterator<Item = u16>) {
        self.bytes(numbers.into_iter().flat_map(u16::to_le_bytes));
    }

    pub(crate) fn u32s(&mut self, numbers: impl IntoIterator<Item = u32>) {
        self.bytes(numbers.into_iter().flat_map(u32::to_le_bytes));
    }

    pub(crate) fn i32s(&mut self, numbers: impl IntoIterator<Item = i32>) {
        self.bytes(numbers.into_iter().flat_map(i32::to_le_bytes));
    }

    pub(crate) fn f32s(&mut self, numbers: impl IntoIterator<Item = f32>) {
        self.bytes(numbers.into_iter().flat_map(f32::to_le_bytes));
    }

    pub(crate) fn f64s(&mut self, numbers: impl IntoIterator<Item = f64>) {
        self.bytes(numbers.into_iter().flat_map(f64::to_le_bytes));
    }

    /// The record, all of whose bytes are written.
    pub(crate) fn finish(self) -> [u8; N] {
        debug_assert!(self.len == N, "{} bytes written into a record of {N}", self.len);
        self.record
    }
}
