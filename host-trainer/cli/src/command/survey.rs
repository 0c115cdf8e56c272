//! `pocketsplat survey`: published methods and this program's side by side on one capture.

mod anchors;
mod explicit;
mod families;
mod point;
mod table;

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::{Context as _, Result, bail};
use pocketsplat_capture::dataset::Background;
use pocketsplat_files::{Output, Outputs};
use pocketsplat_trainer::explicit::CloudConfig;

use super::capture::CaptureArgs;
use super::eval::Measurements;
use super::lpips::LpipsArgs;
use super::outputs::{FIGURE, OverwriteArgs, table as table_file};
use super::tables::published::PublishedRow;
use super::{output, stop, train};
use crate::config::{ExplicitRunConfig, Preset, absolute, check_random_points};
use crate::say::say;
use families::ANCHORS;
use point::Point;
use table::{Line, Table};

/// Train published methods on one capture, and compare them.
///
/// 3DGS, methods that compress its scene, Scaffold-GS, HAC, HAC++, ContextGS, and as `pocketsplat` HAC with this program's own pruning, the
/// default of `train`; at two rates where a method has them. All have the same photographs, steps, seed and effects; methods that compress
/// take their steps on top.
///
/// Writes survey.csv, survey.svg, a picture of the first test view for each method, and every file that was measured. The same command
/// again goes on where it was stopped, but begins a compression anew.
#[derive(clap::Args)]
pub(crate) struct Args {
    #[command(flatten)]
    capture: CaptureArgs,
    /// Folder for the table and all that is trained.
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
    /// Training steps of each method, at least 6.
    #[arg(long, value_name = "N", default_value_t = Preset::Quick.iterations())]
    iterations: u32,
    /// Random points that all methods start from, on captures of Blender.
    #[arg(long, value_name = "N", default_value_t = 30_000)]
    random_points: usize,
    /// Seed of all random numbers.
    #[arg(long, value_name = "N", default_value_t = 42)]
    seed: u64,
    /// Published results, as docs/results/published.csv has them: those of the scene that is called as the capture's folder stand beside.
    #[arg(long, value_name = "FILE.csv")]
    published: Option<PathBuf>,
    #[command(flatten)]
    lpips: LpipsArgs,
    #[command(flatten)]
    overwrite: OverwriteArgs,
}

pub(crate) fn run(args: &Args) -> Result<ExitCode> {
    let folder = absolute(&args.output)?;
    let config = configured(args, &folder)?;
    // All that may be refused, before the first is trained for an hour.
    point::refuse_other_program(&config.output)?;
    for of in &ANCHORS {
        let configured = anchors::configured(of, &folder, &config);
        let (config, _) = configured.with_context(|| format!("{} is no run", of.method))?;
        point::refuse_other_program(&config.output)?;
    }
    let name = config.dataset.file_name().unwrap_or_default().to_string_lossy();
    let published = args.published.as_deref().map(PublishedRow::read_all).transpose()?.unwrap_or_default();
    let published: Vec<PublishedRow> = published.into_iter().filter(|row| row.scene == name).collect();
    if args.published.is_some() && published.is_empty() {
        say!(
            "warning: no published result is of a scene called {name}; rename the capture's folder, or leave --published out"
        );
    }
    let lpips = args.lpips.load()?;
    Outputs::folder(&folder.join(point::PICTURES))?;
    let outputs = args.published.iter().fold(args.overwrite.outputs(), |outputs, path| outputs.reading(path));
    let mut outputs = outputs.reading_folder(&config.dataset);
    let csv = outputs.file(&folder.join("survey.csv"), table_file(&[table::BEGINNING]))?;
    let figure = outputs.file(&folder.join("survey.svg"), FIGURE)?;
    let table = Table::begun(csv.path(), &published)?;
    let mut survey = Survey { csv, figure, table };
    let (stop, what) = (stop::flag()?, Measurements { lpips: lpips.as_ref(), ..Measurements::default() });
    let is_done =
        explicit::points(&config, &folder, &what, (args.overwrite.outputs(), &stop), |point| survey.add(point))?
            && anchors::points(&config, &folder, lpips.as_ref(), |point| survey.add(point))?;
    if !is_done {
        say!("the same command again goes on here");
        return Ok(ExitCode::from(stop::INTERRUPTED));
    }
    train::clear_photographs(&folder, ExitCode::SUCCESS);
    output::print_text(&survey.table.text())?;
    Ok(ExitCode::SUCCESS)
}

/// How the scene is trained that the others are compared with.
fn configured(args: &Args, folder: &Path) -> Result<ExplicitRunConfig> {
    let CaptureArgs { dataset, options } = &args.capture;
    if options.test_every == Some(0) {
        bail!("--test-every 0 holds out no view, and methods are compared on such views; leave it out");
    }
    check_random_points(args.random_points, "--random-points")?;
    let output = folder.join("3dgs.ply");
    let mut config = ExplicitRunConfig::of_preset(Preset::Quick, absolute(dataset)?, output);
    config.capture = options.or(&config.capture);
    if config.capture.n_random_points.is_some() {
        config.capture.n_random_points = Some(args.random_points);
    }
    // The same for all methods, said or not.
    config.capture.background.get_or_insert(Background::Black);
    config.gaussians = CloudConfig { seed: args.seed, ..CloudConfig::hurried(args.iterations) };
    config.gaussians.validate()?;
    Ok(config)
}

/// What is there, and where it is written.
struct Survey {
    csv: Output,
    figure: Output,
    table: Table,
}

impl Survey {
    /// Adds a point, and writes table and figure anew.
    fn add(&mut self, point: Point) -> Result<()> {
        self.table.add(Line::of(&point));
        self.csv.write(&self.table.csv()?)?;
        Ok(self.figure.write(self.table.figure()?.as_bytes())?)
    }
}
