//! `--backbone 3dgs`: explicit Gaussians in place of a bundle.

use std::fs;
use std::path::Path;
use std::process::Command;

use crate::fixture::{ITERATIONS, capture, fails, folder, pocketsplat, resume, starts, succeeds, wait_for};
use crate::interruption::signal;

fn train(output: &Path) -> Command {
    let mut command = pocketsplat();
    command.arg("train").arg(capture()).arg("-o").arg(output);
    command.args(["--backbone", "3dgs", "--iterations", &ITERATIONS.to_string(), "--checkpoint-every", "0", "--json"]);
    command.args(["--set", "capture.n_random_points=2000"]);
    // Growth within so few iterations.
    for key in ["from=20", "interval=10", "gradient_threshold=1e-4"] {
        command.arg("--set").arg(format!("gaussians.density.{key}"));
    }
    command
}

#[test]
fn an_interrupted_run_ends_in_the_same_file_which_is_measured_and_drawn() {
    let home = folder("explicit");
    let (whole, output, run) = (home.join("whole.ply"), home.join("a.ply"), home.join("a.ply.run"));
    let result = train(&whole).output().unwrap();
    assert!(result.status.success());
    let result: serde_json::Value = serde_json::from_slice(&result.stdout).unwrap();
    let bytes = fs::read(&whole).unwrap();
    assert_eq!(result["file_bytes"], bytes.len());
    assert!(bytes.len() as f64 / result["n_gaussians"].as_f64().unwrap() < 62.0 * 4.0 + 1.0, "62 numbers each");
    assert_eq!(result["background"], "white", "as published");
    assert!(result["n_gaussians"].as_u64().is_some_and(|n| n > 2000), "it grew");
    assert!(result["n_test_views"].as_u64().unwrap() > 0 && result["ssim"].as_f64().unwrap() > 0.0);

    let mut child = starts(&mut train(&output));
    wait_for(&run, ITERATIONS / 3, &mut child);
    signal(&child, "TERM");
    assert_eq!(child.wait_with_output().unwrap().status.code(), Some(130));
    let said = succeeds(&mut resume(&run));
    assert!(said.contains("going on after iteration"), "{said}");
    assert!(fs::read(&output).unwrap() == bytes, "the same bytes");

    // As the run measured it: the file says how its photographs were prepared.
    let measured = pocketsplat().args(["eval", "--json"]).arg(&output).arg(capture()).output().unwrap();
    let measured: serde_json::Value = serde_json::from_slice(&measured.stdout).unwrap();
    assert_eq!(measured["psnr_db"], result["psnr_db"]);
    assert_eq!((&measured["bundle_bytes"], &measured["renderer"]), (&result["file_bytes"], &"explicit".into()));
    let picture = home.join("view.png");
    succeeds(pocketsplat().arg("render").arg(&output).arg(capture()).args(["--view", "0", "-o"]).arg(&picture));
    assert!(picture.is_file());
}

#[test]
fn what_makes_no_sense_is_refused_in_a_sentence() {
    let home = folder("explicit_refused");
    let output = home.join("a.ply");
    for (option, value) in
        [("--lambda", "0.1"), ("--ram", "100KiB"), ("--modules", "none"), ("--effects", "all"), ("--device", "gpu:7")]
    {
        let said = fails(train(&output).args([option, value]));
        assert!(said.contains(option) && said.contains("3dgs"), "{said}");
    }
    assert!(fails(&mut train(&home.join("a.psb"))).contains(".ply"));
    assert!(!home.join("a.ply.run").exists(), "nothing was begun");
    fs::write(&output, "nothing").unwrap();
    assert!(fails(pocketsplat().arg("fit").arg(&output)).contains("pocketsplat import"));
}

#[test]
fn splats_become_a_bundle_that_is_measured_against_them() {
    let home = folder("import");
    let (splats, bundle) = (home.join("a.ply"), home.join("a.psb"));
    succeeds(&mut train(&splats));
    let import = |output: &Path| {
        let mut command = pocketsplat();
        command.arg("import").arg(&splats).arg("-o").arg(output).args(["--iterations", "120", "--json"]);
        command.args(["--feature-dim", "8", "--offsets", "3", "--resolution", "32x32"]);
        command
    };
    let imported = import(&bundle).args(["--views", "21"]).output().unwrap();
    assert!(imported.status.success(), "{}", String::from_utf8_lossy(&imported.stderr));
    let result: serde_json::Value = serde_json::from_slice(&imported.stdout).unwrap();
    assert_eq!(result["bundle_bytes"], fs::read(&bundle).unwrap().len());
    assert_eq!(result["original_bytes"], fs::read(&splats).unwrap().len());
    assert_eq!((&result["n_training_views"], &result["n_held_out_views"]), (&21.into(), &3.into()));
    assert!(result["psnr_to_original_db"].as_f64().unwrap() > 12.0, "{result}");
    succeeds(pocketsplat().arg("inspect").arg(&bundle));

    // In the frame of the splats: the cameras of the capture fit both.
    let cameras = capture().join("transforms_train.json");
    let said = fails(import(&bundle).arg("--cameras").arg(&cameras));
    assert!(said.contains("6 cameras, needs 8"), "{said}");
    let said = fails(import(&bundle).args(["--backbone", "scaffold", "--lambda", "0.01"]));
    assert!(said.contains("--lambda weighs the bits of a value, and scaffold scenes are trained without"), "{said}");
    let said = fails(import(&bundle).args(["--effects", "auto"]));
    assert!(said.contains("import measures no effects; name them"), "{said}");
    fs::write(home.join("mesh.ply"), "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nend_header\n1\n")
        .unwrap();
    let mut mesh = pocketsplat();
    mesh.arg("import").arg(home.join("mesh.ply")).arg("-o").arg(home.join("mesh.psb"));
    assert!(fails(&mut mesh).contains("mesh.ply"));
    assert!(!home.join("mesh.psb").exists());
}
