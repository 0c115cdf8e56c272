//! Files of real trouble that other programs wrote, where the folder of them is.
//!
//! Looked for in `$POCKETSPLAT_CASES`, then in `../shared/cases` beside the workspace. Each kind also has an instance of its own in the unit
//! tests, which need no folder.

use std::io::Write as _;
use std::path::{Path, PathBuf};

use pocketsplat_gaussians::{Gaussians, Notes, SpzAxes, read};

fn cases() -> Option<PathBuf> {
    let beside = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/cases");
    let root = std::env::var_os("POCKETSPLAT_CASES").map_or(beside, PathBuf::from);
    if root.is_dir() {
        return Some(root);
    }
    // Not `eprintln!`, which a test that passes keeps to itself.
    let _ = writeln!(
        std::io::stderr(),
        "SKIPPED: no cases at {}; set POCKETSPLAT_CASES to a folder that has them",
        root.display()
    );
    None
}

fn whole(path: &Path, axes: Option<SpzAxes>) -> (Gaussians, Notes) {
    read(path, axes).unwrap_or_else(|error| panic!("{error}"))
}

#[test]
fn files_that_mean_something_are_read() {
    let Some(root) = cases() else { return };
    for (file, n, said) in [
        ("ply-comment-not-utf8/splats.ply", 1500, ""),
        ("ply-opaque-logit-infinite/splats.ply", 1500, "opacities have the logit +inf"),
        ("ply-rotation-zero/splats.ply", 1500, "1 of 1500 rotations are 0"),
        ("splat-transform-opaque-infinite/axes_inf.ply", 60, "1 of 60 opacities"),
        ("splat-transform-opaque-infinite/axes_inf_n.ply", 60, "1 of 60 opacities"),
        ("splats-in-other-formats/axes.compressed.ply", 60, ""),
        ("splats-in-other-formats/axes.splat", 60, ""),
        ("splats-in-other-formats/axes.glb", 60, "1 of 60 opacities"),
        ("splats-in-other-formats/axes_sog/meta.json", 60, ""),
        ("splats-in-other-formats/axes_sog", 60, ""),
        ("spz-version-1/splats.spz", 565, ""),
        ("spz-version-3-not-gzipped/splats.spz", 800, ""),
    ] {
        let (gaussians, notes) = whole(&root.join(file), None);
        assert_eq!((gaussians.len(), gaussians.check()), (n, Ok(())), "{file}");
        let is_said = notes.warnings.iter().any(|warning| warning.contains(said));
        assert!(is_said || said.is_empty() && notes.warnings.is_empty(), "{file}: {notes:?}");
    }
}

/// Red along x, green along y, blue along z, each to 1.
#[test]
fn arms_of_all_formats_point_the_same_way() {
    let Some(root) = cases() else { return };
    let reference = whole(&root.join("spz-axes-of-the-ply/axes.ply"), None).0;
    let tip = |gaussians: &Gaussians, axis: usize| {
        gaussians
            .centres
            .iter()
            .map(|centre| centre[axis])
            .fold(0.0f32, |tip, x| if x.abs() > tip.abs() { x } else { tip })
    };
    for (file, axes) in [
        ("spz-axes-of-the-ply/axes3.spz", Some(SpzAxes::AsInPly)),
        ("spz-axes-of-the-ply/axes4.spz", Some(SpzAxes::AsInPly)),
        ("splats-in-other-formats/axes.compressed.ply", None),
        ("splats-in-other-formats/axes.splat", None),
        ("splats-in-other-formats/axes.glb", None),
        ("splats-in-other-formats/axes_sog", None),
    ] {
        let (gaussians, _) = whole(&root.join(file), axes);
        for axis in 0..3 {
            let (found, wanted) = (tip(&gaussians, axis), tip(&reference, axis));
            assert!((found - wanted).abs() < 1e-2, "{file}: axis {axis} ends at {found}, not {wanted}");
        }
    }
    // Without the option a line says what was assumed, and what says otherwise.
    let (_, notes) = whole(&root.join("spz-axes-of-the-ply/axes3.spz"), None);
    assert!(notes.remarks[0].contains("`--spz-axes as-in-ply`"), "{notes:?}");
}

#[test]
fn files_that_are_something_else_are_named() {
    let Some(root) = cases() else { return };
    for (file, said) in [
        ("ply-damaged-by-line-endings/splats.ply", "damaged by a conversion of line endings"),
        ("web-page-named-spz/splats.spz", "a web page"),
        ("git-lfs-pointer-ply/splats.ply", "`git lfs pull`"),
        ("splats-in-other-formats/axes.ksplat", "`splat-transform "),
    ] {
        let error = read(&root.join(file), None).expect_err(file).to_string();
        assert!(error.contains(said), "{file}: {error}");
    }
}
