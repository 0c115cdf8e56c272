//! A case in a folder of its own, and what the program said of it.

use std::fs;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

/// The commands that most cases name.
pub(crate) const TRAIN: [&str; 8] =
    ["train", "capture", "-o", "out.psb", "--iterations", "300", "--max-resolution", "48"];
pub(crate) const IMPORT: [&str; 10] =
    ["import", "splats.ply", "-o", "out.psb", "--views", "24", "--resolution", "64x64", "--iterations", "200"];

/// A case, copied so that commands may write beside it.
pub(crate) struct Case {
    pub(crate) folder: PathBuf,
}

/// Where the cases lie.
pub(crate) fn root() -> PathBuf {
    let beside = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/cases");
    std::env::var_os("POCKETSPLAT_CASES").map_or(beside, PathBuf::from)
}

/// Says what is not tested, and why.
pub(crate) fn skipped(why: &str) {
    // Not `eprintln!`, which a test that passes keeps to itself.
    let _ = writeln!(std::io::stderr(), "SKIPPED: {why}");
}

impl Case {
    /// The case of this name, or `None` after saying what is skipped.
    pub(crate) fn find(name: &str) -> Option<Self> {
        let source = root().join(name);
        if !source.is_dir() {
            skipped(&format!(
                "case {name}: not at {}; set POCKETSPLAT_CASES to a folder that has {name}/",
                source.display()
            ));
            return None;
        }
        let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("cases").join(name);
        let _ = fs::remove_dir_all(&folder);
        copy(&source, &folder);
        Some(Self { folder })
    }

    /// As [`Self::find`], with the capture of `sound` beside it.
    pub(crate) fn with_sound_capture(name: &str) -> Option<Self> {
        let case = Self::find(name)?;
        copy(&root().join("sound/capture"), &case.folder.join("capture"));
        Some(case)
    }

    /// Runs `pocketsplat` in the folder of the case.
    pub(crate) fn run(&self, args: &[&str]) -> Said {
        let mut command = Command::new(env!("CARGO_BIN_EXE_pocketsplat"));
        Said::of(command.args(args).current_dir(&self.folder).output().unwrap(), &args.join(" "))
    }

    /// Runs a script of the case, which finds `pocketsplat` by its name.
    pub(crate) fn script(&self, program: &str, args: &[&str]) -> Said {
        let folder = Path::new(env!("CARGO_BIN_EXE_pocketsplat")).parent().unwrap().display().to_string();
        let path = format!("{folder}:{}", std::env::var("PATH").unwrap_or_default());
        let mut command = Command::new(program);
        Said::of(command.args(args).env("PATH", path).current_dir(&self.folder).output().unwrap(), program)
    }
}

fn copy(from: &Path, to: &Path) {
    fs::create_dir_all(to).unwrap();
    for entry in fs::read_dir(from).unwrap().map(Result::unwrap) {
        let (source, target) = (entry.path(), to.join(entry.file_name()));
        if source.is_dir() {
            copy(&source, &target);
        } else {
            // Not `fs::copy`, which keeps what makes a file read-only.
            fs::write(&target, fs::read(&source).unwrap()).unwrap();
        }
    }
}

/// What a command said, on stdout and stderr, and how it ended.
pub(crate) struct Said {
    command: String,
    pub(crate) code: Option<i32>,
    pub(crate) text: String,
}

impl Said {
    fn of(output: Output, command: &str) -> Self {
        let text = [output.stdout, output.stderr].map(|bytes| String::from_utf8_lossy(&bytes).into_owned()).join("\n");
        let said = Self { command: command.to_owned(), code: output.status.code(), text };
        assert!(!said.text.contains("panicked at"), "{said}");
        said
    }

    /// PSNR of `train`'s held-out views, or of `import`'s cameras, dB.
    fn psnr_db(&self) -> f64 {
        let after = |line: &str, word: &str| Some(line.split_once(word)?.1.split_whitespace().next()?.parse().ok());
        let found =
            self.text.lines().find_map(|line| after(line, "quality: ").or_else(|| after(line, "psnr_to_original_db")));
        found.flatten().unwrap_or_else(|| panic!("no PSNR: {self}"))
    }

    /// Ended well, with at least this quality.
    pub(crate) fn trained(&self, least_db: f64) {
        assert_eq!(self.code, Some(0), "{self}");
        assert!(self.psnr_db() >= least_db, "{} dB, needs {least_db}: {self}", self.psnr_db());
    }

    pub(crate) fn imported(&self, least_db: f64) {
        self.trained(least_db);
    }

    /// Ended well, and said each of these words, whatever their case.
    pub(crate) fn succeeds(&self, words: &[&str]) {
        assert_eq!(self.code, Some(0), "{self}");
        self.says(words);
    }

    /// Ended with exit code 1, and said each of these words.
    pub(crate) fn refuses(&self, words: &[&str]) {
        assert_eq!(self.code, Some(1), "{self}");
        self.says(words);
    }

    /// Said each of these words, whatever their case.
    pub(crate) fn says(&self, words: &[&str]) {
        let text = self.text.to_lowercase();
        for word in words {
            assert!(text.contains(&word.to_lowercase()), "does not say `{word}`: {self}");
        }
    }

    pub(crate) fn does_not_say(&self, word: &str) {
        assert!(!self.text.to_lowercase().contains(&word.to_lowercase()), "says `{word}`: {self}");
    }
}

impl std::fmt::Display for Said {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}: exit code {:?}\n{}", self.command, self.code, self.text)
    }
}
