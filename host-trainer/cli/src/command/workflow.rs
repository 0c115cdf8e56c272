//! Many runs as a workflow of Snakemake, which places them on one machine or on many.

use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

use anyhow::{Context, Result};
use pocketsplat_capture::dataset::{Capture, Split};
use pocketsplat_files::{Content, Outputs};
use pocketsplat_trainer::train::TrainConfig;
use serde::{Deserialize, Serialize};

use super::capture::views_of;
use super::devices::DeviceChoice;
use super::estimate::{Estimate, Expected, duration};
use super::loaded::LoadedCapture;
use super::point::has_trained_tiers;
use crate::config::RunConfig;

/// What the workflow is made of, whatever it trains.
const SNAKEFILE: &str = include_str!("workflow/Snakefile");
const PROFILE: &str = include_str!("workflow/profile.yaml");
/// The file of a plan, in the folder of its runs.
const PLAN: (&str, Content) = ("runs.json", Content::Text(&["{\n  \"program\""], "a plan of runs"));
const CONFIGURATION: Content = Content::Text(&["preset = ", "unset = ", "dataset = "], "a configuration of a run");
const OPTIONS: Content = Content::Text(&["\n", "--"], "a list of options");
const RULES: Content =
    Content::Text(&["# Written by pocketsplat", "# What `snakemake` in this folder takes"], "a file of the workflow");

/// The option by which `tables` is given published results.
pub(super) const PUBLISHED: &str = "--published";

/// Minutes that a queue gives a run above its estimate, which is off by as much: a run that is stopped goes on.
const MINUTES_MARGIN: f64 = 2.0;
/// And memory.
const MEMORY_MARGIN: f64 = 1.25;

/// All runs of a workflow, and how their results are merged.
#[derive(Debug, Serialize, Deserialize)]
pub(super) struct Plan {
    /// The program, as this machine has it.
    pub(super) program: PathBuf,
    pub(super) runs: Vec<PlannedRun>,
    pub(super) merge: Merge,
}

/// The command that makes tables of measured runs.
#[derive(Debug, Serialize, Deserialize)]
pub(super) struct Merge {
    /// Where it is called.
    pub(super) folder: PathBuf,
    pub(super) arguments: Vec<String>,
    /// What it writes, within the folder of the runs.
    pub(super) files: Vec<String>,
}

/// A run of a plan: NAME.toml says how it is trained, NAME.psb is its bundle, NAME.json its figures, NAME.html its page.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct PlannedRun {
    pub(super) name: String,
    /// Folder of the capture.
    pub(super) capture: PathBuf,
    /// Where it stands in tables.
    pub(super) place: Place,
    /// What trains: the `--device` of `train`.
    #[serde(default = "cpu")]
    pub(super) device: String,
    /// Options of `eval`.
    pub(super) measure: Vec<String>,
    pub(super) threads: usize,
    /// What a queue is asked for: the trainer's estimate with a margin.
    pub(super) memory_mb: u64,
    pub(super) minutes: u64,
}

fn cpu() -> String {
    DeviceChoice::Cpu.to_string()
}

/// Where a run stands in tables.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Place {
    pub(super) dataset: String,
    pub(super) scene: String,
    /// Size of the images as the plan says it; empty where runs do not differ in it.
    pub(super) size: String,
    pub(super) method: String,
    /// Name of the point on the method's curve.
    pub(super) rate: String,
    pub(super) seed: u64,
}

/// Collects the runs of a plan.
#[derive(Default)]
pub(super) struct Planner {
    runs: Vec<PlannedRun>,
    /// How each is trained, and what trains it.
    configs: Vec<(RunConfig, DeviceChoice)>,
    /// What kinds of runs take, each tried out once.
    tried: Vec<(RunConfig, Expected)>,
}

impl Planner {
    /// Adds a run with what it will take, which a few steps tell.
    ///
    /// * `name`: path of its files in the folder of the runs, without extension. * `lpips`: options of `eval`.
    pub(super) fn add(
        &mut self,
        name: String,
        mut config: RunConfig,
        device: DeviceChoice,
        place: Place,
        lpips: &[String],
        loaded: &mut LoadedCapture,
    ) -> Result<()> {
        let capture = loaded.of(&mut config)?;
        views_of(capture, Split::Test).with_context(|| {
            format!("{} has no held-out views, on which runs are compared; see --test-every", config.dataset.display())
        })?;
        let expected = self.expected(&config, capture)?;
        let mut measure = lpips.to_vec();
        if has_trained_tiers(&config) {
            measure.push("--per-tier".to_owned());
        }
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "positive, far below 2⁶³")]
        let above = |value: f64| value.ceil() as u64;
        self.runs.push(PlannedRun {
            name,
            capture: config.dataset.clone(),
            place,
            device: device.to_string(),
            measure,
            threads: rayon::current_num_threads(),
            memory_mb: above(MEMORY_MARGIN * expected.memory_bytes / 1e6),
            minutes: above(MINUTES_MARGIN * expected.minutes),
        });
        self.configs.push((config, device));
        Ok(())
    }

    /// What a run takes, as another one did that differs in seed and weight of the bits alone.
    fn expected(&mut self, config: &RunConfig, capture: &Capture) -> Result<Expected> {
        let mut kind = RunConfig { output: PathBuf::new(), ..config.clone() };
        let TrainConfig { seed, voxel_size, hac, .. } = &mut kind.train;
        (*seed, *voxel_size, hac.lambda) = (0, None, 0.0);
        if let Some((_, expected)) = self.tried.iter().find(|(tried, _)| *tried == kind) {
            return Ok(*expected);
        }
        let (_, expected) = Estimate::measured(capture, &config.train, None, &AtomicBool::new(false))?;
        self.tried.push((kind, expected));
        Ok(expected)
    }

    /// The runs in the order of the plan: the path of each, how it is trained, and what trains it.
    pub(super) fn runs(&self) -> impl Iterator<Item = (&str, &RunConfig, DeviceChoice)> {
        self.runs.iter().zip(&self.configs).map(|(run, (config, device))| (&*run.name, config, *device))
    }

    /// Writes the workflow into a folder; files that are right already stay untouched, so that nothing is done again.
    ///
    /// * `merge`: arguments of the command that merges the runs. * `files`: those it writes.
    pub(super) fn write(
        &self,
        folder: &Path,
        merge: Vec<String>,
        files: &[(&str, Content)],
        outputs: &Outputs,
    ) -> Result<()> {
        let mut outputs = outputs.clone();
        let mut write_changed = |path: &Path, content: Content, text: &str| -> Result<()> {
            let output = outputs.file(path, content)?;
            if std::fs::read_to_string(path).is_ok_and(|found| found == text) {
                return Ok(());
            }
            Ok(output.write(text.as_bytes())?)
        };
        for (run, (config, _)) in self.runs.iter().zip(&self.configs) {
            write_changed(&folder.join(format!("{}.toml", run.name)), CONFIGURATION, &config.to_toml()?)?;
            // Snakemake measures anew where it changes.
            write_changed(&folder.join(format!("{}.measure", run.name)), OPTIONS, &(run.measure.join("\n") + "\n"))?;
        }
        let merge = Merge {
            folder: std::env::current_dir().context("this folder has no path")?,
            arguments: merge,
            files: files.iter().map(|(file, _)| (*file).to_owned()).collect(),
        };
        let program = crate::program::path().context("this program has no path")?;
        let plan = serde_json::to_string_pretty(&Plan { program, runs: self.runs.clone(), merge })? + "\n";
        write_changed(&folder.join(PLAN.0), PLAN.1, &plan)?;
        write_changed(&folder.join("Snakefile"), RULES, SNAKEFILE)?;
        write_changed(&folder.join("profiles/default/config.yaml"), RULES, PROFILE)
    }

    /// How many runs there are, and what they take.
    pub(super) fn size(&self) -> String {
        let minutes = self.runs.iter().map(|run| run.minutes as f64).sum::<f64>() / MINUTES_MARGIN;
        let threads = rayon::current_num_threads();
        format!("{} runs, about {} one after another on {threads} threads", self.runs.len(), duration(minutes))
    }
}

impl Merge {
    /// The published results beside which the plan puts its runs, if it names any.
    pub(super) fn published(&self) -> Option<PathBuf> {
        let mut words = self.arguments.iter().skip_while(|word| *word != PUBLISHED);
        Some(self.folder.join(words.nth(1)?))
    }
}

impl Plan {
    /// Reads the plan in a folder.
    pub(super) fn read(folder: &Path) -> Result<Self> {
        let path = folder.join(PLAN.0);
        let text = std::fs::read(&path)
            .with_context(|| format!("could not read {}: is it a folder that `plan-runs` wrote?", path.display()))?;
        serde_json::from_slice(&text).with_context(|| format!("{} is not a plan of runs", path.display()))
    }
}
