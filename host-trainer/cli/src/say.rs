//! What is said on stderr while a command works: nobody has to read it.
//!
//! A pipe may have lost its reader and a terminal may be gone. A program that works for hours does not end for that, so a write that
//! fails is as good as one that nobody reads.

use std::fmt;
use std::io::Write as _;

/// Says a line on stderr, as `eprintln!` does, and goes on where that fails.
macro_rules! say {
    ($($words:tt)*) => { $crate::say::line(format_args!($($words)*)) };
}
pub(crate) use say;

/// A line on stderr, in one piece.
pub(crate) fn line(words: fmt::Arguments<'_>) {
    text(&format!("{words}\n"));
}

/// Text on stderr as it is.
pub(crate) fn text(words: &str) {
    let _ = std::io::stderr().write_all(words.as_bytes());
}
