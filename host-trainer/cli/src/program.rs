//! Which program a figure is of.

use std::path::PathBuf;
use std::sync::{LazyLock, OnceLock};

use pocketsplat_trainer::{REVISION, revision_of};

use crate::say::say;

static PATH: OnceLock<PathBuf> = OnceLock::new();

/// Says once which file starts this command again.
pub(crate) fn set_path(path: Option<PathBuf>) {
    // A second command in one process keeps the first one's.
    let _ = path.map(|path| PATH.set(path));
}

/// The file that starts this command again.
pub(crate) fn path() -> Option<PathBuf> {
    PATH.get().cloned()
}

/// Version and revision of training, as a bundle keeps them: programs that agree in both give the same bundle of the same run.
pub(crate) fn training() -> String {
    format!("{} r{REVISION}", env!("CARGO_PKG_VERSION"))
}

/// The same with the commit, where this program was built from the repository: `0.1.0 r1 1a2b3c4`, `-dirty` behind it where files
/// were changed since.
pub(crate) fn this() -> &'static str {
    static THIS: LazyLock<String> = LazyLock::new(|| match option_env!("POCKETSPLAT_COMMIT") {
        Some(commit) => format!("{} {commit}", training()),
        None => training(),
    });
    &THIS
}

/// The program of figures that this one measured.
///
/// * `trained`: what trained the bundle, as it says; a file of Gaussians may say nothing.
pub(crate) fn of_figures(trained: Option<&str>) -> String {
    match trained {
        Some(trained) if trained == training() => this().to_owned(),
        Some(trained) => format!("{trained}, measured by {}", this()),
        None => format!("unknown, measured by {}", this()),
    }
}

/// Says where rows of several programs stand in one table: what differs may be the program.
pub(crate) fn warn_of_several<'a>(programs: impl IntoIterator<Item = &'a str>) {
    let mut met: Vec<&str> = programs.into_iter().map(revision_of).collect();
    met.sort_unstable();
    met.dedup();
    if met.len() > 1 {
        say!(
            "warning: these runs were trained by several programs: {}; part of their differences may be the programs'; train them \
             anew with one",
            met.join(", ")
        );
    }
}

/// The program of several rows: theirs, where all are of one.
pub(crate) fn of_all<'a>(programs: impl IntoIterator<Item = &'a str>) -> String {
    let mut met: Vec<&str> = programs.into_iter().collect();
    met.sort_unstable();
    met.dedup();
    met.join("; ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_commit_is_no_other_program_and_a_revision_is() {
        assert_eq!(revision_of("0.1.0 r3 1a2b3c4-dirty"), "0.1.0 r3");
        assert_eq!(revision_of("0.1.0 r3"), "0.1.0 r3");
        assert_eq!(revision_of("0.1.0, measured by 0.1.0 r3 1a2b3c4"), "0.1.0");
        assert_eq!(revision_of("unknown, measured by 0.1.0 r3"), "unknown");
        assert!(this().starts_with(&training()), "{}", this());
        assert_eq!(of_figures(Some(&training())), this());
        assert_eq!(of_all(["b", "a", "b"]), "a; b");
    }
}
