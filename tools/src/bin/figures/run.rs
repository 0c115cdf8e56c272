//! Trains and measures what a plan lists, one run after another, from wherever each stands.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::{Duration, Instant};

use anyhow::{Context as _, Result, ensure};
use pocketsplat_trainer::revision_of;
use serde::Deserialize;
use serde_json::Value;

use super::picture::side_by_side;
use super::plan::{Group, Plan};
use super::rows::{self, Row};
use super::{blocks, board, in_repository, said_by};

/// The capture that `synth` makes, where no folder is asked for.
const PROCEDURAL: &str = "procedural";

#[derive(clap::Args)]
pub(super) struct Args {
    /// Folder of the captures that the plan names; those that are not there are left out.
    captures: PathBuf,
    /// Folder for the runs.
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// The command that trains.
    #[arg(long, default_value = "target/release/pocketsplat")]
    program: PathBuf,
    /// Begin no run after so many hours.
    #[arg(long)]
    hours: Option<f64>,
    /// Run the first N seeds of each group alone.
    #[arg(long, value_name = "N")]
    seeds: Option<usize>,
    /// Groups to run [default: all].
    groups: Vec<String>,
}

pub(super) fn run(args: &Args) -> Result<()> {
    let plan = Plan::read()?;
    for name in &args.groups {
        ensure!(plan.groups.iter().any(|group| group.name == *name), "the plan has no group {name}");
    }
    let program = fs::canonicalize(&args.program)
        .with_context(|| format!("{} is missing; build it: cargo build --release", args.program.display()))?;
    let version = String::from_utf8(said_by(Command::new(&program).arg("--version"))?)?;
    let revision = revision_of(version.trim().trim_start_matches("pocketsplat ")).to_owned();
    fs::create_dir_all(&args.out)?;
    let (out, captures) = (fs::canonicalize(&args.out)?, fs::canonicalize(&args.captures)?);
    let end = args.hours.map(|hours| Instant::now() + Duration::from_secs_f64(3600.0 * hours));
    for group in plan.groups.iter().filter(|group| args.groups.is_empty() || args.groups.contains(&group.name)) {
        let runs = GroupRuns { group, program: &program, revision: &revision, folder: out.join(&group.name) };
        runs.all(&captures, end, args.seeds.unwrap_or(usize::MAX))?;
        blocks::write(&plan)?;
    }
    Ok(())
}

/// A row of a script's table.
#[derive(Deserialize)]
struct Measured {
    file: String,
    psnr_db: f64,
    ssim: f64,
    lpips: Option<f64>,
    bundle_bytes: f64,
    program: String,
}

/// What made a file of a script: where the file does not say, as a .spz does not, the program that measured it, for a script has but one.
fn made_by(program: &str) -> &str {
    program.strip_prefix("unknown, measured by ").unwrap_or(program)
}

struct GroupRuns<'a> {
    group: &'a Group,
    program: &'a Path,
    /// Version and revision of that program.
    revision: &'a str,
    folder: PathBuf,
}

impl GroupRuns<'_> {
    /// Each run in turn, the first seeds first; the CSV is written after each. What the same revision measured, here or on another
    /// machine, is not measured again.
    fn all(&self, captures: &Path, end: Option<Instant>, n_seeds: usize) -> Result<()> {
        let name = &self.group.name;
        if let Some((script, capture)) = &self.group.script {
            return self.of_script(script, &captures.join(capture), end);
        }
        let Some(mut planned) = self.planned(captures)? else {
            println!("{name}: none of its captures is in {}", captures.display());
            return Ok(());
        };
        let seed_of = |run: &Value| run["place"]["seed"].as_u64();
        planned.sort_by_key(seed_of);
        let mut seeds: Vec<Option<u64>> = planned.iter().map(seed_of).collect();
        seeds.dedup();
        seeds.truncate(n_seeds);
        let known = rows::read(name)?;
        let mut table: Vec<Row> = planned.iter().map(row_of).collect::<Result<_>>()?;
        // Runs of captures that are elsewhere keep their figures.
        let elsewhere = known.iter().filter(|row| table.iter().all(|other| other.scene != row.scene));
        let elsewhere: Vec<Row> = elsewhere.cloned().collect();
        for row in &mut table {
            let before = known.iter().find(|before| before.run == row.run && before.seed == row.seed);
            *row = before.cloned().unwrap_or_else(|| row.clone());
        }
        let keep = |table: &[Row]| rows::write(name, &[table, &elsewhere].concat());
        keep(&table)?;
        for (i, run) in planned.iter().enumerate().filter(|(_, run)| seeds.contains(&seed_of(run))) {
            if end.is_some_and(|end| Instant::now() >= end) {
                println!("{name}: out of time; the same command goes on");
                return Ok(());
            }
            let is_done = table[i].is_measured() && revision_of(&table[i].program) == self.revision;
            if is_done && (self.group.picture_of_view.is_none() || self.bundle_of(run).exists()) {
                continue;
            }
            println!("{name}: {} of {}  {}", i + 1, planned.len(), table[i].run);
            self.measured(run, &mut table[i])?;
            let found = revision_of(&table[i].program);
            ensure!(
                found == self.revision,
                "{} has runs of {found}, the program is {}: choose another --out",
                self.folder.display(),
                self.revision
            );
            keep(&table)?;
        }
        // Both are made of the runs of this machine.
        if planned.iter().filter(|run| seeds.contains(&seed_of(run))).all(|run| self.bundle_of(run).exists()) {
            self.kept_curve()?;
            self.kept_picture(&planned)
        } else {
            println!("{name}: some runs lie on another machine; curve and picture stay as they are");
            Ok(())
        }
    }

    fn bundle_of(&self, run: &Value) -> PathBuf {
        self.folder.join(format!("{}.psb", run["name"].as_str().unwrap_or_default()))
    }

    /// The rows that a script measures; it goes on where it was stopped.
    fn of_script(&self, script: &Path, capture: &Path, end: Option<Instant>) -> Result<()> {
        let name = &self.group.name;
        if !capture.exists() || end.is_some_and(|end| Instant::now() >= end) {
            println!("{name}: {} is missing, or there is no time left", capture.display());
            return Ok(());
        }
        println!("{name}: {}", script.display());
        let mut script = Command::new(in_repository(script));
        said_by(script.arg(capture).arg(&self.folder).env("POCKETSPLAT", self.program))?;
        let scene = capture.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let mut table = Vec::new();
        for measured in csv::Reader::from_path(self.folder.join(format!("{name}.csv")))?.into_deserialize() {
            let Measured { file, psnr_db, ssim, lpips, bundle_bytes, program } = measured?;
            table.push(Row {
                run: file.clone(),
                scene: scene.clone(),
                method: file,
                psnr_db: Some(rounded(psnr_db)),
                ssim: Some(rounded(ssim)),
                lpips,
                bytes: Some(bundle_bytes),
                program: made_by(&program).to_owned(),
                ..Row::default()
            });
        }
        rows::write(name, &table)
    }

    /// The runs as `plan-runs` writes them; `None` where no capture is there.
    fn planned(&self, captures: &Path) -> Result<Option<Vec<Value>>> {
        fs::create_dir_all(&self.folder)?;
        let mut plan = self.group.plan.clone();
        if self.group.plan.to_string().contains(PROCEDURAL) && !self.folder.join(PROCEDURAL).exists() {
            self.call("synth", &[self.folder.join(PROCEDURAL).as_os_str()])?;
        }
        if let Some(published) = plan.get_mut("published") {
            *published = in_repository("docs/results").join("published.csv").display().to_string().into();
        }
        let datasets = plan.get_mut("captures").and_then(toml::Value::as_table_mut).context("a plan has captures")?;
        for (_, scenes) in datasets.iter_mut() {
            let scenes = scenes.as_table_mut().context("a dataset has scenes")?;
            scenes.retain(|_, capture| {
                let folder = match capture {
                    toml::Value::Table(table) => table.get_mut("folder"),
                    other => Some(other),
                };
                let Some(toml::Value::String(folder)) = folder else { return true };
                let there = if folder == PROCEDURAL { self.folder.join(PROCEDURAL) } else { captures.join(&*folder) };
                *folder = there.display().to_string();
                there.exists()
            });
        }
        datasets.retain(|_, scenes| scenes.as_table().is_some_and(|scenes| !scenes.is_empty()));
        if datasets.is_empty() {
            return Ok(None);
        }
        let (text, path) = (toml::to_string(&plan)?, self.folder.join("plan.toml"));
        if !self.folder.join("runs.json").exists() || fs::read_to_string(&path).ok().as_ref() != Some(&text) {
            fs::write(&path, text)?;
            self.call("plan-runs", &[path.as_os_str(), "-o".as_ref(), self.folder.as_os_str()])?;
        }
        let runs: Value = serde_json::from_slice(&fs::read(self.folder.join("runs.json"))?)?;
        Ok(Some(runs["runs"].as_array().context("runs.json has runs")?.clone()))
    }

    /// Trains and measures a run where that is not done, and notes its figures.
    fn measured(&self, run: &Value, row: &mut Row) -> Result<()> {
        let name = run["name"].as_str().context("a run has a name")?;
        let capture = run["capture"].as_str().context("a run has a capture")?;
        let at = |extension: &str| self.folder.join(format!("{name}.{extension}"));
        let (config, bundle, figures) = (at("toml"), at("psb"), at("json"));
        self.call("train", &["--config".as_ref(), config.as_os_str(), "--continue".as_ref(), "--no-report".as_ref()])?;
        if !figures.exists() {
            let said = self.output("eval", &[bundle.as_os_str(), capture.as_ref(), "--json".as_ref()])?;
            fs::write(&figures, said)?;
        }
        let eval: Value = serde_json::from_slice(&fs::read(&figures)?)?;
        let result: Value = serde_json::from_slice(&fs::read(at("run").join("result.json"))?)?;
        let page = at("view.html");
        if !page.exists() {
            self.call("view", &[bundle.as_os_str(), "-o".as_ref(), page.as_os_str()])?;
        }
        let figure = |key: &str| eval[key].as_f64();
        *row = Row {
            psnr_db: figure("psnr_db").map(rounded),
            ssim: figure("ssim").map(rounded),
            lpips: figure("lpips").map(rounded),
            bytes: figure("bundle_bytes"),
            n_anchors: figure("n_anchors"),
            n_views: figure("n_views"),
            width_px: figure("width_px"),
            height_px: figure("height_px"),
            processor_minutes: result["train_processor_s"].as_f64().map(|seconds| rounded(seconds / 60.0)),
            memory_bytes: result["peak_memory_bytes"].as_f64(),
            page_bytes: Some(fs::metadata(&page)?.len() as f64),
            instructions: self.instructions(&bundle, &at("frames"))?,
            program: eval["program"].as_str().unwrap_or_default().to_owned(),
            ..row_of(run)?
        };
        Ok(())
    }

    /// Of the slowest frame on the group's board, where it has one.
    fn instructions(&self, bundle: &Path, out: &Path) -> Result<Option<f64>> {
        self.group.board.as_ref().map(|(board, ram_kib)| board::instructions(bundle, board, *ram_kib, out)).transpose()
    }

    fn kept_curve(&self) -> Result<()> {
        self.call("tables", &[self.folder.as_os_str()])?;
        let Some(curve) = &self.group.curve else { return Ok(()) };
        let from = self.folder.join("tables").join(format!("{curve}.svg"));
        let to = in_repository(format!("docs/results/figures/{}.svg", self.group.name));
        fs::copy(&from, to).with_context(|| format!("could not copy {}", from.display()))?;
        Ok(())
    }

    fn kept_picture(&self, planned: &[Value]) -> Result<()> {
        let Some(view) = self.group.picture_of_view else { return Ok(()) };
        let mut images = Vec::new();
        let first_seed = planned.first().map(|run| &run["place"]["seed"]);
        for run in planned.iter().filter(|run| Some(&run["place"]["seed"]) == first_seed) {
            let bundle = self.bundle_of(run);
            let (capture, png) = (run["capture"].as_str().unwrap_or_default(), bundle.with_extension("png"));
            let view = view.to_string();
            let options = [
                bundle.as_os_str(),
                capture.as_ref(),
                "--view".as_ref(),
                view.as_ref(),
                "-o".as_ref(),
                png.as_os_str(),
            ];
            self.call("render", &options)?;
            images.push(image::open(&png)?.to_rgb8());
        }
        let file = in_repository(format!("docs/results/figures/{}.jpg", self.group.name));
        side_by_side(&images, &file)
    }

    fn call(&self, command: &str, arguments: &[&std::ffi::OsStr]) -> Result<()> {
        self.output(command, arguments).map(|_| ())
    }

    fn output(&self, command: &str, arguments: &[&std::ffi::OsStr]) -> Result<Vec<u8>> {
        said_by(Command::new(self.program).arg(command).args(arguments))
    }
}

/// A run without its figures.
fn row_of(run: &Value) -> Result<Row> {
    let text = |value: &Value| value.as_str().unwrap_or_default().to_owned();
    let place = &run["place"];
    Ok(Row {
        run: text(&run["name"]),
        dataset: text(&place["dataset"]),
        scene: text(&place["scene"]),
        size: text(&place["size"]),
        method: text(&place["method"]),
        rate: text(&place["rate"]),
        seed: place["seed"].as_u64().context("a run has a seed")?,
        ..Row::default()
    })
}

fn rounded(value: f64) -> f64 {
    (1e5 * value).round() / 1e5
}
