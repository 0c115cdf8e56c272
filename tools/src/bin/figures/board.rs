//! What a bundle's frames take on an emulated board.

use std::fs;
use std::path::Path;
use std::process::Command;

use anyhow::{Context as _, Result};

use super::{in_repository, said_by};

/// Instructions of the slowest frame.
///
/// * `out`: folder for the firmware's frames and counts, which are not made again.
pub(super) fn instructions(bundle: &Path, board: &str, ram_kib: u32, out: &Path) -> Result<f64> {
    let table = out.join("table.csv");
    if !table.exists() {
        fs::create_dir_all(out)?;
        let mut script = Command::new(in_repository("firmware-example/measure.sh"));
        script.arg(bundle).args([board, &ram_kib.to_string(), ""]).arg(out);
        // Where `tools/ci.sh firmware` installs what the firmware is linked and read with.
        let tools = in_repository("target/tools/bin").display().to_string();
        script.env("PATH", format!("{tools}:{}", std::env::var("PATH").unwrap_or_default()));
        fs::write(&table, said_by(&mut script)?)?;
    }
    let mut frames: Vec<(String, f64)> = Vec::new();
    for record in csv::Reader::from_path(&table)?.into_records() {
        let record = record?;
        let (frame, instructions) = (&record[7], record[9].parse::<f64>()?);
        match frames.iter_mut().find(|(other, _)| other == frame) {
            Some((_, sum)) => *sum += instructions,
            None => frames.push((frame.to_owned(), instructions)),
        }
    }
    let drawn = frames.iter().filter(|(frame, _)| frame != "-").map(|(_, sum)| *sum);
    drawn.reduce(f64::max).with_context(|| format!("{} has no frame", table.display()))
}
