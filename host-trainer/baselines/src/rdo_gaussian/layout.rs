//! The file: `PRD1`, a checksum, and a deflated body, all little-endian:
//!
//! | what | bytes |
//! |---|---|
//! | N | 4 |
//! | degree | 1 |
//! | least and step of the opacity logits | 4 each |
//! | centres, in columns | 2 for each of 3 numbers |
//! | opacity logits, as symbols | |
//! | which degrees a Gaussian has, a bit for each, degree 1 lowest; as symbols | |
//! | scales, rotations, base colours, each further degree: the codes of those that have one, as symbols; the codebook, in columns | 2 a number |
//!
//! Symbols are their number of frequencies and of words of the coder, 4 bytes each; the frequencies in a column, 2 each; the words, 2 each. The
//! frequencies of codes are the distribution that was learned, the others are counted.

use half::f16;
use pocketsplat_gaussians::Degree;

use super::attributes::{ALWAYS, WIDTHS, n_attributes};
use super::quantised::{Codes, Quantised};
use super::symbols::{frequencies_of, put_symbols, symbols};
use crate::baseline::Unreadable;
use crate::bytes::{Bytes, put_range, range};
use crate::packed::{Body, Mark, all_below, opened, put_count, put_rows, sealed};

const MARK: Mark = *b"PRD1";

/// The file of quantised Gaussians.
pub(super) fn written(quantised: &Quantised) -> Vec<u8> {
    sealed(MARK, &body(quantised))
}

/// The Gaussians of a file.
pub(super) fn read(bytes: &[u8]) -> Result<Quantised, Unreadable> {
    of_body(&opened(MARK, bytes)?)
}

fn body(Quantised { degree, centres, opacity_logits, attributes }: &Quantised) -> Vec<u8> {
    let mut body = Vec::new();
    put_count(centres.len(), &mut body);
    body.extend(u8::try_from(degree.number()));
    put_range(opacity_logits, &mut body);
    put_rows(centres, &mut body);
    put_counted(&opacity_logits.bytes.iter().copied().map(u16::from).collect::<Vec<_>>(), &mut body);
    let has = |i: usize| {
        let bits = (0..).zip(&attributes[ALWAYS..]).map(|(bit, codes)| u16::from(codes.chosen[i].is_some()) << bit);
        bits.sum()
    };
    put_counted(&(0..centres.len()).map(has).collect::<Vec<_>>(), &mut body);
    for (Codes { codes, frequencies, chosen }, width) in attributes.iter().zip(WIDTHS) {
        put_symbols(&chosen.iter().flatten().copied().collect::<Vec<_>>(), frequencies, &mut body);
        let column = |column| codes.iter().skip(column).step_by(width);
        put_rows(&(0..width).flat_map(column).map(|value| [*value]).collect::<Vec<_>>(), &mut body);
    }
    body
}

/// Appends symbols whose frequencies are their counts.
fn put_counted(symbols: &[u16], body: &mut Vec<u8>) {
    let mut counts = vec![0.0; symbols.iter().max().map_or(0, |most| usize::from(*most) + 1)];
    symbols.iter().for_each(|symbol| counts[usize::from(*symbol)] += 1.0);
    put_symbols(symbols, &frequencies_of(&counts), body);
}

fn of_body(bytes: &[u8]) -> Result<Quantised, Unreadable> {
    let mut body = Body(bytes);
    let n = body.n_gaussians()?;
    let number = usize::from(body.bytes(1, "the degree")?[0]);
    let Some(degree) = Degree::ALL.get(number).copied() else {
        return Err(Unreadable(format!("the degree is {number}, needed: 0 to 3; write the file again")));
    };
    let [least, step] = range(&mut body)?;
    let centres = body.rows::<3>(n, "centres")?;
    let (_, opacities) = symbols(&mut body, n, "opacities")?;
    all_below(opacities.iter().copied(), 256, "an opacity")?;
    let (_, degrees) = symbols(&mut body, n, "degrees")?;
    all_below(degrees.iter().copied(), 1 << number, "a set of degrees")?;
    let bytes = opacities.into_iter().map(|opacity| opacity.to_le_bytes()[0]).collect();
    let mut attributes = Vec::new();
    for attribute in 0..n_attributes(degree) {
        let has = |degrees: &u16| attribute < ALWAYS || degrees >> (attribute - ALWAYS) & 1 == 1;
        let has: Vec<bool> = degrees.iter().map(has).collect();
        let n_coded = has.iter().filter(|has| **has).count();
        let (frequencies, codes) = symbols(&mut body, n_coded, "codes")?;
        let (n_codes, width) = (frequencies.len(), WIDTHS[attribute]);
        let columns = body.rows::<1>(n_codes * width, "a codebook")?;
        let row = |code: usize| (0..width).map(move |column| column * n_codes + code);
        let mut next = codes.into_iter();
        attributes.push(Codes {
            codes: (0..n_codes).flat_map(row).map(|at| columns[at][0]).collect::<Vec<f16>>(),
            frequencies,
            chosen: has.into_iter().map(|has| has.then(|| next.next()).flatten()).collect(),
        });
    }
    body.end()?;
    Ok(Quantised { degree, centres, opacity_logits: Bytes { least, step, bytes }, attributes })
}

#[cfg(test)]
mod tests {
    use pocketsplat_kernels::finite_difference::random;
    use proptest::prelude::*;

    use super::*;
    use crate::packed::halved;
    use crate::test_files::{damage_of_a_body_is_noticed, other_counts_are_refused};

    /// `n` Gaussians, of which some have no degree 1 and few have degree 2.
    #[expect(clippy::cast_possible_truncation, reason = "any numbers")]
    fn quantised(n: usize) -> Quantised {
        let numbers: Vec<f32> = random(3, 4 * n + 200).into_iter().map(|x| x as f32).collect();
        let attribute = |attribute: usize| {
            let has = |i: usize| i.is_multiple_of([1, 1, 1, 2, 7][attribute]);
            let n_codes = if n > 0 { 5.min(n as u16) } else { 0 };
            Codes {
                codes: numbers[..usize::from(n_codes) * WIDTHS[attribute]].iter().copied().map(halved).collect(),
                frequencies: frequencies_of(&(0..n_codes).map(|code| f32::from(code + 1)).collect::<Vec<_>>()),
                chosen: (0..n).map(|i| has(i).then_some((i * i % usize::from(n_codes)) as u16)).collect(),
            }
        };
        Quantised {
            degree: Degree::Two,
            centres: numbers[n..4 * n].as_chunks().0.iter().map(|centre| centre.map(halved)).collect(),
            opacity_logits: Bytes::of(&numbers[..n]),
            attributes: (0..5).map(attribute).collect(),
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
            assert_eq!((read.gaussians().len(), read.gaussians().harmonics.len()), (n, 9 * n));
        }
    }

    proptest! {
        #[test]
        fn a_damaged_body_is_gaussians_or_an_error(at: prop::sample::Index, flip in 1..=255u8, count: u32) {
            let sound = body(&quantised(20));
            damage_of_a_body_is_noticed(&sound, (at.index(sound.len()), flip), of_body, Quantised::gaussians);
            // The number of Gaussians, and of the frequencies and words of their opacities.
            other_counts_are_refused(&sound, &[0, 133, 137], count, of_body);
        }
    }
}
