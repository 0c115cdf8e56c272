//! Memory in, bundle out: what a device has is kept, and what cannot be kept is said before hours are spent.

use std::fs;

use pocketsplat_core::{Budget, Bundle, Plan, SectionKind};
use pocketsplat_format::bundle::{HEADER_FIXED_LEN, MANIFEST_RECORD_LEN, SECTION_LEN, crc32};

use crate::fixture::{capture, fails, folder, pocketsplat, succeeds, train};

#[test]
fn a_bundle_for_a_device_fits_it_and_passes_its_verification() {
    let home = folder("device");
    let free = home.join("free.psb");
    succeeds(train(&free).args(["--modules", "tiered-pruning"]));
    let bytes = fs::read(&free).unwrap();
    let bundle = Bundle::parse(&bytes).unwrap();
    let frame = Budget::for_frame(32, 32);
    let all_of = |bundle: &Bundle<'_>, ram| {
        Plan::new(bundle, &frame.in_bytes(ram)).is_ok_and(|plan| plan.n_tiers() == bundle.n_tiers())
    };
    let lowest = (1..).find(|&ram| all_of(&bundle, 64 * ram)).unwrap() * 64;
    // `verify` holds what it can draw to the properties, and does not hide that it is a part.
    let verified = |ram: usize| {
        let run = pocketsplat().arg("verify").arg(&free).args(["--ram", &ram.to_string()]).output().unwrap();
        String::from_utf8(run.stdout).unwrap()
    };
    let part = (1..lowest / 64).rfind(|&ram| Plan::new(&bundle, &frame.in_bytes(64 * ram)).is_ok()).unwrap() * 64;
    assert!(verified(part).contains("the whole scene takes "), "{}", verified(part));
    assert!(!verified(lowest).contains("the whole scene takes "), "{}", verified(lowest));
    // Less than the free scene takes as a whole, and less flash.
    let (ram, flash) = (lowest * 9 / 10, bytes.len() * 2 / 3);
    let output = home.join("fitted.psb");
    let limits = ["--ram", &ram.to_string(), "--flash", &flash.to_string()];
    // No smaller model is chosen: this one is to be cut.
    let said = succeeds(train(&output).args(["--config"]).arg(home.join("free.run/config.toml")).args(limits));
    assert!(said.contains("least important anchors were left out to fit"), "{said}");
    assert!(said.contains("the whole scene is drawn in "), "{said}");
    let bytes = fs::read(&output).unwrap();
    assert!(bytes.len() <= flash, "{} bytes for a flash of {flash}", bytes.len());
    let bundle = Bundle::parse(&bytes).unwrap();
    let plan = Plan::new(&bundle, &frame.in_bytes(ram)).expect("a part of it fits");
    assert!(all_of(&bundle, ram), "{plan:?}");
    assert!(plan.scratch_len() <= ram && bundle.n_anchors() > 0, "{plan:?}");
    let ram = ram.to_string();
    succeeds(pocketsplat().arg("verify").arg(&output).arg(capture()).args(["--ram", &ram]));
    succeeds(pocketsplat().arg("verify").arg(&output).args(["--ram", &ram, "--resolution", "24x16"]));
    let fit = pocketsplat().arg("fit").arg(&output).args(["--json", "--ram", &ram]).output().unwrap();
    let fit: serde_json::Value = serde_json::from_slice(&fit.stdout).unwrap();
    assert_eq!((&fit["points"][0]["scratch_bytes"], &fit["schema_version"]), (&plan.scratch_len().into(), &1.into()));
    // Without an amount, each step has its own plan, and more memory never draws less.
    let ladder = pocketsplat().arg("fit").arg(&output).arg("--json").output().unwrap();
    let ladder: serde_json::Value = serde_json::from_slice(&ladder.stdout).unwrap();
    let tiers: Vec<u64> =
        ladder["points"].as_array().unwrap().iter().map(|point| point["n_tiers"].as_u64().unwrap()).collect();
    assert!(tiers.len() > 3 && tiers.is_sorted(), "{tiers:?}");
}

#[test]
fn what_no_device_can_do_is_refused_with_the_nearest_that_can() {
    let home = folder("infeasible");
    let output = home.join("a.psb");
    let said = fails(train(&output).args(["--ram", "4KiB"]));
    assert!(said.contains("limit of 4096 for RAM") && said.contains("takes about"), "{said}");
    let said = fails(train(&output).args(["--ram", "1MiB", "--flash", "2KiB"]));
    assert!(said.contains("limit of 2048 for flash"), "{said}");
    let said = fails(train(&output).args(["--bytes", "300"]));
    assert!(said.contains("a bundle of 300 bytes is asked for") && said.contains("with a unit as in 300kB"), "{said}");
    let mut untrained = train(&output);
    untrained.args(["--bytes", "30kB", "--modules", "none", "--tiers", "0.4,0.4,0"]);
    let said = untrained.output().unwrap().stderr;
    assert!(String::from_utf8_lossy(&said).contains("without rdo-pruning the scene is not trained to this size"));
    assert!(!output.exists() && !home.join("a.run").exists(), "before anything was done");
    let undisturbed = home.join("undisturbed.psb");
    fs::write(&undisturbed, crate::fixture::undisturbed()).unwrap();
    let said = fails(pocketsplat().arg("fit").arg(&undisturbed).args(["--ram", "1000"]));
    assert!(said.contains("do not suffice") && said.contains("--ram"), "{said}");
}

#[test]
fn a_board_sets_what_other_options_leave_open() {
    let home = folder("board");
    let output = home.join("a.psb");
    succeeds(train(&output).args(["--target", "stm32f411", "--resolution", "32x32", "--flash", "20000"]));
    let config = fs::read_to_string(home.join("a.run/config.toml")).unwrap();
    for line in ["ram_bytes = 119808", "flash_bytes = 20000", "processor = \"cortex-m4\"", "resolution = \"32x32\""] {
        assert!(config.contains(line), "{line}: {config}");
    }
    let fit = pocketsplat().args(["fit", "--target", "stm32f411", "--json"]).arg(&output).output().unwrap();
    let fit: serde_json::Value = serde_json::from_slice(&fit.stdout).unwrap();
    let point = &fit["points"][0];
    assert_eq!((&fit["width_px"], &point["ram_bytes"]), (&128.into(), &119_808.into()), "the board's frame and memory");
    let [instructions, seconds] = ["instructions", "seconds"].map(|name| point[name].as_f64().unwrap());
    assert!((seconds - instructions * 1.54 / 100e6).abs() < 1e-9, "{point}");
}

#[test]
fn a_level_sets_limits_that_hold_and_are_declared() {
    let home = folder("level");
    let output = home.join("a.psb");
    for (option, value, needed) in [
        ("--ram", "60000", "--level 1 allows 54272"),
        ("--flash", "1MiB", "--level 1 allows 32768"),
        ("--target", "cortex-m7", "--target contradicts --level 1"),
        ("--target", "rp2350", "--target rp2350 sets what level 1 sets too"),
        ("--resolution", "160x120", "--level 1 allows 12288"),
    ] {
        let said = fails(train(&output).args(["--level", "1", option, value]));
        assert!(said.contains(option) && said.contains(needed), "{said}");
    }
    assert!(!home.join("a.run").exists(), "before anything was done");
    // Less than the level allows may be asked for.
    let run =
        train(&output).args(["--level", "1", "--resolution", "32x32", "--flash", "20000", "--json"]).output().unwrap();
    assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
    let result: serde_json::Value = serde_json::from_slice(&run.stdout).unwrap();
    assert_eq!((&result["level"], &result["profile"]), (&1.into(), &"Device".into()));
    let config = fs::read_to_string(home.join("a.run/config.toml")).unwrap();
    for line in ["ram_bytes = 54272", "flash_bytes = 20000", "processor = \"cortex-m4\"", "level = 1"] {
        assert!(config.contains(line), "{line}: {config}");
    }
    let mut of_level = pocketsplat();
    of_level.args(["train", "--target", "rp2350", "--config"]).arg(home.join("a.run/config.toml"));
    let said = fails(of_level.arg("-o").arg(home.join("b.psb")));
    assert!(said.contains("--target rp2350 sets what level 1 sets too"), "{said}");
    let json = |args: &[&str]| -> serde_json::Value {
        let run = pocketsplat().args(args).arg(&output).arg("--json").output().unwrap();
        serde_json::from_slice(&run.stdout).unwrap()
    };
    let inspected = json(&["inspect"]);
    assert_eq!(inspected["profile"], "Device");
    for tier in inspected["tiers"].as_array().unwrap() {
        assert_eq!(tier["level"], 1, "{tier}");
    }
    let fit = json(&["fit", "--level", "1"]);
    assert!(fit["tiers"].as_array().unwrap().iter().all(|tier| tier["fits"] == true), "{fit}");
    assert_eq!(fit["tiers"][0]["bounds"]["bytes of flash"]["allowed"], 32768);
    succeeds(pocketsplat().arg("verify").arg(&output).args(["--level", "1"]));
    // Another number in the manifest, and checksums to match.
    let mut bytes = fs::read(&output).unwrap();
    let (last, manifest, header_len) = {
        let bundle = Bundle::parse(&bytes).unwrap();
        let section = bundle.sections().find(|section| section.kind == SectionKind::Manifest).unwrap();
        (bundle.n_tiers() - 1, section, usize::from(u16::from_le_bytes([bytes[10], bytes[11]])))
    };
    let mut measures = Bundle::parse(&bytes).unwrap().measures(last).unwrap();
    measures.max_splats = 3_000;
    let start = manifest.offset as usize;
    bytes[start + usize::from(last) * MANIFEST_RECORD_LEN..][..MANIFEST_RECORD_LEN].copy_from_slice(&measures.emit());
    let crc = crc32(&bytes[start..start + manifest.len as usize]).to_le_bytes();
    let row = (HEADER_FIXED_LEN..).step_by(SECTION_LEN).find(|row| bytes[*row] == 6).unwrap();
    bytes[row + 12..row + 16].copy_from_slice(&crc);
    let crc = crc32(&bytes[..header_len - 4]).to_le_bytes();
    bytes[header_len - 4..header_len].copy_from_slice(&crc);
    let tampered = home.join("tampered.psb");
    fs::write(&tampered, bytes).unwrap();
    for args in [&[][..], &["--level", "1"]] {
        let run = pocketsplat().arg("verify").arg(&tampered).args(args).output().unwrap();
        let said = String::from_utf8(run.stdout).unwrap();
        assert_eq!(run.status.code(), Some(1), "{said}");
        assert!(said.contains("BROKEN") && said.contains("3000 splats of a frame, 150.0 % of 2000"), "{said}");
    }
    let run = pocketsplat().args(["fit", "--level", "1"]).arg(&tampered).output().unwrap();
    let said = String::from_utf8(run.stdout).unwrap();
    assert!(said.contains("  no: 3000 splats of a frame, 150.0 % of 2000"), "{said}");
}
