//! .splat of antimatter15's viewer, read: 32 bytes a Gaussian and nothing else.
//!
//! Centre and deviations are six numbers of 32 bits, colour and opacity four bytes, the rotation four bytes from −1 to 1, w first. The
//! colour is the same from all sides. Axes are those of the .ply that the file was made of. Nothing says what it is but its name.

use crate::account::Account;
use crate::opacity::{constant_of_colour, logit_of_byte};
use crate::{Gaussians, Notes, Unreadable};

const ROW_BYTES: usize = 32;

/// Reads the bytes of a file that its name calls a .splat.
///
/// # Errors
/// [`Unreadable`] for what is not a number of rows, and where most rows are no Gaussians.
pub fn read(bytes: &[u8]) -> Result<(Gaussians, Notes), Unreadable> {
    let (rows, rest) = bytes.as_chunks::<ROW_BYTES>();
    if !rest.is_empty() {
        return Err(Unreadable::new(format!(
            "is no whole .splat file: its {} bytes are not a number of rows of {ROW_BYTES}; copy it again",
            bytes.len()
        )));
    }
    let mut gaussians = Gaussians::default();
    for row in rows {
        let number = |index: usize| {
            f32::from_le_bytes([row[4 * index], row[4 * index + 1], row[4 * index + 2], row[4 * index + 3]])
        };
        gaussians.centres.push([0, 1, 2].map(number));
        gaussians.log_scales.push([3, 4, 5].map(|index| number(index).ln()));
        gaussians.harmonics.push([24, 25, 26].map(|at: usize| constant_of_colour(f32::from(row[at]) / 255.0)));
        gaussians.opacity_logits.push(logit_of_byte(row[27]));
        // 128 is 0, and −1 is one step longer than 1.
        gaussians.rotations.push([28, 29, 30, 31].map(|at: usize| (f32::from(row[at]) - 128.0) / 128.0));
    }
    let (gaussians, warnings) = gaussians.meant()?;
    Ok((gaussians, Notes { warnings, ..Notes::default() }))
}

/// Where the bytes of a file went.
pub(crate) fn account(bytes: &[u8]) -> Account {
    let n = bytes.len() / ROW_BYTES;
    let rows = [("centres", 12), ("deviations", 12), ("constant colours", 3), ("opacities", 1), ("rotations", 4)];
    Account::new(".splat".to_owned(), None, &rows.map(|(name, row)| (name, n * row)))
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::read;

    fn row(centre: [f32; 3], deviations: [f32; 3], bytes: [u8; 8]) -> Vec<u8> {
        let numbers = [centre, deviations].concat();
        numbers.iter().flat_map(|number| number.to_le_bytes()).chain(bytes).collect()
    }

    #[test]
    fn rows_are_read() {
        let first = row([1.0, -2.0, 3.0], [1.0, 0.5, 0.0], [255, 128, 0, 128, 255, 128, 0, 128]);
        let bytes = [first.clone(), first].concat();
        let (gaussians, notes) = read(&bytes).expect("two rows");
        assert_eq!((gaussians.len(), gaussians.centres[1]), (2, [1.0, -2.0, 3.0]));
        assert_eq!(gaussians.log_scales[0][..2], [0.0, 0.5f32.ln()]);
        assert!((gaussians.harmonics[0][0] - 1.772_45).abs() < 1e-3 && gaussians.harmonics[0][1].abs() < 0.01);
        assert_eq!(gaussians.rotations[0], [127.0 / 128.0, 0.0, -1.0, 0.0]);
        assert!(notes.warnings[0].starts_with("2 of 2 Gaussians have a deviation of 0"), "{notes:?}");
        assert!(read(&bytes[1..]).expect_err("63 bytes").to_string().contains("63 bytes are not a number of rows"));
        let noise = row([f32::NAN; 3], [1.0; 3], [0; 8]);
        assert!(read(&noise).expect_err("noise").to_string().starts_with("cannot be drawn: 1 of its 1"));
    }

    proptest! {
        #[test]
        fn no_bytes_panic(bytes in prop::collection::vec(any::<u8>(), 0..300)) {
            let _ = read(&bytes);
            let _ = read(&bytes[..bytes.len() / 32 * 32]);
        }
    }
}
