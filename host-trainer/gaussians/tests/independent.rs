//! Files as a reader sees them that shares no line with this crate: `independent_reader.py`.
//!
//! It needs python3, and dwebp of libwebp for .sog. `POCKETSPLAT_NEEDS_READERS=1` fails where they are missing; else the test says so and
//! ends.

use std::path::Path;
use std::process::Command;

use pocketsplat_gaussians::{Degree, Format, Gaussians, Notes};
use serde::Deserialize;

#[derive(Deserialize)]
struct Read {
    compensation: bool,
    degree: usize,
    gaussians: Vec<ReadGaussian>,
}

#[derive(Deserialize)]
struct ReadGaussian {
    centre: [f32; 3],
    deviations: [f32; 3],
    rotation: [f32; 4],
    opacity: f32,
    harmonics: Vec<[f32; 3]>,
}

/// How far a format may be from the numbers that it was given: centre, ln of deviations, rotation (1 − |cos| of half the angle), opacity,
/// constant colour, harmonics of degree 1, and beyond.
fn tolerances(format: Format) -> [f32; 7] {
    match format {
        Format::Ply | Format::Glb => [1e-5; 7],
        Format::Spz => [1e-5, 0.032, 1e-5, 0.002, 0.014, 0.008, 0.008],
        Format::Sog => [1e-3, 0.02, 1e-4, 0.002, 0.01, 0.01, 0.01],
    }
}

/// 200 Gaussians; every 40th has the same colour, which a palette of a quarter of them can hold.
fn example(degree: Degree) -> Gaussians {
    let (n, n_coefficients) = (200, degree.n_coefficients());
    let wave = |index: usize, phase: f32| (index as f32 * 0.7 + phase).sin();
    Gaussians {
        degree,
        centres: (0..n).map(|i| [i as f32 * 0.02, 2.0 * wave(i, 1.3), -4.0 * wave(i, 2.9)]).collect(),
        log_scales: (0..n).map(|i| [0.1, 0.5, 0.9].map(|phase| -4.0 + 2.0 * wave(i, phase))).collect(),
        rotations: (0..n).map(|i| [0.2, 1.3, 2.9, 4.2].map(|phase| wave(3 * i, phase))).collect(),
        opacity_logits: (0..n).map(|i| 3.0 * wave(i, 0.4)).collect(),
        harmonics: (0..n * n_coefficients)
            .map(|i| [0.3, 0.6, 1.9].map(|phase| 0.8 * wave(i % (40 * n_coefficients), phase)))
            .collect(),
    }
}

fn runs(program: &str, argument: &str) -> bool {
    Command::new(program).arg(argument).output().is_ok_and(|output| output.status.success())
}

#[test]
fn an_independent_reader_finds_what_was_written() {
    let is_needed = std::env::var_os("POCKETSPLAT_NEEDS_READERS").is_some();
    for (program, argument) in [("python3", "--version"), ("dwebp", "-version")] {
        if !runs(program, argument) {
            assert!(!is_needed, "{program} is missing");
            eprintln!("{program} is missing, so nothing is read");
            return;
        }
    }
    let folder = tempfile::tempdir().expect("a folder");
    for (format, degree) in Format::ALL.into_iter().flat_map(|format| Degree::ALL.map(|degree| (format, degree))) {
        let gaussians = example(degree);
        let notes =
            Notes { compensation: degree == Degree::Two, comments: vec!["by a test".to_owned()], ..Notes::default() };
        let path = folder.path().join(format!("scene.{}", format.extension()));
        std::fs::write(&path, format.write(&gaussians, &notes).expect("fits").bytes).expect("room");
        let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/independent_reader.py");
        let output = Command::new("python3").arg(script).arg(&path).output().expect("python3 runs");
        assert!(output.status.success(), "{format:?}: {}", String::from_utf8_lossy(&output.stderr));
        let read: Read = serde_json::from_slice(&output.stdout).expect("JSON");
        assert_eq!((read.compensation, read.degree), (notes.compensation, degree.number()), "{format:?}");
        assert_eq!(read.gaussians.len(), gaussians.len(), "{format:?}");
        compare(format, &read.gaussians, &gaussians);
    }
}

/// Gaussians may come in any order; x tells the example's apart.
fn compare(format: Format, found: &[ReadGaussian], wanted: &Gaussians) {
    let [centre, log_scale, rotation, opacity, constant, first, beyond] = tolerances(format);
    for gaussian in found {
        let index = (gaussian.centre[0] / 0.02).round() as usize;
        let near = |what: &str, found: &[f32], wanted: &[f32], tolerance: f32| {
            for (a, b) in found.iter().zip(wanted) {
                assert!((a - b).abs() <= tolerance, "{format:?}, {what} of Gaussian {index}: {a}, written {b}");
            }
        };
        near("centre", &gaussian.centre, &wanted.centres[index], centre);
        near("ln scale", &gaussian.deviations.map(f32::ln), &wanted.log_scales[index], log_scale);
        let dot = |a: &[f32; 4], b: &[f32; 4]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f32>();
        let (q, p) = (&gaussian.rotation, &wanted.rotations[index]);
        near("rotation", &[dot(q, p).abs() / (dot(q, q) * dot(p, p)).sqrt()], &[1.0], rotation);
        near("opacity", &[gaussian.opacity], &[1.0 / (1.0 + (-wanted.opacity_logits[index]).exp())], opacity);
        for (number, (a, b)) in gaussian.harmonics.iter().zip(wanted.harmonics_of(index)).enumerate() {
            let tolerance = [constant, first, first, first].get(number).copied().unwrap_or(beyond);
            near(&format!("harmonic {number}"), a, b, tolerance);
        }
    }
}
