//! Tables between `<!-- table NAME -->` and `<!-- end of table -->`, made of the CSVs.

use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context as _, Result, bail};
use pocketsplat_instructions::Processor;
use pocketsplat_trainer::{REVISION, revision_of};
use serde::Deserialize;

use super::plan::{Plan, Table};
use super::rows::{self, Row};
use super::{decoder, in_repository};

const BEGIN: &str = "<!-- table ";
const BEGIN_END: &str = " -->\n";
const END: &str = "<!-- end of table -->";
const NOT_RUN: &str = "not run";
/// Of a board that people buy: the clock of RP2350.
const CLOCK_HZ: f64 = 150e6;

/// A column: its head, its value of a run, and how many digits are shown.
struct Column {
    head: &'static str,
    value: fn(&Row) -> Option<f64>,
    digits: usize,
}

fn column(name: &str) -> Result<Column> {
    let (head, value, digits): (_, fn(&Row) -> Option<f64>, _) = match name {
        "psnr_db" => ("PSNR, dB", |row| row.psnr_db, 2),
        "ssim" => ("SSIM", |row| row.ssim, 3),
        "lpips" => ("LPIPS", |row| row.lpips, 3),
        "kilobytes" => ("kB", |row| Some(row.bytes? / 1e3), 0),
        "n_anchors" => ("anchors", |row| row.n_anchors, 0),
        "n_views" => ("test views", |row| row.n_views, 0),
        "width_px" => ("width, px", |row| row.width_px, 0),
        "processor_minutes" => ("core minutes", |row| row.processor_minutes, 1),
        "memory_gb" => ("memory, GB", |row| Some(row.memory_bytes? / 1e9), 2),
        "page_kilobytes" => ("page, kB", |row| Some(row.page_bytes? / 1e3), 0),
        "million_instructions" => ("million instructions", |row| Some(row.instructions? / 1e6), 1),
        "seconds_at_150_mhz" => {
            ("seconds at 150 MHz", |row| Some(row.instructions? * cycles_per_instruction(row) / CLOCK_HZ), 2)
        }
        other => bail!("no figure is called {other}"),
    };
    Ok(Column { head, value, digits })
}

/// Of the processor that a group is named for; of others one.
fn cycles_per_instruction(row: &Row) -> f64 {
    Processor::named(&row.group).map_or(1.0, Processor::cycles_per_instruction)
}

/// A published result.
#[derive(Deserialize)]
struct Published {
    #[serde(rename = "Scene")]
    scene: String,
    #[serde(rename = "Method")]
    method: String,
    #[serde(rename = "Submethod")]
    submethod: String,
    #[serde(rename = "PSNR")]
    psnr_db: f64,
    #[serde(rename = "SSIM")]
    ssim: Option<f64>,
    #[serde(rename = "LPIPS")]
    lpips: Option<f64>,
    #[serde(rename = "Size [Bytes]")]
    bytes: Option<f64>,
}

impl Table {
    fn text(&self) -> Result<String> {
        let mut rows = Vec::new();
        for group in &self.groups {
            let shown = |row: &Row| self.only.is_empty() || self.only.contains(&row.scene);
            rows.extend(rows::read(group)?.into_iter().filter(shown).map(|row| Row { group: group.clone(), ..row }));
        }
        let columns = self.columns.iter().map(|name| column(name)).collect::<Result<Vec<_>>>()?;
        let measured = of_the_newest_program(&rows);
        let mut text = String::new();
        let heads = self.rows.iter().map(String::as_str).chain(columns.iter().map(|column| column.head));
        let heads: Vec<&str> = heads.chain(["seeds"]).collect();
        writeln!(text, "| {} |\n|{}", heads.join(" | "), "---|".repeat(heads.len()))?;
        let mut keys: Vec<Vec<String>> = Vec::new();
        for row in &rows {
            let key = self.key(row)?;
            if !keys.contains(&key) {
                keys.push(key);
            }
        }
        for key in &keys {
            let of_key = |row: &&&Row| self.key(row).is_ok_and(|other| other == *key);
            let all: Vec<&Row> = rows.iter().collect();
            let n_planned = all.iter().filter(of_key).count();
            let found: Vec<&Row> = measured.iter().filter(of_key).copied().collect();
            let cells = columns.iter().map(|column| column.cell(&found));
            let seeds = match found.len() {
                n if n == n_planned => n.to_string(),
                n => format!("{n} of {n_planned}"),
            };
            let cells: Vec<String> = key.iter().cloned().chain(cells).chain([seeds]).collect();
            writeln!(text, "| {} |", cells.join(" | "))?;
        }
        text += &self.published_rows(&rows, &columns)?;
        Ok(text + &caption(&measured))
    }

    fn key(&self, row: &Row) -> Result<Vec<String>> {
        let field = |name: &String| {
            Ok(match name.as_str() {
                "group" => row.group.clone(),
                "scene" => row.scene.clone(),
                "method" => row.method.clone(),
                "rate" => row.rate.clone(),
                other => bail!("rows cannot differ in {other}"),
            })
        };
        self.rows.iter().map(field).collect()
    }

    /// Results of others on the scenes of these rows.
    fn published_rows(&self, rows: &[Row], columns: &[Column]) -> Result<String> {
        let mut text = String::new();
        if self.published.is_empty() {
            return Ok(text);
        }
        for published in csv::Reader::from_path(in_repository("docs/results/published.csv"))?.into_deserialize() {
            let published: Published = published?;
            if !self.published.contains(&published.method) || rows.iter().all(|row| row.scene != published.scene) {
                continue;
            }
            let as_row = Row {
                scene: published.scene.clone(),
                method: format!("{} as published", published.method),
                rate: published.submethod.clone(),
                psnr_db: Some(published.psnr_db),
                ssim: published.ssim,
                lpips: published.lpips,
                bytes: published.bytes,
                ..Row::default()
            };
            let cell = |column: &Column| (column.value)(&as_row).map_or("–".to_owned(), |value| column.shown(value));
            let cells: Vec<String> =
                self.key(&as_row)?.into_iter().chain(columns.iter().map(cell)).chain(["–".to_owned()]).collect();
            writeln!(text, "| {} |", cells.join(" | "))?;
        }
        Ok(text)
    }
}

impl Column {
    fn shown(&self, value: f64) -> String {
        format!("{value:.*}", self.digits)
    }

    /// Mean and standard deviation over seeds.
    fn cell(&self, rows: &[&Row]) -> String {
        let values: Vec<f64> = rows.iter().filter_map(|row| (self.value)(row)).collect();
        if values.is_empty() {
            return NOT_RUN.to_owned();
        }
        let n = values.len() as f64;
        let mean = values.iter().sum::<f64>() / n;
        let deviation = (values.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / (n - 1.0).max(1.0)).sqrt();
        let (mean, deviation) = (self.shown(mean), self.shown(deviation));
        if deviation.bytes().any(|digit| digit.is_ascii_digit() && digit != b'0') {
            format!("{mean} ± {deviation}")
        } else {
            mean
        }
    }
}

/// The rows that the newest of their programs measured: no table shows two.
fn of_the_newest_program(rows: &[Row]) -> Vec<&Row> {
    let newest = rows.iter().filter(|row| row.is_measured()).map(|row| revision_number(&row.program)).max();
    rows.iter().filter(|row| row.is_measured() && Some(revision_number(&row.program)) == newest).collect()
}

/// The number after `r` in "0.1.0 r3 1a2b3c4".
fn revision_number(program: &str) -> Option<u32> {
    revision_of(program).rsplit(" r").next().and_then(|revision| revision.parse().ok())
}

/// Which program the figures are of, and whether there is a newer one.
fn caption(measured: &[&Row]) -> String {
    let Some(row) = measured.first() else { return String::new() };
    let age = if revision_number(&row.program) == Some(REVISION) { "" } else { ", older than the present one" };
    format!("\nMeans over seeds, ± their standard deviation. Program: {}{age}.\n", revision_of(&row.program))
}

/// README and all pages.
pub(super) fn pages() -> Result<Vec<PathBuf>> {
    let mut pages = vec![in_repository("README.md")];
    for entry in fs::read_dir(in_repository("docs"))? {
        let path = entry?.path();
        if path.extension().is_some_and(|extension| extension == "md") {
            pages.push(path);
        }
    }
    pages.sort();
    Ok(pages)
}

/// A page with its blocks filled.
fn filled(plan: &Plan, page: &Path, text: &str) -> Result<String> {
    let (mut done, mut rest) = (String::new(), text);
    while let Some(begin) = rest.find(BEGIN) {
        let named = &rest[begin + BEGIN.len()..];
        let end_of_name = named.find(BEGIN_END).with_context(|| format!("{}: a block has no name", page.display()))?;
        let name = &named[..end_of_name];
        let inside = begin + BEGIN.len() + end_of_name + BEGIN_END.len();
        let end = rest[inside..].find(END).with_context(|| format!("{}: table {name} has no end", page.display()))?;
        let of_plan = || plan.tables.iter().find(|table| table.name == name).map(Table::text);
        let table = decoder::table(name).or_else(of_plan);
        let table = table.with_context(|| format!("{}: no table is called {name}", page.display()))??;
        done += &rest[..inside];
        done += &format!("\n{table}\n");
        rest = &rest[inside + end..];
        done += END;
        rest = &rest[END.len()..];
    }
    Ok(done + rest)
}

/// All pages that have blocks: the guides, and the decoder's page.
fn pages_with_blocks() -> Result<Vec<PathBuf>> {
    Ok([pages()?, vec![in_repository("decoder-core/README.md")]].concat())
}

pub(super) fn write(plan: &Plan) -> Result<()> {
    for page in pages_with_blocks()? {
        let text = fs::read_to_string(&page)?;
        let filled = filled(plan, &page, &text)?;
        if filled != text {
            fs::write(&page, filled)?;
        }
    }
    Ok(())
}

/// Blocks that say something else than their CSVs.
pub(super) fn faults(plan: &Plan) -> Result<Vec<String>> {
    let mut faults = Vec::new();
    for page in pages_with_blocks()? {
        let text = fs::read_to_string(&page)?;
        if filled(plan, &page, &text)? != text {
            faults.push(format!(
                "{}: a block is not what its CSV says; run `cargo run -p tools --bin figures -- write`",
                page.display()
            ));
        }
    }
    Ok(faults)
}

/// A page without its blocks.
pub(super) fn outside(text: &str) -> String {
    let mut kept = String::new();
    let mut inside = false;
    for line in text.lines() {
        inside |= line.starts_with(BEGIN);
        kept += if inside { "" } else { line };
        kept += "\n";
        inside &= !line.starts_with(END);
    }
    kept
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(seed: u64, psnr_db: Option<f64>, program: &str) -> Row {
        Row { seed, psnr_db, bytes: psnr_db.map(|_| 1234.0), program: program.to_owned(), ..Row::default() }
    }

    #[test]
    fn a_cell_is_the_mean_and_the_deviation_over_seeds() {
        let rows = [row(1, Some(30.0), ""), row(2, Some(31.0), "")];
        let of = |rows: &[&Row]| column("psnr_db").unwrap().cell(rows);
        assert_eq!(of(&[&rows[0], &rows[1]]), "30.50 ± 0.71");
        assert_eq!(of(&[&rows[0]]), "30.00");
        assert_eq!(of(&[]), "not run");
    }

    #[test]
    fn a_table_shows_the_newest_program_alone_and_says_if_there_is_a_newer_one() {
        let rows = [row(1, Some(30.0), "0.1.0 r9 1a2b3c4"), row(2, Some(31.0), "0.1.0 r10"), row(3, None, "")];
        let shown: Vec<u64> = of_the_newest_program(&rows).iter().map(|row| row.seed).collect();
        assert_eq!(shown, [2]);
        assert!(of_the_newest_program(&rows[2..]).is_empty());
        assert!(caption(&[&row(1, Some(30.0), "0.0.9 r0")]).contains("0.0.9 r0, older than the present one"));
        let now = row(1, Some(30.0), &format!("0.1.0 r{REVISION} 1a2b3c4-dirty"));
        assert!(caption(&[&now]).ends_with(&format!("Program: 0.1.0 r{REVISION}.\n")));
    }

    #[test]
    fn what_stands_outside_of_blocks_is_kept() {
        let text = "a\n<!-- table x -->\n30.1 dB\n<!-- end of table -->\nb\n";
        assert_eq!(outside(text).split_whitespace().collect::<String>(), "ab");
    }
}
