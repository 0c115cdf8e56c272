//! The file: `PC31`, a checksum, and a deflated body, all little-endian:
//!
//! | what | bytes |
//! |---|---|
//! | N, the number of codes of a codebook of scales, of rotations | 4 each |
//! | log₂ of the rows of a level at most | 1 |
//! | least and step of the opacity logits, then of the grid | 4 each |
//! | centres, in columns | 2 for each of 3 numbers |
//! | opacity logits | 1 each |
//! | scales, then rotations: for each stage its codebook, in columns, and a code for each Gaussian | 2 a number, 1 a code |
//! | grid, level by level, all first channels of all rows before the second | 1 a number |
//! | network | 2 a number |

use half::f16;

use super::grid::{self, CHANNELS};
use super::network::N_WEIGHTS;
use super::quantised::Quantised;
use super::residual_codes::{CODES, ResidualCodes, STAGES};
use crate::baseline::Unreadable;
use crate::bytes::{Bytes, put_range, range};
use crate::packed::{Body, Mark, all_below, opened, put_count, put_rows, sealed};

const MARK: Mark = *b"PC31";

/// log₂ of a level's rows at most: all levels then have fewer than 2³² numbers.
const MOST_LOG2_ROWS: u8 = 24;

/// The file of quantised Gaussians.
pub(super) fn written(quantised: &Quantised) -> Vec<u8> {
    sealed(MARK, &body(quantised))
}

/// The Gaussians of a file.
pub(super) fn read(bytes: &[u8]) -> Result<Quantised, Unreadable> {
    of_body(&opened(MARK, bytes)?)
}

fn body(quantised: &Quantised) -> Vec<u8> {
    let Quantised { centres, opacity_logits, log_scales, rotations, log2_rows, rows, weights } = quantised;
    let mut body = Vec::new();
    for count in [centres.len(), log_scales.books[0].len(), rotations.books[0].len()] {
        put_count(count, &mut body);
    }
    body.push(*log2_rows);
    put_range(opacity_logits, &mut body);
    put_range(rows, &mut body);
    put_rows(centres, &mut body);
    body.extend(&opacity_logits.bytes);
    put_codes(log_scales, &mut body);
    put_codes(rotations, &mut body);
    (0..CHANNELS).for_each(|channel| body.extend(rows.bytes.iter().skip(channel).step_by(CHANNELS)));
    put_rows(&weights.iter().map(|weight| [*weight]).collect::<Vec<_>>(), &mut body);
    body
}

fn put_codes<const WIDTH: usize>(codes: &ResidualCodes<WIDTH>, body: &mut Vec<u8>) {
    for stage in 0..STAGES {
        put_rows(&codes.halves(stage), body);
        body.extend(codes.codes.iter().map(|codes| codes[stage]));
    }
}

fn of_body(bytes: &[u8]) -> Result<Quantised, Unreadable> {
    let mut body = Body(bytes);
    let n = body.n_gaussians()?;
    let [n_scales, n_rotations] = [body.count("the number of codes")?, body.count("the number of codes")?];
    let log2_rows = body.bytes(1, "the size of the grid")?[0];
    if log2_rows > MOST_LOG2_ROWS {
        return Err(Unreadable(format!(
            "a level has 2^{log2_rows} rows, needed: 2^{MOST_LOG2_ROWS} at most; write the file again"
        )));
    }
    let [of_opacities, of_rows] = [range(&mut body)?, range(&mut body)?];
    let bytes_of = |[least, step]: [f32; 2], bytes: Vec<u8>| Bytes { least, step, bytes };
    let centres = body.rows::<3>(n, "centres")?;
    let opacity_logits = bytes_of(of_opacities, body.bytes(n, "opacities")?.to_vec());
    let log_scales = codes(&mut body, n, n_scales)?;
    let rotations = codes(&mut body, n, n_rotations)?;
    let n_rows = grid::n_rows(&grid::levels(log2_rows));
    let columns = body.bytes(CHANNELS * n_rows, "the grid")?;
    let row = |i: usize| (0..CHANNELS).map(move |channel| columns[channel * n_rows + i]);
    let rows = bytes_of(of_rows, (0..n_rows).flat_map(row).collect());
    let weights = body.rows::<1>(N_WEIGHTS, "the network")?.into_iter().map(|[weight]| weight).collect();
    body.end()?;
    Ok(Quantised { centres, opacity_logits, log_scales, rotations, log2_rows, rows, weights })
}

fn codes<const WIDTH: usize>(
    body: &mut Body<'_>,
    n: usize,
    n_codes: usize,
) -> Result<ResidualCodes<WIDTH>, Unreadable> {
    if n_codes > CODES || (n > 0 && n_codes == 0) {
        return Err(Unreadable(format!("a codebook has {n_codes} codes, needed: 1 to {CODES}; write the file again")));
    }
    let mut books = [const { Vec::new() }; STAGES];
    let mut codes = vec![[0; STAGES]; n];
    for (stage, book) in books.iter_mut().enumerate() {
        let rows = body.rows::<WIDTH>(n_codes, "a codebook")?;
        *book = rows.into_iter().map(|code| code.map(f16::to_f32)).collect();
        let column = body.bytes(n, "codes")?;
        all_below(column.iter().copied(), n_codes, "a code")?;
        codes.iter_mut().zip(column).for_each(|(codes, code)| codes[stage] = *code);
    }
    Ok(ResidualCodes { books, codes })
}

#[cfg(test)]
mod tests {
    use pocketsplat_kernels::finite_difference::random;
    use proptest::prelude::*;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;

    use super::*;
    use crate::packed::halved;
    use crate::test_files::{damage_of_a_body_is_noticed, other_counts_are_refused};

    #[expect(clippy::cast_possible_truncation, reason = "any numbers")]
    fn quantised(n: usize) -> Quantised {
        let numbers: Vec<f32> = random(3, 7 * n + 1).into_iter().map(|x| x as f32).collect();
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        let row = |i: usize| &numbers[7 * i..][..7];
        let log_scales: Vec<[f32; 3]> = (0..n).map(|i| std::array::from_fn(|at| row(i)[at])).collect();
        let rotations: Vec<[f32; 4]> = (0..n).map(|i| std::array::from_fn(|at| row(i)[at + 3])).collect();
        let grid = random(4, CHANNELS * grid::n_rows(&grid::levels(2)));
        Quantised {
            centres: log_scales.iter().map(|row| row.map(halved)).collect(),
            opacity_logits: Bytes::of(&numbers[..n]),
            log_scales: ResidualCodes::of(&log_scales, &mut rng).rounded(),
            rotations: ResidualCodes::of(&rotations, &mut rng).rounded(),
            log2_rows: 2,
            rows: Bytes::of(&grid.iter().map(|x| *x as f32).collect::<Vec<_>>()),
            weights: random(5, N_WEIGHTS).into_iter().map(|x| halved(x as f32)).collect(),
        }
    }

    #[test]
    fn what_was_written_is_read_and_written_again_the_same() {
        for n in [0, 1, 2, 100] {
            let before = quantised(n);
            let bytes = written(&before);
            let read = read(&bytes).unwrap();
            assert_eq!(read, before, "{n}");
            assert_eq!(written(&read), bytes);
            assert_eq!(read.gaussians().len(), n);
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]
        #[test]
        fn a_damaged_body_is_gaussians_or_an_error(at: prop::sample::Index, near in 0..1500usize, flip in 1..=255u8, count: u32) {
            let sound = body(&quantised(20));
            // Most of a body is the network: half of the damage is before it.
            for at in [at.index(sound.len()), near] {
                damage_of_a_body_is_noticed(&sound, (at, flip), of_body, Quantised::gaussians);
            }
            other_counts_are_refused(&sound, &[0, 4, 8, 9], count, of_body);
        }
    }
}
