//! Runs on a GPU, and where there is none.

use std::fs;
use std::path::Path;
use std::process::Command;

use crate::fixture::{
    CHECKPOINT_EVERY, checkpoints, fails, folder, pocketsplat, resume, starts, succeeds, text, train, train_with,
    undisturbed, wait_for,
};

/// The same, where the loader of Vulkan finds no driver.
#[cfg(target_os = "linux")]
fn without_drivers(mut command: Command) -> Command {
    command.env("VK_DRIVER_FILES", "/nonexistent").env("VK_ICD_FILENAMES", "/nonexistent");
    command
}

fn on_gpu(command: Command) -> Command {
    on("gpu", command)
}

fn on(device: &str, mut command: Command) -> Command {
    // Without it a driver complains on stderr in a line of its own.
    command.args(["--device", device]).env("XDG_RUNTIME_DIR", std::env::temp_dir());
    command
}

/// What a finished run says of itself.
fn result_of(run: &Path) -> serde_json::Value {
    serde_json::from_slice(&fs::read(run.join("result.json")).unwrap()).unwrap()
}

fn has_gpu() -> bool {
    let output = pocketsplat().args(["devices", "--json"]).output().unwrap();
    let found: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    let has_gpu = found["devices"].as_array().is_some_and(|devices| !devices.is_empty());
    assert!(has_gpu || std::env::var_os("POCKETSPLAT_NEEDS_GPU").is_none(), "POCKETSPLAT_NEEDS_GPU is set: {found}");
    if !has_gpu {
        eprintln!("skipped: there is no GPU");
    }
    has_gpu
}

#[cfg(target_os = "linux")]
#[test]
fn without_a_gpu_it_says_so_and_auto_takes_the_cpu() {
    let home = folder("no-gpu");
    let mut devices = pocketsplat();
    devices.arg("devices");
    let output = without_drivers(devices).output().unwrap();
    assert!(output.status.success() && text(&output.stdout).contains("no GPU"), "{}", text(&output.stdout));
    let error = fails(&mut without_drivers(on_gpu(train(&home.join("a.psb")))));
    assert!(error.contains("0 adapters") && error.contains("--device cpu"), "{error}");
    let output = without_drivers(on("auto", train(&home.join("b.psb")))).output().unwrap();
    assert!(text(&output.stderr).contains("device: cpu"), "{}", text(&output.stderr));
    assert!(fs::read(home.join("b.psb")).unwrap() == undisturbed());
}

#[test]
fn a_device_that_there_is_not_is_refused_by_number() {
    let home = folder("no-such-gpu");
    let error = fails(&mut on("gpu:99", train(&home.join("a.psb"))));
    assert!(
        error.contains("no adapter 99") || error.contains("no GPU was found") || error.contains("without GPUs"),
        "{error}"
    );
    let output = on("cuda", train(&home.join("a.psb"))).output().unwrap();
    assert!(output.status.code() == Some(2) && text(&output.stderr).contains("gpu:N"), "{}", text(&output.stderr));
}

#[test]
fn a_run_on_a_gpu_that_is_killed_goes_on_to_the_same_bytes() {
    if !has_gpu() {
        return;
    }
    let home = folder("gpu");
    // Where a CPU plays the GPU, each anchor counts: 1,278 at the start, where other tests have 3,298.
    let run = |name: &str| train_with(&home.join(name), "0.3", CHECKPOINT_EVERY);
    succeeds(&mut on_gpu(run("whole.psb")));
    succeeds(&mut run("cpu.psb"));
    let whole = fs::read(home.join("whole.psb")).unwrap();
    let mut child = starts(&mut on_gpu(run("a.psb")));
    let run = home.join("a.run");
    wait_for(&run, 50, &mut child);
    child.kill().unwrap();
    child.wait().unwrap();
    assert!(!checkpoints(&run).is_empty());
    succeeds(&mut on_gpu(resume(&run)));
    assert!(fs::read(home.join("a.psb")).unwrap() == whole, "the same bytes");
    // A run of 160 steps is unsettled: another rounding moves its bytes by 10 %, but not the scene that they hold.
    let (on_gpu, on_cpu) = (result_of(&home.join("whole.run")), result_of(&home.join("cpu.run")));
    let (psnr_gpu, psnr_cpu) = (on_gpu["psnr_db"].as_f64().unwrap(), on_cpu["psnr_db"].as_f64().unwrap());
    assert!((psnr_gpu - psnr_cpu).abs() < 0.3, "{psnr_gpu} dB, {psnr_cpu} on the CPU");
    let drawn = |result: &serde_json::Value| result["drawn_offsets"].as_f64().unwrap();
    assert!(
        (drawn(&on_gpu) / drawn(&on_cpu) - 1.0).abs() < 0.05,
        "{} offsets drawn, {} on the CPU",
        drawn(&on_gpu),
        drawn(&on_cpu)
    );
}

#[test]
fn bench_measures_every_device_and_number_of_threads() {
    let mut bench = pocketsplat();
    bench.args(["bench", "--splats", "500", "--sizes", "40x30,16x16", "--steps", "2", "--json"]);
    let output = bench.output().unwrap();
    assert!(output.status.success(), "{}", text(&output.stderr));
    let found: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    let rows = found["rows"].as_array().unwrap();
    assert!(
        rows.iter().any(|row| row["device"] == "cpu" && row["threads"] == 1) && rows.len().is_multiple_of(2),
        "{found}"
    );
    assert!(
        rows.iter().all(|row| row["step_ms"].as_f64().unwrap() > 0.0 && row["pairs"].as_u64().unwrap() > 0),
        "{found}"
    );
    let n = |row: &serde_json::Value, key: &str| row[key].as_u64().unwrap();
    for scene in ["plain", "coded"] {
        let row = rows.iter().find(|row| row["scene"] == scene).unwrap();
        assert!(n(row, "resident") >= n(row, "active") && n(row, "evaluated") >= n(row, "blended"), "{row}");
        assert!(n(row, "blended") > 0, "{row}");
    }
    let error = fails(pocketsplat().args(["bench", "--steps", "0"]));
    assert!(error.contains("--steps is 0"), "{error}");
}
