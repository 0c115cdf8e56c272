//! The file: `PLG1`, a checksum, and a deflated body, all little-endian:
//!
//! | what | bytes |
//! |---|---|
//! | N, the number of codes | 4 each |
//! | lattice: corner `[3]`, side of a voxel | 4 each |
//! | for each Gaussian but the first: whether its voxel is that of the one before | a bit each |
//! | the octree of the voxels | one a node |
//! | shapes, in columns | 2 for each of 8 numbers |
//! | whether a Gaussian has a code | a bit each |
//! | codes | 2 each |
//! | codebook, then the colours of those without a code, in columns | 2 for each of 27 numbers |

use super::quantisation::{COLOUR, Quantised, SHAPE};
use crate::baseline::Unreadable;
use crate::octree;
use crate::packed::{Body, Mark, all_below, opened, put_bits, put_count, put_rows, put_words, sealed};
use crate::voxels::Lattice;

const MARK: Mark = *b"PLG1";

/// The file of quantised Gaussians.
pub(super) fn written(quantised: &Quantised) -> Vec<u8> {
    sealed(MARK, &body(quantised))
}

/// The Gaussians of a file.
pub(super) fn read(bytes: &[u8]) -> Result<Quantised, Unreadable> {
    of_body(&opened(MARK, bytes)?)
}

fn body(quantised: &Quantised) -> Vec<u8> {
    let Quantised { lattice, voxels, shapes, code_of, codebook, kept } = quantised;
    let mut body = Vec::new();
    for count in [voxels.len(), codebook.len()] {
        put_count(count, &mut body);
    }
    let [x, y, z] = lattice.corner;
    [x, y, z, lattice.voxel].iter().for_each(|number| body.extend(number.to_le_bytes()));
    let again: Vec<bool> = voxels.windows(2).map(|pair| pair[0] == pair[1]).collect();
    put_bits(&again, &mut body);
    let mut leaves = voxels.clone();
    leaves.dedup();
    octree::put_leaves(&leaves, &mut body);
    put_rows(shapes, &mut body);
    put_bits(&code_of.iter().map(Option::is_some).collect::<Vec<_>>(), &mut body);
    put_words(code_of.iter().flatten().copied(), &mut body);
    put_rows(codebook, &mut body);
    put_rows(kept, &mut body);
    body
}

fn of_body(bytes: &[u8]) -> Result<Quantised, Unreadable> {
    let mut body = Body(bytes);
    let n = body.n_gaussians()?;
    let n_codes = body.count("the number of codes")?;
    let mut number = || body.number("the lattice");
    let (corner, voxel) = ([number()?, number()?, number()?], number()?);
    let far = corner.map(|number| number + voxel * (1 << octree::DEPTH) as f32);
    if !(voxel > 0.0 && corner.iter().chain(&far).all(|number| number.is_finite())) {
        return Err(Unreadable(format!(
            "the lattice lies from {corner:?} to {far:?} in voxels of {voxel}, needed: finite numbers, voxels above 0; write the file again"
        )));
    }
    let again = body.bits(n.saturating_sub(1), "voxels that come again")?;
    let leaves = octree::leaves(&mut body)?;
    let n_leaves = n - again.iter().filter(|again| **again).count();
    if leaves.len() != n_leaves {
        let found = leaves.len();
        return Err(Unreadable(format!("the octree has {found} leaves, needed: {n_leaves}; write the file again")));
    }
    let mut next = leaves.into_iter();
    let mut voxels: Vec<u64> = next.by_ref().take(1).collect();
    for again in again {
        voxels.extend(if again { voxels.last().copied() } else { next.next() });
    }
    let shapes = body.rows::<SHAPE>(n, "shapes")?;
    let is_coded = body.bits(n, "who has a code")?;
    let n_coded = is_coded.iter().filter(|coded| **coded).count();
    let codes = body.words(n_coded, "codes")?;
    all_below(codes.iter().copied(), n_codes, "a code")?;
    let mut next = codes.into_iter();
    let code_of = is_coded.iter().map(|coded| coded.then(|| next.next()).flatten()).collect();
    let codebook = body.rows::<COLOUR>(n_codes, "the codebook")?;
    let kept = body.rows::<COLOUR>(n - n_coded, "colours")?;
    body.end()?;
    Ok(Quantised { lattice: Lattice { corner, voxel }, voxels, shapes, code_of, codebook, kept })
}

#[cfg(test)]
mod tests {
    use pocketsplat_kernels::finite_difference::random;
    use proptest::prelude::*;

    use super::*;
    use crate::packed::halved;
    use crate::test_files::{damage_of_a_body_is_noticed, other_counts_are_refused};

    /// `n` Gaussians, of which some share a voxel and every third has a code.
    #[expect(clippy::cast_possible_truncation, reason = "any numbers")]
    fn quantised(n: usize) -> Quantised {
        let numbers: Vec<f32> = random(3, 70 * n + 70).into_iter().map(|x| x as f32).collect();
        let row = |i: usize| &numbers[70 * i..][..70];
        Quantised {
            lattice: Lattice { corner: [-1.0, 2.0, 0.5], voxel: 1e-4 },
            voxels: (0..n as u64).map(|i| i * 2 / 3 * 1_234_567_891).collect(),
            shapes: (0..n).map(|i| std::array::from_fn(|at| halved(row(i)[at]))).collect(),
            code_of: (0..n).map(|i| (i % 3 == 0).then_some(i as u16 % 4)).collect(),
            codebook: (0..4).map(|i| std::array::from_fn(|at| halved(numbers[i * 5 + at]))).collect(),
            kept: (0..n - n.div_ceil(3)).map(|i| std::array::from_fn(|at| halved(row(i)[at + 30]))).collect(),
        }
    }

    #[test]
    fn what_was_written_is_read_and_written_again_the_same() {
        for n in [0, 1, 2, 3, 100] {
            let before = quantised(n);
            let bytes = written(&before);
            let read = read(&bytes).unwrap();
            assert_eq!(read, before, "{n}");
            assert_eq!(written(&read), bytes);
            assert_eq!(read.gaussians().len(), n);
        }
    }

    #[test]
    fn a_lattice_without_a_size_is_refused() {
        for voxel in [0.0, -1.0, f32::MAX] {
            let faulty = Quantised { lattice: Lattice { corner: [1.0; 3], voxel }, ..quantised(3) };
            let said = read(&written(&faulty)).unwrap_err().to_string();
            assert!(said.contains("needed: finite numbers, voxels above 0"), "{said}");
        }
    }

    proptest! {
        #[test]
        fn a_damaged_body_is_gaussians_or_an_error(at: prop::sample::Index, flip in 1..=255u8, count: u32) {
            let sound = body(&quantised(20));
            damage_of_a_body_is_noticed(&sound, (at.index(sound.len()), flip), of_body, Quantised::gaussians);
            other_counts_are_refused(&sound, &[0, 4], count, of_body);
        }
    }
}
