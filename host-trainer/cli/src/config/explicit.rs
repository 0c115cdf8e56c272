//! The configuration of a run on explicit Gaussians, beside that of a run on anchors.

use std::path::PathBuf;

use anyhow::{Result, bail};
use pocketsplat_capture::dataset::{Background, Layout, PointsChoice, layout_of};
use pocketsplat_trainer::explicit::CloudConfig;
use serde::{Deserialize, Serialize};
use toml::{Table, Value};

use super::named::EXPLICIT;
use super::{CaptureOptions, Preset, check_is_text, keys_of, merge, refuse_unknown, table_of};

/// Random points that training starts from on captures of Blender, as published.
const PUBLISHED_POINTS: usize = 100_000;

/// Everything such a run was asked for.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct ExplicitRunConfig {
    /// [`EXPLICIT`]: what tells the two kinds of configuration apart.
    backbone: String,
    /// Folder of the capture.
    pub(crate) dataset: PathBuf,
    /// The file to write.
    pub(crate) output: PathBuf,
    /// Iterations from one checkpoint to the next; by time without.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) checkpoint_every: Option<u32>,
    pub(crate) keep_checkpoints: bool,
    pub(crate) capture: CaptureOptions,
    pub(crate) gaussians: CloudConfig,
}

impl ExplicitRunConfig {
    /// A run that nothing else is known of.
    pub(crate) fn new(dataset: PathBuf, output: PathBuf, capture: CaptureOptions, gaussians: CloudConfig) -> Self {
        let backbone = EXPLICIT.to_owned();
        Self { backbone, dataset, output, checkpoint_every: None, keep_checkpoints: false, capture, gaussians }
    }

    /// What a run does where nothing is said: schedules as published, length and size of the images by the preset.
    pub(crate) fn of_preset(preset: Preset, dataset: PathBuf, output: PathBuf) -> Self {
        let preset = preset.config();
        let gaussians = CloudConfig { iterations: preset.train.iterations, ..CloudConfig::default() };
        let capture = as_published(layout_of(&dataset), preset.capture);
        Self::new(dataset, output, capture, gaussians)
    }

    /// Whether a configuration is one of these.
    pub(crate) fn is_one(text: &str) -> bool {
        text.parse::<Table>().is_ok_and(|table| table.get("backbone").and_then(Value::as_str) == Some(EXPLICIT))
    }

    /// Reads what [`Self::to_toml`] wrote.
    pub(crate) fn parse(text: &str) -> Result<Self> {
        let config: Self = super::parse(text)?;
        if config.backbone != EXPLICIT {
            bail!("`backbone` is {}, needs {EXPLICIT}", config.backbone);
        }
        config.gaussians.validate()?;
        Ok(config)
    }

    /// As TOML.
    pub(crate) fn to_toml(&self) -> Result<String> {
        Ok(toml::to_string(self)?)
    }

    /// The same with some keys set, each given as `table.key=value`.
    pub(crate) fn with_keys(&self, keys: &[String]) -> Result<Self> {
        // Before tables name them: those would say only that some path is no text.
        check_is_text(&self.dataset)?;
        check_is_text(&self.output)?;
        let (mut all, given) = (table_of(self)?, keys_of(keys)?);
        merge(&mut all, &given);
        let config: Self = all.try_into()?;
        refuse_unknown(&given, &table_of(&config)?, "")?;
        config.capture.check()?;
        Ok(config)
    }

    /// The first key at which two differ in what decides the result, with both values.
    ///
    /// * `places`: as those of [`RunConfig::difference`](super::RunConfig::difference).
    pub(crate) fn difference(&self, other: &Self, places: [&str; 2]) -> Result<Option<String>> {
        let deciding = |config: &Self| {
            let Self { capture, gaussians, .. } = config.clone();
            table_of(&Self::new(PathBuf::new(), PathBuf::new(), capture, gaussians))
        };
        let differences = super::table_differences(&deciding(self)?, &deciding(other)?);
        Ok(differences.first().map(|difference| difference.at(places)))
    }
}

/// Options with the published protocol of captures of Blender, which show an object before nothing and bring no points: on white, from
/// random points.
fn as_published(layout: Option<Layout>, options: CaptureOptions) -> CaptureOptions {
    if layout != Some(Layout::Blender) {
        return options;
    }
    CaptureOptions {
        background: Some(Background::White),
        points: Some(PointsChoice::Random),
        n_random_points: Some(PUBLISHED_POINTS),
        ..options
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn config() -> ExplicitRunConfig {
        let capture = CaptureOptions { max_resolution: Some(200), ..CaptureOptions::default() };
        ExplicitRunConfig::new("lego".into(), "lego.ply".into(), capture, CloudConfig::default())
    }

    #[test]
    fn a_configuration_comes_back_from_its_text() {
        let text = config().to_toml().unwrap();
        assert!(ExplicitRunConfig::is_one(&text), "{text}");
        assert_eq!(ExplicitRunConfig::parse(&text).unwrap(), config());
        assert!(!ExplicitRunConfig::is_one(&crate::config::RunConfig::default().to_toml().unwrap()));
        let other = text.replace("3dgs", "hac");
        assert!(ExplicitRunConfig::parse(&other).unwrap_err().to_string().contains("needs 3dgs"));
    }

    #[test]
    fn a_backbone_in_the_wrong_place_makes_no_configuration_explicit() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("run.toml");
        for (text, said) in [
            ("backbone = \"hac\"", "unknown key `backbone`; known here: "),
            ("backbone = 3", "unknown key `backbone`; known here: "),
            ("backbone = \"3dgs\"", "is of a run of --backbone 3dgs"),
        ] {
            std::fs::write(&path, text).unwrap();
            let error = format!("{:#}", crate::config::RunConfig::read(&path).unwrap_err());
            assert!(error.contains("run.toml") && error.contains(said), "{text}: {error}");
        }
    }

    #[test]
    fn captures_of_blender_are_trained_as_published_unless_someone_says_otherwise() {
        let options = Preset::Standard.config().capture;
        for layout in [None, Some(Layout::Colmap), Some(Layout::Nerfstudio)] {
            assert_eq!(as_published(layout, options.clone()), options);
        }
        let published = as_published(Some(Layout::Blender), options);
        assert_eq!((published.background, published.n_random_points), (Some(Background::White), Some(100_000)));
        let said = CaptureOptions {
            background: Some(Background::Black),
            points: Some(PointsChoice::Matched),
            ..CaptureOptions::default()
        };
        let both = said.or(&published);
        assert_eq!((both.background, both.points), (said.background, said.points));
    }

    #[test]
    fn keys_can_be_set_and_told_apart() {
        let keys = ["gaussians.density.interval=50".to_owned(), "gaussians.rates.bands_divisor=10".to_owned()];
        let changed = config().with_keys(&keys).unwrap();
        assert_eq!((changed.gaussians.density.interval, changed.gaussians.rates.bands_divisor), (50, 10.0));
        let places = ["in the run", "on the command line"];
        let said = config().difference(&changed, places).unwrap().unwrap();
        assert_eq!(said, "`gaussians.density.interval` is 100 in the run, 50 on the command line");
        let elsewhere = ExplicitRunConfig { dataset: "moved".into(), ..config() };
        assert_eq!(config().difference(&elsewhere, places).unwrap(), None);
        assert!(config().with_keys(&["gaussians.density.intervall=50".to_owned()]).is_err());
        let error = config().with_keys(&["capture.n_random_points=0".to_owned()]).unwrap_err().to_string();
        assert!(error.contains("0 random points, needed: 1 to 10,000,000"), "{error}");
    }
}
