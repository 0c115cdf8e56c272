//! What docs/results/plan.toml asks for.

use std::path::PathBuf;

use anyhow::{Context as _, Result, ensure};
use serde::Deserialize;

use super::in_repository;

pub(super) const PLAN: &str = "docs/results/plan.toml";

/// The plan: groups of runs, and the tables made of them.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Plan {
    /// In the order in which they are run.
    #[serde(rename = "group")]
    pub(super) groups: Vec<Group>,
    #[serde(rename = "table")]
    pub(super) tables: Vec<Table>,
}

/// Runs that are planned together.
#[derive(Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub(super) struct Group {
    /// Of its CSV, NAME.csv in docs/results/figures.
    pub(super) name: String,
    /// As `pocketsplat plan-runs` reads it, with the captures' folders relative to the folder of captures.
    #[serde(default)]
    pub(super) plan: toml::Table,
    /// In place of a plan: a script of the repository and its capture, which writes the CSV of its measurements, NAME.csv, into a folder.
    pub(super) script: Option<(PathBuf, String)>,
    /// An emulated board that draws each bundle, and the RAM that it has, KiB.
    pub(super) board: Option<(String, u32)>,
    /// A figure of `pocketsplat tables` to keep beside the CSV, as DATASET/SCENE.
    pub(super) curve: Option<String>,
    /// A picture of this view from all bundles of the first seed, side by side.
    pub(super) picture_of_view: Option<usize>,
}

/// A table in the pages.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Table {
    /// Of its blocks.
    pub(super) name: String,
    pub(super) groups: Vec<String>,
    /// Scenes to show [default: all].
    #[serde(default)]
    pub(super) only: Vec<String>,
    /// What its rows differ in, seeds aside: `group`, `scene`, `method`, `rate`.
    pub(super) rows: Vec<String>,
    pub(super) columns: Vec<String>,
    /// Published methods whose results on the same scenes stand below, from docs/results/published.csv.
    #[serde(default)]
    pub(super) published: Vec<String>,
}

impl Plan {
    pub(super) fn read() -> Result<Self> {
        let text = std::fs::read_to_string(in_repository(PLAN)).with_context(|| format!("could not read {PLAN}"))?;
        let plan: Self = toml::from_str(&text).with_context(|| format!("{PLAN} is no plan of figures"))?;
        for table in &plan.tables {
            for name in &table.groups {
                let known = plan.groups.iter().any(|group| group.name == *name);
                ensure!(known, "{PLAN}: table {} names the group {name}, which there is not", table.name);
            }
        }
        Ok(plan)
    }
}
