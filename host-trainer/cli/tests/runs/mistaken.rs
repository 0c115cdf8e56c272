//! Files and captures that are not what a command takes them for: figures of them would look right and be wrong.

use std::ffi::OsString;
use std::fs;
use std::os::unix::ffi::OsStringExt as _;
use std::path::{Path, PathBuf};
use std::process::Command;

use crate::fixture::{capture, fails, folder, pocketsplat, starts, succeeds, text, undisturbed_run};
use crate::interruption::signal;

/// A copy of the undisturbed run and its bundle.
fn copied_run(home: &Path) -> (PathBuf, PathBuf) {
    let (run, bundle) = (undisturbed_run(), undisturbed_run().with_extension("psb"));
    let copy = home.join("a.run");
    assert!(Command::new("cp").arg("-r").arg(run).arg(&copy).status().unwrap().success());
    let moved = home.join("a.psb");
    fs::copy(&bundle, &moved).unwrap();
    let config = copy.join("config.toml");
    let text = fs::read_to_string(&config).unwrap();
    let of_copy = text.replace(bundle.to_str().unwrap(), moved.to_str().unwrap());
    assert_ne!(of_copy, text);
    fs::write(&config, of_copy).unwrap();
    (copy, moved)
}

fn another_capture(home: &Path) -> PathBuf {
    let path = home.join("another");
    let mut synth = pocketsplat();
    synth.arg("synth").arg(&path).args(["--size", "32", "--train-views", "6", "--seed", "9"]);
    succeeds(&mut synth);
    path
}

#[test]
fn a_damaged_bundle_is_refused_by_what_only_looks_at_it() {
    let home = folder("mistaken-damage");
    let (_, bundle) = copied_run(&home);
    let mut bytes = fs::read(&bundle).unwrap();
    let last = bytes.len() - 9;
    bytes[last] ^= 16;
    fs::write(&bundle, bytes).unwrap();
    let page = home.join("a.html");
    for command in [&["fit"][..], &["view", "-o", page.to_str().unwrap()], &["inspect"]] {
        let said = fails(pocketsplat().arg(command[0]).arg(&bundle).args(&command[1..]));
        assert!(said.contains("is damaged: CRC") && said.contains("copy the file again"), "{command:?}: {said}");
    }
    assert!(!page.exists());
}

#[test]
fn a_report_is_of_the_runs_own_photographs() {
    let home = folder("mistaken-report");
    let (run, _) = copied_run(&home);
    succeeds(pocketsplat().arg("report").arg(&run));
    let page = run.join("report.html");
    let before = fs::read(&page).unwrap();
    let said = fails(pocketsplat().arg("report").arg(&run).arg(another_capture(&home)));
    assert!(said.contains("this is another capture") && said.contains("as CAPTURE"), "{said}");
    assert_eq!(fs::read(&page).unwrap(), before);
}

#[test]
fn compare_takes_figures_of_its_own_capture_and_views_alone() {
    let home = folder("mistaken-compare");
    let (run, bundle) = copied_run(&home);
    let other = another_capture(&home);
    let kept = bundle.with_extension("json");
    let eval = |of: &Path, options: &[&str]| {
        let output = pocketsplat().arg("eval").arg(&bundle).arg(of).args(options).arg("--json").output().unwrap();
        assert!(output.status.success(), "{}", text(&output.stderr));
        fs::write(&kept, &output.stdout).unwrap();
        serde_json::from_slice::<serde_json::Value>(&output.stdout).unwrap()["psnr_db"].as_f64().unwrap()
    };
    let compare = || {
        let mut command = pocketsplat();
        command.arg("compare").arg(&run).arg("-o").arg(home.join("c"));
        command
    };
    let right = eval(capture(), &[]);
    succeeds(&mut compare());
    let wrong = eval(&other, &[]);
    assert!((wrong - right).abs() > 0.1, "{wrong} {right}");
    for (of, options) in [(&*other, &[][..]), (capture(), &["--split", "train"])] {
        eval(of, options);
        let before = fs::read(&kept).unwrap();
        let said = fails(&mut compare());
        assert!(said.contains("taken otherwise, or of another capture; move it away"), "{said}");
        assert_eq!(fs::read(&kept).unwrap(), before, "they are not lost");
    }
    fs::remove_file(&kept).unwrap();
    succeeds(&mut compare());
    let figures: serde_json::Value = serde_json::from_slice(&fs::read(&kept).unwrap()).unwrap();
    assert!((figures["psnr_db"].as_f64().unwrap() - right).abs() < 1e-9);
}

#[test]
fn a_plan_takes_no_file_of_another_run_for_its_own() {
    let home = folder("mistaken-plan");
    let own = home.join("capture");
    assert!(Command::new("cp").arg("-r").arg(capture()).arg(&own).status().unwrap().success());
    let plan = home.join("plan.toml");
    let text = "[captures.S]\na = \"capture\"\n[options]\niterations = 20\nlambda = 0.002\nfeature-dim = 8\noffsets = 3\n[vary]\nseed = [1, 2]\n";
    fs::write(&plan, text).unwrap();
    let runs = home.join("runs");
    let run = || {
        let mut command = pocketsplat();
        command.args(["--threads", "1", "plan-runs"]).arg(&plan).arg("-o").arg(&runs).arg("--run");
        command
    };
    succeeds(&mut run());
    let (one, two) = (runs.join("a/seed-1.psb"), runs.join("a/seed-2.psb"));
    let before = fs::read(&two).unwrap();
    fs::copy(&one, &two).unwrap();
    let said = fails(&mut run());
    assert!(said.contains("another run has replaced it"), "{said}");
    fs::write(&two, before).unwrap();
    fs::remove_dir_all(&own).unwrap();
    fs::rename(another_capture(&home), &own).unwrap();
    let said = fails(&mut run());
    assert!(said.contains("another capture") && said.contains("choose another --output"), "{said}");
}

#[test]
fn a_demo_goes_on_that_was_stopped_while_it_made_its_capture() {
    let home = folder("mistaken-demo");
    let demo = |size: &str| {
        let mut command = pocketsplat();
        command.arg("demo").arg("-o").arg(home.join("demo")).args(["--iterations", "20", "--size", size]);
        command
    };
    let mut child = starts(&mut demo("512"));
    while !home.join("demo/.capture-being-made").exists() {
        assert!(child.try_wait().unwrap().is_none(), "ended before");
        std::thread::sleep(std::time::Duration::from_millis(2));
    }
    signal(&child, "KILL");
    child.wait().unwrap();
    assert!(!home.join("demo/capture").exists());
    succeeds(&mut demo("32"));
    assert!(home.join("demo/scene.psb").is_file() && !home.join("demo/.capture-being-made").exists());
}

#[test]
fn what_shows_nothing_is_not_converted_without_loss() {
    let home = folder("mistaken-nothing");
    let names = "x y z f_dc_0 f_dc_1 f_dc_2 opacity scale_0 scale_1 scale_2 rot_0 rot_1 rot_2 rot_3";
    let properties: String = names.split(' ').map(|name| format!("property float {name}\n")).collect();
    let mut ply = format!("ply\nformat ascii 1.0\nelement vertex 2\n{properties}end_header\n");
    for x in ["0.1", "0.7"] {
        ply += &format!("{x} 0.2 0.3 0.5 0.5 0.5 -20 -3 -3 -3 1 0 0 0\n");
    }
    let faint = home.join("faint.ply");
    fs::write(&faint, ply).unwrap();
    let said = fails(pocketsplat().arg("export").arg(&faint).arg("-o").arg(home.join("a.spz")));
    assert!(said.contains("can be seen") && said.contains("0 of 2 Gaussians are opaque enough to be drawn"), "{said}");
    assert!(!home.join("a.spz").exists());
}

#[test]
fn a_shorter_turn_tells_of_the_pictures_of_a_longer_one() {
    let home = folder("mistaken-turn");
    let (_, bundle) = copied_run(&home);
    let turn = |n: &str| {
        let mut command = pocketsplat();
        command
            .arg("render")
            .arg(&bundle)
            .args(["--orbit", n, "--resolution", "16x16"])
            .arg("-o")
            .arg(home.join("film"));
        succeeds(&mut command)
    };
    assert!(!turn("6").contains("warning"));
    let said = turn("4");
    assert!(said.contains("2 numbered pictures that are not of this command, from 0004.png on"), "{said}");
}

#[test]
fn costs_name_what_was_drawn() {
    let home = folder("mistaken-cost");
    let (_, bundle) = copied_run(&home);
    let fit: serde_json::Value =
        serde_json::from_slice(&pocketsplat().arg("fit").arg(&bundle).arg("--json").output().unwrap().stdout).unwrap();
    let least =
        fit["points"].as_array().unwrap().iter().map(|point| point["ram_bytes"].as_u64().unwrap()).min().unwrap();
    let mut cost = pocketsplat();
    cost.arg("cost").arg(&bundle).arg(capture()).arg("-o").arg(home.join("c")).args(["--count", "0", "--views", "1"]);
    let said = succeeds(cost.args(["--ram", &least.to_string()]));
    assert!(said.contains("left out: this memory has no room for it"), "{said}");
    let table = fs::read_to_string(home.join("c/cost.csv")).unwrap();
    let rows: Vec<Vec<&str>> = table.lines().map(|line| line.split(',').collect()).collect();
    let rates = |knob: &str| rows.iter().filter(|row| row[0] == knob).map(|row| row[2]).collect::<Vec<_>>();
    assert_eq!(rates("level").len(), 3, "{table}");
    assert!(rates("level").iter().all(|rate| rate.parse::<f64>().unwrap() > 0.2), "{table}");
    assert!(rates("pruning rate").iter().all(|rate| *rate == rates("level")[0]), "{table}");
}

#[test]
fn a_figure_is_of_numbers_alone() {
    let home = folder("mistaken-figure");
    let table = home.join("r.csv");
    let plot = |rows: &str| {
        fs::write(&table, format!("Submethod,PSNR,Size [Bytes]\n{rows}")).unwrap();
        let mut command = pocketsplat();
        command.arg("plot").arg(&table).arg("-o").arg(home.join("r.svg"));
        command
    };
    assert!(fails(&mut plot("a,30,1000\nb,NaN,2000\n")).contains("`NaN` is no number (line 3, PSNR)"));
    assert!(fails(&mut plot("a,30,1000\nb,31,0\n")).contains("a size is 0 bytes, needed: more than 0 (line 3"));
    let said = plot("a,30,1000\nb,31,2000\n").arg("--json").output().unwrap();
    assert!(serde_json::from_slice::<serde_json::Value>(&said.stdout).is_ok_and(|said| said.is_object()));
    let learning = |psnr_db: &str| {
        fs::write(&table, format!("iteration,psnr_db,anchors\n1,20,5\n2,,5\n3,{psnr_db},5\n")).unwrap();
        let mut command = pocketsplat();
        command.arg("plot").arg(&table).arg("-o").arg(home.join("l.svg"));
        command
    };
    let said = fails(&mut learning("inf"));
    let needed = "line 4, column psnr_db: found `inf`, needed: a finite number";
    assert!(said.contains("r.csv cannot be plotted") && said.contains(needed), "{said}");
    succeeds(&mut learning("21"));
}

#[test]
fn a_run_from_no_point_is_refused_before_any_work() {
    let home = folder("mistaken-points");
    for (options, output) in [
        (&["survey", "--random-points", "0"][..], "survey"),
        (&["train", "--set", "capture.n_random_points=0"], "a.psb"),
        (&["train", "--backbone", "3dgs", "--set", "capture.n_random_points=0"], "a.ply"),
    ] {
        let mut command = pocketsplat();
        command.arg(options[0]).arg(capture()).args(&options[1..]).arg("-o").arg(home.join(output));
        let said = fails(&mut command);
        assert!(said.contains("asks for 0 random points, needed: 1 to 10,000,000"), "{options:?}: {said}");
    }
    assert_eq!(fs::read_dir(&home).unwrap().count(), 0, "nothing was written");
}

#[test]
fn a_name_that_is_no_text_is_refused_before_any_work() {
    let home = folder("mistaken-bytes");
    let plan = home.join("plan.toml");
    fs::write(&plan, format!("[captures.own]\nscene = {:?}\n", capture())).unwrap();
    let odd = |ending: &[u8]| home.join(OsString::from_vec([&b"caf\xe9"[..], ending].concat()));
    for (options, source, ending) in [
        (&["train"][..], capture(), &b".psb"[..]),
        (&["train", "--backbone", "3dgs"], capture(), b".ply"),
        (&["train", "--backbone", "3dgs", "--set", "gaussians.iterations=9"], capture(), b".ply"),
        (&["import"], Path::new("splats.ply"), b".psb"),
        (&["survey"], capture(), b""),
        (&["plan-runs", "--run"], &plan, b""),
    ] {
        let mut command = pocketsplat();
        command.arg(options[0]).arg(source).args(&options[1..]).arg("-o").arg(odd(ending));
        let said = fails(&mut command);
        assert!(said.contains("caf\\xe9") && said.contains("is not UTF-8"), "{options:?}: {said}");
        assert!(said.contains("rename it, or link to it by another name"), "{options:?}: {said}");
    }
    assert_eq!(fs::read_dir(&home).unwrap().count(), 1, "nothing but the plan");
}

#[test]
fn an_option_and_a_key_do_not_say_two_things() {
    let home = folder("mistaken-set");
    let train = |options: &[&str]| {
        let mut command = pocketsplat();
        command.arg("train").arg(capture()).arg("-o").arg(home.join("a.psb")).arg("--dry-run").args(options);
        command
    };
    let twice = "is 60 by an option and 50 by --set; leave one of them out";
    let said = fails(&mut train(&["--iterations", "60", "--set", "train.iterations=50"]));
    assert!(said.contains("`train.iterations`") && said.contains(twice), "{said}");
    // The default too, where somebody gives it.
    let said = fails(&mut train(&["--lambda", "0.002", "--set", "train.hac.lambda=0.004"]));
    assert!(said.contains("`train.hac.lambda` is 0.002 by an option and 0.004 by --set"), "{said}");
    let explicit = ["--backbone", "3dgs", "--iterations", "60", "--set", "gaussians.iterations=50"];
    let mut command = pocketsplat();
    command.arg("train").arg(capture()).arg("-o").arg(home.join("a.ply")).args(explicit);
    assert!(fails(&mut command).contains(twice));
    for key in ["dataset", "output", "preset"] {
        let said = fails(&mut train(&["--set", &format!("{key}=x")]));
        assert!(said.contains(&format!("`{key}` cannot be set: it ")), "{said}");
    }
    let both = ["--iterations", "60", "--modules", "tiered-pruning", "--set", "train.modules.pruning.rate=0.3"];
    succeeds(train(&both).args(["--set", "train.iterations=60"]));
    let learned = train(&["--set", "capture.background=learned"]).output().unwrap();
    assert!(text(&learned.stdout).contains("learns_background = true"), "{}", text(&learned.stderr));
}

#[test]
fn options_that_change_nothing_are_refused() {
    let home = folder("mistaken-nothing-changed");
    let train = |options: &[&str]| {
        let mut command = pocketsplat();
        command.arg("train").arg(capture()).arg("-o").arg(home.join("a.psb")).arg("--dry-run").args(options);
        fails(&mut command)
    };
    let mut seed = pocketsplat();
    let output = seed.args(["train", "x", "-o", "a.psb", "--seed", "9223372036854775808"]).output().unwrap();
    assert!(text(&output.stderr).contains("9223372036854775808 is not in 0..=9223372036854775807"));
    let said = train(&["--ram", "10EiB"]);
    assert!(said.contains("--ram asks for 11529215046068469760 bytes"), "{said}");
    let mut fork = pocketsplat();
    fork.arg("train")
        .arg("--from")
        .arg(undisturbed_run())
        .args(["--at", "10", "--points", "random", "-o"])
        .arg(home.join("b.psb"));
    let said = fails(&mut fork);
    assert!(said.contains("--points says where training starts") && said.contains("leave it out"), "{said}");
    let bundle = undisturbed_run().with_extension("psb");
    for command in [&["render", "--preview"][..], &["view"], &["inspect"], &["export"]] {
        let mut with_axes = pocketsplat();
        with_axes.arg(command[0]).arg(&bundle).args(&command[1..]).args(["--spz-axes", "as-in-ply"]);
        if command[0] != "inspect" {
            let name = match command[0] {
                "render" => "c.png",
                "view" => "c.html",
                _ => "c.ply",
            };
            with_axes.arg("-o").arg(home.join(name));
        }
        let said = fails(&mut with_axes);
        assert!(said.contains("is no .spz; leave --spz-axes out"), "{command:?}: {said}");
    }
}

#[test]
fn what_fit_advises_works() {
    let bundle = undisturbed_run().with_extension("psb");
    let fit = |ram: &str, options: &[&str]| {
        let mut command = pocketsplat();
        command.arg("fit").arg(&bundle).args(["--ram", ram]).args(options);
        command
    };
    let said = fails(&mut fit("9000", &[]));
    let needed = said.split("give --ram ").nth(1).and_then(|rest| rest.split(' ').next()).expect("a number");
    succeeds(&mut fit(needed, &[]));
    assert!(!said.contains("--slabs") && !said.contains("--resolution"), "neither would do: {said}");
    fails(&mut fit("9000", &["--slabs"]));
    fails(&mut fit("9000", &["--resolution", "16x16"]));
    let little_less = (needed.parse::<u64>().expect("a number") - 1).to_string();
    assert!(fails(&mut fit(&little_less, &[])).contains("time for `fit --slabs`"));
    succeeds(&mut fit(&little_less, &["--slabs"]));
}

#[test]
fn a_comparison_says_what_to_do_where_a_capture_has_moved() {
    let home = folder("mistaken-moved");
    let (run, _) = copied_run(&home);
    let config = run.join("config.toml");
    let text = fs::read_to_string(&config).unwrap();
    fs::write(&config, text.replace(capture().to_str().unwrap(), "/gone")).unwrap();
    let compare = || {
        let mut command = pocketsplat();
        command.arg("compare").arg(&run).arg("-o").arg(home.join("c"));
        command
    };
    let said = fails(&mut compare());
    assert!(said.contains("if its capture has moved, name it as `dataset` in"), "{said}");
    fs::write(&config, text).unwrap();
    succeeds(&mut compare());
}

#[test]
fn a_run_and_its_bundle_are_told_apart() {
    let home = folder("mistaken-run");
    let (run, bundle) = copied_run(&home);
    for command in [&["report"][..], &["train", "-o", "b.psb", "--at", "10", "--from"], &["train", "--resume"]] {
        let said = fails(pocketsplat().args(command).arg(&bundle));
        assert!(said.contains(&format!("is no run folder (it has no config.toml); give {}", run.display())), "{said}");
    }
    let said = fails(pocketsplat().arg("compare").arg(&run).arg(capture()).arg("-o").arg(home.join("c")));
    assert!(said.contains("is no run folder") && said.contains("OUT.run"), "{said}");
    for command in ["fit", "inspect", "verify"] {
        let said = fails(pocketsplat().arg(command).arg(&run));
        assert!(said.contains(&format!("is the folder of a run; give its bundle, {}", bundle.display())), "{said}");
        assert!(fails(pocketsplat().arg(command).arg(capture())).contains("is a folder; give a bundle (.psb)"));
    }
}

#[test]
fn a_white_backdrop_is_no_other_background() {
    let home = folder("mistaken-backdrop");
    let white = home.join("white");
    succeeds(pocketsplat().arg("synth").arg(&white).args(["--size", "32", "--train-views", "8", "--seed", "3"]));
    for split in ["train", "test"] {
        for entry in fs::read_dir(white.join(split)).unwrap().map(Result::unwrap) {
            let mut picture = image::open(entry.path()).unwrap().into_rgba8();
            for pixel in picture.pixels_mut() {
                let alpha = u32::from(pixel.0[3]);
                pixel.0 = pixel.0.map(|c| ((u32::from(c) * alpha + 255 * (255 - alpha)) / 255) as u8);
                pixel.0[3] = 255;
            }
            image::DynamicImage::from(picture).into_rgb8().save(entry.path()).unwrap();
        }
    }
    let (bundle, run) = (home.join("w.psb"), home.join("w.run"));
    succeeds(pocketsplat().arg("train").arg(&white).arg("-o").arg(&bundle).args(["--iterations", "20", "--no-report"]));
    succeeds(pocketsplat().arg("compare").arg(&run).arg("-o").arg(home.join("c")));
    let output = pocketsplat().arg("eval").arg(&bundle).arg(&white).output().unwrap();
    assert!(text(&output.stdout).contains("background white"), "{}", text(&output.stdout));
    let said = fails(pocketsplat().arg("eval").arg(&bundle).arg(&white).args(["--background", "white"]));
    assert!(said.contains("was trained on black, not on white; leave --background out"), "{said}");
    let mut explicit = pocketsplat();
    explicit.arg("train").arg(&white).arg("-o").arg(home.join("w3.ply")).args([
        "--backbone",
        "3dgs",
        "--iterations",
        "20",
    ]);
    let output = explicit.output().unwrap();
    let said = text(&output.stderr);
    assert!(output.status.success() && said.contains("-o scene.psb --background white"), "{said}");
}

#[test]
fn two_files_of_one_stem_are_two_runs() {
    let home = folder("mistaken-stem");
    let (run, bundle) = copied_run(&home);
    let result = fs::read(run.join("result.json")).unwrap();
    let explicit = |options: &[&str]| {
        let mut command = pocketsplat();
        command.arg("train").arg(capture()).arg("-o").arg(home.join("a.ply"));
        command.args(["--backbone", "3dgs", "--iterations", "5"]).args(options);
        command
    };
    succeeds(&mut explicit(&[]));
    let other = home.join("a.ply.run");
    for command in [&["report"][..], &["train", "-o", "c.psb", "--at", "2", "--from"]] {
        let said = fails(pocketsplat().args(command).arg(&other));
        assert!(said.contains("is of a run of --backbone 3dgs"), "{command:?}: {said}");
    }
    let in_vain = fails(&mut explicit(&["--run", run.to_str().unwrap()]));
    let needed = format!("is the folder of the run that wrote {}; choose another folder with --run", bundle.display());
    assert!(in_vain.contains(&needed), "{in_vain}");
    assert_eq!(fs::read(run.join("result.json")).unwrap(), result);
    succeeds(&mut explicit(&["--overwrite", "--run", run.to_str().unwrap()]));
}

#[test]
fn a_run_of_another_capture_is_not_replaced_unasked() {
    let home = folder("mistaken-another-capture");
    let (run, bundle) = copied_run(&home);
    let kept = |name: &str| fs::read(run.join(name)).unwrap();
    let before = [kept("result.json"), kept("config.toml")];
    let other = another_capture(&home);
    let again = |options: &[&str]| {
        let mut command = pocketsplat();
        command
            .arg("train")
            .arg(&other)
            .arg("-o")
            .arg(&bundle)
            .args(["--iterations", "8", "--no-report"])
            .args(options);
        command
    };
    let said = fails(&mut again(&[]));
    let needed = format!("has a run of another capture, {}; choose another --output", capture().display());
    assert!(said.contains(&needed), "{said}");
    assert_eq!([kept("result.json"), kept("config.toml")], before, "nothing is lost");
    succeeds(&mut again(&["--overwrite"]));
}

#[test]
fn a_finished_run_without_its_bundle_is_trained_anew_with_a_word() {
    let home = folder("mistaken-bundle-gone");
    let (run, bundle) = copied_run(&home);
    fs::remove_file(&bundle).unwrap();
    let mut again = pocketsplat();
    let output = again.arg("train").arg("--continue").arg("--config").arg(run.join("config.toml")).output().unwrap();
    let said = text(&output.stderr);
    assert!(output.status.success() && said.contains("is not there: it is trained anew"), "{said}");
    assert!(bundle.is_file());
}

#[test]
fn what_is_asked_for_in_vain_is_told_before_a_run() {
    let home = folder("mistaken-before");
    let said = fails(pocketsplat().args(["train", "--watch", "/gone", "-o"]).arg(home.join("a.psb")));
    assert!(said.contains("/gone"), "--watch takes no capture for its port: {said}");
    let mut dry = pocketsplat();
    let output = dry.arg("train").arg(capture()).args(["-o", "a.psb", "--dry-run", "--json"]).output().unwrap();
    assert!(!output.status.success() && text(&output.stderr).contains("cannot be used with '--json'"));
    let plan = home.join("plan.toml");
    let scene = format!("published = \"gone.csv\"\n[captures.own]\nscene = {:?}\n", capture());
    fs::write(&plan, scene + "[options]\niterations = 5\n").unwrap();
    let said = fails(pocketsplat().arg("plan-runs").arg(&plan).arg("--run").arg("-o").arg(home.join("o")));
    assert!(said.contains("could not read the published results") && !home.join("o").exists(), "{said}");
}
