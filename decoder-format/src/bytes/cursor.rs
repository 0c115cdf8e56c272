//! Bytes taken off the front of a section.

use crate::error::{DecodeError, SectionKind, saturate};

/// Takes one part of a section after the other, and knows which section it is.
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

    /// The next `n` bytes.
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

    /// A record of `N` bytes.
    pub(crate) fn record<const N: usize>(&mut self) -> Result<&'a [u8; N], DecodeError> {
        self.bytes(N)?.first_chunk().ok_or(DecodeError::Internal)
    }

    fn truncated(&self, n: usize) -> DecodeError {
        let needed = self.position().saturating_add(n);
        DecodeError::Truncated { section: self.section, needed: saturate(needed), available: saturate(self.len) }
    }
}
