//! What a plan of runs asks for: captures, and the options of `train` that runs share and differ in.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use serde::Deserialize;
use toml::{Table, Value};

use crate::command::tables::OWN_NAMES;
use crate::config::absolute;

/// Options that name a point on a method's curve.
const RATES: [&str; 5] = ["lambda", "bytes", "flash", "ram", "level"];
/// Options that say how large images are.
const SIZES: [&str; 2] = ["max-resolution", "resolution"];
const SEED: &str = "seed";
/// Where the curve of a method without rates has its one point.
const ONE_RATE: &str = "default";
/// What no name of a file has everywhere.
const NOT_IN_NAMES: &str = r#"/\:*?"<>|"#;

/// A plan of runs, as its file has it.
#[derive(Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub(super) struct Spec {
    /// For each dataset its scenes: a folder, or a table with `folder` and options of its own.
    captures: Table,
    /// Options of `train` that all runs share.
    #[serde(default)]
    options: Table,
    /// Options of `train` with the values in which runs differ: every combination is a run.
    #[serde(default)]
    vary: Table,
    /// Combinations to leave out: those that have all of these values.
    #[serde(default)]
    exclude: Vec<Table>,
    /// What tables call methods, by the names that they have otherwise.
    #[serde(default)]
    names: Table,
    /// Published results for the tables, as docs/results/published.csv has them.
    #[serde(default)]
    pub(super) published: Option<PathBuf>,
}

/// A run that is asked for.
#[derive(Clone, Debug)]
pub(super) struct AskedRun {
    /// Path of its files in the folder of the runs.
    pub(super) name: String,
    pub(super) dataset: String,
    pub(super) scene: String,
    pub(super) size: String,
    pub(super) method: String,
    /// The method as its options say it.
    unnamed: String,
    pub(super) rate: String,
    /// Of its capture.
    pub(super) folder: PathBuf,
    /// Options of `train`.
    given: Table,
}

/// A capture, and the options that it needs.
struct Scene {
    dataset: String,
    name: String,
    folder: PathBuf,
    options: Table,
}

impl Spec {
    /// Reads a plan; paths in it are relative to its folder.
    pub(super) fn read(path: &Path) -> Result<Self> {
        let text = std::fs::read_to_string(path).with_context(|| format!("could not read {}", path.display()))?;
        let base = absolute(path)?;
        let base = base.parent().unwrap_or(Path::new(""));
        Self::parse(&text, base).with_context(|| format!("{} is no plan of runs", path.display()))
    }

    fn parse(text: &str, base: &Path) -> Result<Self> {
        let mut spec: Self = toml::from_str(text)?;
        spec.published = spec.published.map(|published| base.join(published));
        for (dataset, scenes) in &mut spec.captures {
            check_dataset(dataset)?;
            let Value::Table(scenes) = scenes else {
                bail!("`captures.{dataset}` is no table; needs SCENE = \"FOLDER\" in [captures.{dataset}]");
            };
            for (scene, capture) in scenes {
                check_file_name("scene", scene)?;
                let folder = match capture {
                    Value::Table(table) => table.get_mut("folder"),
                    other => Some(other),
                };
                let Some(Value::String(folder)) = folder else {
                    bail!("`captures.{dataset}.{scene}` names no folder; needs a text, or a table with `folder`");
                };
                *folder = base.join(&*folder).display().to_string();
            }
        }
        for (option, values) in &spec.vary {
            if values.as_array().is_none_or(Vec::is_empty) {
                bail!("`vary.{option}` is {values}, needs a list of values");
            }
        }
        for (option, value) in spec.exclude.iter().flatten() {
            if ["dataset", "scene"].contains(&option.as_str()) {
                continue;
            }
            let Some(values) = spec.vary.get(option).and_then(Value::as_array) else {
                bail!("[[exclude]] names `{option}`, which runs do not differ in; needs `scene` or a key of [vary]");
            };
            if !values.contains(value) {
                bail!("[[exclude]] has {option} {value}, which no run has; needs one of `vary.{option}`");
            }
        }
        Ok(spec)
    }

    /// All runs: scene by scene, in the order of the values.
    ///
    /// # Errors
    /// No scene; two runs of one name.
    pub(super) fn runs(&self) -> Result<Vec<AskedRun>> {
        let mut runs: Vec<AskedRun> = Vec::new();
        for scene in self.scenes() {
            let mut done: Vec<Table> = Vec::new();
            for varied in self.combinations() {
                let varied = self.meant(varied);
                if done.contains(&varied) || self.exclude.iter().any(|exclude| excludes(exclude, &scene, &varied)) {
                    continue;
                }
                let run = self.run(&scene, &varied);
                done.push(varied);
                // Two values may read alike.
                if let Some(other) = runs.iter().find(|other| other.name == run.name) {
                    bail!("two runs would be called {}; change a value, or leave one out", other.name);
                }
                runs.push(run);
            }
        }
        self.check_names(&runs)?;
        if runs.is_empty() {
            bail!("no run is left: [captures] is empty, or [[exclude]] takes all");
        }
        Ok(runs)
    }

    /// Refuses names of no method, and one name of two.
    fn check_names(&self, runs: &[AskedRun]) -> Result<()> {
        for (method, name) in &self.names {
            if !name.is_str() || runs.iter().all(|run| run.unnamed != *method) {
                let known: BTreeSet<&str> = runs.iter().map(|run| run.unnamed.as_str()).collect();
                let known: Vec<&str> = known.into_iter().collect();
                bail!("[names] calls `{method}` {name}; needs a text, for one of the methods {}", known.join(", "));
            }
        }
        let mut by_name: BTreeMap<&str, &str> = BTreeMap::new();
        for run in runs {
            let other = by_name.entry(&run.method).or_insert(&run.unnamed);
            if *other != run.unnamed {
                bail!(
                    "`{other}` and `{}` are both called {}; tables would mix them, change [names]",
                    run.unnamed,
                    run.method
                );
            }
        }
        Ok(())
    }

    fn scenes(&self) -> Vec<Scene> {
        let mut all = Vec::new();
        for (dataset, scenes) in &self.captures {
            for (name, capture) in scenes.as_table().into_iter().flatten() {
                let mut options = capture.as_table().cloned().unwrap_or_default();
                let folder = options.remove("folder").unwrap_or_else(|| capture.clone());
                let folder = PathBuf::from(folder.as_str().unwrap_or_default());
                all.push(Scene { dataset: dataset.clone(), name: name.clone(), folder, options });
            }
        }
        all
    }

    /// Every combination of the values in `vary`, the last key fastest.
    fn combinations(&self) -> Vec<Table> {
        let mut all = vec![Table::new()];
        for (option, values) in &self.vary {
            let with = |table: &Table, value: &Value| {
                let mut table = table.clone();
                table.insert(option.clone(), value.clone());
                table
            };
            let values = values.as_array().map_or(&[][..], Vec::as_slice);
            all = all.iter().flat_map(|table| values.iter().map(|value| with(table, value))).collect();
        }
        all
    }

    /// The same without what says nothing: scaffold scenes are trained without weighing bits, so that one run stands for all weights.
    fn meant(&self, mut varied: Table) -> Table {
        let backbone = varied.get("backbone").or(self.options.get("backbone"));
        if backbone.and_then(Value::as_str) == Some("scaffold") {
            varied.remove("lambda");
        }
        varied
    }

    fn run(&self, scene: &Scene, varied: &Table) -> AskedRun {
        let is_method = |option: &str| !RATES.contains(&option) && !SIZES.contains(&option) && option != SEED;
        let method = named(varied, is_method, |_, value| value.to_owned(), " ");
        let method = if method.is_empty() { "ours".to_owned() } else { method };
        let rate = named(varied, |option| RATES.contains(&option), |option, value| format!("{option}={value}"), " ");
        let size = named(varied, |option| SIZES.contains(&option), |_, value| value.to_owned(), " ");
        let all = |option: &str, value: &str| match is_method(option) {
            true => value.to_owned(),
            false => format!("{option}-{value}"),
        };
        let name = named(varied, |_| true, all, "-");
        let mut given = self.options.clone();
        given.extend(scene.options.clone());
        given.extend(varied.clone());
        AskedRun {
            name: format!("{}/{}", plain(&scene.name), plain(if name.is_empty() { "run" } else { &name })),
            dataset: scene.dataset.clone(),
            scene: scene.name.clone(),
            size,
            method: self.names.get(&method).and_then(Value::as_str).map_or_else(|| method.clone(), str::to_owned),
            unnamed: method,
            rate: if rate.is_empty() { ONE_RATE.to_owned() } else { rate },
            folder: scene.folder.clone(),
            given,
        }
    }
}

impl AskedRun {
    /// Whether the plan says an option of this run.
    pub(super) fn says(&self, option: &str) -> bool {
        self.given.contains_key(option)
    }

    /// As words of a command line.
    pub(super) fn options(&self) -> Vec<String> {
        let mut words = Vec::new();
        for (option, value) in &self.given {
            match value {
                Value::Boolean(false) => {}
                Value::Boolean(true) => words.push(format!("--{option}")),
                // The one option that may be given several times.
                Value::Array(values) if option == "set" => {
                    words.extend(values.iter().map(|value| format!("--set={}", text(value))));
                }
                value => words.push(format!("--{option}={}", text(value))),
            }
        }
        words
    }
}

/// Whether a combination has all the values of an exclusion.
fn excludes(exclude: &Table, scene: &Scene, varied: &Table) -> bool {
    exclude.iter().all(|(option, value)| match option.as_str() {
        "dataset" => value.as_str() == Some(&scene.dataset),
        "scene" => value.as_str() == Some(&scene.name),
        _ => varied.get(option) == Some(value),
    })
}

/// The values of the options that are `wanted`, joined.
fn named(varied: &Table, wanted: impl Fn(&str) -> bool, name: impl Fn(&str, &str) -> String, between: &str) -> String {
    let names = varied.iter().filter(|(option, _)| wanted(option));
    names.map(|(option, value)| name(option, &text(value))).collect::<Vec<_>>().join(between)
}

/// A value as a command line has it.
fn text(value: &Value) -> String {
    match value {
        Value::String(text) => text.clone(),
        Value::Array(values) => values.iter().map(text).collect::<Vec<_>>().join(","),
        other => other.to_string(),
    }
}

/// Refuses the name of a dataset that tables cannot have files of.
fn check_dataset(name: &str) -> Result<()> {
    check_file_name("dataset", name)?;
    if OWN_NAMES.iter().any(|own| own.eq_ignore_ascii_case(name)) {
        let own = OWN_NAMES.join(", ");
        bail!(
            "[captures] names a dataset `{name}`, and tables keep {own} for files of their own; give it another name"
        );
    }
    Ok(())
}

/// Refuses a name that cannot be that of a file: tables and runs are called by it, and would lie in another folder.
///
/// * `what`: has the name.
fn check_file_name(what: &str, name: &str) -> Result<()> {
    let ends_badly = |end: Option<char>| end.is_none_or(|c| c == '.' || c.is_whitespace());
    let has_bad = name.contains(|c: char| c.is_control() || NOT_IN_NAMES.contains(c));
    if has_bad || ends_badly(name.chars().next()) || ends_badly(name.chars().next_back()) {
        bail!(
            "[captures] names a {what} `{}`, and files are called by it; needs a plain file name: no {NOT_IN_NAMES} or line break in \
             it, no dot or space at its ends",
            name.escape_debug()
        );
    }
    Ok(())
}

/// A name that is one part of a path everywhere.
fn plain(name: &str) -> String {
    let kept = |c: char| if c.is_alphanumeric() || "._+-=".contains(c) { c } else { '-' };
    name.chars().map(kept).collect()
}

#[cfg(test)]
mod tests;
