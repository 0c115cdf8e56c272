//! What stands around the state in every checkpoint: magic, version, checksum.

use std::io::{self, Write};

use serde::Serialize;
use serde::de::DeserializeOwned;

use super::{CheckpointFault, VERSION};

/// Bytes of the version and of the checksum.
const NUMBER_LEN: usize = 4;

/// Writes a checkpoint: `magic`, version, `state`, checksum.
pub(crate) fn write(out: impl Write, magic: [u8; 8], state: &impl Serialize) -> io::Result<()> {
    let mut out = Checksummed { out, checksum: crc32fast::Hasher::new() };
    out.write_all(&magic)?;
    out.write_all(&VERSION.to_le_bytes())?;
    // Not `to_io`, which hides what the disk reports.
    out.write_all(&postcard::to_stdvec(state).map_err(io::Error::other)?)?;
    let checksum = out.checksum.clone().finalize();
    out.write_all(&checksum.to_le_bytes())
}

/// Passes on what is written and sums it up.
struct Checksummed<W> {
    out: W,
    checksum: crc32fast::Hasher,
}

impl<W: Write> Write for Checksummed<W> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let n = self.out.write(bytes)?;
        self.checksum.update(&bytes[..n]);
        Ok(n)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.out.flush()
    }
}

/// What stands between version and checksum, once these are right.
pub(crate) fn content(bytes: &[u8], magic: [u8; 8]) -> Result<&[u8], CheckpointFault> {
    let rest = bytes.strip_prefix(&magic).ok_or(CheckpointFault::Magic)?;
    let Some((version, rest)) = rest.split_first_chunk().map(|(number, rest)| (u32::from_le_bytes(*number), rest))
    else {
        return Err(CheckpointFault::Magic);
    };
    if version != VERSION {
        return Err(CheckpointFault::Version { found: version });
    }
    let (content, found) = rest.split_last_chunk::<NUMBER_LEN>().unwrap_or((rest, &[0; NUMBER_LEN]));
    let found = u32::from_le_bytes(*found);
    let computed = crc32fast::hash(&bytes[..bytes.len() - NUMBER_LEN]);
    if found == computed { Ok(content) } else { Err(CheckpointFault::Checksum { found, computed }) }
}

/// The next part and the bytes behind it.
pub(crate) fn part<T: DeserializeOwned>(bytes: &[u8]) -> Result<(T, &[u8]), CheckpointFault> {
    postcard::take_from_bytes(bytes).map_err(|e| CheckpointFault::Form { what: "state", why: e.to_string() })
}

/// Refuses a number that the rest of the checkpoint contradicts.
pub(crate) fn needs(what: &'static str, found: usize, needed: usize) -> Result<(), CheckpointFault> {
    if found == needed {
        return Ok(());
    }
    Err(CheckpointFault::Content { what, found: found as u64, needed: needed as u64 })
}
