//! Programs that are not ours: whether they are there, and how to get them.

use std::process::{Command, Output, Stdio};

use anyhow::{Context, Result, anyhow};

/// A program of another project, and the package that brings it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Needed {
    pub(super) name: &'static str,
    /// What it is needed for, as `finds where photographs were taken`.
    does: &'static str,
    debian: &'static str,
    homebrew: &'static str,
}

pub(super) const COLMAP: Needed =
    Needed { name: "colmap", does: "finds where photographs were taken", debian: "colmap", homebrew: "colmap" };
pub(super) const FFMPEG: Needed =
    Needed { name: "ffmpeg", does: "takes photographs out of films", debian: "ffmpeg", homebrew: "ffmpeg" };
pub(super) const FFPROBE: Needed = Needed { name: "ffprobe", does: "says what a film is", ..FFMPEG };
/// As libheif up to 1.18 calls it.
pub(super) const HEIF_CONVERT: Needed = Needed {
    name: "heif-convert",
    does: "converts HEIC and AVIF photographs",
    debian: "libheif-examples",
    homebrew: "libheif",
};
/// As later ones do.
pub(super) const HEIF_DEC: Needed = Needed { name: "heif-dec", ..HEIF_CONVERT };

impl Needed {
    /// The program, to be given its arguments.
    pub(super) fn command(self) -> Command {
        let mut command = Command::new(self.name);
        command.stdin(Stdio::null());
        command
    }

    /// Whether it can be started.
    pub(super) fn is_there(self) -> bool {
        let mut asked = self.command();
        asked.arg("-h").stdout(Stdio::null()).stderr(Stdio::null());
        asked.status().is_ok()
    }

    /// Fails where it is not installed, with the command that installs it.
    pub(super) fn check(self) -> Result<()> {
        if self.is_there() { Ok(()) } else { Err(self.is_missing()) }
    }

    /// What to say where it is not installed.
    pub(super) fn is_missing(self) -> anyhow::Error {
        let Self { name, does, debian, homebrew } = self;
        anyhow!(
            "`{name}` is not installed, and it {does}; install it and give the same command again: \
             `sudo apt-get install {debian}` (Debian, Ubuntu), `brew install {homebrew}` (macOS)"
        )
    }

    /// What it says to these arguments.
    pub(super) fn says<'a>(self, arguments: impl IntoIterator<Item = &'a std::ffi::OsStr>) -> Result<Output> {
        match self.command().args(arguments).output() {
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => Err(self.is_missing()),
            said => said.with_context(|| format!("could not start `{}`", self.name)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_program_that_is_missing_is_named_with_the_command_that_installs_it() {
        let missing = Needed { name: "no-such-program-of-anyone", ..HEIF_CONVERT };
        let said = missing.check().unwrap_err().to_string();
        assert!(said.contains("`no-such-program-of-anyone` is not installed, and it converts HEIC"), "{said}");
        assert!(said.contains("`sudo apt-get install libheif-examples`"), "{said}");
        assert_eq!(missing.says([]).unwrap_err().to_string(), said);
    }
}
