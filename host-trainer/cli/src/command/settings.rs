//! What decides how a run trains, as options of every command that trains; each may also stand in a configuration.

use anyhow::{Result, bail};
use clap::ArgAction;
use pocketsplat_capture::dataset::Background;
use pocketsplat_trainer::bundle::Coder;
use pocketsplat_trainer::device::Choice;
use pocketsplat_trainer::effects::{Effect, Request};
use pocketsplat_trainer::scene::QuantisationSteps;
use pocketsplat_trainer::train::TrainConfig;
use pocketsplat_trainer::train::config::Backbone;
use pocketsplat_trainer::train::module::{Modules, Pruning, pruning};

use super::capture::CaptureOptions;
use super::named::{BACKBONES, CODERS, PRUNING_FORMS, one_of};
use super::run_config::RunConfig;

/// Options by which a run differs from the default one.
#[derive(clap::Args)]
pub(crate) struct Settings {
    #[command(flatten)]
    capture: CaptureOptions,
    /// Iterations from one checkpoint to the next; 0: only on interruption. [default: by time, every minute]
    #[arg(long, value_name = "N")]
    checkpoint_every: Option<u32>,
    /// Keep the last two checkpoints of the finished run.
    #[arg(long)]
    keep_checkpoints: bool,
    /// Kind of scene: scaffold (Scaffold-GS, trained for the image alone) or hac (HAC, trained for image and bits).
    /// [default: scaffold for train, hac for sweep]
    #[arg(long, value_parser = one_of::<Backbone>(BACKBONES))]
    backbone: Option<Backbone>,
    #[arg(long, value_name = "N", help = with_default("Hold out every N-th training view, to measure with; 0: none",
        TrainConfig::default().validation_every))]
    validation_every: Option<u32>,
    #[arg(long, help = with_default("Training steps; schedules scale with them", TrainConfig::default().iterations))]
    iterations: Option<u32>,
    #[arg(long, help = with_default("Everything random follows from it: same seed, same machine, same bundle",
        TrainConfig::default().seed))]
    seed: Option<u64>,
    /// Feature width of an anchor, and hidden width of the heads. [default: 32, with `--backbone hac` 50]
    #[arg(long, value_name = "F")]
    feature_dim: Option<usize>,
    #[arg(long, value_name = "K", help = with_default("Gaussians of an anchor", TrainConfig::default().shape.n_offsets))]
    offsets: Option<usize>,
    /// What the scene takes into account, of view-colour, view-geometry, view-distance, dilation-compensation, detail and
    /// anisotropy: auto trains short pilots and keeps what pays; none, all, +NAME and -NAME in a list force. [default: auto for train,
    /// view-colour,view-geometry,anisotropy for runs that are compared or too short]
    #[arg(long, value_name = "LIST", allow_hyphen_values = true)]
    effects: Option<Request>,
    /// Show no head the direction of view: neither view-colour nor view-geometry.
    #[arg(long, value_name = "BOOL", num_args = 0..=1, require_equals = true, default_missing_value = "true",
        action = ArgAction::Set)]
    no_view_direction: Option<bool>,
    /// Show the heads the distance of view.
    #[arg(long, value_name = "BOOL", num_args = 0..=1, require_equals = true, default_missing_value = "true",
        action = ArgAction::Set)]
    view_distance: Option<bool>,
    /// Compensate opacities for the 0.3 px² dilation, for drawing at other resolutions than the training one.
    #[arg(long, value_name = "BOOL", num_args = 0..=1, require_equals = true, default_missing_value = "true",
        action = ArgAction::Set)]
    dilation_compensation: Option<bool>,
    /// Edge of a lattice cell, normalised units (the cameras span about 5). [default: from the points' spacing]
    #[arg(long)]
    voxel_size: Option<f64>,
    /// Grow no further than this many anchors; the candidates with the largest gradients come first. [default: no limit]
    #[arg(long, value_name = "N")]
    max_anchors: Option<usize>,
    /// When growth ends, half-way, keep this many anchors: those that contribute most to the training views.
    /// [default: all]
    #[arg(long, value_name = "N")]
    keep_anchors: Option<usize>,
    #[arg(long, help = with_default("Quantisation step of the anchor features", QuantisationSteps::default().feature))]
    feature_step: Option<f32>,
    /// What gives the symbols their frequencies. [default: auto]
    #[arg(long, value_parser = one_of::<Coder>(CODERS))]
    coder: Option<Coder>,
    /// Pruning rates of the bundle's tiers, falling to 0: the shares of anchors that a smaller device leaves out.
    /// [default: 0.4,0.3,0.2,0.1,0.05,0]
    #[arg(long, value_name = "RATES", value_delimiter = ',')]
    tiers: Option<Vec<f32>>,
    /// Modules to attach, of distribution, pruning, detail; none: without those of the configuration. [default: none]
    #[arg(long, value_name = "NAMES", value_delimiter = ',')]
    modules: Option<Vec<String>>,
    /// Attach the pruning module: hard deletes anchors once, tiered trains one scene for every pruning rate up to it.
    #[arg(long, value_parser = one_of::<pruning::Form>(PRUNING_FORMS))]
    prune: Option<pruning::Form>,
    #[arg(long, value_name = "RATE", help = with_default("Share of the anchors that the pruning module takes",
        Pruning::default().rate))]
    prune_rate: Option<f64>,
    /// Set any key of the configuration, as train.modules.distribution.target=0.5; may be given several times.
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
}

/// A help text with the value that stands where the option is not given.
pub(super) fn with_default(help: &str, default: impl std::fmt::Display) -> String {
    format!("{help} [default: {default}]")
}

impl Settings {
    /// `config` with everything replaced that the command line says.
    ///
    /// # Errors
    /// A module or a key that there is not; effects that two options say different things about.
    pub(crate) fn applied_to(&self, mut config: RunConfig) -> Result<RunConfig> {
        fn set<T: Clone>(into: &mut T, given: &Option<T>) {
            if let Some(value) = given {
                *into = value.clone();
            }
        }
        config.capture = self.capture.or(&config.capture);
        config.checkpoint_every = self.checkpoint_every.or(config.checkpoint_every);
        config.keep_checkpoints |= self.keep_checkpoints;
        if let Some(backbone) = self.backbone {
            config.train = config.train.with_backbone(backbone);
        }
        let encoding = &mut config.encoding;
        set(&mut encoding.quantisation.feature, &self.feature_step);
        set(&mut encoding.coder, &self.coder);
        set(&mut encoding.tiers, &self.tiers);
        let train = &mut config.train;
        set(&mut train.iterations, &self.iterations);
        set(&mut train.seed, &self.seed);
        set(&mut train.validation_every, &self.validation_every);
        train.voxel_size = self.voxel_size.or(train.voxel_size);
        train.densification.max_anchors = self.max_anchors.or(train.densification.max_anchors);
        train.densification.kept_anchors = self.keep_anchors.or(train.densification.kept_anchors);
        set(&mut train.shape.feature_dim, &self.feature_dim);
        set(&mut train.shape.n_offsets, &self.offsets);
        let sees_direction = self.no_view_direction.map(|no| !no);
        set(&mut train.shape.view_colour, &sees_direction);
        set(&mut train.shape.view_geometry, &sees_direction);
        set(&mut train.shape.view_distance, &self.view_distance);
        set(&mut train.shape.dilation_compensation, &self.dilation_compensation);
        train.learns_background |= config.capture.background == Some(Background::Learned);
        self.attach_modules(train)?;
        if !self.set.is_empty() {
            config = config.with_keys(&self.set)?;
        }
        self.decide_effects(&mut config)?;
        // As a run keeps it: the same options again are no other setting.
        config.train.shape = config.train.modules.shape(config.train.shape);
        Ok(config)
    }

    /// `config` with what a device affords, where the command line leaves it open: HAC, the widths, the cap, trained tiers.
    pub(crate) fn chosen(&self, config: RunConfig, choice: &Choice) -> RunConfig {
        let mut config = config;
        let train = &mut config.train;
        if self.backbone.is_none() {
            *train = train.with_backbone(Backbone::Hac);
        }
        if self.feature_dim.is_none() {
            train.shape.feature_dim = choice.feature_dim;
        }
        if self.offsets.is_none() {
            train.shape.n_offsets = choice.n_offsets;
        }
        if self.max_anchors.is_none() {
            train.densification.max_anchors = Some(choice.max_anchors);
        }
        if self.keep_anchors.is_none() {
            train.densification.kept_anchors = Some(choice.max_anchors);
        }
        if self.modules.is_none() && self.prune.is_none() {
            train.modules.pruning.get_or_insert_with(Pruning::tiered);
        }
        config
    }

    /// Whether an option other than `--effects` decides about an effect.
    fn decides(&self, effect: Effect) -> bool {
        let by_option = match effect {
            Effect::ViewColour | Effect::ViewGeometry => self.no_view_direction.is_some(),
            Effect::ViewDistance => self.view_distance.is_some(),
            Effect::DilationCompensation => self.dilation_compensation.is_some(),
            // There is no option beside `--effects`.
            Effect::Anisotropy => false,
            Effect::Detail => self.modules.iter().flatten().any(|name| name == effect.name() || name == "none"),
        };
        by_option || self.set.iter().any(|key| key.trim_start().starts_with(effect.key()))
    }

    fn decide_effects(&self, config: &mut RunConfig) -> Result<()> {
        let decided = Effect::ALL.into_iter().find(|effect| self.decides(*effect));
        config.effects.auto &= self.effects.is_none() && decided.is_none();
        match (&self.effects, decided) {
            (None, _) => {}
            (Some(Request::Auto), Some(effect)) => {
                bail!(
                    "--effects auto measures every effect, and another option decides about {effect}; leave one of them out"
                )
            }
            (Some(Request::Auto), None) => config.effects.auto = true,
            (Some(Request::Forced(list)), _) => {
                for (effect, on) in list {
                    if self.decides(*effect) && effect.is_in(&config.train) != *on {
                        let word = if *on { "with" } else { "without" };
                        bail!(
                            "--effects asks for a scene {word} {effect}, and another option for the opposite; leave one of them out"
                        );
                    }
                    effect.set(&mut config.train, *on);
                }
            }
        }
        Ok(())
    }

    fn attach_modules(&self, train: &mut TrainConfig) -> Result<()> {
        let modules = &mut train.modules;
        if let Some(names) = &self.modules {
            *modules = Modules::default();
            // A configuration that a run wrote has the shape that its modules gave it.
            train.shape.detail_hidden = 0;
            for name in names.iter().filter(|name| *name != "none") {
                if !modules.attach(name) {
                    bail!("there is no module `{name}`; needs some of {}, or none", Modules::NAMES.join(", "));
                }
            }
        }
        if let Some(form) = self.prune {
            let kept = modules.pruning.filter(|pruning| pruning.form == form);
            modules.pruning = Some(kept.unwrap_or_else(|| match form {
                pruning::Form::Hard => Pruning::default(),
                pruning::Form::Tiered => Pruning::tiered(),
            }));
        }
        if let Some(rate) = self.prune_rate {
            modules.pruning.get_or_insert_default().rate = rate;
        }
        Ok(())
    }
}
