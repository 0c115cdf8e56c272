//! As much of zip as a .sog needs: files without folders or encryption, below 4 GiB; written as they are, read also when deflated.

use std::io::Read as _;

use flate2::read::DeflateDecoder;

use crate::Unreadable;

const LOCAL: [u8; 4] = *b"PK\x03\x04";
const CENTRAL: [u8; 4] = *b"PK\x01\x02";
const END: [u8; 4] = *b"PK\x05\x06";
const LOCAL_BYTES: usize = 30;
const CENTRAL_BYTES: usize = 46;
const END_BYTES: usize = 22;
/// A comment may follow the end, which is why it is searched for.
const MAX_COMMENT: usize = 65_535;
/// Most files looked at; a .sog has eight.
const MAX_FILES: usize = 1024;
/// Bytes that one byte of a file may become, and that any file may become.
const MAX_EXPANSION: usize = 64;
const ANY_EXPANSION: usize = 1 << 24;

/// Writes `files`, name and bytes, without compression: images are compressed already.
pub(super) fn write(files: &[(String, Vec<u8>)]) -> Result<Vec<u8>, Unreadable> {
    let total: usize =
        files.iter().map(|(name, bytes)| bytes.len() + 2 * name.len() + LOCAL_BYTES + CENTRAL_BYTES).sum();
    if u32::try_from(total + END_BYTES).is_err() {
        return Err(Unreadable::new(format!("would have {total} bytes, a zip has {} at most; write a .ply", u32::MAX)));
    }
    let (mut out, mut central) = (Vec::with_capacity(total + END_BYTES), Vec::new());
    for (name, bytes) in files {
        let offset = out.len() as u32;
        // From the version needed to the lengths of the name and of what extends it: version 2.0, names in UTF-8, stored, 1 January 1980.
        let mut record = Vec::new();
        for field in [20u16, 0x800, 0, 0, 0x21] {
            record.extend(field.to_le_bytes());
        }
        for field in [crc32fast::hash(bytes), bytes.len() as u32, bytes.len() as u32] {
            record.extend(field.to_le_bytes());
        }
        record.extend((name.len() as u16).to_le_bytes());
        record.extend(0u16.to_le_bytes());
        for part in [LOCAL.as_slice(), &record, name.as_bytes(), bytes] {
            out.extend(part);
        }
        central.extend(CENTRAL);
        central.extend(20u16.to_le_bytes());
        central.extend(&record);
        // Comment, disk and attributes: none.
        central.extend([0; 10]);
        central.extend(offset.to_le_bytes());
        central.extend(name.as_bytes());
    }
    let (offset, n_files) = (out.len() as u32, files.len() as u16);
    out.extend(&central);
    out.extend(END);
    out.extend([0; 4]);
    for field in [n_files, n_files] {
        out.extend(field.to_le_bytes());
    }
    for field in [central.len() as u32, offset] {
        out.extend(field.to_le_bytes());
    }
    out.extend([0; 2]);
    Ok(out)
}

/// A zip whose directory was read.
pub(super) struct Archive<'a> {
    bytes: &'a [u8],
    entries: Vec<Entry<'a>>,
}

struct Entry<'a> {
    name: &'a [u8],
    method: u16,
    packed: usize,
    unpacked: usize,
    crc: u32,
    offset: usize,
}

fn u16_at(bytes: &[u8], offset: usize) -> Option<usize> {
    Some(usize::from(u16::from_le_bytes(*bytes.get(offset..)?.first_chunk()?)))
}

fn u32_at(bytes: &[u8], offset: usize) -> Option<usize> {
    Some(u32::from_le_bytes(*bytes.get(offset..)?.first_chunk()?) as usize)
}

impl<'a> Archive<'a> {
    pub(super) fn open(bytes: &'a [u8]) -> Result<Self, Unreadable> {
        if !bytes.starts_with(b"PK") {
            return Err(Unreadable::new("is no .sog file: it does not start as zip does"));
        }
        let tail = bytes.len().saturating_sub(END_BYTES + MAX_COMMENT);
        let end = bytes[tail..].windows(END.len()).rposition(|window| window == END).map(|place| tail + place);
        let end = end.ok_or_else(|| {
            Unreadable::new(
                "is cut off: the directory that ends a zip is missing; copy it again from where it was made",
            )
        })?;
        Self::entries(bytes, end).map(|entries| Self { bytes, entries }).ok_or_else(|| {
            Unreadable::new("is damaged: the directory that ends its zip points outside of the file; copy it again")
        })
    }

    fn entries(bytes: &'a [u8], end: usize) -> Option<Vec<Entry<'a>>> {
        let n_files = u16_at(bytes, end + 10)?.min(MAX_FILES);
        let mut at = u32_at(bytes, end + 16)?;
        let mut entries = Vec::new();
        for _ in 0..n_files {
            let record = bytes.get(at..at.checked_add(CENTRAL_BYTES)?)?;
            if !record.starts_with(&CENTRAL) {
                return None;
            }
            let name_bytes = u16_at(record, 28)?;
            entries.push(Entry {
                name: bytes.get(at + CENTRAL_BYTES..at + CENTRAL_BYTES + name_bytes)?,
                method: u16_at(record, 10)? as u16,
                crc: u32_at(record, 16)? as u32,
                packed: u32_at(record, 20)?,
                unpacked: u32_at(record, 24)?,
                offset: u32_at(record, 42)?,
            });
            at += CENTRAL_BYTES + name_bytes + u16_at(record, 30)? + u16_at(record, 32)?;
        }
        Some(entries)
    }

    /// The bytes of the file `name`, checked against their checksum.
    pub(super) fn file(&self, name: &str) -> Result<Vec<u8>, Unreadable> {
        let entry = self.entries.iter().find(|entry| entry.name == name.as_bytes()).ok_or_else(|| {
            Unreadable::new(format!("holds no {name} in its zip, so it is no .sog file or an incomplete one"))
        })?;
        let packed = self.packed(entry).ok_or_else(|| {
            Unreadable::new(format!(
                "is cut off or damaged: {name} lies outside of the {} bytes of the file",
                self.bytes.len()
            ))
        })?;
        let allowed = packed.len().saturating_mul(MAX_EXPANSION).max(ANY_EXPANSION);
        if entry.unpacked > allowed {
            return Err(Unreadable::new(format!(
                "says that {name} unpacks from {} to {} bytes, at most {allowed} are unpacked",
                packed.len(),
                entry.unpacked
            )));
        }
        let bytes = match entry.method {
            0 => packed.to_vec(),
            8 => {
                // Grows with what is unpacked, one byte beyond what was said at most.
                let mut bytes = Vec::new();
                DeflateDecoder::new(packed)
                    .take(entry.unpacked as u64 + 1)
                    .read_to_end(&mut bytes)
                    .map_err(|error| Unreadable::new(format!("is damaged in {name}: {error}; copy it again")))?;
                bytes
            }
            method => {
                return Err(Unreadable::new(format!(
                    "has {name} packed by method {method}, methods 0 and 8 (deflate) are read"
                )));
            }
        };
        if bytes.len() != entry.unpacked || crc32fast::hash(&bytes) != entry.crc {
            return Err(Unreadable::new(format!(
                "is damaged: {name} does not match its length and checksum; copy it again"
            )));
        }
        Ok(bytes)
    }

    /// The packed bytes: what follows the local header, whose name and extension may differ in length from the directory's.
    fn packed(&self, entry: &Entry<'a>) -> Option<&'a [u8]> {
        let local = self.bytes.get(entry.offset..)?;
        if !local.starts_with(&LOCAL) {
            return None;
        }
        let start = LOCAL_BYTES + u16_at(local, 26)? + u16_at(local, 28)?;
        local.get(start..start.checked_add(entry.packed)?)
    }
}
