//! Writes the frequency tables of integer Gaussians, or checks them: little-endian u16 beside the format's description, which names
//! their checksum.
//!
//!     cargo run -p tools --bin normal_tables -- --write
//!     cargo run -p tools --bin normal_tables -- --check

use anyhow::{Result, bail, ensure};
use pocketsplat_format::bundle::crc32;
use pocketsplat_format::entropy::{EIGHTHS, FREQUENCY_TOTAL, N_PHASES, N_SCALES, SCALE_ONE};

const FILE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../decoder-format/src/bundle/normal_tables.bin");
const DOCUMENT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../decoder-format/src/bundle/FORMAT.md");

fn main() -> Result<()> {
    let tables: Vec<u8> = tables().iter().flat_map(|bound| bound.to_le_bytes()).collect();
    let crc = format!("{:#010X}", crc32(&tables)).replacen("0X", "0x", 1);
    match std::env::args().nth(1).as_deref() {
        Some("--write") => std::fs::write(FILE, tables)?,
        Some("--check") => {
            ensure!(std::fs::read(FILE)? == tables, "{FILE} is not what this program writes; run it with --write");
            ensure!(std::fs::read_to_string(DOCUMENT)?.contains(&crc), "{DOCUMENT} lacks the tables' CRC {crc}");
        }
        _ => bail!("one of --write, --check"),
    }
    Ok(())
}

/// The bounds of all tables.
fn tables() -> Vec<u16> {
    let mut all_bounds = Vec::new();
    for scale in 0..N_SCALES {
        let sigma = 2f64.powf((scale as f64 - f64::from(SCALE_ONE)) / 8.0);
        let reach = (4.0 * sigma).ceil() as i32 + 2;
        for phase in 0..N_PHASES {
            let bounds = bounds(&frequencies(phase as f64 / f64::from(EIGHTHS), sigma, reach));
            // None is above 4096.
            all_bounds.extend(bounds.into_iter().map(|bound| bound as u16));
        }
    }
    all_bounds
}

/// Where each entry begins, where the escape begins, and where it ends.
fn bounds(frequencies: &[usize]) -> Vec<usize> {
    let ends = frequencies.iter().scan(0, |sum, frequency| {
        *sum += frequency;
        Some(*sum)
    });
    [0].into_iter().chain(ends).chain([FREQUENCY_TOTAL.into()]).collect()
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
