//! Whether a JPEG file is all there.
//!
//! The decoder paints what a cut file lacks in grey and says nothing, so the markers are walked here (ITU-T T.81, annex B).

/// The marker SOI, which every JPEG begins with.
pub(super) const START: [u8; 2] = [0xFF, 0xD8];

/// Whether the marker EOI is reached from the start of the file: segments are stepped over by their length, so that a
/// thumbnail's end inside one is not taken for the picture's, and what follows the end does not matter.
///
/// * `bytes`: begin with [`START`].
pub(super) fn is_whole(bytes: &[u8]) -> bool {
    let mut rest = bytes.get(START.len()..).unwrap_or_default();
    // Behind a segment the next marker follows at once, behind coded data at its end. In coded data FF 00 is the byte
    // FF and FF D0 to FF D7 restart the coder; FF FF is filling everywhere.
    while let Some(at) = rest.windows(2).position(|pair| pair[0] == 0xFF && !matches!(pair[1], 0 | 0xD0..=0xD7 | 0xFF))
    {
        let (marker, behind) = (rest[at + 1], &rest[at + 2..]);
        if marker == 0xD9 {
            return true;
        }
        let Some(length) = behind.first_chunk().map(|&length| usize::from(u16::from_be_bytes(length))) else {
            return false;
        };
        rest = behind.get(length..).unwrap_or_default();
    }
    false
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A segment of application data with a thumbnail's end in it, a scan with a stuffed and a restart marker, the end.
    const WHOLE: [u8; 21] =
        [0xFF, 0xD8, 0xFF, 0xE1, 0, 4, 0xFF, 0xD9, 0xFF, 0xFF, 0xDA, 0, 3, 9, 1, 0xFF, 0, 0xFF, 0xD3, 0xFF, 0xD9];

    #[test]
    fn every_cut_of_a_jpeg_is_found() {
        assert!(is_whole(&WHOLE));
        assert!(is_whole(&[&WHOLE[..], b"a film behind the photograph"].concat()));
        for n in START.len()..WHOLE.len() {
            assert!(!is_whole(&WHOLE[..n]), "cut to {n} bytes");
            let zeroed = [&WHOLE[..n], &[0; 40]].concat();
            assert!(!is_whole(&zeroed), "all zero from byte {n}");
        }
    }

    #[test]
    fn every_cut_of_an_encoded_photograph_is_found() {
        let pixels: Vec<u8> = (0..64 * 48 * 3).map(|i| (i * 7919 % 251) as u8).collect();
        let mut bytes = Vec::new();
        let encoder = ::image::codecs::jpeg::JpegEncoder::new(&mut bytes);
        ::image::ImageEncoder::write_image(encoder, &pixels, 64, 48, ::image::ExtendedColorType::Rgb8).expect("a JPEG");
        assert!(is_whole(&bytes));
        for n in START.len()..bytes.len() {
            assert!(!is_whole(&bytes[..n]), "cut to {n} of {} bytes", bytes.len());
        }
    }
}
