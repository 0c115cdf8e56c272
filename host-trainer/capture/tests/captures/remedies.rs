//! Every remedy that reading a capture prints is done here once, and afterwards the capture loads whole and says it no more.
//!
//! What a foreign program does (COLMAP, ImageMagick, FFmpeg, unzip, Git LFS, nerfstudio) is quoted from its documentation and done by
//! hand: the file that it leaves is written where it leaves it.

use std::path::{Path, PathBuf};

use glam::{DMat3, DVec3};
use pocketsplat_capture::dataset::{FrameSize, LoadOptions, diagnose, load};

use crate::exports::{NSVF_MATRIX, write_metashape, write_nsvf, write_polycam, write_record3d};
use crate::fixture::Kind::{Blender, ColmapBinary, ColmapText, Nerfstudio};
use crate::fixture::{FOCAL_PX, Fixture, Kind, SIZE_PX, photo};

/// A capture that lacks something, and what is to be done about it.
struct Trouble {
    name: &'static str,
    kind: Kind,
    break_it: fn(&mut Fixture),
    /// Part of the remedy as it is printed.
    remedy: &'static str,
    /// Does it; gives the folder and the options to load with.
    mend: fn(&mut Fixture, &str) -> (PathBuf, LoadOptions),
}

const N_VIEWS: usize = 12;

/// The same folder, as before.
fn again(fixture: &Fixture) -> (PathBuf, LoadOptions) {
    (fixture.path().to_owned(), LoadOptions::default())
}

fn with(fixture: &Fixture, options: LoadOptions) -> (PathBuf, LoadOptions) {
    (fixture.path().to_owned(), options)
}

/// What a message has in the last pair of backticks before `behind`.
fn named(message: &str, behind: &str) -> PathBuf {
    let (before, _) = message.split_once(behind).expect("the remedy names it");
    PathBuf::from(before.trim_end_matches('`').rsplit('`').next().expect("a name in backticks"))
}

fn trouble(
    name: &'static str,
    kind: Kind,
    remedy: &'static str,
    break_it: fn(&mut Fixture),
    mend: fn(&mut Fixture, &str) -> (PathBuf, LoadOptions),
) -> Trouble {
    Trouble { name, kind, break_it, remedy, mend }
}

/// Does what it says: before, the remedy is printed; afterwards all views load and nobody prints it.
fn check(trouble: &Trouble, options: &LoadOptions) {
    let name = trouble.name;
    let mut fixture = Fixture::new(trouble.kind, N_VIEWS);
    fixture.points = (0..120).map(|i| DVec3::new(0.01 * f64::from(i) - 0.6, 0.2, 0.05 * f64::from(i % 7))).collect();
    (trouble.break_it)(&mut fixture);
    let said = |path: &Path, options: &LoadOptions| {
        let loaded = load(path, options).map(|(capture, report)| (capture.train.len() + capture.test.len(), report));
        let diagnosis = diagnose(path, options).to_string();
        match loaded {
            Ok((n, report)) => (n, format!("{report}\n{diagnosis}")),
            Err(error) => (0, format!("{error}\n{diagnosis}")),
        }
    };
    let (_, before) = said(fixture.path(), options);
    assert!(before.contains(trouble.remedy), "{name}: `{}` is not in: {before}", trouble.remedy);
    let (path, options) = (trouble.mend)(&mut fixture, &before);
    let (n, after) = said(&path, &options);
    assert_eq!(n, N_VIEWS, "{name}: after the remedy: {after}");
    assert!(!after.contains(trouble.remedy), "{name}: is still told: {after}");
}

fn check_all(troubles: &[Trouble]) {
    troubles.iter().for_each(|trouble| check(trouble, &LoadOptions::default()));
}

/// Replaces text of a written file.
fn replace(fixture: &Fixture, file: &str, from: &str, to: &str) {
    let text = std::fs::read_to_string(fixture.at(file)).expect("written");
    assert!(text.contains(from), "{from} is not in {file}");
    fixture.write(file, text.replace(from, to));
}

#[test]
fn remedies_for_folders() {
    check_all(&[
        trouble(
            "a folder further out",
            ColmapText,
            "/fox` is one, give that",
            |f| {
                f.write_files();
                std::fs::create_dir(f.at("fox")).expect("a folder");
                for name in ["images", "sparse"] {
                    std::fs::rename(f.at(name), f.at("fox").join(name)).expect("written");
                }
            },
            |_, said| (named(said, " is one, give that"), LoadOptions::default()),
        ),
        trouble(
            "several sizes",
            ColmapBinary,
            "choose one with `--images`",
            |f| {
                std::fs::rename(f.write_files().at("images"), f.at("images_2")).expect("a folder");
                f.write_image("images_4/p_00.png", (6, 4));
            },
            |f, _| with(f, LoadOptions { images: Some("images_2".to_owned()), ..LoadOptions::default() }),
        ),
        trouble(
            "no images",
            ColmapText,
            "put the photographs into `images`",
            |f| {
                std::fs::rename(f.write_files().at("images"), f.at("photos")).expect("a folder");
            },
            |f, _| {
                std::fs::rename(f.at("photos"), f.at("images")).expect("a folder");
                again(f)
            },
        ),
        trouble(
            "a file of poses missing",
            ColmapBinary,
            "check that the file is there and may be read",
            |f| {
                f.write_files().remove("sparse/0/images.bin");
            },
            |f, _| {
                f.write_files();
                again(f)
            },
        ),
    ]);
    // As a part of the capture is given.
    let fixture = Fixture::new(ColmapText, N_VIEWS);
    let part = fixture.write_files().at("sparse/0");
    let error = load(&part, &LoadOptions::default()).expect_err("a part").to_string();
    assert!(load(&named(&error, "; give that folder"), &LoadOptions::default()).is_ok(), "{error}");
    let file = fixture.at("images/p_00.png");
    assert!(
        load(&file, &LoadOptions::default()).expect_err("a file").to_string().contains("give the folder that holds")
    );
}

#[test]
fn options_without_effect_are_left_out() {
    let fixture = Fixture::new(Nerfstudio, N_VIEWS);
    write_nsvf(&fixture, NSVF_MATRIX, |_| "");
    let said = |options: &LoadOptions| fixture.load_with(options).expect("a capture").1.to_string();
    let ignored = LoadOptions { images: Some("rgb_2".to_owned()), ..LoadOptions::default() };
    assert!(said(&ignored).contains("leave it out") && !said(&LoadOptions::default()).contains("leave it out"));
}

#[test]
fn remedies_for_options() {
    let fixture = Fixture::new(ColmapBinary, N_VIEWS);
    fixture.write_files();
    let default = LoadOptions::default;
    for (options, remedy, mended) in [
        (LoadOptions { test_every: 1, ..default() }, "0 holds out none", LoadOptions { test_every: 0, ..default() }),
        (LoadOptions { max_resolution: Some(0), ..default() }, "leave it out to load", default()),
        (
            LoadOptions { model: Some(3), ..default() },
            "there are 0; give `--model` one of these",
            LoadOptions { model: Some(0), ..default() },
        ),
        (LoadOptions { model: Some(3), ..default() }, "or leave it out", default()),
        (
            LoadOptions { images: Some("images_8".to_owned()), ..default() },
            "give `--images` one that is there",
            LoadOptions { images: Some("images".to_owned()), ..default() },
        ),
        (
            LoadOptions { frame: Some(FrameSize { width_px: 90, height_px: 90 }), ..default() },
            "ask for a smaller frame",
            LoadOptions { frame: Some(FrameSize { width_px: 16, height_px: 16 }), ..default() },
        ),
    ] {
        let error = fixture.load_with(&options).expect_err(remedy).to_string();
        assert!(error.contains(remedy), "`{remedy}` is not in: {error}");
        assert!(fixture.load_with(&mended).is_ok(), "{remedy}");
    }
    let three = Fixture::new(ColmapText, 3);
    let error = three.write_files().load().expect_err("two to train on").to_string();
    assert!(
        error.contains("2 of 2 training views can be used, needed: at least 3; train on all 3 with `--test-every 0`"),
        "{error}"
    );
    let diagnosis = diagnose(three.path(), &default()).to_string();
    assert!(diagnosis.contains("train on all 3 with `--test-every 0`"), "{diagnosis}");
    let all = three.load_with(&LoadOptions { test_every: 0, ..default() }).expect("three are enough").0;
    assert_eq!((all.train.len(), all.test.len()), (3, 0));
    let two = Fixture::new(ColmapText, 2);
    let error = two.write_files().load().expect_err("two").to_string();
    assert!(error.contains("take more photographs") && !error.contains("--test-every"), "{error}");
    for (n, remedy) in [(0, "hold out every 8th image with `--test-every 8`"), (8, "")] {
        let report = fixture.load_with(&LoadOptions { test_every: n, ..default() }).expect("a capture").1.to_string();
        assert_eq!(report.contains("`--test-every 8`"), !remedy.is_empty() && report.contains(remedy), "{report}");
    }
}

#[test]
fn remedies_for_transforms() {
    check_all(&[
        trouble(
            "degrees",
            Blender,
            "convert it if it is in degrees",
            |f| {
                f.shared = "\"camera_angle_x\": 50".to_owned();
                f.write_files();
            },
            |f, _| {
                f.shared = format!("\"camera_angle_x\": {}", 50_f64.to_radians());
                f.write_files();
                again(f)
            },
        ),
        trouble(
            "no focal length",
            Nerfstudio,
            "give the focal length in pixels",
            |f| {
                f.shared = "\"w\": 24, \"h\": 16".to_owned();
                f.write_files();
            },
            |f, _| {
                f.shared.push_str(&format!(", \"fl_x\": {FOCAL_PX}"));
                f.write_files();
                again(f)
            },
        ),
        trouble(
            "no frames",
            Nerfstudio,
            "`frames`, each frame with `file_path` and a `transform_matrix`",
            |f| {
                f.write("transforms.json", "{\"fl_x\": 20}");
            },
            |f, _| {
                f.write_files();
                again(f)
            },
        ),
        trouble(
            "a web page",
            Nerfstudio,
            "it is a web page: the download failed: fetch the file itself again",
            |f| {
                f.write("transforms.json", "<!DOCTYPE html>");
            },
            |f, _| {
                f.write_files();
                again(f)
            },
        ),
        trouble(
            "a missing height",
            Nerfstudio,
            "needed: `h`; correct the camera's numbers",
            |f| {
                f.shared = "\"fl_x\": 40, \"cx\": 24, \"cy\": 24, \"w\": 48".to_owned();
                f.write_files();
            },
            |f, _| {
                f.shared = "\"fl_x\": 40, \"cx\": 24, \"cy\": 16, \"w\": 48, \"h\": 32".to_owned();
                f.write_files();
                again(f)
            },
        ),
        trouble(
            "another size",
            Nerfstudio,
            "needed: `w` and `h`",
            |f| {
                f.shared = "\"fl_x\": 40, \"cx\": 24, \"cy\": 16".to_owned();
                f.write_files();
            },
            |f, _| {
                f.shared.push_str(", \"w\": 48, \"h\": 32");
                f.write_files();
                again(f)
            },
        ),
        trouble(
            "a focal length and a field of view that differ",
            Nerfstudio,
            "needed: numbers that agree, or one of them",
            |f| {
                f.shared.push_str(", \"camera_angle_x\": 0.5");
                f.write_files();
            },
            |f, _| {
                f.shared = f.shared.replace(", \"camera_angle_x\": 0.5", "");
                f.write_files();
                again(f)
            },
        ),
        trouble(
            "a size of its own",
            Nerfstudio,
            "needed: `fl_x`, `fl_y`, `cx` and `cy` of its own",
            |f| {
                f.photos[3].extra = "\"w\": 48, \"h\": 32, ".to_owned();
                f.write_files();
            },
            |f, _| {
                f.photos[3].extra.push_str("\"fl_x\": 40, \"fl_y\": 40, \"cx\": 24, \"cy\": 16, ");
                f.write_files();
                again(f)
            },
        ),
        trouble(
            "axes of OpenCV",
            Nerfstudio,
            "turn the signs of the second and third column",
            |f| {
                let turned = DMat3::from_diagonal(DVec3::new(1.0, -1.0, -1.0));
                f.photos.iter_mut().for_each(|photo| photo.rotation *= turned);
                f.write_files();
            },
            |f, _| {
                // In the file alone, as a person does it.
                let mut json: serde_json::Value =
                    serde_json::from_slice(&std::fs::read(f.at("transforms.json")).expect("written")).expect("JSON");
                for frame in json["frames"].as_array_mut().expect("a list") {
                    for row in frame["transform_matrix"].as_array_mut().expect("rows").iter_mut().take(3) {
                        for column in [1, 2] {
                            row[column] = (-row[column].as_f64().expect("a number")).into();
                        }
                    }
                }
                f.write("transforms.json", json.to_string());
                again(f)
            },
        ),
        trouble(
            "points that are not there",
            Nerfstudio,
            "or take `ply_file_path` out",
            |f| {
                f.shared.push_str(", \"ply_file_path\": \"sparse.ply\"");
                f.write_files();
            },
            |f, _| {
                replace(f, "transforms.json", ", \"ply_file_path\": \"sparse.ply\"", "");
                again(f)
            },
        ),
        trouble(
            "points that are none",
            Nerfstudio,
            "or take `ply_file_path` out to start from random points",
            |f| {
                f.shared.push_str(", \"ply_file_path\": \"sparse.ply\"");
                f.write_files().write("sparse.ply", "solid cube");
            },
            |f, _| {
                replace(f, "transforms.json", ", \"ply_file_path\": \"sparse.ply\"", "");
                again(f)
            },
        ),
        trouble(
            "a focal length of pixels that are no squares",
            Nerfstudio,
            "check fl_x and fl_y",
            |f| {
                f.shared = "\"fl_x\": 20, \"fl_y\": 60".to_owned();
                f.write_files();
            },
            |f, _| {
                f.shared = "\"fl_x\": 20, \"fl_y\": 20".to_owned();
                f.write_files();
                again(f)
            },
        ),
    ]);
}

#[test]
fn remedies_for_views() {
    check_all(&[
        trouble(
            "a missing image",
            ColmapText,
            "restore it or take the view out of the model",
            |f| {
                f.write_files().remove("images/p_03.png");
            },
            |f, _| {
                f.write_image("images/p_03.png", SIZE_PX);
                again(f)
            },
        ),
        trouble(
            "two folders in one",
            ColmapText,
            "put each photograph where its name says",
            |f| {
                for i in 0..6 {
                    for (j, side) in [(i, "left"), (i + 6, "right")] {
                        f.photos[j].name = format!("{side}/p_{i:02}.png");
                    }
                }
                f.write_files();
            },
            |f, _| {
                for photo in &f.photos {
                    f.write_image(&format!("images/{}", photo.name), SIZE_PX);
                }
                again(f)
            },
        ),
        trouble(
            "a cut image",
            ColmapBinary,
            "replace it with a whole PNG, JPEG or WebP",
            |f| {
                let bytes = std::fs::read(f.write_files().at("images/p_05.png")).expect("written");
                f.write("images/p_05.png", &bytes[..60]);
            },
            |f, _| {
                f.write_image("images/p_05.png", SIZE_PX);
                again(f)
            },
        ),
        // Git LFS, `git lfs pull`: "Download Git LFS objects for the currently checked out ref, and update the working copy with the
        // downloaded content if required": the pointer becomes the file.
        trouble(
            "pointers of Git LFS",
            ColmapBinary,
            "run `git lfs pull` in its repository",
            |f| {
                f.write_files()
                    .write("images/p_05.png", "version https://git-lfs.github.com/spec/v1\noid sha256:0\nsize 9\n");
            },
            |f, _| {
                f.write_image("images/p_05.png", SIZE_PX);
                again(f)
            },
        ),
        // ImageMagick, `mogrify -format type`: "This option will convert any image to the image format you specify. … By default the file
        // is written to its original name. However, if the filename extension matches a supported format, the extension is replaced":
        // the converted file lies beside the first.
        trouble(
            "HEIC",
            ColmapText,
            "magick mogrify -format jpg -quality 95 '",
            |f| {
                f.photos.iter_mut().for_each(|photo| photo.name = photo.name.replace(".png", ".JPG"));
                f.write_files();
                for photo in &f.photos {
                    f.remove(&format!("images/{}", photo.name.replace(".JPG", ".png")));
                    f.write(&format!("images/{}", photo.name), b"\0\0\0\x18ftypheic\0\0\0\0");
                }
            },
            |f, _| {
                for photo in &f.photos {
                    f.write_image(&format!("images/{}", photo.name.replace(".JPG", ".jpg")), SIZE_PX);
                }
                again(f)
            },
        ),
        trouble(
            "an image of another size",
            Blender,
            "export it again at that size",
            |f| {
                f.write_files().write_image("images/p_06.png", (12, 8));
            },
            |f, _| {
                f.write_image("images/p_06.png", SIZE_PX);
                again(f)
            },
        ),
        trouble(
            "an image cut to another shape",
            Nerfstudio,
            "use the images that the poses were made from",
            |f| {
                f.write_files().write_image("images/p_06.png", (24, 10));
            },
            |f, _| {
                f.write_image("images/p_06.png", SIZE_PX);
                again(f)
            },
        ),
        trouble(
            "a distortion that is none",
            Nerfstudio,
            "needed: coefficients of a calibration that fits, or none",
            |f| {
                f.shared.push_str(", \"k1\": -44.85, \"k2\": 1017.4");
                f.write_files();
            },
            |f, _| {
                f.shared = f.shared.replace(", \"k1\": -44.85, \"k2\": 1017.4", "");
                f.write_files();
                again(f)
            },
        ),
        // COLMAP, `image_undistorter`: "Undistort images and/or export them for MVS or to external dense reconstruction software": the
        // cameras of the model that it writes are of the kind PINHOLE.
        trouble(
            "a camera that is not read",
            ColmapText,
            "undistort the capture first (COLMAP: image_undistorter)",
            |f| {
                f.cameras[0].model = (12, "SIMPLE_DIVISION");
                f.write_files();
            },
            |f, _| {
                f.cameras[0].model = (1, "PINHOLE");
                f.write_files();
                again(f)
            },
        ),
        trouble(
            "a mask that is not there",
            Nerfstudio,
            "restore the mask or take it out of the capture",
            |f| {
                f.photos[2].extra = "\"mask_path\": \"masks/2.png\", ".to_owned();
                f.write_files();
            },
            |f, _| {
                f.write_mask("masks/2.png", SIZE_PX);
                again(f)
            },
        ),
        trouble(
            "one mask for two",
            ColmapBinary,
            "restore the mask or take it out of the capture",
            |f| {
                for (i, side) in [(2, "left"), (3, "right")] {
                    f.photos[i].name = format!("{side}/p_02.png");
                    f.write_image(&format!("images/{side}/p_02.png"), SIZE_PX);
                }
                f.write_files().write_mask("masks/p_02.png.png", SIZE_PX);
            },
            |f, _| {
                f.remove("masks/p_02.png.png");
                f.photos.iter().for_each(|photo| f.write_mask(&format!("masks/{}.png", photo.name), SIZE_PX));
                again(f)
            },
        ),
        trouble(
            "masks that have other names",
            ColmapBinary,
            "name masks like their images, with `.png` behind the name",
            |f| {
                f.write_files().write_mask("masks/p_03.png.png", SIZE_PX);
                f.write_mask("masks/mask_04.png", SIZE_PX);
            },
            |f, _| {
                f.photos.iter().for_each(|photo| f.write_mask(&format!("masks/{}.png", photo.name), SIZE_PX));
                again(f)
            },
        ),
        trouble(
            "masks that nobody names",
            Nerfstudio,
            "name the mask of each photograph in its frame as `mask_path`",
            |f| {
                f.write_files().write_mask("masks/p_03.png", SIZE_PX);
            },
            |f, _| {
                f.photos[3].extra = "\"mask_path\": \"masks/p_03.png\", ".to_owned();
                f.write_files();
                again(f)
            },
        ),
        trouble(
            "masks that hide nothing",
            ColmapText,
            "make what does not count black or transparent in them",
            |f| {
                f.write_files();
                for photo in &f.photos {
                    f.write_image(&format!("masks/{}", photo.name), SIZE_PX);
                }
            },
            |f, _| {
                f.photos.iter().for_each(|photo| f.write_mask(&format!("masks/{}", photo.name), SIZE_PX));
                again(f)
            },
        ),
        trouble(
            "a pose with NaN",
            Nerfstudio,
            "export it again",
            |f| {
                f.photos[3].centre.x = f64::NAN;
                write_record3d(f, "metadata", "rgbd", 0);
            },
            |f, _| {
                let numbers = std::fs::read_to_string(f.at("metadata")).expect("written");
                f.write("metadata", numbers.replace("NaN", &format!("{:?}", photo(3, DVec3::ZERO).centre.x)));
                again(f)
            },
        ),
        trouble(
            "cameras in one place",
            Nerfstudio,
            "give views from different places",
            |f| {
                f.photos.iter_mut().for_each(|photo| photo.centre = DVec3::ONE);
                f.write_files();
            },
            |f, _| {
                f.photos = (0..N_VIEWS).map(|i| photo(i, DVec3::ZERO)).collect();
                f.write_files();
                again(f)
            },
        ),
    ]);
}

// FFmpeg, "-vf fps=2 … %04d.jpg" (image2 muxer): "The pattern may contain the string "%d" or "%0Nd", this string specifies the position of
// the characters representing a sequential number in the filenames": photographs 0001.jpg, … in `images`, as the next remedy needs them.
// unzip, `-d exdir`: "An optional directory to which to extract files": the capture's files in that folder.
// nerfstudio, `ns-process-data metashape --data {data directory} --xml {xml file} --output-dir {output directory}` ("Using custom data"):
// a folder with a `transforms.json`, which loads as any.
#[test]
fn remedies_for_captures_without_poses() {
    /// What COLMAP's mapper leaves in `sparse/0`, `--output_path`: "the reconstructed models are written to numbered folders".
    fn reconstruct(fixture: &mut Fixture, said: &str) -> (PathBuf, LoadOptions) {
        let sparse = said.lines().find_map(|line| line.split_once("mkdir -p ")).expect("a command").1;
        assert_eq!(unquoted(sparse), fixture.at("sparse"));
        fixture.write_files();
        again(fixture)
    }
    check_all(&[
        trouble("photographs", ColmapBinary, "make poses with COLMAP and give this folder again", |_| {}, reconstruct),
        trouble(
            "a camera of Polycam cut",
            Nerfstudio,
            "export the capture again",
            |f| {
                write_polycam(f, "cameras", "images");
                f.write("keyframes/cameras/p_04.json", "{\"fx\": 20");
            },
            |f, _| {
                let whole = std::fs::read(f.at("keyframes/cameras/p_05.json")).expect("written");
                f.write("keyframes/cameras/p_04.json", whole);
                again(f)
            },
        ),
        trouble(
            "cameras of Metashape without poses",
            Nerfstudio,
            "export again with File > Export > Export Cameras",
            |f| {
                f.write("cameras.xml", "<document><chunk><sensors/><cameras/></chunk></document>");
            },
            |f, _| {
                write_metashape(f, "frame");
                again(f)
            },
        ),
    ]);
}

/// The path of a word of a shell.
fn unquoted(word: &str) -> PathBuf {
    let plain = word.strip_prefix('\'').and_then(|word| word.strip_suffix('\'')).map(|word| word.replace("'\\''", "'"));
    PathBuf::from(plain.unwrap_or_else(|| word.to_owned()))
}

#[test]
fn commands_are_words_of_a_shell_whatever_the_folder_is_called() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let capture = folder.path().join("Ann's $HOME photographs");
    std::fs::create_dir_all(capture.join("images")).expect("a folder");
    std::fs::write(capture.join("images/1.HEIC"), "").expect("a file");
    std::fs::write(folder.path().join("Ann's.zip"), "").expect("a file");
    std::fs::write(folder.path().join("Ann's.mov"), "").expect("a file");
    let said = |path: &Path| load(path, &LoadOptions::default()).expect_err("no capture").to_string();
    for path in [capture.clone(), folder.path().join("Ann's.zip"), folder.path().join("Ann's.mov")] {
        let message = said(&path);
        let commands: Vec<&str> =
            message.lines().skip(1).filter(|line| line.starts_with("  ")).map(str::trim).collect();
        assert!(!commands.is_empty(), "{message}");
        for command in commands {
            // The shell itself says how it takes the words apart.
            let printed = std::process::Command::new("sh")
                .args(["-c", &format!("set -f; printf '%s\\n' {command}")])
                .output()
                .expect("a shell");
            assert!(printed.status.success(), "{command}");
            let words = String::from_utf8(printed.stdout).expect("text");
            let is_of_folder = |word: &str| word.starts_with(folder.path().to_str().expect("text"));
            assert!(words.lines().any(is_of_folder), "{command} is {words}");
            assert!(
                words.lines().filter(|word| is_of_folder(word)).all(|word| word.contains("Ann's")),
                "{command}: {words}"
            );
        }
    }
}

#[cfg(unix)]
#[test]
fn a_folder_that_is_no_utf_8_is_named_so_that_it_can_be_found() {
    use std::os::unix::ffi::OsStrExt as _;
    let fixture = Fixture::new(ColmapText, N_VIEWS);
    fixture.write_files().remove("images/p_03.png");
    let odd = fixture.at("outer").join(std::ffi::OsStr::from_bytes(b"caf\xe9"));
    std::fs::create_dir_all(&odd).expect("a folder");
    for name in ["images", "sparse"] {
        std::fs::rename(fixture.at(name), odd.join(name)).expect("written");
    }
    let diagnosis = diagnose(&odd, &LoadOptions::default());
    assert!(diagnosis.to_string().contains("/caf\\xe9/images/p_03.png` does not exist"), "{diagnosis}");
    let json = serde_json::to_value(&diagnosis).expect("JSON").to_string();
    assert!(json.contains("caf\\\\xe9"), "{json}");
    std::fs::remove_dir_all(odd.join("sparse")).expect("written");
    let error = load(&odd, &LoadOptions::default()).expect_err("no poses").to_string();
    let word = error.lines().find_map(|line| line.split_once("mkdir -p ")).expect("a command").1;
    assert!(word.starts_with("\"$(printf '") && word.ends_with("/caf\\351/sparse')\""), "{word}");
}

#[test]
fn remedies_for_doubtful_captures() {
    check_all(&[
        trouble(
            "a camera far away",
            ColmapBinary,
            "its pose is probably wrong: mend it, or take the view out",
            |f| {
                f.photos.push(photo(N_VIEWS, DVec3::ZERO));
                f.photos[N_VIEWS].centre *= 100.0;
                f.write_image("images/p_12.png", SIZE_PX);
                f.write_files();
            },
            |f, _| {
                f.photos.pop();
                f.write_files();
                again(f)
            },
        ),
        trouble(
            "coordinates of a map",
            ColmapText,
            "subtract a common offset from all poses and points",
            |f| move_by(f, DVec3::new(5e6, 5e6, 0.0)),
            |f, _| {
                move_by(f, -DVec3::new(5e6, 5e6, 0.0));
                again(f)
            },
        ),
        trouble(
            "an image listed twice",
            ColmapBinary,
            "list each image once",
            |f| {
                f.photos[6].name = f.photos[5].name.clone();
                f.write_files();
            },
            |f, _| {
                f.photos[6].name = "p_06.png".to_owned();
                f.write_files();
                again(f)
            },
        ),
        trouble(
            "a principal point outside",
            ColmapText,
            "check cx and cy: they are pixels from the image's corner",
            |f| {
                f.cameras[0].parameters[2] = 48.0;
                f.write_files();
            },
            |f, _| {
                f.cameras[0].parameters[2] = 12.0;
                f.write_files();
                again(f)
            },
        ),
        trouble(
            "few points",
            ColmapText,
            "or take the file out to start from random points",
            |f| {
                f.points.truncate(7);
                f.write_files();
            },
            |f, _| {
                f.remove("sparse/0/points3D.txt");
                again(f)
            },
        ),
        trouble(
            "several models",
            ColmapBinary,
            "choose another with `--model N`",
            |f| {
                f.write_files();
                std::fs::rename(f.at("sparse/0"), f.at("sparse/1")).expect("a model");
                let photos = f.photos.clone();
                f.photos.truncate(5);
                f.write_files();
                f.photos = photos;
            },
            |f, _| with(f, LoadOptions { model: Some(1), ..LoadOptions::default() }),
        ),
        trouble(
            "several folders of images",
            ColmapText,
            "choose another folder with `--images`",
            |f| {
                f.write_files().write_image("images_2/p_00.png", (12, 8));
            },
            |f, _| with(f, LoadOptions { images: Some("images".to_owned()), ..LoadOptions::default() }),
        ),
        trouble(
            "renderings without a test split",
            Blender,
            "move some frames of `transforms_train.json` into it",
            |f| f.write_files().write("transforms_test.json", "{\"camera_angle_x\": 0.7, \"frames\": []}"),
            |f, _| {
                f.write_files();
                again(f)
            },
        ),
        trouble(
            "names that no frame has",
            Nerfstudio,
            "they must be spelt like `file_path`",
            |f| {
                let names: Vec<String> = (1..N_VIEWS).map(|i| format!("\"images/p_{i:02}.png\"")).collect();
                let split = format!(
                    ", \"train_filenames\": [{}], \"test_filenames\": [\"pictures/p_00.png\"]",
                    names.join(", ")
                );
                f.shared.push_str(&split);
                f.write_files();
            },
            |f, _| {
                replace(f, "transforms.json", "pictures/p_00.png", "images/p_00.png");
                again(f)
            },
        ),
        trouble(
            "a pose with scale",
            Nerfstudio,
            "apply the camera's scale before exporting",
            |f| {
                f.photos[2].rotation *= 2.0;
                f.write_files();
            },
            |f, _| {
                f.photos[2].rotation *= 0.5;
                f.write_files();
                again(f)
            },
        ),
        trouble(
            "a mirrored pose",
            Nerfstudio,
            "negate one axis of the camera",
            |f| {
                f.photos[2].rotation *= DMat3::from_diagonal(DVec3::new(-1.0, 1.0, 1.0));
                f.write_files();
            },
            |f, _| {
                f.photos[2].rotation *= DMat3::from_diagonal(DVec3::new(-1.0, 1.0, 1.0));
                f.write_files();
                again(f)
            },
        ),
        trouble(
            "a skew",
            Nerfstudio,
            "remove it from the photographs first",
            |f| write_nsvf(f, &NSVF_MATRIX.replacen("20.0 0 ", "20.0 4 ", 1), |_| ""),
            |f, _| {
                f.write("intrinsics.txt", NSVF_MATRIX);
                again(f)
            },
        ),
    ]);
}

/// Moves cameras and points, and writes them.
fn move_by(fixture: &mut Fixture, offset: DVec3) {
    fixture.photos.iter_mut().for_each(|photo| photo.centre += offset);
    fixture.points.iter_mut().for_each(|point| *point += offset);
    fixture.write_files();
}

#[test]
fn a_packed_file_is_unpacked_by_the_commands_that_are_printed() {
    let gzip = |args: &[&str], path: &Path| std::process::Command::new("gzip").args(args).arg(path).status();
    let fixture = Fixture::new(ColmapText, N_VIEWS);
    let path = fixture.write_files().at("sparse/0/points3D.txt");
    if !gzip(&["-k"], &path).is_ok_and(|status| status.success()) {
        eprintln!("skipped: no gzip on this machine");
        return;
    }
    std::fs::rename(fixture.at("sparse/0/points3D.txt.gz"), &path).expect("packed");
    let error = fixture.load().expect_err("a gzip file").to_string();
    assert!(error.contains("points3D.txt` is a gzip file"), "{error}");
    for command in error.lines().skip(1) {
        let done = std::process::Command::new("sh").args(["-c", command]).status().expect("a shell");
        assert!(done.success(), "{command}");
    }
    assert_eq!(fixture.load().expect("a sound capture").0.train.len(), 10);
}
