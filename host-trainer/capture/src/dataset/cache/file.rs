//! One decoded photograph in a file: magic, a header with its length and checksum, pixels, mask.
//!
//! The header is JSON. Pixels are `[height, width, 3]` bytes; the mask, where there is one, a byte a pixel. There is nothing to
//! unpack: reading is what the disk takes.

use std::fs::File;
use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use serde::{Deserialize, Serialize};

use crate::dataset::{Image, Mask, Photograph};

/// As the checkpoints of a run have it, with letters of its own.
const MAGIC: [u8; 8] = *b"\x8bPSPHT\r\n";
/// Bytes of a length or checksum.
const NUMBER_LEN: usize = 4;
/// A header that claims to be longer is none: paths and lenses are shorter.
const MAX_HEADER_LEN: u32 = 1 << 16;

/// What stands before the pixels.
#[derive(Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Header {
    /// What the photograph was made from, and how.
    pub(super) made_from: String,
    width_px: u32,
    height_px: u32,
    pub(super) has_mask: bool,
    /// Share of the pixels that are not wholly transparent, as the bits of an f64: text might round it.
    shown_bits: u64,
    /// [`Photograph::crc32`].
    pub(super) crc32: u32,
}

/// Why a file holds no decoded photograph.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum FileFault {
    /// It is not there, or shorter than its header says.
    #[error("could not be read ({0})")]
    Io(#[from] io::Error),
    /// It is no such file, or its header is damaged.
    #[error("has no sound header")]
    Header,
    /// Its pixels are damaged.
    #[error("is damaged: the checksum of its pixels is {found:08x}, needed: {needed:08x}")]
    Checksum {
        /// Of the bytes.
        found: u32,
        /// In the header.
        needed: u32,
    },
}

impl Header {
    pub(super) fn new(made_from: String, photograph: &Photograph, shown: f64) -> Self {
        let Photograph { image, mask } = photograph;
        Self {
            made_from,
            width_px: image.width_px,
            height_px: image.height_px,
            has_mask: mask.is_some(),
            shown_bits: shown.to_bits(),
            crc32: photograph.crc32(),
        }
    }

    pub(super) fn shown(&self) -> f64 {
        f64::from_bits(self.shown_bits)
    }
}

/// Writes a photograph. Whatever interrupts this leaves a file that [`read`] refuses.
pub(super) fn write(path: &Path, header: &Header, photograph: &Photograph) -> io::Result<()> {
    let json = serde_json::to_vec(header)?;
    let mut start = MAGIC.to_vec();
    let len = u32::try_from(json.len()).ok().filter(|len| *len <= MAX_HEADER_LEN);
    start.extend(len.ok_or(io::ErrorKind::InvalidInput)?.to_le_bytes());
    start.extend(&json);
    start.extend(crc32fast::hash(&json).to_le_bytes());
    let mut out = File::create(path)?;
    out.write_all(&start)?;
    out.write_all(&photograph.image.rgb)?;
    if let Some(mask) = &photograph.mask {
        out.write_all(&mask.valid.iter().map(|valid| u8::from(*valid)).collect::<Vec<_>>())?;
    }
    Ok(())
}

/// Reads a photograph and checks it.
pub(super) fn read(path: &Path) -> Result<(Header, Photograph), FileFault> {
    let mut file = File::open(path)?;
    let header = read_header(&mut file)?;
    let n_pixels = header.width_px as usize * header.height_px as usize;
    let mut rgb = vec![0; 3 * n_pixels];
    file.read_exact(&mut rgb)?;
    let mut hasher = crc32fast::Hasher::new();
    hasher.update(&rgb);
    let mut mask = None;
    let (width_px, height_px) = (header.width_px, header.height_px);
    if header.has_mask {
        let mut bytes = vec![0; n_pixels];
        file.read_exact(&mut bytes)?;
        hasher.update(&bytes);
        mask = Some(Mask { width_px, height_px, valid: bytes.iter().map(|byte| *byte == 1).collect() });
    }
    let found = hasher.finalize();
    if found != header.crc32 {
        return Err(FileFault::Checksum { found, needed: header.crc32 });
    }
    Ok((header, Photograph { image: Image { width_px, height_px, rgb }, mask }))
}

fn read_header(file: &mut File) -> Result<Header, FileFault> {
    let mut start = [0; MAGIC.len() + NUMBER_LEN];
    file.read_exact(&mut start)?;
    let Some(&len) = start.strip_prefix(&MAGIC).and_then(<[u8]>::first_chunk) else { return Err(FileFault::Header) };
    let len = u32::from_le_bytes(len);
    if len > MAX_HEADER_LEN {
        return Err(FileFault::Header);
    }
    let mut rest = vec![0; len as usize + NUMBER_LEN];
    file.read_exact(&mut rest)?;
    match rest.split_last_chunk() {
        Some((json, checksum)) if crc32fast::hash(json) == u32::from_le_bytes(*checksum) => {
            serde_json::from_slice(json).map_err(|_| FileFault::Header)
        }
        _ => Err(FileFault::Header),
    }
}

/// A photograph in a cache.
#[derive(Debug)]
pub(in crate::dataset) struct CacheFile {
    path: PathBuf,
    crc32: u32,
    has_mask: bool,
    /// Keeps other processes out of the folder as long as something can be read.
    _lock: Arc<File>,
}

impl CacheFile {
    pub(super) fn new(path: PathBuf, header: &Header, lock: &Arc<File>) -> Self {
        Self { path, crc32: header.crc32, has_mask: header.has_mask, _lock: lock.clone() }
    }

    pub(in crate::dataset) fn path(&self) -> &Path {
        &self.path
    }

    pub(in crate::dataset) fn crc32(&self) -> u32 {
        self.crc32
    }

    pub(in crate::dataset) fn has_mask(&self) -> bool {
        self.has_mask
    }

    /// Reads the photograph: the one that was written, or an error.
    pub(in crate::dataset) fn read(&self) -> Result<Photograph, FileFault> {
        let (header, photograph) = read(&self.path)?;
        if header.crc32 != self.crc32 {
            return Err(FileFault::Checksum { found: header.crc32, needed: self.crc32 });
        }
        Ok(photograph)
    }
}
