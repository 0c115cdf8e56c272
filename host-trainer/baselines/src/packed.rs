//! Files: a mark, a checksum, and a body that is deflated.
//!
//! Numbers of 16 bits stand in columns, all low bytes of a column before all high ones: alike bytes lie together, which is what deflate
//! (RFC 1951) codes well.

use std::io::{Read, Write};

use flate2::Compression;
use flate2::read::DeflateDecoder;
use flate2::write::DeflateEncoder;
use half::f16;

use crate::baseline::Unreadable;

/// The first bytes of a file.
pub(crate) type Mark = [u8; 4];

/// Gaussians of a file at most, and bytes of its body: what is damaged asks for no more memory than so many take.
const MOST_GAUSSIANS: usize = 10_000_000;
const MOST_BODY: u64 = 1 << 30;
/// Bytes of the mark and the checksum.
const HEADER: usize = 8;

/// The file of a body.
pub(crate) fn sealed(mark: Mark, body: &[u8]) -> Vec<u8> {
    let mut encoder = DeflateEncoder::new(Vec::new(), Compression::best());
    let deflated = encoder.write_all(body).and_then(|()| encoder.finish()).expect("a vector takes all bytes");
    [&mark[..], &crc32fast::hash(&deflated).to_le_bytes(), &deflated].concat()
}

/// The body of a file.
///
/// # Errors
/// Another mark, a checksum that does not fit, or bytes that no encoder writes.
pub(crate) fn opened(mark: Mark, bytes: &[u8]) -> Result<Vec<u8>, Unreadable> {
    let Some((header, deflated)) = bytes.split_at_checked(HEADER).filter(|(header, _)| header[..4] == mark) else {
        let [found, needed] = [&bytes[..bytes.len().min(4)], &mark].map(|b| b.escape_ascii().to_string());
        return Err(Unreadable(format!(
            "the file begins with `{found}`, needed: `{needed}`; give a file of this method"
        )));
    };
    let (found, needed) = (crc32fast::hash(deflated).to_le_bytes(), &header[4..]);
    if found != needed {
        return Err(Unreadable(format!(
            "the file's bytes have the checksum {found:02x?}, needed: {needed:02x?}; copy the file again"
        )));
    }
    let mut body = Vec::new();
    match DeflateDecoder::new(deflated).take(MOST_BODY).read_to_end(&mut body) {
        Ok(n) if n as u64 == MOST_BODY => Err(Unreadable(format!(
            "the file's body has {MOST_BODY} bytes or more, needed: fewer; write the file again"
        ))),
        Ok(_) => Ok(body),
        Err(fault) => Err(Unreadable(format!("the file's body cannot be inflated: {fault}; write the file again"))),
    }
}

/// Appends a column.
pub(crate) fn put_words(words: impl Iterator<Item = u16> + Clone, body: &mut Vec<u8>) {
    body.extend(words.clone().map(|word| word.to_le_bytes()[0]));
    body.extend(words.map(|word| word.to_le_bytes()[1]));
}

/// Appends rows of halves, column by column.
pub(crate) fn put_rows<const WIDTH: usize>(rows: &[[f16; WIDTH]], body: &mut Vec<u8>) {
    (0..WIDTH).for_each(|column| put_words(rows.iter().map(|row| row[column].to_bits()), body));
}

/// Appends yes or no, eight to a byte, the first lowest.
pub(crate) fn put_bits(bits: &[bool], body: &mut Vec<u8>) {
    body.extend(bits.chunks(8).map(|bits| bits.iter().rev().fold(0, |byte, bit| byte << 1 | u8::from(*bit))));
}

/// Appends a count, in four bytes.
pub(crate) fn put_count(count: usize, body: &mut Vec<u8>) {
    body.extend(u32::try_from(count).expect("fewer than 2³²").to_le_bytes());
}

/// That symbols are below a bound.
///
/// # Errors
/// The first that is not.
pub(crate) fn all_below<S: Into<usize>>(
    symbols: impl IntoIterator<Item = S>,
    bound: usize,
    what: &str,
) -> Result<(), Unreadable> {
    match symbols.into_iter().map(Into::<usize>::into).find(|symbol| *symbol >= bound) {
        Some(symbol) => Err(Unreadable(format!("{what} is {symbol}, needed: less than {bound}; write the file again"))),
        None => Ok(()),
    }
}

/// A value as files keep it: the nearest half, the largest one for what is beyond.
pub(crate) fn halved(value: f32) -> f16 {
    f16::from_f32(value.clamp(f16::MIN.to_f32(), f16::MAX.to_f32()))
}

/// What is left to read of a body.
pub(crate) struct Body<'a>(pub(crate) &'a [u8]);

impl<'a> Body<'a> {
    /// The next `n` bytes.
    pub(crate) fn bytes(&mut self, n: usize, what: &str) -> Result<&'a [u8], Unreadable> {
        let Some((bytes, rest)) = self.0.split_at_checked(n) else {
            let left = self.0.len();
            return Err(Unreadable(format!("{left} bytes are left for {what}, needed: {n}; write the file again")));
        };
        self.0 = rest;
        Ok(bytes)
    }

    fn four(&mut self, what: &str) -> Result<[u8; 4], Unreadable> {
        let bytes = self.bytes(4, what)?;
        Ok(std::array::from_fn(|i| bytes[i]))
    }

    /// The next four bytes as a count.
    pub(crate) fn count(&mut self, what: &str) -> Result<usize, Unreadable> {
        Ok(u32::from_le_bytes(self.four(what)?) as usize)
    }

    /// The next four bytes as a number, which need not be finite.
    pub(crate) fn number(&mut self, what: &str) -> Result<f32, Unreadable> {
        Ok(f32::from_le_bytes(self.four(what)?))
    }

    /// How many Gaussians follow.
    pub(crate) fn n_gaussians(&mut self) -> Result<usize, Unreadable> {
        let n = self.count("the number of Gaussians")?;
        if n > MOST_GAUSSIANS {
            return Err(Unreadable(format!(
                "there are {n} Gaussians, needed: {MOST_GAUSSIANS} at most; write the file again"
            )));
        }
        Ok(n)
    }

    /// A column of `n`.
    pub(crate) fn words(&mut self, n: usize, what: &str) -> Result<Vec<u16>, Unreadable> {
        let (low, high) = self.bytes(n.saturating_mul(2), what)?.split_at(n);
        Ok(low.iter().zip(high).map(|(low, high)| u16::from_le_bytes([*low, *high])).collect())
    }

    /// `n` rows of halves, all finite.
    pub(crate) fn rows<const WIDTH: usize>(&mut self, n: usize, what: &str) -> Result<Vec<[f16; WIDTH]>, Unreadable> {
        let columns = (0..WIDTH).map(|_| self.words(n, what)).collect::<Result<Vec<_>, _>>()?;
        if let Some(bits) = columns.iter().flatten().find(|bits| !f16::from_bits(**bits).is_finite()) {
            let found = f16::from_bits(*bits);
            return Err(Unreadable(format!("{what} hold {found}, needed: finite numbers; write the file again")));
        }
        Ok((0..n).map(|row| std::array::from_fn(|column| f16::from_bits(columns[column][row]))).collect())
    }

    /// `n` times yes or no.
    pub(crate) fn bits(&mut self, n: usize, what: &str) -> Result<Vec<bool>, Unreadable> {
        let bytes = self.bytes(n.div_ceil(8), what)?;
        Ok((0..n).map(|i| bytes[i / 8] >> (i % 8) & 1 == 1).collect())
    }

    /// That nothing is left.
    pub(crate) fn end(self) -> Result<(), Unreadable> {
        let left = self.0.len();
        if left == 0 {
            return Ok(());
        }
        Err(Unreadable(format!("{left} bytes follow the last array, needed: none; write the file again")))
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    const MARK: Mark = *b"TEST";

    proptest! {
        #[test]
        fn a_body_comes_back_and_no_damage_passes(body: Vec<u8>, at: prop::sample::Index, flip in 1..=255u8) {
            let file = sealed(MARK, &body);
            prop_assert_eq!(opened(MARK, &file), Ok(body));
            prop_assert!(opened(MARK, &file[..at.index(file.len())]).is_err());
            let mut damaged = file;
            let at = at.index(damaged.len());
            damaged[at] ^= flip;
            prop_assert!(opened(MARK, &damaged).is_err());
        }

        #[test]
        fn arrays_come_back(words: Vec<u16>, bits: Vec<bool>) {
            let mut body = Vec::new();
            put_words(words.iter().copied(), &mut body);
            put_bits(&bits, &mut body);
            let mut rest = Body(&body);
            prop_assert_eq!(rest.words(words.len(), "words"), Ok(words));
            prop_assert_eq!(rest.bits(bits.len(), "bits"), Ok(bits));
            prop_assert_eq!(rest.end(), Ok(()));
        }
    }

    #[test]
    fn counts_beyond_the_bytes_and_infinities_are_refused() {
        assert!(Body(&[0; 9]).words(usize::MAX, "words").is_err());
        assert!(Body(&[0; 9]).bits(usize::MAX, "bits").is_err());
        assert_eq!(Body(&10_000_000_u32.to_le_bytes()).n_gaussians(), Ok(10_000_000));
        let said = Body(&10_000_001_u32.to_le_bytes()).n_gaussians().unwrap_err().to_string();
        assert_eq!(said, "there are 10000001 Gaussians, needed: 10000000 at most; write the file again");
        let mut body = Vec::new();
        put_rows(&[[halved(1.0), f16::INFINITY]], &mut body);
        let said = Body(&body).rows::<2>(1, "rows").unwrap_err().to_string();
        assert_eq!(said, "rows hold inf, needed: finite numbers; write the file again");
        assert_eq!(halved(1e9), f16::MAX);
    }
}
