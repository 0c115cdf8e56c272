//! `pocketsplat train`: a capture in, a bundle out.

mod explicit;
mod limits;
mod standing;
mod summary;
#[cfg(test)]
mod tests;

use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::atomic::AtomicBool;

use anyhow::{Context, Result, bail};
use pocketsplat_capture::dataset::{Background, Capture, Split, View, remove_cache};
use pocketsplat_core::budget::MAX_FRAME_PX;
use pocketsplat_instructions::level::{Bound, Level, Profile};
use pocketsplat_trainer::device::Limits;
use pocketsplat_trainer::effects::Effect;
use pocketsplat_trainer::encode::{Encoding, Fitted, Scale};
use pocketsplat_trainer::step::SharedDevice;
use pocketsplat_trainer::train::finish::Finished;
use pocketsplat_trainer::train::gauge::Gauge;
use pocketsplat_trainer::train::run::{Ending, Interval, RunError, RunFolder, fork, photographs_in, shell_word};
use pocketsplat_trainer::train::{TrainConfig, Trainer};
use serde::Serialize;

use super::bundle::BundleFile;
use super::capture::CaptureArgs;
use super::effects::Resolved;
use super::estimate::{Estimate, Warned};
use super::eval::{Evaluation, Measurements, Renderer, ViewEvaluation, measure};
use super::process::peak_memory_bytes;
use super::progress::Progress;
use super::train_args::Args;
use super::{effects, output, report, stop, watch};
use crate::config::{CaptureOptions, ExplicitRunConfig, Protocol, RunConfig};
pub(crate) use standing::Standing;
use summary::Summary;

/// Seconds between checkpoints unless the user says otherwise: what an accident may cost.
const CHECKPOINT_SECONDS: f64 = 60.0;

/// Where the two configurations stand that have to agree.
pub(crate) const IN_RUN_AND_ON_COMMAND_LINE: [&str; 2] = ["in the run", "on the command line"];

/// Test views that tiers are measured with at most, evenly picked: more would cost time and say little.
const MOST_JUDGES: usize = 12;

/// What a finished run reports.
#[derive(Debug, Serialize)]
pub(crate) struct TrainResult {
    pub(crate) bundle: PathBuf,
    pub(crate) bundle_bytes: usize,
    /// What a decoder needs: `Device` or `Full`.
    pub(crate) profile: String,
    /// Least level that the whole scene keeps; 0 for none.
    pub(crate) level: u8,
    /// Scratch memory in which a device with limited memory draws the whole scene.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) scratch_bytes: Option<usize>,
    /// Predicted for the dearest frame of some training views, where there is a processor.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) instructions: Option<u64>,
    pub(crate) n_anchors: usize,
    /// Of these, with a drawn offset; the others are not coded.
    pub(crate) n_valid_anchors: usize,
    pub(crate) drawn_offsets: usize,
    pub(crate) undrawn_offsets: usize,
    /// What coded the symbols: `context` or `static`.
    pub(crate) coder: &'static str,
    /// Bytes of features, log-scales and offsets under the float context model.
    pub(crate) estimated_bytes: Option<[f64; 3]>,
    pub(crate) bytes_per_anchor: f64,
    pub(crate) iterations: u32,
    pub(crate) dropped_steps: u32,
    pub(crate) train_s: f64,
    /// Processor time of all threads.
    pub(crate) train_processor_s: f64,
    pub(crate) iterations_per_s: f64,
    /// Of the steps' time, the share that was spent on waiting for photographs, where they do not lie in memory.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) photographs_waited_share: Option<f64>,
    pub(crate) background: String,
    pub(crate) effects: String,
    /// Largest amount of memory that the program has held, where the system tells.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) peak_memory_bytes: Option<u64>,
    /// Of the bundle, over the views that are held out for testing, where there are any: as `eval` measures it.
    #[serde(flatten)]
    pub(crate) held_out: Option<HeldOut>,
    /// How the photographs were prepared, and the fingerprint of the capture.
    pub(crate) protocol: Protocol,
}

impl TrainResult {
    /// * `bundle`: its path as people know it.
    fn summary<'a>(&'a self, bundle: &'a Path) -> Summary<'a> {
        Summary {
            held_out: self.held_out.as_ref(),
            path: bundle,
            n_bytes: self.bundle_bytes,
            level: Some((self.level, &self.profile)),
            peak_memory_bytes: self.peak_memory_bytes,
            train_s: self.train_s,
            train_processor_s: self.train_processor_s,
            photographs_waited_share: self.photographs_waited_share,
            iterations: self.iterations,
            dropped_steps: self.dropped_steps,
        }
    }
}

/// How good a bundle is on views that training did not see.
#[derive(Debug, Serialize)]
pub(crate) struct HeldOut {
    pub(crate) psnr_db: f64,
    pub(crate) ssim: f64,
    pub(crate) n_test_views: usize,
    pub(crate) views: Vec<ViewEvaluation>,
}

pub(crate) fn run(args: &Args) -> Result<ExitCode> {
    match args.resume() {
        Some(path) => resume(args, path),
        None if args.is_explicit() => explicit::begin(args),
        None if args.continues() => begin_or_go_on(args),
        None => begin(args),
    }
}

fn resume(args: &Args, path: &Path) -> Result<ExitCode> {
    let folder = RunFolder::reopen(path)?;
    if ExplicitRunConfig::is_one(&folder.config()?) {
        return explicit::resume(args, folder);
    }
    let begun = RunConfig::parse(&folder.config()?);
    let begun = begun.with_context(|| format!("could not use the config.toml in {}", path.display()))?;
    let mut config = args.applied_to(begun.clone())?;
    if let Some(difference) = begun.difference(&config, IN_RUN_AND_ON_COMMAND_LINE)? {
        bail!("the run began with another setting than the command line asks for: {difference}; leave it out");
    }
    // What was chosen stays; what an accident kept from being chosen is measured now.
    config.effects = begun.effects;
    output::check_writable(&config.output)?;
    let capture = load(&mut config, Some(&photographs_in(folder.path())))?;
    let path = folder.path().to_owned();
    let code = train_and_print(args, folder, config, &capture, Start::Resumed)?;
    drop(capture);
    clear_photographs(&path, code);
    Ok(code)
}

fn begin(args: &Args) -> Result<ExitCode> {
    let mut config = args.resolved()?;
    output::check_writable(&config.output)?;
    let path = args.run_folder(args.named_paths(&config.dataset, &config.output).1)?;
    // Before the run's files are touched: a capture or checkpoint that does not load must not cost an earlier run its results.
    let capture = load(&mut config, Some(&photographs_in(&path)))?;
    let start = match args.fork() {
        Some((run, _)) if run.canonicalize().ok() == path.canonicalize().ok() => {
            bail!("{} cannot be both the run to begin from and the new one; choose another --output", path.display())
        }
        Some((run, iteration)) => {
            let trainer = fork(run, iteration, &capture, config.train)?;
            eprintln!("going on after iteration {iteration} of {}", run.display());
            Start::Forked(Box::new(trainer))
        }
        None => Start::New(Warned::default()),
    };
    let folder = RunFolder::start(&path, &config.to_toml()?, args.overwrite())?;
    let code = train_and_print(args, folder, config, &capture, start)?;
    drop(capture);
    clear_photographs(&path, code);
    Ok(code)
}

/// Removes the decoded photographs of a run that is finished; one that was interrupted needs them again.
pub(super) fn clear_photographs(run: &Path, code: ExitCode) {
    if code == ExitCode::SUCCESS
        && let Err(error) = remove_cache(&photographs_in(run))
    {
        eprintln!(
            "warning: the decoded photographs of the run are still in {}: {error}",
            photographs_in(run).display()
        );
    }
}

/// Does what is left of a run, which may be all of it or nothing.
fn begin_or_go_on(args: &Args) -> Result<ExitCode> {
    let mut config = args.resolved()?;
    if config.effects.auto {
        bail!("--continue needs effects that are decided; force them, as --effects +view-colour");
    }
    output::check_writable(&config.output)?;
    let path = args.run_folder(args.named_paths(&config.dataset, &config.output).1)?;
    let capture = load(&mut config, Some(&photographs_in(&path)))?;
    let code = match Standing::of(&path, &config)? {
        Standing::New(folder) => train_and_print(args, folder, config, &capture, Start::New(Warned::default()))?,
        Standing::Begun(folder) => train_and_print(args, folder, config, &capture, Start::Resumed)?,
        Standing::Finished => {
            eprintln!("trained before");
            ExitCode::SUCCESS
        }
    };
    drop(capture);
    clear_photographs(&path, code);
    Ok(code)
}

fn train_and_print<'a>(
    args: &Args,
    folder: RunFolder,
    mut config: RunConfig,
    capture: &'a Capture,
    start: Start<'a>,
) -> Result<ExitCode> {
    let device = args.device()?;
    if let Some(port) = args.watch() {
        let photograph = capture.test.first().or(capture.train.first()).map(View::photograph).transpose()?;
        let image = photograph.as_ref().map(|photograph| &photograph.image);
        watch::serve(folder.path(), port, config.train.iterations, image)?;
    }
    // Not before: until here there is nothing to keep, and Ctrl-C may end the process at once.
    let stop = stop::flag()?;
    // Before the pilots: they may take hours too.
    let start = match start {
        Start::New(_) => {
            let with_pilots = effects::are_measured(&config, capture);
            Start::New(Estimate::try_out(capture, &config.train, with_pilots, device.clone(), &stop)?)
        }
        other => other,
    };
    if effects::resolve(&mut config, capture, &folder, &stop)? == Resolved::Interrupted {
        return Ok(ExitCode::from(stop::INTERRUPTED));
    }
    let path = folder.path().to_owned();
    let Some(result) = train_in(folder, &config, capture, start, device, &stop)? else {
        return Ok(ExitCode::from(stop::INTERRUPTED));
    };
    let (dataset, bundle) = args.named_paths(&config.dataset, &config.output);
    output::print_or(&result, args.json(), result.summary(bundle))?;
    if args.writes_report() {
        report::write_into(&path, &config, capture);
    }
    let (bundle, dataset) = (shell_word(bundle), shell_word(dataset));
    eprintln!("see it:       pocketsplat render {bundle} {dataset} --view 0 -o view.png");
    eprintln!("on a device:  pocketsplat fit {bundle}");
    Ok(ExitCode::SUCCESS)
}

/// Loads the capture that a run is configured for, and decides what the configuration left to it.
///
/// * `photographs`: folder for decoded photographs that are too many for the memory; without one they are decoded again for every
///   step.
pub(crate) fn load(config: &mut RunConfig, photographs: Option<&Path>) -> Result<Capture> {
    let source = CaptureArgs { dataset: config.dataset.clone(), options: config.capture.clone() };
    // At once: large captures take their time.
    eprintln!("reading {}", config.dataset.display());
    let capture = match photographs {
        Some(folder) => source.load_cached(config.train.seed, folder)?,
        None => source.load(config.train.seed)?,
    };
    decide(config, &capture)?;
    Ok(capture)
}

/// Decides what the configuration of a run left to its capture.
pub(crate) fn decide(config: &mut RunConfig, capture: &Capture) -> Result<()> {
    check_size(capture, &config.encoding.limits)?;
    config.train = config.train.resolved_for(capture);
    if std::mem::take(&mut config.scales_lambda) && config.train.backbone.is_coded() && capture.shown < 1.0 {
        config.train.hac.lambda *= capture.shown;
        eprintln!(
            "lambda {:.5}, since {:.0} % of the pixels show the scene",
            config.train.hac.lambda,
            100.0 * capture.shown
        );
    }
    eprintln!("voxel size {:.5}, normalised units", config.train.voxel_size_for(capture));
    Ok(())
}

/// Refuses photographs that the decoder cannot draw, or that the level has no room for.
fn check_size(capture: &Capture, limits: &Limits) -> Result<()> {
    let [width, height] = capture.largest_px();
    if let Some(level) = limits.level.and_then(Level::numbered)
        && u64::from(width) * u64::from(height) > level.most(Bound::Frame)
    {
        let ([most_width, most_height], number) = (level.frame_px, level.number);
        bail!(
            "the photographs are {width}x{height} px, and level {number} allows frames of {most_width}x{most_height}; use \
             --resolution {most_width}x{most_height}, or a smaller --max-resolution"
        );
    }
    let (largest, most) = (width.max(height), u32::from(MAX_FRAME_PX));
    if largest > most {
        bail!(
            "the photographs are {largest} px wide or high and the decoder draws {most}; use --max-resolution {most}"
        );
    }
    Ok(())
}

/// Where a run begins.
#[derive(Debug)]
pub(crate) enum Start<'a> {
    /// With the capture's points; what the user was warned of when the run was tried out.
    New(Warned),
    /// With the newest checkpoint of its folder.
    Resumed,
    /// With the state of another run.
    Forked(Box<Trainer<'a>>),
}

/// Trains in a run folder and writes the bundle; `None` when `stop` was set before the end.
pub(crate) fn train_in<'a>(
    folder: RunFolder,
    config: &RunConfig,
    capture: &'a Capture,
    start: Start<'a>,
    device: Option<SharedDevice<f32>>,
    stop: &AtomicBool,
) -> Result<Option<TrainResult>> {
    let mut folder = folder.forking_at(&config.fork_at);
    let path = folder.path().to_owned();
    let scale = config.encoding.scale(capture);
    let warned = if let Start::New(warned) = start { warned } else { Warned::default() };
    let trainer = match start {
        Start::New(_) => Trainer::new(capture, config.train)?,
        Start::Resumed => resumed(&folder, config, capture, device.clone())?,
        Start::Forked(trainer) => {
            // Without it a resumed run would begin with the capture's points.
            folder.save(&*trainer)?;
            *trainer
        }
    };
    let mut trainer = trainer.fitting(gauge(scale.as_ref()));
    trainer.set_device(device);
    folder.write_config(&config.to_toml()?)?;
    let interval = config.checkpoint_every.map_or(Interval::Seconds(CHECKPOINT_SECONDS), Interval::Iterations);
    let how_to_go_on = || format!("go on with `pocketsplat train --resume {}`", shell_word(&path));
    let estimate = Estimate::new(capture, &config.train, trainer.iteration, warned);
    let mut progress = Progress::new(trainer.iteration, config.train.iterations).estimating(estimate);
    let ending = folder.train(&mut trainer, &mut progress, interval, stop);
    let ending = ending.map_err(|error| {
        let stopped = format!("training stopped at iteration {}", trainer.iteration);
        match error {
            // It would come to the same end again; a device says itself what to do.
            RunError::Train(_) => anyhow::Error::new(error).context(stopped),
            _ => anyhow::Error::new(error).context(format!("{stopped}; to retry, {}", how_to_go_on())),
        }
    })?;
    if ending == Ending::Interrupted {
        eprintln!(
            "interrupted after iteration {} of {}; {}",
            trainer.iteration,
            config.train.iterations,
            how_to_go_on()
        );
        return Ok(None);
    }
    let result = write_bundle(&trainer, capture, &config.capture, &config.encoding, &config.output)
        .with_context(|| format!("the training is done and kept; {}", how_to_go_on()))?;
    folder.finish(&output::json(&result)?, config.keep_checkpoints)?;
    Ok(Some(result))
}

/// What tells a run that its bundle has limits.
fn gauge<'a>(scale: Option<&'a Scale<'a>>) -> Option<&'a dyn Gauge> {
    scale.map(|scale| scale as &dyn Gauge)
}

/// The run as its newest sound checkpoint has it, or at its start where it was stopped before the first one.
fn resumed<'a>(
    folder: &RunFolder,
    config: &RunConfig,
    capture: &'a Capture,
    device: Option<SharedDevice<f32>>,
) -> Result<Trainer<'a>> {
    let Some(resumed) = folder.resume(capture)? else {
        eprintln!("the run in {} has no checkpoint yet; it begins anew", folder.path().display());
        return Ok(Trainer::new(capture, config.train)?);
    };
    for fault in &resumed.passed_over {
        eprintln!("warning: a checkpoint is damaged, so the run goes on from an older one: {fault}");
    }
    let mut trainer = resumed.restored.trainer;
    trainer.set_device(device);
    let at_checkpoint = RunConfig { train: *trainer.config(), ..config.clone() };
    if let Some(difference) = config.difference(&at_checkpoint, ["in config.toml", "in the checkpoint"])? {
        bail!("config.toml and the checkpoint disagree: {difference}; write back what the run began with");
    }
    let (then, now) = (&resumed.restored.written_by, trainer.kernels());
    if *then != now {
        eprintln!(
            "warning: the checkpoint was computed with {then}; this is {now}. The run goes on, but will not end in the \
             same bits as there"
        );
    }
    eprintln!("going on after iteration {} of {}", trainer.iteration, config.train.iterations);
    Ok(trainer)
}

/// Trains on a capture that was loaded as it is, without a run folder, and writes the bundle.
pub(crate) fn train(capture: &Capture, config: TrainConfig, encoding: &Encoding, output: &Path) -> Result<TrainResult> {
    train_as(capture, config, &CaptureOptions::default(), encoding, output)
}

/// As [`train`]; the bundle says that the capture was loaded with `options`.
pub(crate) fn train_as(
    capture: &Capture,
    config: TrainConfig,
    options: &CaptureOptions,
    encoding: &Encoding,
    output: &Path,
) -> Result<TrainResult> {
    let scale = encoding.scale(capture);
    let mut trainer = Trainer::new(capture, config)?.fitting(gauge(scale.as_ref()));
    trainer.run(&mut Progress::new(0, config.iterations))?;
    write_bundle(&trainer, capture, options, encoding, output)
}

/// The views that tiers are measured with: those held out of training for it, else some of the test views.
fn judges(trainer: &Trainer<'_>, capture: &Capture) -> Vec<View> {
    let held_out: Vec<View> = trainer.validation_views().cloned().collect();
    if !held_out.is_empty() {
        return held_out;
    }
    let n = capture.test.len().min(MOST_JUDGES);
    (0..n).map(|i| capture.test[i * capture.test.len() / n].clone()).collect()
}

fn write_bundle(
    trainer: &Trainer<'_>,
    capture: &Capture,
    options: &CaptureOptions,
    encoding: &Encoding,
    output: &Path,
) -> Result<TrainResult> {
    let protocol = Protocol::of(capture, options);
    if let Some(images) = protocol.omitted_images()? {
        eprintln!(
            "warning: the name of the folder of images is too long for the bundle; give --images {} to eval and render",
            shell_word(Path::new(images))
        );
    }
    let finished = Finished { protocol: Some(protocol.to_text()?), ..trainer.finish()? };
    let held_out = judges(trainer, capture);
    let fitted = encoding.encode(finished, capture, &held_out)?;
    output::write_whole(output, &fitted.written.bytes)?;
    let file = BundleFile { path: output.to_owned(), bytes: fitted.written.bytes.clone() };
    limits::say(&file, &encoding.limits, &fitted)?;
    let Fitted { finished, plan, instructions, .. } = fitted;
    let held_out = if capture.test.is_empty() {
        None
    } else {
        let what = Measurements::default();
        let Evaluation { psnr_db, ssim, n_views, views, .. } =
            measure(&file, capture, options, Split::Test, Renderer::Core, &what)?;
        Some(HeldOut { psnr_db, ssim, n_test_views: n_views, views })
    };
    let Finished { scene, background, n_undrawn, estimated_bits, .. } = finished;
    let bundle = file.parse()?;
    let of_whole = bundle.n_tiers().checked_sub(1).and_then(|tier| bundle.measures(tier));
    let n_anchors = scene.anchors.len();
    Ok(TrainResult {
        bundle: output.to_owned(),
        bundle_bytes: file.bytes.len(),
        profile: Profile::of(&bundle.header().features).to_string(),
        level: of_whole.map_or(0, |measures| measures.level),
        scratch_bytes: plan.map(|plan| plan.least_len()),
        instructions,
        n_anchors,
        n_valid_anchors: (0..n_anchors).filter(|a| scene.anchors.has_drawn(*a)).count(),
        drawn_offsets: (0..scene.anchors.mask_logits.len()).filter(|offset| scene.anchors.is_drawn(*offset)).count(),
        undrawn_offsets: n_undrawn,
        coder: if bundle.context().is_some() { "context" } else { "static" },
        estimated_bytes: estimated_bits.map(|bits| bits.map(|bits| bits / 8.0)),
        bytes_per_anchor: file.bytes.len() as f64 / n_anchors as f64,
        iterations: trainer.iteration,
        dropped_steps: trainer.n_dropped(),
        train_s: trainer.seconds,
        train_processor_s: trainer.processor_seconds,
        iterations_per_s: f64::from(trainer.iteration) / trainer.seconds,
        photographs_waited_share: trainer.waited_share(),
        background: match [Background::Black, Background::White].into_iter().find(|known| known.rgb8() == background) {
            Some(known) => known.to_string(),
            None => format!("{background:?}"),
        },
        effects: Effect::names(&Effect::all_in(trainer.config())),
        peak_memory_bytes: peak_memory_bytes(),
        held_out,
        protocol,
    })
}
