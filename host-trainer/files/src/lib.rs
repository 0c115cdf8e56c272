//! Files as people have them: what their bytes are, whatever they are called, and their paths in commands that people copy.
//!
//! Every reader that refuses a file asks [`FileKind`] what the file is instead, so that a Git LFS pointer, a web page or a file of
//! another program is named in the same words everywhere. Every command that writes does it by [`Outputs`], so that nothing is lost
//! that is not its own.

mod kind;
mod output;
pub mod ply;
mod reach;
mod shell;

pub use kind::FileKind;
pub use output::{Content, MARK, Output, OutputError, Outputs, write_whole};
pub use reach::{closed_folder, out_of_reach, why_missing};
pub use shell::{beside, shell_word, shown, unused};
