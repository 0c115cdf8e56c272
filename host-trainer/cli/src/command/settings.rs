//! What decides how a run trains, as options of every command that trains; each may also stand in a configuration.

mod backbone;
mod modules;

use anyhow::{Result, bail};
use pocketsplat_trainer::device::{ModelChoice, bytes_of_heads, widest_within};
use pocketsplat_trainer::effects::{Effect, Request};
use pocketsplat_trainer::encode::CoderChoice;
use pocketsplat_trainer::explicit::CloudConfig;
use pocketsplat_trainer::train::TrainConfig;
use serde::Serialize;

use crate::config::heading::{OUTPUT, QUALITY, RUN};
use crate::config::named::{CODERS, one_of};
use crate::config::{Difference, EXPLICIT, ExplicitRunConfig, RunConfig, said_otherwise};

use backbone::backbone_choice;
pub(super) use backbone::{BackboneChoice, backbone_of_anchors};
pub(super) use modules::tiers_of;
use modules::{TrainingModule, attach};

/// How good a scene becomes, and how large.
#[derive(Clone, clap::Args)]
pub(crate) struct QualityOptions {
    /// Kind of scene: scaffold (Scaffold-GS) is trained for the image alone; hac (HAC), hac-plus (HAC++) and contextgs (ContextGS)
    /// for image and size; 3dgs (3D Gaussian Splatting) makes an uncompressed .ply to compare with
    /// [default: hac]
    #[arg(long, value_parser = backbone_choice(), help_heading = QUALITY)]
    backbone: Option<BackboneChoice>,
    /// Training steps, with which all schedules scale
    #[arg(long, value_name = "N", help_heading = QUALITY)]
    iterations: Option<u32>,
    /// Effects to train: auto, which tests them in runs of 16,000 iterations and more, or a list of none, all, +NAME and -NAME with the
    /// names view-colour, view-geometry, view-distance, dilation-compensation, detail, anisotropy and exposure
    #[arg(long, value_name = "LIST", allow_hyphen_values = true, help_heading = QUALITY)]
    effects: Option<Request>,
    /// Training modules to attach in place of those of the configuration
    #[arg(long, value_name = "LIST", value_delimiter = ',', value_enum, help_heading = QUALITY)]
    modules: Option<Vec<TrainingModule>>,
    #[arg(long, value_name = "F", help_heading = QUALITY, hide_short_help = true, help = with_default(
        "Feature width of an anchor, and hidden width of the heads", TrainConfig::default().shape.feature_dim))]
    feature_dim: Option<usize>,
    #[arg(long, value_name = "K", help_heading = QUALITY, hide_short_help = true,
        help = with_default("Gaussians of an anchor",
        format_args!("{}; by the limits for a device", TrainConfig::default().shape.n_offsets)))]
    offsets: Option<usize>,
    /// Edge of a lattice cell in normalised units, of which the cameras span about 5 [default: from the points' spacing]
    #[arg(long, value_name = "E", help_heading = QUALITY, hide_short_help = true)]
    voxel_size: Option<f64>,
    /// Grow to at most N anchors, those with the largest gradients first [default: no limit; by the limits
    /// for a device]
    #[arg(long, value_name = "N", help_heading = QUALITY, hide_short_help = true)]
    max_anchors: Option<usize>,
    /// Keep N anchors: those that contribute most to the training views when growth ends, half-way, or with rdo-pruning those
    /// that are worth most at its last event [default: all]
    #[arg(long, value_name = "N", help_heading = QUALITY, hide_short_help = true)]
    keep_anchors: Option<usize>,
    /// Entropy coder: static tables (fast on a device), the context model (smaller), or auto [default: auto]
    #[arg(long, value_parser = one_of::<CoderChoice>(CODERS), help_heading = OUTPUT, hide_short_help = true)]
    coder: Option<CoderChoice>,
    /// Shares of the anchors that smaller devices leave out, falling to 0 [default: 0.4,0.3,0.2,0.1,0.05,0]
    #[arg(long, value_name = "RATES", value_delimiter = ',', help_heading = OUTPUT, hide_short_help = true)]
    tiers: Option<Vec<f32>>,
    #[arg(long, value_name = "N", help_heading = QUALITY, hide_short_help = true,
        help = with_default("Hold out every N-th training view, and measure the tiers with these instead of test views; 0 holds out none",
        TrainConfig::default().validation_every))]
    validation_every: Option<u32>,
}

/// The largest number that a configuration can hold.
const MOST_SEED: u64 = i64::MAX as u64;

/// How a run proceeds.
#[derive(clap::Args)]
pub(crate) struct RunOptions {
    /// Set a key of the configuration, as train.modules.pruning.rate=0.2; may be given several times.
    #[arg(long, value_name = "KEY=VALUE", help_heading = RUN, hide_short_help = true)]
    set: Vec<String>,
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(..=MOST_SEED), help_heading = RUN,
        help = with_default("Seed of all random numbers: the same seed on the same machine gives the same bundle",
        TrainConfig::default().seed))]
    seed: Option<u64>,
    /// Iterations between checkpoints; 0 writes them on interruption alone [default: by time, every minute]
    #[arg(long, value_name = "N", help_heading = RUN, hide_short_help = true)]
    checkpoint_every: Option<u32>,
    /// Keep the last two checkpoints of the finished run [default: they are removed]
    #[arg(long, help_heading = RUN, hide_short_help = true)]
    keep_checkpoints: bool,
    /// Keep the checkpoints after these iterations, for other runs to begin from with --from [default: none]
    #[arg(long, value_name = "STEPS", value_delimiter = ',', help_heading = RUN, hide_short_help = true)]
    fork_at: Option<Vec<u32>>,
}

/// A help text with the value that stands where the option is not given.
pub(super) fn with_default(help: &str, default: impl std::fmt::Display) -> String {
    format!("{help} [default: {default}]")
}

impl QualityOptions {
    /// Whether explicit Gaussians are asked for in place of anchors.
    pub(crate) fn is_explicit(&self) -> bool {
        self.backbone == Some(BackboneChoice::Explicit)
    }

    /// Sets what holds for explicit Gaussians too.
    pub(crate) fn apply_to_explicit(&self, gaussians: &mut CloudConfig) {
        gaussians.iterations = self.iterations.unwrap_or(gaussians.iterations);
    }

    /// The given options that say nothing about explicit Gaussians.
    pub(crate) fn of_anchors(&self) -> Vec<&'static str> {
        let Self { backbone: _, iterations: _, effects, modules, feature_dim, offsets, voxel_size, .. } = self;
        let Self { max_anchors, keep_anchors, coder, tiers, validation_every, .. } = self;
        [
            ("--effects", effects.is_some()),
            ("--modules", modules.is_some()),
            ("--feature-dim", feature_dim.is_some()),
            ("--offsets", offsets.is_some()),
            ("--voxel-size", voxel_size.is_some()),
            ("--max-anchors", max_anchors.is_some()),
            ("--keep-anchors", keep_anchors.is_some()),
            ("--coder", coder.is_some()),
            ("--tiers", tiers.is_some()),
            ("--validation-every", validation_every.is_some()),
        ]
        .into_iter()
        .filter_map(|(name, given)| given.then_some(name))
        .collect()
    }

    /// Sets what the options say.
    pub(crate) fn apply_to(&self, config: &mut RunConfig) -> Result<()> {
        fn set<T: Clone>(into: &mut T, given: &Option<T>) {
            if let Some(value) = given {
                *into = value.clone();
            }
        }
        if self.is_explicit() {
            bail!(
                "--backbone {EXPLICIT} makes a .ply; it works with `pocketsplat train CAPTURE --backbone {EXPLICIT} -o SCENE.ply` alone"
            );
        }
        if let Some(BackboneChoice::Anchors(backbone)) = self.backbone {
            *config = config.clone().with_backbone(backbone);
        }
        let (encoding, train) = (&mut config.encoding, &mut config.train);
        set(&mut encoding.coder, &self.coder);
        set(&mut encoding.tiers, &self.tiers);
        set(&mut train.iterations, &self.iterations);
        set(&mut train.validation_every, &self.validation_every);
        train.voxel_size = self.voxel_size.or(train.voxel_size);
        train.densification.max_anchors = self.max_anchors.or(train.densification.max_anchors);
        set(&mut train.shape.feature_dim, &self.feature_dim);
        set(&mut train.shape.n_offsets, &self.offsets);
        if let Some(names) = &self.modules {
            attach(&mut train.modules, names)?;
        }
        if let Some(most) = self.keep_anchors {
            keep(train, most);
        }
        if let Some(request) = &self.effects {
            config.effects.auto = *request == Request::Auto;
            if let Request::Forced(list) = request {
                list.iter().for_each(|(effect, on)| effect.set(train, *on));
            }
        }
        Ok(())
    }

    /// Sets the width of features for a bundle of so many bytes, where the command line leaves it open.
    ///
    /// # Errors
    /// The heads alone take more.
    pub(crate) fn choose_width(&self, train: &mut TrainConfig, bytes: u64) -> Result<()> {
        let feature_dim = self.feature_dim.unwrap_or_else(|| widest_within(bytes, &train.shape));
        train.shape.feature_dim = feature_dim;
        let of_heads = bytes_of_heads(&train.shape);
        if bytes <= of_heads {
            bail!(
                "a bundle of {bytes} bytes is asked for, and the heads of a model with features of width {feature_dim} take about \
                 {of_heads}; ask for several times as many, with a unit as in 300kB"
            );
        }
        Ok(())
    }

    /// Sets what a device affords, where the command line leaves it open: the widths, the number of anchors, rate–distortion pruning
    /// down to it, trained tiers.
    pub(crate) fn choose(&self, train: &mut TrainConfig, choice: &ModelChoice) {
        train.shape.feature_dim = self.feature_dim.unwrap_or(choice.feature_dim);
        train.shape.n_offsets = self.offsets.unwrap_or(choice.n_offsets);
        if self.modules.is_none() {
            let tiers = tiers_of(&train.modules);
            train.modules.pruning.get_or_insert(tiers);
        }
        let grown = match train.modules.rdo {
            // Its events leave what is measured to fit.
            Some(_) => choice.max_anchors.saturating_mul(GROWTH),
            None => {
                keep(train, self.keep_anchors.unwrap_or(choice.max_anchors));
                choice.max_anchors
            }
        };
        train.densification.max_anchors = self.max_anchors.or(Some(grown));
    }
}

/// Where rate–distortion pruning leaves what fits, growth goes to so many times what fits on average.
const GROWTH: usize = 3;

/// Lets `most` anchors stay.
fn keep(train: &mut TrainConfig, most: usize) {
    match &mut train.modules.rdo {
        Some(rdo) => rdo.anchors = Some(most),
        None => train.densification.kept_anchors = Some(most),
    }
}

impl RunOptions {
    /// The same for explicit Gaussians.
    pub(crate) fn applied_to_explicit(&self, mut config: ExplicitRunConfig) -> Result<ExplicitRunConfig> {
        if self.fork_at.is_some() {
            bail!("--fork-at works with anchors alone; leave it out with --backbone {EXPLICIT}");
        }
        config.checkpoint_every = self.checkpoint_every.or(config.checkpoint_every);
        config.keep_checkpoints |= self.keep_checkpoints;
        config.gaussians.seed = self.seed.unwrap_or(config.gaussians.seed);
        Ok(config)
    }

    /// Sets what the options say, but for `--set`.
    pub(crate) fn apply_to(&self, config: &mut RunConfig) {
        config.checkpoint_every = self.checkpoint_every.or(config.checkpoint_every);
        config.keep_checkpoints |= self.keep_checkpoints;
        if let Some(fork_at) = &self.fork_at {
            config.fork_at.clone_from(fork_at);
        }
        config.train.seed = self.seed.unwrap_or(config.train.seed);
    }

    /// `config` as the other options change it, then with what `--set` says.
    ///
    /// * `set`: the latter.
    ///
    /// # Errors
    /// Those of both; a key that an option and `--set` give two values.
    pub(crate) fn set_after<C: Clone + Serialize>(
        &self,
        config: C,
        options: impl Fn(C) -> Result<C>,
        set: impl Fn(&Self, C) -> Result<C>,
    ) -> Result<C> {
        if self.set.is_empty() {
            return options(config);
        }
        let set_last = set(self, options(config.clone())?)?;
        // A key for which the order matters is one that both say. An order that fails was not asked for.
        if let Ok(set_first) = set(self, config).and_then(options)
            && let Some(Difference { key, one, other }) = said_otherwise(&set_last, &set_first)?
        {
            bail!("`{key}` is {other} by an option and {one} by --set; leave one of them out");
        }
        Ok(set_last)
    }

    /// `config` with what `--set` says.
    pub(crate) fn with_set(&self, config: RunConfig) -> Result<RunConfig> {
        self.set.iter().try_fold(config, |config, key| with_key(&config, key.trim_start()))
    }

    /// The same for explicit Gaussians.
    pub(crate) fn with_set_explicit(&self, config: ExplicitRunConfig) -> Result<ExplicitRunConfig> {
        config.with_keys(&self.set)
    }
}

/// `config` with one key set, which must not decide about an effect.
fn with_key(config: &RunConfig, key: &str) -> Result<RunConfig> {
    // The detail module has settings of its own where the run has the effect.
    let names =
        |effect: &Effect| key.starts_with(effect.key()) && !(*effect == Effect::Detail && effect.is_in(&config.train));
    let named = Effect::ALL.into_iter().find(names);
    let set = match named {
        Some(_) => config.clone(),
        None => config.with_keys(&[key.to_owned()])?,
    };
    // A table may hold the key of an effect as well.
    let changes = |effect: &Effect| effect.is_in(&config.train) != effect.is_in(&set.train);
    if let Some(effect) = named.or_else(|| Effect::ALL.into_iter().find(changes)) {
        bail!("--set {key} belongs to the effect {effect}; force it with --effects +{effect} or --effects -{effect}");
    }
    if set.train.shape.detail_hidden != config.train.shape.detail_hidden {
        bail!(
            "--set {key} belongs to the effect detail; set its width with --effects +detail --set train.modules.detail.hidden=N"
        );
    }
    Ok(set)
}

#[cfg(test)]
mod tests {
    use super::*;
    use pocketsplat_trainer::train::modules::Rdo;

    #[test]
    fn what_stays_follows_pruning_by_worth() {
        let mut train = TrainConfig::default();
        keep(&mut train, 700);
        assert_eq!(train.densification.kept_anchors, Some(700));
        train.densification.kept_anchors = None;
        train.modules.rdo = Some(Rdo::default());
        keep(&mut train, 700);
        assert_eq!((train.modules.rdo.unwrap().anchors, train.densification.kept_anchors), (Some(700), None));
    }
}
