//! The only code that turns bytes into numbers.

use crate::error::{DecodeError, SectionKind, saturate};

/// Reads little-endian numbers one after the other and knows in which section it stands.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Cursor<'a> {
    rest: &'a [u8],
    len: usize,
    section: SectionKind,
}

impl<'a> Cursor<'a> {
    pub(crate) fn new(bytes: &'a [u8], section: SectionKind) -> Self {
        Self { rest: bytes, len: bytes.len(), section }
    }

    /// Bytes read so far.
    pub(crate) fn position(&self) -> usize {
        self.len.saturating_sub(self.rest.len())
    }

    /// Bytes not yet read.
    pub(crate) fn rest(&self) -> &'a [u8] {
        self.rest
    }

    /// The section must end here.
    pub(crate) fn end(&self) -> Result<(), DecodeError> {
        if self.rest.is_empty() {
            return Ok(());
        }
        let [expected, found] = [self.position(), self.len].map(saturate);
        Err(DecodeError::WrongLength { section: self.section, expected, found })
    }

    pub(crate) fn array<const N: usize>(&mut self) -> Result<[u8; N], DecodeError> {
        let Some((head, rest)) = self.rest.split_first_chunk::<N>() else { return Err(self.truncated(N)) };
        self.rest = rest;
        Ok(*head)
    }

    pub(crate) fn bytes(&mut self, n: usize) -> Result<&'a [u8], DecodeError> {
        let Some((head, rest)) = self.rest.split_at_checked(n) else { return Err(self.truncated(n)) };
        self.rest = rest;
        Ok(head)
    }

    /// `n` pairs of bytes: 16-bit numbers or halves, left in flash.
    pub(crate) fn pairs(&mut self, n: usize) -> Result<&'a [[u8; 2]], DecodeError> {
        let (pairs, _) = self.bytes(n.saturating_mul(2))?.as_chunks();
        Ok(pairs)
    }

    pub(crate) fn u8(&mut self) -> Result<u8, DecodeError> {
        let [byte] = self.array()?;
        Ok(byte)
    }

    pub(crate) fn u16(&mut self) -> Result<u16, DecodeError> {
        Ok(u16::from_le_bytes(self.array()?))
    }

    pub(crate) fn i16(&mut self) -> Result<i16, DecodeError> {
        Ok(i16::from_le_bytes(self.array()?))
    }

    pub(crate) fn u32(&mut self) -> Result<u32, DecodeError> {
        Ok(u32::from_le_bytes(self.array()?))
    }

    pub(crate) fn i32(&mut self) -> Result<i32, DecodeError> {
        Ok(i32::from_le_bytes(self.array()?))
    }

    pub(crate) fn f32(&mut self) -> Result<f32, DecodeError> {
        Ok(f32::from_le_bytes(self.array()?))
    }

    pub(crate) fn f64(&mut self) -> Result<f64, DecodeError> {
        Ok(f64::from_le_bytes(self.array()?))
    }

    pub(crate) fn u16s<const N: usize>(&mut self) -> Result<[u16; N], DecodeError> {
        let mut numbers = [0; N];
        for number in &mut numbers {
            *number = self.u16()?;
        }
        Ok(numbers)
    }

    pub(crate) fn u32s<const N: usize>(&mut self) -> Result<[u32; N], DecodeError> {
        let mut numbers = [0; N];
        for number in &mut numbers {
            *number = self.u32()?;
        }
        Ok(numbers)
    }

    pub(crate) fn f32s<const N: usize>(&mut self) -> Result<[f32; N], DecodeError> {
        let mut floats = [0.0; N];
        for x in &mut floats {
            *x = self.f32()?;
        }
        Ok(floats)
    }

    fn truncated(&self, n: usize) -> DecodeError {
        let needed = self.position().saturating_add(n);
        DecodeError::Truncated { section: self.section, needed: saturate(needed), available: saturate(self.len) }
    }
}
