//! What is packed around the sections: nothing, gzip, or a zstd stream for each.

use std::io::Read;

use flate2::read::GzDecoder;
use ruzstd::decoding::StreamingDecoder;

use super::header::{HEADER_BYTES, Header};
use super::{FLAG_RECORDS, MAGIC};
use crate::Unreadable;

/// Bytes that one byte of a file may become, and that any file may become: more is no scene.
const MAX_EXPANSION: usize = 64;
const ANY_EXPANSION: usize = 1 << 24;
/// Bytes of records that are looked at: those that are known have a dozen.
const MAX_RECORD_BYTES: usize = 1 << 16;
/// Bytes of the header of version 4, behind which records and then the table of streams stand.
const LONG_HEADER_BYTES: usize = 32;
/// Of a stream in that table: its bytes packed and unpacked, in 64 bits each.
const ENTRY_BYTES: usize = 16;

/// The header, all sections one after the other, and the records of vendors.
pub(super) fn unpack(bytes: &[u8]) -> Result<(Header, Vec<u8>, Vec<u8>), Unreadable> {
    if bytes.starts_with(&MAGIC) {
        let first = bytes.first_chunk().ok_or_else(|| {
            Unreadable::new(format!("is cut off: it has {} bytes, its header alone has {HEADER_BYTES}", bytes.len()))
        })?;
        let header = Header::parse(*first)?;
        return if header.version < 4 {
            in_a_row(header, &bytes[HEADER_BYTES..], bytes.len())
        } else {
            in_streams(header, bytes)
        };
    }
    if !bytes.starts_with(&[0x1f, 0x8b]) {
        return Err(Unreadable::new("is no .spz file: it starts neither as gzip does nor with `NGSP`"));
    }
    let mut stream = GzDecoder::new(bytes);
    let mut first = [0; HEADER_BYTES];
    stream.read_exact(&mut first).map_err(|error| {
        Unreadable::new(format!("is no .spz file: its header of {HEADER_BYTES} bytes cannot be unpacked ({error})"))
    })?;
    let header = Header::parse(first)?;
    if header.version > 3 {
        return Err(Unreadable::new(format!(
            "is a .spz of version {} within gzip, which that version does not have; unpack it with `gunzip`",
            header.version
        )));
    }
    in_a_row(header, stream, bytes.len())
}

/// Sections and records of versions 1 to 3.
fn in_a_row(
    header: Header,
    mut stream: impl Read,
    file_bytes: usize,
) -> Result<(Header, Vec<u8>, Vec<u8>), Unreadable> {
    let needed = check_size(&header, file_bytes)?;
    // Grows with what is unpacked, never from the header's count.
    let mut body = Vec::new();
    stream.by_ref().take(needed as u64).read_to_end(&mut body).map_err(|error| {
        Unreadable::new(format!("is damaged or cut off after {} of {needed} bytes: {error}; copy it again", body.len()))
    })?;
    if body.len() < needed {
        return Err(Unreadable::new(format!(
            "is cut off: it holds {} of the {needed} bytes of its {} Gaussians; copy it again from where it was made",
            body.len(),
            header.n_points
        )));
    }
    let mut records = Vec::new();
    if header.flags & FLAG_RECORDS != 0 {
        // What is damaged here is no Gaussian.
        let _ = stream.take(MAX_RECORD_BYTES as u64).read_to_end(&mut records);
    }
    Ok((header, body, records))
}

/// The bytes of all sections, where a file of so many bytes may have them.
fn check_size(header: &Header, file_bytes: usize) -> Result<usize, Unreadable> {
    let needed = header.n_bytes();
    let allowed = file_bytes.saturating_mul(MAX_EXPANSION).max(ANY_EXPANSION);
    if needed > allowed {
        return Err(Unreadable::new(format!(
            "says it holds {} Gaussians, which are {needed} bytes; from a file of {file_bytes} bytes at most {allowed} are unpacked",
            header.n_points
        )));
    }
    Ok(needed)
}

/// Of version 4, the bytes of each section in the file; `None` for others.
pub(super) fn packed_sizes(header: &Header, bytes: &[u8]) -> Option<[usize; 6]> {
    if header.version < 4 {
        return None;
    }
    let table_at = u32::from_le_bytes(*bytes.get(HEADER_BYTES..)?.first_chunk()?) as usize;
    let mut sizes = [0; 6];
    for (number, size) in sizes.iter_mut().enumerate().take(header.n_streams) {
        let entry = bytes.get(table_at.checked_add(number * ENTRY_BYTES)?..)?;
        *size = usize::try_from(u64::from_le_bytes(*entry.first_chunk()?)).ok()?;
    }
    Some(sizes)
}

/// Sections and records of version 4.
fn in_streams(header: Header, bytes: &[u8]) -> Result<(Header, Vec<u8>, Vec<u8>), Unreadable> {
    let needed = check_size(&header, bytes.len())?;
    let damaged = |what: &str| Unreadable::new(format!("is damaged or cut off: {what}; copy it again"));
    let rows: Vec<usize> = header.row_bytes().into_iter().filter(|&row| row > 0).collect();
    if header.n_streams < rows.len() {
        return Err(damaged(&format!("it has {} streams, {} are needed", header.n_streams, rows.len())));
    }
    let table_at = bytes.get(HEADER_BYTES..HEADER_BYTES + 4).and_then(<[u8]>::first_chunk);
    let table_at = table_at.map_or(0, |place| u32::from_le_bytes(*place) as usize);
    let table = bytes
        .get(table_at..)
        .and_then(|rest| rest.get(..header.n_streams * ENTRY_BYTES))
        .filter(|_| table_at >= LONG_HEADER_BYTES)
        .ok_or_else(|| {
            damaged(&format!("its table of streams at {table_at} lies outside of its {} bytes", bytes.len()))
        })?;
    let records = bytes[LONG_HEADER_BYTES..table_at].to_vec();
    let mut packed = &bytes[table_at + table.len()..];
    let mut body = Vec::new();
    for (number, (&row, entry)) in rows.iter().zip(table.as_chunks::<ENTRY_BYTES>().0).enumerate() {
        let size = |at: usize| {
            let number = entry[at..].first_chunk().map(|size| u64::from_le_bytes(*size));
            number.and_then(|size| usize::try_from(size).ok()).unwrap_or(usize::MAX)
        };
        let (held, unpacked, wanted) = (size(0), size(8), row * header.n_points);
        let outside = || damaged(&format!("stream {number} of {held} bytes ends outside of the file"));
        let stream = packed.get(..held).ok_or_else(outside)?;
        packed = &packed[held..];
        if unpacked != wanted {
            return Err(damaged(&format!("stream {number} says it unpacks to {unpacked} bytes, {wanted} are needed")));
        }
        let before = body.len();
        unpack_zstd(stream, wanted, &mut body).map_err(|error| damaged(&format!("stream {number}: {error}")))?;
        if body.len() - before != wanted {
            return Err(damaged(&format!("stream {number} has {} of {wanted} bytes", body.len() - before)));
        }
    }
    debug_assert_eq!(body.len(), needed, "the rows' sum");
    Ok((header, body, records))
}

/// Adds at most `wanted` bytes of a zstd stream to `body`.
fn unpack_zstd(stream: &[u8], wanted: usize, body: &mut Vec<u8>) -> Result<(), String> {
    if wanted == 0 {
        return Ok(());
    }
    let decoder = StreamingDecoder::new(stream).map_err(|error| error.to_string())?;
    decoder.take(wanted as u64).read_to_end(body).map_err(|error| error.to_string())?;
    Ok(())
}
