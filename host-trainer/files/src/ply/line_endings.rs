//! Binary files that were copied as text: every LF became CR LF, or every CR LF became LF.

use super::Fault;
use super::header::Header;

/// A file may be shorter by one byte for so many that it should have, to be taken for one whose CR LF became LF: random bytes have such a
/// pair in 65,536, and numbers that repeat some more.
const BYTES_FOR_A_PAIR: usize = 1024;

/// Refuses a binary file whose line endings were converted.
///
/// * `head`, `body`: the bytes of the header's text, and those after it.
///
/// # Errors
/// [`Fault`] that says which way they were converted.
pub fn check(header: &Header<'_>, head: &[u8], body: &[u8]) -> Result<(), Fault> {
    let Some(promised) = header.n_bytes() else { return Ok(()) };
    let has_pairs = head.windows(2).any(|pair| pair == b"\r\n");
    let n_feeds = body.iter().filter(|&&byte| byte == b'\n').count();
    let n_pairs = body.windows(2).filter(|pair| pair == b"\r\n").count();
    let damaged = |by: usize, than: &str, sign: &str| {
        Err(Fault::new(format!(
            "is damaged by a conversion of line endings: it is {by} bytes {than} than the {promised} that its header promises, and {sign}; \
             copy it again as binary, from where it was made"
        )))
    };
    if has_pairs && body.len() > promised && n_feeds > 0 && n_pairs == n_feeds && body.len() - n_pairs >= promised {
        return damaged(body.len() - promised, "longer", "a CR stands before every LF");
    }
    let missing = promised.saturating_sub(body.len());
    if !has_pairs && (1..=promised / BYTES_FOR_A_PAIR).contains(&missing) && n_pairs == 0 {
        return damaged(missing, "shorter", "no CR stands before any LF");
    }
    Ok(())
}
