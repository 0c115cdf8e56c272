//! `import` of splats with one bad value, and where its cameras stand.

use crate::IMPORTED_DB;
use crate::case::{Case, IMPORT};

#[test]
fn one_bad_gaussian_costs_nothing() {
    for name in ["ply-one-stray", "ply-opaque-logit-infinite", "ply-rotation-zero"] {
        let Some(case) = Case::find(name) else { return };
        let said = case.run(&IMPORT);
        said.imported(IMPORTED_DB);
        said.says(&["warning", " 1 "]);
    }
}

#[test]
fn a_figure_stands_upright() {
    let Some(case) = Case::find("import-figure-on-its-side") else { return };
    let import =
        ["import", "figure.ply", "-o", "f.psb", "--resolution", "64x64", "--views", "24", "--iterations", "150"];
    case.run(&import).succeeds(&["--up"]);
    case.run(&["render", "f.psb", "--preview", "-o", "f.png"]).succeeds(&[]);
    let picture = image::open(case.folder.join("f.png")).unwrap().to_rgb8();
    // The head is red, the feet are blue: where each is seen, as the mean of its rows.
    let mean_row = |channel: usize, other: usize| {
        let rows = picture.enumerate_pixels().filter(|(_, _, p)| p[channel] > 60 && p[channel] / 2 > p[other]);
        let (sum, n) = rows.fold((0.0, 0), |(sum, n), (_, y, _)| (sum + f64::from(y), n + 1));
        assert!(n > 0, "channel {channel} is not seen");
        sum / f64::from(n)
    };
    let (head, feet) = (mean_row(0, 2), mean_row(2, 0));
    assert!(head + f64::from(picture.height()) / 4.0 < feet, "head at row {head}, feet at {feet}");
}

#[test]
fn a_hollow_object_is_seen_from_outside() {
    let Some(case) = Case::find("import-hollow-object") else { return };
    let import =
        ["import", "ball.ply", "-o", "ball.psb", "--resolution", "64x64", "--views", "24", "--iterations", "100"];
    let said = case.run(&import);
    said.succeeds(&["around", "--inside"]);
}
