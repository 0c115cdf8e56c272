//! `pocketsplat export`: a bundle in each format, read again; and what every other command says of such a file.

use std::fs;
use std::path::Path;
use std::process::Command;

use pocketsplat_gaussians::{Degree, Format};

use crate::fixture::{capture, fails, folder, pocketsplat, text, undisturbed};

fn export(bundle: &Path, output: &Path) -> Command {
    let mut command = pocketsplat();
    command.arg("export").arg(bundle).arg("-o").arg(output).args(["--iterations", "20", "--json"]);
    command
}

fn measured(command: &mut Command) -> serde_json::Value {
    let output = command.output().unwrap();
    assert!(output.status.success(), "{}", text(&output.stderr));
    serde_json::from_slice(&output.stdout).unwrap()
}

#[test]
fn every_format_holds_what_was_measured() {
    let home = folder("export");
    let bundle = home.join("a.psb");
    fs::write(&bundle, undisturbed()).unwrap();
    for format in Format::ALL {
        let output = home.join(format!("deep/scene.{}", format.extension()));
        let said = measured(export(&bundle, &output).arg(capture()).args(["--sh-degree", "1"]));
        assert_eq!(said["bytes"], fs::metadata(&output).unwrap().len());
        assert!(said["n_views"].as_u64().unwrap() > 0 && said["split"] == "test", "{said}");
        let loss = said["bundle_psnr_db"].as_f64().unwrap() - said["psnr_db"].as_f64().unwrap();
        assert!((said["loss_db"].as_f64().unwrap() - loss).abs() < 1e-9 && loss < 3.0, "{said}");
        let (gaussians, notes) = pocketsplat_gaussians::read(&output, None).unwrap();
        assert_eq!((gaussians.len() as u64, gaussians.degree), (said["n_gaussians"].as_u64().unwrap(), Degree::One));
        if format == Format::Ply {
            let says_loss = |comment: &String| comment.starts_with("Exported by pocketsplat from a.psb: ");
            assert!(notes.comments.iter().any(says_loss), "{:?}", notes.comments);
            // The file says how its photographs were prepared.
            let again = measured(pocketsplat().args(["eval", "--json"]).arg(&output).arg(capture()));
            assert!((again["psnr_db"].as_f64().unwrap() - said["psnr_db"].as_f64().unwrap()).abs() < 1e-3, "{again}");
        }
    }
}

#[test]
fn without_a_capture_cameras_are_generated() {
    let home = folder("export_alone");
    let (bundle, output) = (home.join("a.psb"), home.join("a.spz"));
    fs::write(&bundle, undisturbed()).unwrap();
    let said = measured(&mut export(&bundle, &output));
    assert!(said["split"] == "generated" && said["n_views"] == 16 && said.get("psnr_db").is_none(), "{said}");
    assert!(said["psnr_to_bundle_db"].as_f64().unwrap() > 20.0, "{said}");
}

#[test]
fn a_file_of_gaussians_is_written_in_another_format() {
    let home = folder("export_convert");
    let (bundle, first, second) = (home.join("a.psb"), home.join("a.ply"), home.join("b.sog"));
    fs::write(&bundle, undisturbed()).unwrap();
    let made = measured(&mut export(&bundle, &first));
    let said =
        measured(pocketsplat().arg("export").arg(&first).arg("-o").arg(&second).args(["--json", "--sh-degree", "1"]));
    assert_eq!((&said["n_gaussians"], &said["source_bytes"]), (&made["n_gaussians"], &made["bytes"]));
    let (gaussians, _) = pocketsplat_gaussians::read(&second, None).unwrap();
    assert_eq!((gaussians.degree, gaussians.len() as u64), (Degree::One, made["n_gaussians"].as_u64().unwrap()));
    let capture = capture().display().to_string();
    for given in [&[capture.as_str()][..], &["--iterations", "5"], &["--background", "white"]] {
        let said = fails(pocketsplat().arg("export").arg(&first).args(given).arg("-o").arg(&second));
        assert!(said.contains("leave CAPTURE, --iterations and options of photographs out"), "{said}");
    }
    let said = fails(pocketsplat().arg("export").arg(&bundle).args(["--background", "white", "-o"]).arg(&first));
    assert!(said.contains("need a capture"), "{said}");
    let said = fails(pocketsplat().arg("import").arg(&first).arg("-o").arg(&first));
    assert!(said.contains("end the name in .psb"), "{said}");
}

#[test]
fn what_cannot_be_written_is_refused_before_any_work() {
    let home = folder("export_refused");
    let bundle = home.join("a.psb");
    fs::write(&bundle, undisturbed()).unwrap();
    let said = fails(&mut export(&bundle, &home.join("a.ksplat")));
    assert!(said.contains(".ply, .spz, .sog, .glb"), "{said}");
    assert!(fails(&mut export(&home.join("none.psb"), &home.join("a.ply"))).contains("none.psb"));
    assert_eq!(fs::read_dir(&home).unwrap().count(), 1, "nothing was written");
}

#[test]
fn every_other_command_names_import() {
    let home = folder("export_others");
    for name in ["a.ply", "b.spz", "c.SOG", "d.glb"] {
        let file = home.join(name);
        fs::write(&file, b"ply\n").unwrap();
        for arguments in [&["fit", "--ram", "100KiB"][..], &["verify"], &["train", "-o", "a.psb"], &["doctor"]] {
            let said = fails(pocketsplat().args(arguments).arg(&file));
            assert!(said.contains("pocketsplat import") && said.contains(name), "{arguments:?}: {said}");
        }
    }
}
