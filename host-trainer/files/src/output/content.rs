//! What is about to be written, and which files it may replace.

use std::fmt;

use crate::FileKind;

/// Stands within the first bytes of pictures that this product writes: nothing else tells them from photographs.
pub const MARK: &str = "pocketsplat";

/// What an output will be; it may replace a file of its own kind, and an empty one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Content {
    /// A file that its first bytes tell.
    Kind(FileKind),
    /// A picture of this kind with [`MARK`].
    Picture(FileKind),
    /// Text that begins in one of these ways, and what it is called, with its article.
    Text(&'static [&'static str], &'static str),
}

impl Content {
    /// Whether a file that begins with `first` may be replaced.
    pub(super) fn may_replace(self, first: &[u8]) -> bool {
        first.is_empty() || self.is_that_of(first)
    }

    fn is_that_of(self, first: &[u8]) -> bool {
        match self {
            Self::Kind(kind) => FileKind::of(first) == Some(kind),
            Self::Picture(kind) => FileKind::of(first) == Some(kind) && has_mark(first),
            Self::Text(beginnings, _) => beginnings.iter().any(|beginning| first.starts_with(beginning.as_bytes())),
        }
    }

    /// Whether a file that begins with `first` can be no part of a capture: points come as .ply too.
    pub(super) fn is_surely_ours(self, first: &[u8]) -> bool {
        self.is_that_of(first) && (self != Self::Kind(FileKind::Ply) || has_mark(first))
    }

    /// What a file is that must not be replaced, in words.
    pub(super) fn said_of(self, first: &[u8]) -> String {
        match (FileKind::of(first), self) {
            (Some(found), Self::Picture(_)) if found.is_picture() => format!("{found} that pocketsplat did not draw"),
            (Some(FileKind::Json), Self::Text(..)) => "another JSON file".to_owned(),
            (Some(FileKind::Empty), _) => "a file that cannot be read".to_owned(),
            (Some(found), _) => found.to_string(),
            (None, _) => "another file".to_owned(),
        }
    }
}

impl fmt::Display for Content {
    /// With its article.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Kind(kind) | Self::Picture(kind) => kind.fmt(f),
            Self::Text(_, name) => f.write_str(name),
        }
    }
}

fn has_mark(first: &[u8]) -> bool {
    first.windows(MARK.len()).any(|part| part == MARK.as_bytes())
}
