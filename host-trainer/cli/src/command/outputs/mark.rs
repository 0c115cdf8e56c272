//! The mark of pictures that were drawn here, which tells them from photographs.

use pocketsplat_files::MARK;
use pocketsplat_format::bundle::crc32;

/// Bytes of a PNG before the chunk that follows its header: signature, and IHDR with its length, name and checksum.
const PNG_HEAD: usize = 8 + 25;
/// Begins a JPEG; JFIF wants its own segment (APP0) next.
const JPEG_START: &[u8] = &[0xff, 0xd8];
const APP0: &[u8] = &[0xff, 0xe0];

/// The same PNG with a `tEXt` chunk (PNG, third edition, 11.3.3.2) that names the software.
pub(in crate::command) fn marked_png(png: &[u8]) -> Vec<u8> {
    let chunk = [b"tEXtSoftware\0", MARK.as_bytes()].concat();
    let len = u32::try_from(chunk.len() - 4).unwrap_or(0).to_be_bytes();
    let (head, rest) = png.split_at(PNG_HEAD.min(png.len()));
    [head, &len, &chunk, &crc32(&chunk).to_be_bytes(), rest].concat()
}

/// The same JPEG with a comment (COM, ITU-T T.81, B.2.4.5) that names the software.
pub(in crate::command) fn marked_jpeg(jpeg: &[u8]) -> Vec<u8> {
    let len = u16::try_from(2 + MARK.len()).unwrap_or(2).to_be_bytes();
    let start = JPEG_START.len();
    let app0_len = match jpeg.get(start..start + 4) {
        Some([a, b, high, low]) if [*a, *b] == *APP0 => APP0.len() + usize::from(u16::from_be_bytes([*high, *low])),
        _ => 0,
    };
    let (head, rest) = jpeg.split_at((start + app0_len).min(jpeg.len()));
    [head, &[0xff, 0xfe], &len, MARK.as_bytes(), rest].concat()
}

#[cfg(test)]
mod tests {
    use pocketsplat_capture::dataset::Image;

    use super::*;

    #[test]
    fn a_marked_picture_is_the_same_picture() {
        let drawn = Image { width_px: 3, height_px: 2, rgb: (0..18).map(|i| 14 * i).collect() };
        let (png, jpeg) = (drawn.to_png().unwrap(), drawn.to_jpeg().unwrap());
        let pixels = |bytes: &[u8]| image::load_from_memory(bytes).unwrap().into_rgb8();
        assert_eq!(pixels(&marked_png(&png)).into_raw(), drawn.rgb);
        assert_eq!(pixels(&marked_jpeg(&jpeg)), pixels(&jpeg));
        let app0 = jpeg.windows(5).position(|part| part == b"JFIF\0");
        assert_eq!(marked_jpeg(&jpeg).windows(5).position(|part| part == b"JFIF\0"), app0, "JFIF comes first");
        // Its checksum is right: a reader of text chunks finds it.
        let marked = marked_png(&png);
        let reader = png::Decoder::new(std::io::Cursor::new(marked.as_slice())).read_info().unwrap();
        let text = &reader.info().uncompressed_latin1_text;
        assert!(text.iter().any(|chunk| chunk.keyword == "Software" && chunk.text == MARK), "{text:?}");
    }
}
