//! Writes the frequency tables of integer Gaussians (`decoder-core/src/entropy/normal_tables.rs`), or checks them.
//!
//!     cargo run -p tools --bin normal_tables -- --write
//!     cargo run -p tools --bin normal_tables -- --check

use std::fmt::Write as _;
use std::path::Path;

use anyhow::{Result, bail};
use pocketsplat_core::entropy::{FREQUENCY_TOTAL, N_PHASES, N_SCALES, SCALE_ONE};

const FILE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../decoder-core/src/entropy/normal_tables.rs");

fn main() -> Result<()> {
    let path = Path::new(FILE);
    let text = source();
    match std::env::args().nth(1).as_deref() {
        Some("--write") => Ok(std::fs::write(path, text)?),
        Some("--check") if std::fs::read_to_string(path)? == text => Ok(()),
        Some("--check") => bail!("{FILE} is not what this program writes; run it with --write"),
        _ => bail!("one of --write, --check"),
    }
}

fn source() -> String {
    let (mut reach, mut first, mut ends) = (Vec::new(), Vec::new(), Vec::new());
    for scale in 0..N_SCALES {
        let sigma = 2f64.powf((scale as f64 - f64::from(SCALE_ONE)) / 8.0);
        let farthest = (4.0 * sigma).ceil() as i32 + 2;
        reach.push(farthest as usize);
        first.push(ends.len());
        for phase in 0..N_PHASES {
            let mut sum = 0;
            ends.extend(frequencies(phase as f64 / 8.0, sigma, farthest).into_iter().map(|frequency| {
                sum += frequency;
                sum
            }));
        }
    }
    let mut text = String::from(
        "//! Tables of [`normal`](super::normal), written by `cargo run -p tools --bin normal_tables -- --write`.\n",
    );
    array(&mut text, "`[scale]` D, the farthest symbol that has an entry.", "REACH: [u8; N_SCALES]", &reach);
    array(&mut text, "`[scale]` where its tables begin in [`ENDS`].", "FIRST: [u16; N_SCALES]", &first);
    let name = format!("ENDS: [u16; {}]", ends.len());
    array(&mut text, "Per scale and phase `[2D + 1]` sums of frequencies.", &name, &ends);
    text.replacen("\n\n", "\n\nuse super::normal::N_SCALES;\n\n", 1)
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

fn array(text: &mut String, doc: &str, name: &str, values: &[usize]) {
    let _ = write!(text, "\n/// {doc}\n#[rustfmt::skip]\npub(super) static {name} = [");
    for row in values.chunks(20) {
        text.push_str("\n   ");
        for value in row {
            let _ = write!(text, " {value},");
        }
    }
    text.push_str("\n];\n");
}
