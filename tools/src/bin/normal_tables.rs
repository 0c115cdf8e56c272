//! Writes the frequency tables of integer Gaussians, or checks them: as source (`decoder-format/src/entropy/normal/tables.rs`), and as
//! little-endian u16 beside the format's description, whose checksum it names.
//!
//!     cargo run -p tools --bin normal_tables -- --write
//!     cargo run -p tools --bin normal_tables -- --check

use std::fmt::Write as _;

use anyhow::{Result, bail, ensure};
use pocketsplat_format::bundle::crc32;
use pocketsplat_format::entropy::{
    EIGHTHS, FREQUENCY_TOTAL, N_NORMAL_SHORT_CUTS, N_PHASES, N_SCALES, NORMAL_WINDOW, SCALE_ONE,
};

const SOURCE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../decoder-format/src/entropy/normal/tables.rs");
const BINARY: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../decoder-format/src/bundle/normal_tables.bin");
const DOCUMENT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../decoder-format/src/bundle/FORMAT.md");

fn main() -> Result<()> {
    let (scales, bounds) = tables();
    let binary: Vec<u8> = bounds.iter().flat_map(|bound| bound.to_le_bytes()).collect();
    let crc = format!("{:#010X}", crc32(&binary)).replacen("0X", "0x", 1);
    let files = [(SOURCE, source(&scales, &bounds).into_bytes()), (BINARY, binary)];
    match std::env::args().nth(1).as_deref() {
        Some("--write") => files.iter().try_for_each(|(path, bytes)| std::fs::write(path, bytes))?,
        Some("--check") => {
            for (path, bytes) in files {
                ensure!(std::fs::read(path)? == bytes, "{path} is not what this program writes; run it with --write");
            }
            ensure!(std::fs::read_to_string(DOCUMENT)?.contains(&crc), "{DOCUMENT} lacks the tables' CRC {crc}");
        }
        _ => bail!("one of --write, --check"),
    }
    Ok(())
}

/// The scales as source, and the bounds of all tables.
fn tables() -> (String, Vec<u16>) {
    let (mut scales, mut all_bounds) = (String::new(), Vec::new());
    for scale in 0..N_SCALES {
        let sigma = 2f64.powf((scale as f64 - f64::from(SCALE_ONE)) / 8.0);
        let reach = (4.0 * sigma).ceil() as i32 + 2;
        let tables = (0..N_PHASES).map(|phase| bounds(&frequencies(phase as f64 / 8.0, sigma, reach)));
        let tables: Vec<Vec<usize>> = tables.collect();
        let table_of = |delta: i32| all_bounds.len() + delta.unsigned_abs() as usize * (2 * reach as usize + 3);
        let first: Vec<usize> = (-EIGHTHS / 2..EIGHTHS / 2).map(table_of).collect();
        let short_cuts = short_cuts(&tables);
        let _ = write!(scales, "\n    Scale {{ first: {first:?}, reach: {reach}, short_cuts: {short_cuts:?} }},");
        // None is above 4096.
        all_bounds.extend(tables.concat().into_iter().map(|bound| bound as u16));
    }
    (scales, all_bounds)
}

/// * `scales`: as source. * `bounds`: of all tables.
fn source(scales: &str, bounds: &[u16]) -> String {
    // A decoder looks at as many from the start of any table.
    let bounds = [bounds, &[FREQUENCY_TOTAL; NORMAL_WINDOW]].concat();
    let mut text = String::from(
        "//! The tables, written by `cargo run -p tools --bin normal_tables -- --write`.

use super::{N_SCALES, Scale};

/// Of each scale where its tables begin in [`BOUNDS`], how far they reach, and short cuts into them.
#[rustfmt::skip]
pub(super) static SCALES: [Scale; N_SCALES] = [",
    );
    text.push_str(scales);
    let _ = write!(
        text,
        "\n];

/// Per scale and phase `[2D + 3]` where each entry begins, where the escape begins, and where it ends; padding at the end.
#[rustfmt::skip]
pub(super) static BOUNDS: [u16; {}] = [",
        bounds.len()
    );
    for row in bounds.chunks(20) {
        text.push_str("\n   ");
        for bound in row {
            let _ = write!(text, " {bound},");
        }
    }
    text.push_str("\n];\n");
    text
}

/// Where each entry begins, where the escape begins, and where it ends.
fn bounds(frequencies: &[usize]) -> Vec<usize> {
    let ends = frequencies.iter().scan(0, |sum, frequency| {
        *sum += frequency;
        Some(*sum)
    });
    [0].into_iter().chain(ends).chain([FREQUENCY_TOTAL.into()]).collect()
}

/// For each piece of the range the last entry that begins at or before the piece's start in all tables.
fn short_cuts(tables: &[Vec<usize>]) -> [usize; N_NORMAL_SHORT_CUTS] {
    std::array::from_fn(|piece| {
        let start = piece * usize::from(FREQUENCY_TOTAL) / N_NORMAL_SHORT_CUTS;
        let entry = |bounds: &Vec<usize>| bounds.partition_point(|&bound| bound <= start) - 1;
        tables.iter().map(entry).min().unwrap_or_default()
    })
}

/// The frequencies of −D..=D: masses scaled so that, rounded and at least 1 each, they and the escape fill the range.
fn frequencies(mean: f64, sigma: f64, farthest: i32) -> Vec<usize> {
    let total = usize::from(FREQUENCY_TOTAL);
    // Exact in the tails on both sides of the mean, where 1 − Φ would cancel.
    let mass = |low: f64, high: f64| {
        let tail = |x: f64| 0.5 * libm::erfc(x / std::f64::consts::SQRT_2);
        if low > 0.0 { tail(low) - tail(high) } else { tail(-high) - tail(-low) }
    };
    let edge = |d: i32, half: f64| (f64::from(d) + half - mean) / sigma;
    let mut masses: Vec<f64> = (-farthest..=farthest).map(|d| mass(edge(d, -0.5), edge(d, 0.5))).collect();
    masses.push(1.0 - mass(edge(-farthest, -0.5), edge(farthest, 0.5)));
    let rounded =
        |factor: f64| -> Vec<usize> { masses.iter().map(|mass| ((mass * factor).round() as usize).max(1)).collect() };
    // The largest factor whose frequencies still fit; ties of the rounding leave a few slots over.
    let (mut low, mut high) = (0.0, total as f64);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if rounded(middle).iter().sum::<usize>() <= total { low = middle } else { high = middle }
    }
    let mut frequencies = rounded(low);
    let left_over = total - frequencies.iter().sum::<usize>();
    let largest = (0..masses.len()).max_by(|&a, &b| masses[a].total_cmp(&masses[b])).expect("at least one entry");
    frequencies[largest] += left_over;
    frequencies.pop();
    frequencies
}
