//! The configuration of a run as TOML: written into its folder, read by `--config`.

mod capture;
mod effects;
mod explicit;
pub(crate) mod heading;
pub(crate) mod named;
mod preset;
mod protocol;
mod spread;

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use pocketsplat_capture::dataset::Background;
use pocketsplat_trainer::encode::Encoding;
use pocketsplat_trainer::train::TrainConfig;
use pocketsplat_trainer::train::config::Backbone;
use serde::{Deserialize, Serialize};
use toml::{Table, Value};

pub(crate) use capture::CaptureOptions;
pub(crate) use effects::EffectsConfig;
pub(crate) use explicit::ExplicitRunConfig;
pub(crate) use named::EXPLICIT;
pub(crate) use preset::Preset;
pub(crate) use protocol::Protocol;

/// Everything a run was asked for.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct RunConfig {
    /// Folder of the capture.
    pub(crate) dataset: PathBuf,
    /// The bundle to write.
    pub(crate) output: PathBuf,
    /// Iterations from one checkpoint to the next; by time without.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) checkpoint_every: Option<u32>,
    pub(crate) keep_checkpoints: bool,
    /// Iterations whose checkpoints stay, for other runs to begin from.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub(crate) fork_at: Vec<u32>,
    pub(crate) capture: CaptureOptions,
    pub(crate) train: TrainConfig,
    pub(crate) encoding: Encoding,
    pub(crate) effects: EffectsConfig,
    /// Whether the weight of the bits still has to be multiplied by the share of the pixels that show the scene: where nobody said one.
    #[serde(skip)]
    pub(crate) scales_lambda: bool,
}

impl Default for RunConfig {
    fn default() -> Self {
        Self {
            dataset: PathBuf::new(),
            output: PathBuf::new(),
            checkpoint_every: None,
            keep_checkpoints: false,
            fork_at: Vec::new(),
            capture: CaptureOptions { background: Some(Background::Black), ..CaptureOptions::default() },
            train: TrainConfig::default(),
            encoding: Encoding::default(),
            effects: EffectsConfig::default(),
            scales_lambda: false,
        }
    }
}

impl RunConfig {
    /// Reads a configuration; keys that are missing have their defaults.
    pub(crate) fn read(path: &Path) -> Result<Self> {
        let text = std::fs::read_to_string(path);
        let text = text.with_context(|| format!("could not read the configuration {}", path.display()))?;
        Self::parse(&text).with_context(|| format!("the configuration {} cannot be used", path.display()))
    }

    /// That of the run in a folder, with what was decided on the way: effects are not chosen again.
    pub(crate) fn of_run(folder: &Path) -> Result<Self> {
        let mut config = Self::read(&folder.join("config.toml"))?;
        config.effects.auto = false;
        Ok(config)
    }

    /// As [`Self::read`], from its text.
    pub(crate) fn parse(text: &str) -> Result<Self> {
        let given: Table = text.parse()?;
        let train = TrainConfig::of(given_backbone(&given)?);
        let effects = EffectsConfig { auto: false, ..EffectsConfig::default() };
        let mut all = Table::try_from(Self { train, effects, ..Self::default() })?;
        merge(&mut all, &given);
        let config: Self = all.try_into()?;
        // What is not written again was not understood.
        refuse_unknown(&given, &Table::try_from(&config)?, "")?;
        Ok(config)
    }

    /// The same with some keys set, each given as `table.key=value`; what is no TOML value is taken as text.
    pub(crate) fn with_keys(&self, keys: &[String]) -> Result<Self> {
        let mut all = Table::try_from(self)?;
        let given = keys_of(keys)?;
        merge(&mut all, &given);
        let says_lambda = ["train", "hac"].iter().try_fold(&given, |table, name| table.get(*name)?.as_table());
        let says_lambda = says_lambda.is_some_and(|hac| hac.contains_key("lambda"));
        let config = Self { scales_lambda: self.scales_lambda && !says_lambda, ..all.try_into()? };
        refuse_unknown(&given, &Table::try_from(&config)?, "")?;
        Ok(config)
    }

    /// As TOML that [`Self::parse`] reads back.
    pub(crate) fn to_toml(&self) -> Result<String> {
        Ok(toml::to_string(self)?)
    }

    /// Refuses what no run can use, before any work starts.
    pub(crate) fn check(&self) -> Result<()> {
        self.train.validate()?;
        let n = self.train.iterations;
        if let Some(beyond) = self.fork_at.iter().find(|iteration| **iteration > n) {
            bail!("--fork-at names iteration {beyond}, and the run has {n}; name one of 1 to {n}, or set --iterations");
        }
        Ok(self.encoding.check(self.train.backbone)?)
    }

    /// The first key at which two configurations differ in what decides the training, with both values.
    ///
    /// Where the capture lies, where the bundle goes and when checkpoints are written do not. How the bundle is coded does where it
    /// has limits, for the run is steered by what its bundle takes of them; without, the bundle is written anew from what was
    /// trained.
    ///
    /// * `places`: where this one and the other stand, as "in the run" and "on the command line".
    pub(crate) fn difference(&self, other: &Self, places: [&str; 2]) -> Result<Option<String>> {
        let is_steered = !(self.encoding.limits.is_none() && other.encoding.limits.is_none());
        let differences = differences(self, other, |config| {
            let Self { capture, train, .. } = config;
            let encoding = if is_steered { config.encoding } else { Encoding::default() };
            Self { capture, train, encoding, ..Self::default() }
        });
        Ok(differences?.first().map(|difference| difference.at(places)))
    }

    /// All keys at which their bundles differ: those, and how bundles are coded. The effects that were chosen are among them, how
    /// they were chosen is not.
    pub(crate) fn differences_of_bundles(&self, other: &Self) -> Result<Vec<Difference>> {
        differences(self, other, |config| {
            let Self { capture, train, encoding, .. } = config;
            Self { capture, train, encoding, ..Self::default() }
        })
    }
}

/// A key at which two configurations differ, and both values as TOML; `nothing` for none.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Difference {
    pub(crate) key: String,
    pub(crate) one: String,
    pub(crate) other: String,
}

impl Difference {
    /// With both values, and where they stand.
    fn at(&self, [here, there]: [&str; 2]) -> String {
        let Self { key, one, other } = self;
        format!("`{key}` is {one} {here}, {other} {there}")
    }
}

/// Keys given as `table.key=value`, as tables; what is no TOML value is taken as text.
fn keys_of(keys: &[String]) -> Result<Table> {
    let mut given = Table::new();
    for key in keys {
        let Some((path, value)) = key.split_once('=') else {
            bail!("`{key}` sets nothing; needs KEY=VALUE, as train.hac.sample=0.1");
        };
        let value = format!("x = {value}").parse::<Table>().ok().and_then(|mut table| table.remove("x"));
        let value = value.unwrap_or_else(|| Value::String(key[path.len() + 1..].to_owned()));
        let nested = path
            .trim()
            .rsplit('.')
            .fold(value, |inner, name| Value::Table(Table::from_iter([(name.to_owned(), inner)])));
        if let Value::Table(nested) = nested {
            merge(&mut given, &nested);
        }
    }
    Ok(given)
}

/// All keys at which two configurations differ in what `deciding` leaves of them.
fn differences(
    one: &RunConfig,
    other: &RunConfig,
    deciding: impl Fn(RunConfig) -> RunConfig,
) -> Result<Vec<Difference>> {
    let table = |config: &RunConfig| Table::try_from(deciding(config.clone()));
    Ok(table_differences(&table(one)?, &table(other)?))
}

/// All keys at which two tables differ.
fn table_differences(one: &Table, other: &Table) -> Vec<Difference> {
    let mut all = Vec::new();
    collect_differences(one, other, "", &mut all);
    all
}

/// The backbone that a configuration names; its defaults stand for what else is missing.
fn given_backbone(given: &Table) -> Result<Backbone> {
    let named = given.get("train").and_then(|train| train.get("backbone"));
    named.map_or(Ok(Backbone::default()), |name| Ok(name.clone().try_into()?))
}

/// Replaces values of `into` by those of `from`, table by table.
fn merge(into: &mut Table, from: &Table) {
    for (key, value) in from {
        match (into.get_mut(key), value) {
            (Some(Value::Table(into)), Value::Table(from)) => merge(into, from),
            // A rate of `1` means 1.0.
            (Some(Value::Float(into)), Value::Integer(from)) => *into = *from as f64,
            _ => {
                into.insert(key.clone(), value.clone());
            }
        }
    }
}

fn refuse_unknown(given: &Table, known: &Table, at: &str) -> Result<()> {
    for (key, value) in given {
        match (known.get(key), value) {
            (Some(Value::Table(known)), Value::Table(given)) => refuse_unknown(given, known, &format!("{at}{key}."))?,
            (Some(_), _) => {}
            (None, _) => {
                let keys: Vec<&str> = known.keys().map(String::as_str).collect();
                bail!("unknown key `{at}{key}`; known here: {}", keys.join(", "));
            }
        }
    }
    Ok(())
}

fn collect_differences(a: &Table, b: &Table, at: &str, all: &mut Vec<Difference>) {
    let keys = a.keys().chain(b.keys().filter(|key| !a.contains_key(*key)));
    for key in keys.filter(|key| a.get(*key) != b.get(*key)) {
        match (a.get(key), b.get(key)) {
            (Some(Value::Table(a)), Some(Value::Table(b))) => collect_differences(a, b, &format!("{at}{key}."), all),
            (a, b) => {
                let text = |value: Option<&Value>| value.map_or("nothing".to_owned(), ToString::to_string);
                all.push(Difference { key: format!("{at}{key}"), one: text(a), other: text(b) });
            }
        }
    }
}

#[cfg(test)]
mod tests;
