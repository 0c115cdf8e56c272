//! The only code that turns bytes into numbers.

/// Reads little-endian numbers off the front of a record; behind its end they are 0, which its length rules out.
///
/// What a [`Cursor`](super::Cursor) may run out of is found out once a record, so that no number can be an error.
pub(crate) struct Fields<'a>(&'a [u8]);

impl<'a> Fields<'a> {
    #[inline]
    pub(crate) fn new<const LEN: usize>(record: &'a [u8; LEN]) -> Self {
        Self(record)
    }

    #[inline]
    pub(crate) fn bytes<const N: usize>(&mut self) -> [u8; N] {
        let Some((head, rest)) = self.0.split_first_chunk::<N>() else { return [0; N] };
        self.0 = rest;
        *head
    }

    #[inline]
    pub(crate) fn u16(&mut self) -> u16 {
        u16::from_le_bytes(self.bytes())
    }

    #[inline]
    pub(crate) fn u32(&mut self) -> u32 {
        u32::from_le_bytes(self.bytes())
    }

    #[inline]
    pub(crate) fn f32(&mut self) -> f32 {
        f32::from_le_bytes(self.bytes())
    }

    #[inline]
    pub(crate) fn u16s<const N: usize>(&mut self) -> [u16; N] {
        [(); N].map(|()| self.u16())
    }

    #[inline]
    pub(crate) fn u32s<const N: usize>(&mut self) -> [u32; N] {
        [(); N].map(|()| self.u32())
    }

    #[inline]
    pub(crate) fn i32s<const N: usize>(&mut self) -> [i32; N] {
        [(); N].map(|()| i32::from_le_bytes(self.bytes()))
    }

    #[inline]
    pub(crate) fn f32s<const N: usize>(&mut self) -> [f32; N] {
        [(); N].map(|()| self.f32())
    }

    #[inline]
    pub(crate) fn f64s<const N: usize>(&mut self) -> [f64; N] {
        [(); N].map(|()| f64::from_le_bytes(self.bytes()))
    }
}
