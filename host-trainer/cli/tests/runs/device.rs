//! Memory in, bundle out: what a device has is kept, and what cannot be kept is said before hours are spent.

use std::fs;

use pocketsplat_core::{Budget, Bundle};

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
        bundle.plan(&frame.in_bytes(ram)).is_ok_and(|plan| plan.n_tiers() == bundle.n_tiers())
    };
    let lowest = (1..).find(|&ram| all_of(&bundle, 64 * ram)).unwrap() * 64;
    // `verify` holds what it can draw to the laws, and does not hide that it is a part.
    let verified = |ram: usize| {
        let run = pocketsplat().arg("verify").arg(&free).args(["--ram", &ram.to_string()]).output().unwrap();
        String::from_utf8(run.stdout).unwrap()
    };
    let part = (1..lowest / 64).rfind(|&ram| bundle.plan(&frame.in_bytes(64 * ram)).is_ok()).unwrap() * 64;
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
    let plan = bundle.plan(&frame.in_bytes(ram)).expect("a part of it fits");
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
    assert!(!output.exists() && !home.join("a.run").exists(), "before anything was done");
    let undisturbed = home.join("undisturbed.psb");
    fs::write(&undisturbed, crate::fixture::undisturbed()).unwrap();
    let said = fails(pocketsplat().arg("fit").arg(&undisturbed).args(["--ram", "1000"]));
    assert!(said.contains("do not suffice") && said.contains("--ram"), "{said}");
}
