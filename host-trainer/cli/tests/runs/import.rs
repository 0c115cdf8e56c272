//! `import`, and looking at splats without it: where the cameras stand, what is up, and strays that decide nothing.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use pocketsplat_gaussians::{Format, Gaussians, Notes};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::fixture::{fails, folder, pocketsplat, resume, starts, succeeds, text, undisturbed, wait_for};
use crate::interruption::signal;

/// Opaque ones at these places and of these colours.
fn splats(places: impl IntoIterator<Item = ([f32; 3], [f32; 3])>) -> Gaussians {
    let (centres, harmonics): (Vec<_>, Vec<_>) = places.into_iter().unzip();
    let n = centres.len();
    Gaussians {
        centres,
        log_scales: vec![[-2.7; 3]; n],
        rotations: vec![[1.0, 0.0, 0.0, 0.0]; n],
        opacity_logits: vec![3.0; n],
        harmonics,
        ..Gaussians::default()
    }
}

fn write(path: &Path, splats: &Gaussians, comments: &[&str]) {
    let comments = comments.iter().map(|comment| (*comment).to_owned()).collect();
    let notes = Notes { comments, ..Notes::default() };
    fs::write(path, Format::of_path(path).unwrap().write(splats, &notes).unwrap().bytes).unwrap();
}

/// A ball of painted ones, 7 units from the origin.
fn ball() -> Gaussians {
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    splats((0..1200).map(|_| {
        let place = [0.0; 3].map(|_: f32| rng.random_range(-1.0f32..1.0));
        let length = place.iter().map(|x| x * x).sum::<f32>().sqrt();
        let colour = place.map(|x| (4.0 * x).sin());
        (place.map(|x| 7.0 + x / length), colour)
    }))
}

/// Someone with a red head at +`axis` and blue feet at −`axis`.
fn figure(axis: usize) -> Gaussians {
    let mut rng = ChaCha8Rng::seed_from_u64(6);
    splats((0..900).map(|_| {
        let mut place = [0.0; 3].map(|_: f32| 0.25 * rng.random_range(-1.0f32..1.0));
        let height = rng.random_range(-1.0f32..1.0);
        place[axis] = height;
        (place, if height > 0.4 { [1.7, -1.7, -1.7] } else { [-1.7, -1.7, 1.7] })
    }))
}

fn import(splats: &Path, bundle: &Path) -> Command {
    let mut command = pocketsplat();
    command.arg("import").arg(splats).arg("-o").arg(bundle).args(["--iterations", "150", "--json"]);
    command.args(["--feature-dim", "8", "--offsets", "3", "--resolution", "32x32", "--views", "21"]);
    command
}

/// What it printed, and what it said.
fn imported(command: &mut Command) -> (serde_json::Value, String) {
    let done = command.output().unwrap();
    let said = text(&done.stderr);
    assert!(done.status.success(), "{said}");
    (serde_json::from_slice(&done.stdout).unwrap(), said)
}

/// Mean height of the pixels that are more red than blue, and of the others that are lit, from above.
fn heights(picture: &Path) -> [f64; 2] {
    let picture = image::open(picture).unwrap().into_rgb8();
    let mean = |is_one: fn(&[u8; 3]) -> bool| {
        let rows: Vec<f64> =
            picture.enumerate_pixels().filter(|(_, _, p)| is_one(&p.0)).map(|(_, y, _)| y.into()).collect();
        assert!(rows.len() > 20, "{} pixels", rows.len());
        rows.iter().sum::<f64>() / rows.len() as f64
    };
    [mean(|[r, _, b]| *r > 80 && r > b), mean(|[r, _, b]| *b > 80 && b > r)]
}

#[test]
fn strays_cost_nothing_and_are_told() {
    let home = folder("import_strays");
    let psnr_db = |name: &str, gaussians: &Gaussians| {
        let path = home.join(name);
        write(&path, gaussians, &[]);
        let (result, said) = imported(&mut import(&path, &home.join("a.psb")));
        (result["psnr_to_original_db"].as_f64().unwrap(), result["n_strays"].as_u64().unwrap(), said)
    };
    let sound = ball();
    let (sound_db, n_strays, said) = psnr_db("sound.ply", &sound);
    assert!(n_strays == 0 && !said.contains("lie apart"), "{said}");
    let with = |places: Vec<[f32; 3]>| {
        let mut all = sound.clone();
        let strays = splats(places.into_iter().map(|place| (place, [0.0; 3])));
        all.centres.extend(strays.centres);
        all.log_scales.extend(strays.log_scales);
        all.rotations.extend(strays.rotations);
        all.opacity_logits.extend(strays.opacity_logits);
        all.harmonics.extend(strays.harmonics);
        all
    };
    let direction = |i: u16| [0.0, 2.1, 4.2].map(|phase| (f32::from(i) + phase).sin());
    for (name, strays) in [
        ("one.ply", vec![[1e6, 0.0, 0.0]]),
        ("tenth_one_way.ply", (0..120).map(|i| direction(i).map(|x| 3e4 + x)).collect()),
        ("tenth_all_around.ply", (0..120).map(|i| direction(i).map(|x| 3e5 * x)).collect()),
    ] {
        let n = strays.len() as u64;
        let (found_db, n_strays, said) = psnr_db(name, &with(strays));
        assert_eq!(n_strays, n, "{name}");
        assert!(said.contains(&format!("{n} of {} Gaussians lie apart", 1200 + n)), "{said}");
        assert!(found_db > sound_db - 1.0, "{name}: {found_db:.2} dB, {sound_db:.2} without");
    }
}

#[test]
fn scenes_stand_upright_by_what_the_file_says_or_the_command_line() {
    let home = folder("import_up");
    let picture = home.join("a.png");
    let upright = |said: &str, expected: &str| {
        assert!(said.contains(expected), "{said}");
        let [red, blue] = heights(&picture);
        assert!(red + 5.0 < blue, "{said}: the head at row {red:.1}, the feet at {blue:.1}");
    };
    let render = |splats: &Path, options: &[&str]| {
        let mut command = pocketsplat();
        command.arg("render").arg(splats).args(options).arg("-o").arg(&picture);
        succeeds(&mut command)
    };
    // y points down: the head is at −y, so that the figure of +y is upside down, as turned by the reader of .spz.
    let turned = |mut gaussians: Gaussians| {
        gaussians.centres.iter_mut().for_each(|centre| *centre = centre.map(|x| -x));
        gaussians
    };
    for (name, gaussians, comments, expected) in [
        ("down.ply", turned(figure(1)), &[][..], "up is -y, as in COLMAP's axes"),
        ("said.ply", turned(figure(1)), &["Vertical axis: y"], "up is -y, as a comment of the file says"),
        ("z.ply", figure(2), &["Vertical axis: z"], "up is +z, as a comment of the file says"),
        ("x.ply", turned(figure(0)), &["Vertical axis: -x"], "up is -x, as a comment of the file says"),
        ("down.spz", turned(figure(1)), &[], "which is y up in the axes of a .spz"),
        ("down.sog", turned(figure(1)), &[], "up is -y"),
    ] {
        let path = home.join(name);
        write(&path, &gaussians, comments);
        let said = render(&path, &["--orbit", "4", "--resolution", "64x64", "--contact-sheet"]);
        assert!(said.contains("--up says otherwise"), "{said}");
        // A sheet of four has two rows: one picture tells.
        upright(&render(&path, &["--preview", "--resolution", "64x64"]), expected);
    }
    let path = home.join("other.ply");
    write(&path, &figure(2), &[]);
    upright(&render(&path, &["--preview", "--up", "+z"]), "up is +z, as --up says");

    // The bundle, and what a device turns, inherit it.
    let bundle = home.join("a.psb");
    let (_, said) = imported(import(&path, &bundle).args(["--up", "+z"]));
    upright(&succeeds(pocketsplat().arg("render").arg(&bundle).args(["--preview", "-o"]).arg(&picture)), "");
    assert!(said.contains("up is +z"), "{said}");
    let turn = home.join("turn");
    succeeds(pocketsplat().arg("render").arg(&bundle).args(["--orbit", "4", "-o"]).arg(&turn));
    for i in 0..4 {
        let [red, blue] = heights(&turn.join(format!("{i:04}.png")));
        assert!(red + 3.0 < blue, "picture {i}: the head at row {red:.1}, the feet at {blue:.1}");
    }
    let said = fails(pocketsplat().arg("render").arg(&bundle).args(["--preview", "--up", "+z", "-o"]).arg(&picture));
    assert!(said.contains("a bundle has a camera of its own"), "{said}");
}

#[test]
fn hollow_objects_are_seen_from_around_unless_the_command_line_says_otherwise() {
    let home = folder("import_side");
    let path = home.join("ball.ply");
    write(&path, &ball(), &[]);
    let (result, said) = imported(&mut import(&path, &home.join("a.psb")));
    assert!(said.contains("cameras stand around it") && said.contains("--inside says otherwise"), "{said}");
    assert!(result["psnr_to_original_db"].as_f64().unwrap() > 15.0, "{result}");
    for (option, expected) in [("--inside", "cameras stand inside of it"), ("--around", "cameras stand around it")] {
        let (_, said) = imported(import(&path, &home.join("a.psb")).arg(option));
        assert!(said.contains(expected), "{said}");
        assert!(!said.contains("--inside says") && !said.contains("--around says"), "nothing was assumed: {said}");
    }
    let cameras = home.join("cameras.json");
    fs::write(&cameras, "{}").unwrap();
    let mut of_cameras = pocketsplat();
    of_cameras
        .arg("import")
        .arg(&path)
        .arg("-o")
        .arg(home.join("b.psb"))
        .arg("--inside")
        .arg("--cameras")
        .arg(&cameras);
    let said = fails(&mut of_cameras);
    assert!(said.contains("--cameras has some"), "{said}");
}

/// The commands in backquotes, as a shell gets them.
fn commands(said: &str) -> Vec<String> {
    said.split('`').skip(1).step_by(2).filter(|part| part.starts_with("pocketsplat ")).map(str::to_owned).collect()
}

/// Runs a command that was printed.
fn runs(command: &str, within: &Path) {
    let program = PathBuf::from(env!("CARGO_BIN_EXE_pocketsplat"));
    let line = command.replacen("pocketsplat", "\"$PROGRAM\"", 1);
    let done = Command::new("sh").args(["-c", &line]).env("PROGRAM", program).current_dir(within).output().unwrap();
    assert!(done.status.success(), "{command}: {}", text(&done.stderr));
}

#[test]
fn splats_are_looked_at_without_training() {
    let home = folder("view splats");
    let (path, page) = (home.join("it's a ball.ply"), home.join("a.html"));
    write(&path, &ball(), &["made \"by\" <b>hand</b>"]);
    let view = || {
        let mut command = pocketsplat();
        command.arg("view").arg(&path).arg("-o").arg(&page);
        command
    };
    succeeds(&mut view());
    let html = fs::read_to_string(&page).unwrap();
    assert_eq!(html.matches("<img src=\"data:image/jpeg;base64,").count(), 36);
    assert!(html.contains("<td>1200</td>") && html.contains("<td>-y</td>") && html.contains("it's a ball.ply"));
    assert!(!html.contains("://") && !html.contains("{{"), "nothing is fetched, no mark is left");
    fs::remove_file(&page).unwrap();

    let golden = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/golden/static.psb");
    let two = fails(view().arg(&golden));
    let package = fails(view().arg("--package").arg(home.join("pkg")));
    assert!(!page.exists() && !home.join("pkg").exists(), "nothing was written");
    let alone = fails(pocketsplat().arg("view").arg(&path).arg("--package").arg(home.join("pkg")));
    for said in [two, package, alone] {
        let all = commands(&said);
        assert!(!all.is_empty(), "{said}");
        for command in all {
            let quick = if command.contains(" import ") {
                format!("{command} --iterations 20 --views 7 --resolution 16x16")
            } else {
                command
            };
            runs(&quick, &home);
        }
    }
    let bundle = home.join("a.psb");
    fs::write(&bundle, undisturbed()).unwrap();
    let said = fails(pocketsplat().arg("view").arg(&bundle).args(["--around", "-o"]).arg(&page));
    assert!(said.contains("a bundle has a camera of its own"), "{said}");
}

/// Numbers of a file that lie elsewhere in its scene are drawn where they are.
#[test]
fn splats_whose_numbers_are_not_the_scenes_are_seen() {
    let home = folder("import_frame");
    let (here, moved) = (home.join("here.ply"), home.join("moved.ply"));
    write(&here, &ball(), &[]);
    write(&moved, &ball(), &["Frame: scene = file * 2 + (100, -30, 0)"]);
    let picture = |splats: &Path| {
        let picture = home.join("a.png");
        succeeds(pocketsplat().arg("render").arg(splats).args(["--preview", "-w", "-o"]).arg(&picture));
        image::open(&picture).unwrap().into_rgb8()
    };
    assert!(picture(&here).pixels().any(|pixel| pixel.0 != [0; 3]));
    assert!(picture(&moved) == picture(&here), "the same numbers from the same side");
    // Cameras of the scene: the bundle lies there, too. One looks away.
    let cameras = |name: &str, from: f64| {
        let path = home.join(name);
        let looks_away = |i: i32| i == 20;
        let camera = |i: i32| {
            let (x, z) = (114.0 + 0.1 * f64::from(i), if looks_away(i) { from + 30.0 } else { from });
            format!(
                r#"{{"width_px": 32, "height_px": 32, "focal_px": [40.0, 40.0], "principal_px": [16.0, 16.0],
                "rotation": [[1, 0, 0], [0, 1, 0], [0, 0, 1]], "translation": [{}, 16.0, {}]}}"#,
                -x, -z
            )
        };
        let all: Vec<String> = (0..21).map(camera).collect();
        fs::write(&path, format!(r#"{{"cameras": [{}]}}"#, all.join(", "))).unwrap();
        path
    };
    let with = |cameras: &Path| {
        let mut command = pocketsplat();
        command.arg("import").arg(&moved).arg("--cameras").arg(cameras).arg("-o").arg(home.join("a.psb"));
        command.args(["--iterations", "100", "--json", "--feature-dim", "8", "--offsets", "3"]);
        command
    };
    let (result, said) = imported(&mut with(&cameras("good.json", 0.0)));
    assert!(said.contains("warning: of 19 cameras of ") && said.contains("good.json 18 see a Gaussian of "), "{said}");
    assert!(result["drawn_offsets"].as_u64().unwrap() > 0, "{result}");
    let bundle = fs::read(home.join("a.psb")).unwrap();
    let said = fails(&mut with(&cameras("far.json", 1e4)));
    assert!(said.contains("of 19 cameras of ") && said.contains("far.json 0 see a Gaussian of "), "{said}");
    assert!(fs::read(home.join("a.psb")).unwrap() == bundle, "nothing is lost");
}

#[test]
fn cameras_of_a_file_draw_splats_in_their_own_frame() {
    let home = folder("render_splats");
    let (path, picture) = (home.join("a.ply"), home.join("a.png"));
    write(&path, &splats([([7.0, 7.0, 9.0], [1.7; 3]), ([7.2, 7.0, 9.0], [1.7; 3]), ([7.1, 7.1, 9.0], [1.7; 3])]), &[]);
    let cameras = home.join("cameras.json");
    let camera = r#"{"cameras": [{"width_px": 20, "height_px": 10, "focal_px": [20.0, 20.0], "principal_px": [10.0, 5.0],
        "rotation": [[1, 0, 0], [0, 1, 0], [0, 0, 1]], "translation": [-7.1, -7.03, -7.0]}]}"#;
    fs::write(&cameras, camera).unwrap();
    succeeds(pocketsplat().arg("render").arg(&path).arg("--camera").arg(&cameras).arg("-o").arg(&picture));
    let drawn = image::open(&picture).unwrap().into_rgb8();
    assert_eq!(drawn.dimensions(), (20, 10));
    assert!(drawn.get_pixel(10, 5).0[0] > 150 && drawn.get_pixel(1, 1).0[0] < 20);
    let mut two = pocketsplat();
    two.arg("render").arg(&path).args(["--inside", "--camera"]).arg(&cameras).arg("-o").arg(&picture);
    assert!(fails(&mut two).contains("--camera has some"));
    let nothing = Gaussians { opacity_logits: vec![-60.0; 3], ..splats([([0.0; 3], [0.0; 3]); 3]) };
    write(&path, &nothing, &[]);
    let said = fails(pocketsplat().arg("render").arg(&path).args(["--preview", "-o"]).arg(&picture));
    assert!(said.contains("no Gaussian is opaque"), "{said}");
}

#[test]
fn an_import_that_was_interrupted_goes_on_in_the_same_bytes() {
    let home = folder("import_interrupted");
    let (splats, whole, output) = (home.join("a.ply"), home.join("whole.psb"), home.join("a.psb"));
    write(&splats, &ball(), &[]);
    succeeds(&mut import(&splats, &whole));
    let mut child = starts(&mut import(&splats, &output));
    wait_for(&home.join("a.run"), 10, &mut child);
    signal(&child, "TERM");
    let ended = child.wait_with_output().unwrap();
    assert_eq!(ended.status.code(), Some(130));
    assert!(text(&ended.stderr).contains("give the same command again to go on"), "{}", text(&ended.stderr));

    let error = fails(&mut resume(&home.join("a.run")));
    assert!(error.contains("is of `pocketsplat import`; give that command again"), "{error}");
    let error = fails(import(&splats, &output).args(["--seed", "7"]));
    assert!(error.contains("`train.seed` is 42 in the run, 7 on the command line"), "{error}");
    let error = fails(import(&splats, &output).args(["--up", "+z"]));
    assert!(error.contains("a.run is another one"), "the pictures are others: {error}");
    let said = succeeds(&mut import(&splats, &output));
    assert!(said.contains("going on after iteration "), "{said}");
    assert_eq!(fs::read(&output).unwrap(), fs::read(&whole).unwrap());
    // Begun anew, whatever is left there.
    let mut child = starts(import(&splats, &output).args(["--seed", "7"]));
    wait_for(&home.join("a.run"), 10, &mut child);
    child.kill().unwrap();
    child.wait().unwrap();
    let said = succeeds(import(&splats, &output).arg("--overwrite"));
    assert!(!said.contains("going on") && fs::read(&output).unwrap() == fs::read(&whole).unwrap(), "{said}");
}
