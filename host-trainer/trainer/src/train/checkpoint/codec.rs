//! Numbers, texts and arrays as bytes with a checksum, and back.

use std::io::{self, Write};

use bytemuck::{Pod, Zeroable};

use super::{CheckpointFault, MAGIC, VERSION};

/// Bytes of the checksum at the end.
const CHECKSUM_LEN: usize = 4;

/// Writes a checkpoint front to back.
pub(super) struct Encoder<W> {
    out: W,
    checksum: crc32fast::Hasher,
}

impl<W: Write> Encoder<W> {
    /// Begins with magic and version.
    pub(super) fn begin(out: W) -> io::Result<Self> {
        let mut encoder = Self { out, checksum: crc32fast::Hasher::new() };
        encoder.bytes(&MAGIC)?;
        encoder.value(VERSION)?;
        Ok(encoder)
    }

    fn bytes(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.checksum.update(bytes);
        self.out.write_all(bytes)
    }

    /// One number.
    pub(super) fn value<T: Pod>(&mut self, value: T) -> io::Result<()> {
        self.bytes(bytemuck::bytes_of(&value))
    }

    /// A count and so many numbers.
    pub(super) fn values<T: Pod>(&mut self, values: &[T]) -> io::Result<()> {
        self.value(values.len() as u64)?;
        self.bytes(bytemuck::cast_slice(values))
    }

    /// A count and so many bytes of UTF-8.
    pub(super) fn text(&mut self, text: &str) -> io::Result<()> {
        self.values(text.as_bytes())
    }

    /// Ends with the checksum.
    pub(super) fn end(mut self) -> io::Result<()> {
        let checksum = self.checksum.clone().finalize();
        self.value(checksum)
    }
}

/// Reads a checkpoint front to back.
pub(super) struct Decoder<'b> {
    rest: &'b [u8],
}

impl<'b> Decoder<'b> {
    /// Checks magic, version and checksum.
    pub(super) fn begin(bytes: &'b [u8]) -> Result<Self, CheckpointFault> {
        let mut decoder = Self { rest: bytes.strip_prefix(&MAGIC).ok_or(CheckpointFault::Magic)? };
        let found: u32 = decoder.value("version")?;
        if found != VERSION {
            return Err(CheckpointFault::Version { found });
        }
        let (content, checksum) = bytes.split_at(bytes.len() - CHECKSUM_LEN.min(decoder.rest.len()));
        let found = Decoder { rest: checksum }.value("checksum")?;
        let computed = crc32fast::hash(content);
        if found != computed {
            return Err(CheckpointFault::Checksum { found, computed });
        }
        let n = decoder.rest.len() - CHECKSUM_LEN;
        Ok(Self { rest: &decoder.rest[..n] })
    }

    fn bytes(&mut self, what: &'static str, n: usize) -> Result<&'b [u8], CheckpointFault> {
        let Some((bytes, rest)) = self.rest.split_at_checked(n) else {
            return Err(CheckpointFault::Content { what, found: self.rest.len() as u64, needed: n as u64 });
        };
        self.rest = rest;
        Ok(bytes)
    }

    /// One number.
    pub(super) fn value<T: Pod>(&mut self, what: &'static str) -> Result<T, CheckpointFault> {
        Ok(bytemuck::pod_read_unaligned(self.bytes(what, size_of::<T>())?))
    }

    /// A count and so many numbers.
    pub(super) fn values<T: Pod + Zeroable>(&mut self, what: &'static str) -> Result<Vec<T>, CheckpointFault> {
        let n: u64 = self.value(what)?;
        let n_bytes = usize::try_from(n).ok().and_then(|n| n.checked_mul(size_of::<T>())).unwrap_or(usize::MAX);
        let bytes = self.bytes(what, n_bytes)?;
        let mut values = vec![T::zeroed(); n_bytes / size_of::<T>()];
        bytemuck::cast_slice_mut(&mut values).copy_from_slice(bytes);
        Ok(values)
    }

    /// A count, which must be `needed`, and so many numbers.
    pub(super) fn exactly<T: Pod>(&mut self, what: &'static str, needed: usize) -> Result<Vec<T>, CheckpointFault> {
        let values = self.values(what)?;
        if values.len() != needed {
            return Err(CheckpointFault::Content { what, found: values.len() as u64, needed: needed as u64 });
        }
        Ok(values)
    }

    /// A count and so many bytes of UTF-8.
    pub(super) fn text(&mut self, what: &'static str) -> Result<String, CheckpointFault> {
        String::from_utf8(self.values(what)?).map_err(|e| CheckpointFault::Text { what, why: e.to_string() })
    }

    /// Refuses bytes that nobody asked for.
    pub(super) fn end(self) -> Result<(), CheckpointFault> {
        match self.rest.len() {
            0 => Ok(()),
            n => Err(CheckpointFault::Content { what: "bytes after the last array", found: n as u64, needed: 0 }),
        }
    }
}
