//! Instructions as the firmware counts them on an emulated board.

use std::env;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use pocketsplat_format::{Camera, Stage};
use pocketsplat_instructions::Processor;

use super::{Setting, Stages};

/// What `firmware-example` keeps of its RAM for itself: stack and other statics, bytes.
const FIRMWARE_BYTES: usize = 10 * 1024 + 512;
/// The firmware numbers its frames with one digit.
pub const MOST_VIEWS: usize = 10;

/// Why nothing can be counted, or a count came to nothing.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
#[expect(missing_docs, reason = "each message names its fields")]
pub enum CountError {
    /// The folder is not that of the firmware.
    #[error("{} is not there; needs the repository's folder firmware-example", .0.display())]
    NoFirmware(PathBuf),
    /// A program is missing.
    #[error("`{0}` is not on the PATH; firmware-example/README.md says how to install it")]
    NoProgram(&'static str),
    /// A file of a count could not be written or a program not be started.
    #[error("{}: {source}", path.display())]
    Io { path: PathBuf, source: std::io::Error },
    /// The firmware did not build or did not draw.
    #[error("the firmware on {board}: {said}")]
    Failed { board: &'static str, said: String },
}

/// Builds `firmware-example` with a bundle and a setting, and lets emulated boards draw.
#[derive(Clone, Debug)]
pub struct Counter {
    script: PathBuf,
    /// Absolute, as the firmware's build script wants it.
    bundle: PathBuf,
    /// For cameras, frames and logs.
    folder: PathBuf,
}

impl Counter {
    /// One for `bundle`, with the firmware in the folder `firmware`, that keeps its files in `folder`.
    ///
    /// # Errors
    /// [`CountError`] when the firmware or a program that `targets` need is not there.
    pub fn new(firmware: &Path, bundle: &Path, folder: &Path, targets: &[Processor]) -> Result<Self, CountError> {
        let script = firmware.join("measure.sh");
        if !script.is_file() {
            return Err(CountError::NoFirmware(script));
        }
        let needed = targets.iter().flat_map(|target| programs(*target));
        let paths: Vec<PathBuf> = env::var_os("PATH").iter().flat_map(env::split_paths).collect();
        for program in needed {
            if !paths.iter().any(|path| path.join(program).is_file()) {
                return Err(CountError::NoProgram(program));
            }
        }
        let io = |path: &Path, source| CountError::Io { path: path.to_owned(), source };
        std::fs::create_dir_all(folder).map_err(|source| io(folder, source))?;
        let whole = |path: &Path| path.canonicalize().map_err(|source| io(path, source));
        Ok(Self { script, bundle: whole(bundle)?, folder: whole(folder)? })
    }

    /// Instructions of a frame, mean over the views of `cameras`, at most [`MOST_VIEWS`], in memory for a plan of `scratch_len` bytes.
    ///
    /// # Errors
    /// [`CountError`] when the firmware does not build, or the board has too little memory.
    pub fn count(
        &self,
        target: Processor,
        setting: &Setting,
        cameras: &[Camera],
        scratch_len: usize,
    ) -> Result<Stages, CountError> {
        let views = self.folder.join("views.txt");
        pocketsplat_files::write_whole(&views, |out| out.write_all(lines(cameras).as_bytes()))
            .map_err(|source| CountError::Io { path: views.clone(), source })?;
        let [width, height] =
            [|c: &Camera| c.width_px, |c: &Camera| c.height_px].map(|side| cameras.iter().map(side).max().unwrap_or(1));
        let board = board(target);
        let output = Command::new(&self.script)
            .arg(&self.bundle)
            .args([board, &(scratch_len + FIRMWARE_BYTES).div_ceil(1024).to_string(), &format!("{width}x{height}")])
            .arg(&self.folder)
            .env("VIEWS", &views)
            .env("BUDGET", budget(setting))
            .env("ARITHMETIC", setting.arithmetic.type_name())
            // A frame of a processor without an FPU is billions of instructions.
            .env("QEMU_TIMEOUT_S", "1800")
            .stdin(Stdio::null())
            .output()
            .map_err(|source| CountError::Io { path: self.script.clone(), source })?;
        let [printed, said] = [output.stdout, output.stderr].map(|text| String::from_utf8_lossy(&text).into_owned());
        let failed = |said: &str| {
            let line = said.lines().rev().find(|line| !line.trim().is_empty()).unwrap_or("it printed nothing");
            CountError::Failed { board, said: line.trim().to_owned() }
        };
        if !output.status.success() {
            return Err(failed(&said));
        }
        stages(&printed, cameras.len()).ok_or_else(|| failed(&printed))
    }
}

/// The emulated board that stands for a target.
fn board(target: Processor) -> &'static str {
    match target {
        Processor::CortexM0Plus => "mps2-an385",
        Processor::CortexM4 => "mps2-an386",
        Processor::CortexM7 => "mps2-an500",
        Processor::Riscv32imac => "virt",
        Processor::Riscv32imafc => "virt-fpu",
    }
}

fn programs(target: Processor) -> [&'static str; 4] {
    let emulator = match target {
        Processor::CortexM0Plus | Processor::CortexM4 | Processor::CortexM7 => "qemu-system-arm",
        Processor::Riscv32imac | Processor::Riscv32imafc => "qemu-system-riscv32",
    };
    ["bash", "flip-link", "defmt-print", emulator]
}

/// Cameras as the firmware's build script reads them.
fn lines(cameras: &[Camera]) -> String {
    let line = |camera: &Camera| {
        let rotation = camera.rotation.to_array();
        let floats = rotation.iter().chain(&camera.translation).chain(&camera.focal_px).chain(&camera.principal_px);
        let mut numbers: Vec<String> = floats.map(f32::to_string).collect();
        numbers.extend([camera.width_px, camera.height_px].map(|px| px.to_string()));
        numbers.join(" ") + "\n"
    };
    cameras.iter().map(line).collect()
}

/// A setting as calls of a `Budget`, in Rust.
fn budget(setting: &Setting) -> String {
    let Setting { quality, tiers, residency, strips, .. } = setting;
    let krate = "pocketsplat_core";
    format!(
        ".with_quality({krate}::{quality:?}).with_tiers({tiers}).with_residency({krate}::Residency::{residency:?})\
         .with_strips({krate}::Strips::{strips:?})"
    )
}

/// The mean of each stage over frames, of what `measure.sh` prints; `None` where a number is missing.
fn stages(table: &str, n_frames: usize) -> Option<Stages> {
    let mut sums = [0.0; Stage::ALL.len()];
    let mut n_rows = 0;
    for row in table.lines().skip(1) {
        let columns: Vec<&str> = row.split(',').collect();
        let [.., frame, stage, instructions] = columns.as_slice() else { return None };
        if *frame != "-" {
            let place = Stage::ALL.iter().position(|known| known.name() == *stage)?;
            sums[place] += instructions.parse::<f64>().ok()? / n_frames as f64;
            n_rows += 1;
        }
    }
    (n_rows == n_frames * sums.len()).then_some(sums)
}

#[cfg(test)]
mod tests {
    use pocketsplat_core::{Quality, Residency, Strips};

    use super::super::ArithmeticChoice;
    use super::*;

    #[test]
    fn a_setting_is_said_in_the_firmwares_words() {
        let setting = Setting {
            quality: Quality::BALANCED,
            tiers: 2,
            residency: Residency::Streamed,
            strips: Strips::Exactly(4),
            ..Setting::exact(ArithmeticChoice::Reference)
        };
        assert_eq!(
            budget(&setting),
            ".with_quality(pocketsplat_core::Quality { alpha_cut: 2, detail: true }).with_tiers(2)\
             .with_residency(pocketsplat_core::Residency::Streamed).with_strips(pocketsplat_core::Strips::Exactly(4))"
        );
    }

    #[test]
    fn frames_of_a_table_are_averaged_stage_by_stage() {
        let mut table = "board,frame,stage,instructions\nvirt,-,bind,7\n".to_owned();
        for (frame, factor) in [(0, 1), (1, 3)] {
            for (i, stage) in Stage::ALL.iter().enumerate() {
                table += &format!("virt,{frame},{},{}\n", stage.name(), factor * i);
            }
        }
        let means: Stages = std::array::from_fn(|i| 2.0 * i as f64);
        assert_eq!(stages(&table, 2), Some(means));
        assert_eq!(stages(&table, 3), None, "a frame is missing");
        assert_eq!(stages("", 1), None);
    }
}
