//! Files of Gaussians of every kind: what is read, what is written, what that lost, and what is said of it.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::OnceLock;

use pocketsplat_gaussians::{Format, Gaussians, Notes};

use crate::fixture::{capture, fails, folder, pocketsplat, text, undisturbed};

/// What a command says on stdout, as JSON, and on stderr.
fn measured(command: &mut Command) -> (serde_json::Value, String) {
    let output = command.arg("--json").output().unwrap();
    let said = text(&output.stderr);
    assert!(output.status.success(), "{said}");
    (serde_json::from_slice(&output.stdout).unwrap(), said)
}

/// A bundle's Gaussians as a .ply in the frame of its capture.
fn splats() -> &'static Path {
    static SPLATS: OnceLock<PathBuf> = OnceLock::new();
    SPLATS.get_or_init(|| {
        let home = folder("splats");
        let (bundle, output) = (home.join("a.psb"), home.join("a.ply"));
        fs::write(&bundle, undisturbed()).unwrap();
        let mut command = pocketsplat();
        command.arg("export").arg(&bundle).arg(capture()).arg("-o").arg(&output).args(["--iterations", "20"]);
        assert!(command.output().unwrap().status.success());
        output
    })
}

fn gaussians() -> (Gaussians, Notes) {
    pocketsplat_gaussians::read(splats(), None).unwrap()
}

fn convert(from: &Path, to: &Path) -> Command {
    let mut command = pocketsplat();
    command.arg("export").arg(from).arg("-o").arg(to);
    command
}

#[test]
fn axes_of_a_spz_are_said_and_what_is_wrong_with_them_is_noticed() {
    let home = folder("spz_axes");
    let spz = home.join("a.spz");
    let eval = |axes: &[&str]| {
        measured(pocketsplat().arg("eval").arg(&spz).arg(capture()).args(["--max-resolution", "32"]).args(axes))
    };
    let (_, said) = measured(convert(splats(), &spz).args(["--spz-axes", "as-in-ply"]));
    assert!(said.contains("a.spz: its axes are written as-in-ply"), "{said}");
    let (right, said) = eval(&[]);
    assert!(said.contains("as its record says"), "{said}");
    let (wrong, said) = eval(&["--spz-axes", "as-described"]);
    let of = |value: &serde_json::Value, name: &str| value[name].as_f64().unwrap();
    // The bundle has seen few steps: 16 dB are all that it has.
    assert!(of(&wrong, "psnr_db") < 14.0 && of(&right, "psnr_db") > 15.0, "{wrong} {right}");
    assert!((of(&wrong, "psnr_with_other_axes_db") - of(&right, "psnr_db")).abs() < 0.01, "{wrong}");
    assert!(said.contains("read it with `--spz-axes as-in-ply`"), "{said}");
    assert!(right.get("psnr_with_other_axes_db").is_none());
    let said = fails(
        pocketsplat().arg("eval").arg(splats().with_extension("psb")).arg(capture()).args(["--spz-axes", "as-in-ply"]),
    );
    assert!(said.contains("is no .spz"), "{said}");
}

#[test]
fn what_a_conversion_loses_is_measured_and_its_reason_named() {
    let home = folder("conversion_loss");
    for format in Format::ALL {
        let (said, _) = measured(&mut convert(splats(), &home.join(format!("a.{}", format.extension()))));
        let psnr = said["psnr_to_source_db"].as_f64().unwrap();
        assert!(psnr > 30.0 && (format != Format::Ply || psnr == 100.0), "{format:?}: {said}");
        assert_eq!((&said["n_left_out"], &said["n_views"]), (&0.into(), &16.into()));
    }
    // Colours far beyond what a .spz holds.
    let (mut gaussians, notes) = gaussians();
    let n = gaussians.degree.n_coefficients();
    gaussians.harmonics.iter_mut().step_by(n).for_each(|colour| colour[0] = 8.0);
    gaussians.harmonics.iter_mut().skip(1).step_by(n).for_each(|colour| colour[0] = -12.0);
    let loud = home.join("loud.ply");
    fs::write(&loud, Format::Ply.write(&gaussians, &notes).unwrap().bytes).unwrap();
    let (report, said) = measured(&mut convert(&loud, &home.join("loud.spz")));
    assert!(report["loss_at_30_db"].as_f64().unwrap() > 0.5, "{report}");
    assert!(said.contains("lie beyond ±1") && said.contains("lie beyond ±3.33"), "{said}");
    assert!(said.contains("by which a scene of 30 dB loses") && said.contains("most of it in its "), "{said}");
    let again = home.join("loud-again.spz");
    let refused = convert(&loud, &again).args(["--max-loss", "0.5", "--json"]).output().unwrap();
    let said = String::from_utf8(refused.stderr).unwrap();
    assert_eq!(refused.status.code(), Some(1), "{said}");
    assert!(said.contains("loud-again.spz is written and loses") && said.contains("a .ply loses none"), "{said}");
    let printed: serde_json::Value = serde_json::from_slice(&refused.stdout).expect("the result alone");
    assert_eq!(printed["loss_at_30_db"], report["loss_at_30_db"]);
    assert_eq!(fs::read(&again).unwrap(), fs::read(home.join("loud.spz")).unwrap(), "written all the same");
    measured(convert(&loud, &home.join("same.ply")).args(["--max-loss", "0"]));
    let said = fails(convert(&loud, &home.join("none.ply")).args(["--max-loss", "-1"]));
    assert!(said.contains("--max-loss -1: needs a number of decibels") && !home.join("none.ply").exists(), "{said}");
}

#[test]
fn strays_and_units_do_not_spoil_a_file() {
    let home = folder("strays");
    let (whole, notes) = gaussians();
    let mut gaussians = whole.clone();
    gaussians.centres[0] = [1e6, 0.0, 0.0];
    let stray = home.join("stray.ply");
    fs::write(&stray, Format::Ply.write(&gaussians, &notes).unwrap().bytes).unwrap();
    let (report, said) = measured(&mut convert(&stray, &home.join("stray.spz")));
    assert!(report["n_left_out"] == 1 && report["loss_at_30_db"].as_f64().unwrap() < 0.5, "{report}");
    assert!(said.contains("1 of ") && said.contains("left out"), "{said}");
    let mut micrometres = whole;
    micrometres.centres.iter_mut().for_each(|centre| *centre = centre.map(|x| 1e6 * x));
    micrometres.log_scales.iter_mut().for_each(|scales| *scales = scales.map(|scale| scale + 1e6f32.ln()));
    let (small, spz, back) = (home.join("micro.ply"), home.join("micro.spz"), home.join("back.ply"));
    fs::write(&small, Format::Ply.write(&micrometres, &notes).unwrap().bytes).unwrap();
    let (report, said) = measured(&mut convert(&small, &spz));
    assert!(report["loss_at_30_db"].as_f64().unwrap() < 0.5, "{report}");
    assert!(
        report["frame"]["scale"].as_f64().unwrap() > 1e4 && said.contains("not the scene's own"),
        "{report} {said}"
    );
    // The file says where it lies, so it goes back to where it came from.
    measured(&mut convert(&spz, &back));
    let (back, notes) = pocketsplat_gaussians::read(&back, None).unwrap();
    let frame = notes.frame;
    for (a, b) in back.centres.iter().zip(&micrometres.centres) {
        for axis in 0..3 {
            let there = frame.offset[axis] + frame.scale * f64::from(a[axis]);
            assert!((there - f64::from(b[axis])).abs() < 100.0, "{there} for {}", b[axis]);
        }
    }
}

#[test]
fn splats_are_inspected() {
    let spz = folder("inspect_splats").join("a.spz");
    measured(&mut convert(splats(), &spz));
    let (report, _) = measured(pocketsplat().arg("inspect").arg(&spz));
    let (gaussians, _) = gaussians();
    assert_eq!((&report["n_gaussians"], &report["sh_degree"]), (&gaussians.len().into(), &3.into()));
    assert!(report["format"] == ".spz, version 3" && report["parts_packed_by"] == "gzip", "{report}");
    assert!(report["x_percentiles"].as_array().unwrap().len() == 5 && report["up"].as_str().unwrap().starts_with("-y"));
    let words = pocketsplat().arg("inspect").arg(splats()).output().unwrap();
    let words = text(&words.stdout);
    for expected in [".ply, little-endian", "strays", "opacities", "up ", "a .spz", "comment", "harmonics"] {
        assert!(words.contains(expected), "{expected}: {words}");
    }
    let said = fails(pocketsplat().args(["inspect", "--hexdump"]).arg(&spz));
    assert!(said.contains("leave out --hexdump"), "{said}");
}

#[test]
fn names_that_lie_are_seen_through() {
    let home = folder("names");
    let (bundle, splats_as_bundle) = (home.join("bundle.ply"), home.join("splats.psb"));
    fs::write(&bundle, undisturbed()).unwrap();
    fs::copy(splats(), &splats_as_bundle).unwrap();
    let said = fails(pocketsplat().arg("import").arg(&bundle).arg("-o").arg(home.join("out.psb")));
    assert!(said.contains("is a bundle (.psb), no file of Gaussians") && said.contains("pocketsplat export"), "{said}");
    let said = fails(pocketsplat().arg("fit").arg(&splats_as_bundle).args(["--ram", "100KiB"]));
    assert!(said.contains("pocketsplat import"), "{said}");
    let (_, said) = measured(&mut convert(&splats_as_bundle, &home.join("b.sog")));
    assert!(said.contains("it is a .ply file, whatever its name says"), "{said}");
    let said = fails(&mut convert(splats(), &home.join("b.compressed.ply")));
    assert!(said.contains("splat-transform scene.ply") && said.contains("b.compressed.ply"), "{said}");
    assert!(!home.join("b.compressed.ply").exists());
    let page = home.join("page.spz");
    fs::write(&page, "<!DOCTYPE html><html><title>404</title></html>").unwrap();
    let said = fails(pocketsplat().arg("import").arg(&page).arg("-o").arg(home.join("out.psb")));
    assert!(said.contains("a web page") && said.contains("fetch the file itself again"), "{said}");
}
