//! Files of splats of other programs, other versions and other units.

use std::fs;

use crate::case::{Case, TRAIN};

/// Centres of a .ply that `export` wrote, and its colours' constant coefficients.
fn rows(case: &Case, name: &str) -> Vec<[f32; 6]> {
    let (gaussians, _) = pocketsplat_gaussians::read(&case.folder.join(name), None).unwrap();
    let n = gaussians.degree.n_coefficients();
    let colours = gaussians.harmonics.chunks_exact(n).map(|set| set[0]);
    gaussians.centres.iter().zip(colours).map(|(p, c)| [p[0], p[1], p[2], c[0], c[1], c[2]]).collect()
}

/// Mean centre of the Gaussians whose largest colour is this channel.
fn arm(rows: &[[f32; 6]], channel: usize) -> [f32; 3] {
    let is_of = |row: &&[f32; 6]| (0..3).all(|other| other == channel || row[3 + other] < row[3 + channel] - 0.5);
    let of: Vec<_> = rows.iter().filter(is_of).collect();
    assert!(!of.is_empty(), "no Gaussian of channel {channel}");
    [0, 1, 2].map(|axis| of.iter().map(|row| row[axis]).sum::<f32>() / of.len() as f32)
}

#[test]
fn axes_of_spz_are_said_and_chosen() {
    let Some(case) = Case::find("spz-axes-of-the-ply") else { return };
    let expected = rows(&case, "axes.ply");
    for file in ["axes3.spz", "axes4.spz"] {
        let out = format!("{file}.ply");
        case.run(&["export", file, "--spz-axes", "as-in-ply", "-o", &out]).succeeds(&[]);
        let found = rows(&case, &out);
        for channel in 0..3 {
            let (a, b) = (arm(&expected, channel), arm(&found, channel));
            assert!(a.iter().zip(b).all(|(a, b)| (a - b).abs() < 0.02), "{file}, channel {channel}: {a:?} and {b:?}");
        }
        case.run(&["export", file, "-o", "default.ply", "--overwrite"]).succeeds(&["axes", "--spz-axes"]);
    }
}

#[test]
fn formats_of_others_are_read_or_named() {
    let Some(case) = Case::find("splats-in-other-formats") else { return };
    for file in ["axes.compressed.ply", "axes.splat", "axes_sog/meta.json", "axes.glb"] {
        case.run(&["export", file, "-o", "out.ply", "--overwrite"]).succeeds(&[]);
        assert_eq!(rows(&case, "out.ply").len(), 60, "{file}");
    }
    for args in [["export", "axes.ksplat", "-o", "x.spz"], ["import", "axes.ksplat", "-o", "x.psb"]] {
        case.run(&args).refuses(&["splat-transform"]);
    }
}

#[test]
fn what_converters_write_is_read() {
    let Some(case) = Case::find("splat-transform-opaque-infinite") else { return };
    for file in ["axes_inf.ply", "axes_inf_n.ply", "axes.compressed.ply"] {
        case.run(&["export", file, "-o", "out.spz", "--overwrite"]).succeeds(&[]);
    }
    case.run(&["export", "axes_inf.ply", "-o", "out.spz", "--overwrite"]).says(&["warning", "opaque"]);
}

#[test]
fn versions_of_spz_are_read_or_have_a_remedy() {
    for name in ["spz-version-1", "spz-version-3-not-gzipped"] {
        let Some(case) = Case::find(name) else { return };
        let said = case.run(&["export", "splats.spz", "-o", "out.ply"]);
        if said.code != Some(0) {
            said.refuses(&["splat-transform"]);
        }
    }
}

#[test]
fn a_comment_that_is_not_utf_8_is_a_comment() {
    let Some(case) = Case::find("ply-comment-not-utf8") else { return };
    case.run(&["export", "splats.ply", "-o", "out.spz"]).succeeds(&[]);
}

#[test]
fn converted_line_endings_are_named() {
    let Some(case) = Case::find("ply-damaged-by-line-endings") else { return };
    case.run(&["export", "splats.ply", "-o", "out.spz"]).refuses(&["line endings", "binary"]);
}

#[test]
fn pointers_and_pages_are_named() {
    for (name, file, words) in [
        ("git-lfs-pointer-ply", "splats.ply", ["Git LFS pointer", "git lfs pull"]),
        ("web-page-named-spz", "splats.spz", ["web page", "again"]),
    ] {
        let Some(case) = Case::find(name) else { return };
        case.run(&["import", file, "-o", "out.psb"]).refuses(&words);
        // The same in every place where such a file is read.
        for other in ["a.ply", "a.spz", "a.sog", "a.psb"] {
            fs::copy(case.folder.join(file), case.folder.join(other)).unwrap();
            case.run(&["inspect", other]).refuses(&words);
        }
    }
}

#[test]
fn units_that_a_format_cannot_hold() {
    let Some(case) = Case::find("ply-in-micrometres") else { return };
    let said = case.run(&["export", "splats.ply", "-o", "out.spz"]);
    said.says(&["scale"]);
    if said.code == Some(0) {
        said.says(&["warning"]);
    }
}

#[test]
fn coordinates_that_a_format_cannot_hold() {
    let Some(case) = Case::find("colmap-coordinates-of-a-map") else { return };
    case.run(&TRAIN).trained(crate::TRAINED_DB);
    for name in ["out.ply", "out.spz"] {
        let said = case.run(&["export", "out.psb", "capture", "-o", name]);
        said.says(&["offset"]);
    }
}
