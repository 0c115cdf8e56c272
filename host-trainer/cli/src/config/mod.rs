//! The configuration of a run as TOML: written into its folder, read by `--config`.

mod capture;
mod effects;
mod explicit;
pub(crate) mod heading;
pub(crate) mod named;
mod preset;
mod protocol;
mod spread;
pub(crate) mod target;

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use pocketsplat_files::shown;
use pocketsplat_trainer::encode::Encoding;
use pocketsplat_trainer::train::TrainConfig;
use pocketsplat_trainer::train::config::Backbone;
use pocketsplat_trainer::train::run::RunError;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use toml::{Table, Value};

pub(crate) use capture::{CaptureOptions, check_random_points};
pub(crate) use effects::EffectsConfig;
pub(crate) use explicit::ExplicitRunConfig;
pub(crate) use named::EXPLICIT;
pub(crate) use preset::Preset;
pub(crate) use protocol::Protocol;

/// Everything a run was asked for.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct RunConfig {
    /// What keys are that nobody gives.
    pub(crate) preset: Preset,
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

/// What a run does where nothing is said, in a file or on the command line.
impl Default for RunConfig {
    fn default() -> Self {
        Preset::default().config()
    }
}

/// A path as a run keeps it, so that it can go on from any folder.
///
/// # Errors
/// The path is empty, or not UTF-8.
pub(crate) fn absolute(path: &Path) -> Result<PathBuf> {
    let absolute = std::path::absolute(path).with_context(|| format!("`{}` is no path", path.display()))?;
    check_is_text(&absolute)?;
    Ok(absolute)
}

/// Refuses a path that is not UTF-8: configurations, plans and their command lines are text, and would name another file or none.
fn check_is_text(path: &Path) -> Result<()> {
    if path.to_str().is_none() {
        bail!(
            "`{}` is not UTF-8, and a configuration names files in UTF-8; rename it, or link to it by another name",
            shown(path)
        );
    }
    Ok(())
}

/// A configuration as tables of TOML.
///
/// Through its text, since another way of writing would be compiled once more for each type that a configuration has.
fn table_of(config: &impl Serialize) -> Result<Table> {
    Ok(toml::to_string(config)?.parse()?)
}

/// Reads what [`toml::to_string`] wrote. Through tables, as [`RunConfig::parse`] has to: another way of reading would be compiled too.
pub(crate) fn parse<T: DeserializeOwned>(text: &str) -> Result<T> {
    Ok(text.parse::<Table>()?.try_into()?)
}

impl RunConfig {
    /// Reads a configuration; keys that are missing are those of its preset, as in a run without it.
    pub(crate) fn read(path: &Path) -> Result<Self> {
        let text = std::fs::read_to_string(path);
        let text = text.with_context(|| format!("could not read the configuration {}", path.display()))?;
        if ExplicitRunConfig::is_one(&text) {
            bail!(
                "{} is of a run of --backbone 3dgs; measure its .ply with `eval`, or make a bundle of it with `import`",
                path.display()
            );
        }
        Self::parse(&text).with_context(|| format!("the configuration {} cannot be used", path.display()))
    }

    /// That of the run in a folder, as it was written.
    pub(crate) fn of_run(folder: &Path) -> Result<Self> {
        let path = folder.join("config.toml");
        if !path.is_file() {
            return Err(RunError::NoRun { path: folder.to_owned() }.into());
        }
        Self::read(&path)
    }

    /// As [`Self::read`], from its text.
    pub(crate) fn parse(text: &str) -> Result<Self> {
        let mut given: Table = text.parse()?;
        let unset: Vec<String> = given.remove("unset").map_or(Ok(Vec::new()), Value::try_into)?;
        let base = Self::base_of(&given)?;
        let mut all = table_of(&base)?;
        for key in &unset {
            remove(&mut all, key).with_context(|| format!("`unset` names `{key}`, which the preset does not have"))?;
        }
        merge(&mut all, &given);
        let config: Self = all.try_into()?;
        // What is not written again was not understood.
        refuse_unknown(&given, &table_of(&config)?, "")?;
        Ok(Self { scales_lambda: base.scales_lambda && !says_lambda(&given), ..config })
    }

    /// What the keys of a configuration are added to.
    fn base_of(given: &Table) -> Result<Self> {
        let key = |table: &str, key: &str| given.get(table).and_then(|table| table.get(key));
        let backbone: Option<Backbone> = key("train", "backbone").map(|name| name.clone().try_into()).transpose()?;
        let preset: Preset = match given.get("preset") {
            Some(name) => name.clone().try_into()?,
            None => Preset::default(),
        };
        let mut base = preset.config();
        if key("capture", "resolution").is_some() {
            base.capture.max_resolution = None;
        }
        Ok(match backbone {
            Some(backbone) => base.with_backbone(backbone),
            None => base,
        })
    }

    /// The same with another backbone.
    pub(crate) fn with_backbone(mut self, backbone: Backbone) -> Self {
        self.train.backbone = backbone;
        if !backbone.is_coded() {
            // Nothing is worth its bits where there are none.
            self.train.modules.rdo = None;
        }
        self
    }

    /// The same with some keys set, each given as `table.key=value`; what is no TOML value is taken as text.
    pub(crate) fn with_keys(&self, keys: &[String]) -> Result<Self> {
        let mut all = table_of(self)?;
        let given = keys_of(keys)?;
        merge(&mut all, &given);
        let config = Self { scales_lambda: self.scales_lambda && !says_lambda(&given), ..all.try_into()? };
        refuse_unknown(&given, &table_of(&config)?, "")?;
        Ok(config)
    }

    /// As TOML that [`Self::parse`] reads back; `unset` names the keys of the preset that the run does not have.
    pub(crate) fn to_toml(&self) -> Result<String> {
        let keys = toml::to_string(self)?;
        let own: Table = keys.parse()?;
        let mut unset = Vec::new();
        collect_missing(&table_of(&Self::base_of(&own)?)?, &own, "", &mut unset);
        Ok(if unset.is_empty() { keys } else { format!("unset = {}\n{keys}", Value::from(unset)) })
    }

    /// Refuses what no run can use, before any work starts.
    pub(crate) fn check(&self) -> Result<()> {
        self.capture.check()?;
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
    for (key, instead) in [
        ("preset", "would change no other key; give --preset, or the key in a configuration"),
        ("dataset", "is said by DATASET; give it there"),
        ("output", "is said by --output; give it there"),
    ] {
        if given.contains_key(key) {
            bail!("`{key}` cannot be set: it {instead}");
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
    let table = |config: &RunConfig| table_of(&deciding(config.clone()));
    Ok(table_differences(&table(one)?, &table(other)?))
}

/// The first key that two ways of applying options and keys give two values, beside those of modules: an option attaches these, keys set
/// them up.
pub(crate) fn said_otherwise(one: &impl Serialize, other: &impl Serialize) -> Result<Option<Difference>> {
    let all = table_differences(&table_of(one)?, &table_of(other)?);
    // What is no number differs from itself; it is refused elsewhere.
    let is_said =
        |difference: &Difference| difference.one != difference.other && !difference.key.starts_with("train.modules.");
    Ok(all.into_iter().find(is_said))
}

/// All keys at which two tables differ.
fn table_differences(one: &Table, other: &Table) -> Vec<Difference> {
    let mut all = Vec::new();
    collect_differences(one, other, "", &mut all);
    all
}

/// Whether keys say how much bits weigh.
fn says_lambda(given: &Table) -> bool {
    let hac = ["train", "hac"].iter().try_fold(given, |table, name| table.get(*name)?.as_table());
    hac.is_some_and(|hac| hac.contains_key("lambda"))
}

/// Takes a key out, given as `table.key`.
fn remove(from: &mut Table, key: &str) -> Option<Value> {
    match key.split_once('.') {
        Some((table, rest)) => remove(from.get_mut(table)?.as_table_mut()?, rest),
        None => from.remove(key),
    }
}

/// The keys of `all` that `some` lacks.
fn collect_missing(all: &Table, some: &Table, at: &str, missing: &mut Vec<String>) {
    for (key, value) in all {
        match (value, some.get(key)) {
            (_, None) => missing.push(format!("{at}{key}")),
            (Value::Table(all), Some(Value::Table(some))) => {
                collect_missing(all, some, &format!("{at}{key}."), missing)
            }
            _ => {}
        }
    }
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
