//! COLMAP as it is installed: which options it has, and its commands.

use std::collections::BTreeSet;
use std::ffi::OsStr;
use std::path::Path;
use std::process::Command;

use anyhow::{Context, Result, bail};

use super::programs::COLMAP;

/// Blocks of photographs along each side of the square of pairs: what a kill may cost, and how finely progress is told.
const N_BLOCKS: usize = 8;

/// Options that COLMAP has under one name up to 3.12 and another one later.
const EXTRACTION_ON_GPU: [&str; 2] = ["--FeatureExtraction.use_gpu", "--SiftExtraction.use_gpu"];
const MATCHING_ON_GPU: [&str; 2] = ["--FeatureMatching.use_gpu", "--SiftMatching.use_gpu"];
const BLOCK_SIZE: [&str; 2] = ["--ExhaustivePairing.block_size", "--ExhaustiveMatching.block_size"];

/// The COLMAP of this machine.
#[derive(Clone, Debug)]
pub(super) struct Colmap {
    /// As it calls itself, `COLMAP 3.8`.
    pub(super) version: String,
    has_cuda: bool,
    extraction: Options,
    exhaustive: Options,
    sequential: Options,
    of_pairs: Options,
}

impl Colmap {
    /// Asks COLMAP what it is.
    pub(super) fn find() -> Result<Self> {
        let (version, has_cuda) = version_in(&said(&["help"])?);
        let options = |program| -> Result<Options> { Ok(Options::in_help(&said(&[program, "-h"])?)) };
        let colmap = Self {
            version,
            has_cuda,
            extraction: options("feature_extractor")?,
            exhaustive: options("exhaustive_matcher")?,
            sequential: options("sequential_matcher")?,
            of_pairs: options("matches_importer")?,
        };
        if colmap.extraction.0.is_empty() {
            bail!(
                "`colmap feature_extractor -h` lists no options, so this is no COLMAP that is known; install COLMAP 3.8 or later"
            );
        }
        Ok(colmap)
    }

    /// Whether its programs work on a GPU here: with CUDA where there is a device of NVIDIA, else by OpenGL, which needs a display.
    pub(super) fn finds_gpu(&self) -> bool {
        works_on_gpu(self.has_cuda, Path::new("/dev/nvidia0").exists(), has_display())
    }

    /// Finds features in photographs, which one camera took or one each.
    ///
    /// * `list`: their names, one a line. * `camera`: the number of the camera that an earlier process began with.
    pub(super) fn features(&self, paths: &Paths, list: &Path, shared: Shared, on_gpu: bool) -> Command {
        let mut command = paths.command("feature_extractor", true);
        command.arg("--image_list_path").arg(list);
        match shared {
            // A lens of its own for each leaves few photographs to fix each, so it has few parameters.
            Shared::Each => command.args(["--ImageReader.camera_model", "SIMPLE_RADIAL"]),
            Shared::One { begun } => {
                command.args(["--ImageReader.single_camera", "1", "--ImageReader.camera_model", "OPENCV"]);
                if let Some(camera) = begun {
                    command.args(["--ImageReader.existing_camera_id", &camera.to_string()]);
                }
                &mut command
            }
        };
        self.extraction.set(&mut command, &EXTRACTION_ON_GPU, u8::from(on_gpu));
        command
    }

    /// Compares each photograph with each other one.
    pub(super) fn exhaustive(&self, paths: &Paths, n: usize, on_gpu: bool) -> Command {
        let mut command = paths.command("exhaustive_matcher", false);
        self.exhaustive.set(&mut command, &MATCHING_ON_GPU, u8::from(on_gpu));
        self.exhaustive.set(&mut command, &BLOCK_SIZE, n.div_ceil(N_BLOCKS).clamp(5, 50));
        command
    }

    /// Compares each photograph with the next ones by name.
    pub(super) fn sequential(&self, paths: &Paths, on_gpu: bool) -> Command {
        let mut command = paths.command("sequential_matcher", false);
        self.sequential.set(&mut command, &MATCHING_ON_GPU, u8::from(on_gpu));
        command
    }

    /// Compares the pairs of a list.
    pub(super) fn pairs(&self, paths: &Paths, list: &Path, on_gpu: bool) -> Command {
        let mut command = paths.command("matches_importer", false);
        command.arg("--match_list_path").arg(list).args(["--match_type", "pairs"]);
        self.of_pairs.set(&mut command, &MATCHING_ON_GPU, u8::from(on_gpu));
        command
    }
}

/// Places cameras and points, and leaves models in the folder `models`.
///
/// * `with_distortion`: whether the distortion of the lens is found on the way, or left as it is at first: none.
pub(super) fn mapper(paths: &Paths, models: &Path, with_distortion: bool) -> Command {
    let mut command = paths.command("mapper", true);
    command.arg("--output_path").arg(models);
    if !with_distortion {
        command.args(["--Mapper.ba_refine_extra_params", "0"]);
    }
    command
}

/// Fits poses, points and lens of a model together.
pub(super) fn adjuster(model: &Path) -> Command {
    let mut command = on_no_display(COLMAP.command());
    command.arg("bundle_adjuster").arg("--input_path").arg(model).arg("--output_path").arg(model);
    command
}

/// Whose lens it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Shared {
    /// One camera took all photographs of the list.
    One {
        /// Its number where an earlier process began with it.
        begun: Option<usize>,
    },
    /// Each photograph has its own.
    Each,
}

/// Where COLMAP reads and writes.
pub(super) struct Paths<'a> {
    pub(super) database: &'a Path,
    pub(super) images: &'a Path,
}

impl Paths<'_> {
    fn command(&self, program: &str, with_images: bool) -> Command {
        let mut command = on_no_display(COLMAP.command());
        command.arg(program).arg("--database_path").arg(self.database);
        if with_images {
            command.arg("--image_path").arg(self.images);
        }
        command
    }
}

fn has_display() -> bool {
    ["DISPLAY", "WAYLAND_DISPLAY"].iter().any(|name| std::env::var_os(name).is_some())
}

/// The same, which what Qt looks for does not end where there is no display.
fn on_no_display(mut command: Command) -> Command {
    if !has_display() {
        command.env("QT_QPA_PLATFORM", "offscreen");
    }
    command
}

/// Which options a program of COLMAP has.
#[derive(Clone, Debug)]
struct Options(BTreeSet<String>);

impl Options {
    fn in_help(help: &str) -> Self {
        let words = help.split_whitespace().filter(|word| word.starts_with("--"));
        Self(words.map(str::to_owned).collect())
    }

    /// Sets the first of these that there is; none is the default of a COLMAP that has other ones.
    fn set(&self, command: &mut Command, names: &[&str], value: impl ToString) {
        if let Some(name) = names.iter().find(|name| self.0.contains(**name)) {
            command.args([*name, &value.to_string()]);
        }
    }
}

/// What COLMAP prints: on stdout in old versions, on stderr in new ones.
fn said(arguments: &[&str]) -> Result<String> {
    let output = COLMAP.says(arguments.iter().map(OsStr::new)).context("could not ask COLMAP what it is")?;
    Ok([output.stdout, output.stderr].map(|bytes| String::from_utf8_lossy(&bytes).into_owned()).concat())
}

/// `COLMAP 3.8`, and whether it was built with CUDA.
fn version_in(help: &str) -> (String, bool) {
    let mut words = help.split_whitespace().skip_while(|word| *word != "COLMAP").skip(1);
    let version = words.next().map_or_else(|| "COLMAP".to_owned(), |number| format!("COLMAP {number}"));
    (version, help.contains("with CUDA"))
}

fn works_on_gpu(has_cuda: bool, has_nvidia: bool, has_display: bool) -> bool {
    if has_cuda { has_nvidia } else { has_display }
}

#[cfg(test)]
mod tests {
    use super::*;

    const OLD: &str = "COLMAP 3.8 (Commit Unknown on Unknown without CUDA)\n\n  --image_path arg\n  \
                       --SiftExtraction.use_gpu arg (=1)\n  --SiftMatching.use_gpu arg (=1)\n  --ExhaustiveMatching.block_size arg (=50)\n";
    const NEW: &str = "COLMAP 3.13.0 (Commit 1 on 2025-10-01 with CUDA)\n\n  --FeatureExtraction.use_gpu arg (=1)\n  \
                       --FeatureMatching.use_gpu arg (=1)\n";

    fn colmap(help: &str) -> Colmap {
        let (version, has_cuda) = version_in(help);
        let options = Options::in_help(help);
        let [extraction, exhaustive, sequential, of_pairs] = [(); 4].map(|()| options.clone());
        Colmap { version, has_cuda, extraction, exhaustive, sequential, of_pairs }
    }

    fn words(command: &Command) -> String {
        command.get_args().map(|word| word.to_string_lossy().into_owned()).collect::<Vec<_>>().join(" ")
    }

    #[test]
    fn options_are_called_as_the_installed_version_calls_them() {
        let paths = Paths { database: Path::new("d.db"), images: Path::new("i") };
        let old = colmap(OLD);
        assert_eq!((old.version.as_str(), old.has_cuda), ("COLMAP 3.8", false));
        let features = words(&old.features(&paths, Path::new("l.txt"), Shared::One { begun: Some(1) }, false));
        assert_eq!(
            features,
            "feature_extractor --database_path d.db --image_path i --image_list_path l.txt --ImageReader.single_camera 1 \
             --ImageReader.camera_model OPENCV --ImageReader.existing_camera_id 1 --SiftExtraction.use_gpu 0"
        );
        let matches = words(&old.exhaustive(&paths, 80, true));
        assert!(matches.ends_with("--SiftMatching.use_gpu 1 --ExhaustiveMatching.block_size 10"), "{matches}");
        let new = colmap(NEW);
        assert_eq!((new.version.as_str(), new.has_cuda), ("COLMAP 3.13.0", true));
        let features = words(&new.features(&paths, Path::new("l.txt"), Shared::Each, false));
        assert!(features.ends_with("SIMPLE_RADIAL --FeatureExtraction.use_gpu 0"), "{features}");
        let matches = words(&new.exhaustive(&paths, 80, false));
        assert!(matches.ends_with("exhaustive_matcher --database_path d.db --FeatureMatching.use_gpu 0"), "{matches}");
    }

    #[test]
    fn without_a_display_opengl_finds_no_gpu() {
        assert!(!works_on_gpu(false, true, false) && works_on_gpu(false, false, true));
        assert!(works_on_gpu(true, true, false) && !works_on_gpu(true, false, true));
    }
}
