//! Remedies for folders, and for options of loading.

use super::*;

#[test]
fn remedies_for_folders() {
    check_all(&[
        trouble("a folder further out", ColmapText, |f| {
            f.write_files();
            std::fs::create_dir(f.at("fox")).expect("a folder");
            for name in ["images", "sparse"] {
                std::fs::rename(f.at(name), f.at("fox").join(name)).expect("written");
            }
        })
        .remedy("/fox` is one, give that", |_, said| (named(said, " is one, give that"), LoadOptions::default())),
        trouble("several sizes", ColmapBinary, |f| {
            std::fs::rename(f.write_files().at("images"), f.at("images_2")).expect("a folder");
            f.write_image("images_4/p_00.png", (6, 4));
        })
        .remedy("choose one with `--images`", |f, _| {
            with(f, LoadOptions { images: Some("images_2".to_owned()), ..LoadOptions::default() })
        }),
        trouble("no images", ColmapText, |f| {
            std::fs::rename(f.write_files().at("images"), f.at("photos")).expect("a folder");
        })
        .remedy("put the photographs into `images`", |f, _| {
            std::fs::rename(f.at("photos"), f.at("images")).expect("a folder");
            again(f)
        }),
        trouble("a file of poses missing", ColmapBinary, |f| {
            f.write_files().remove("sparse/0/images.bin");
        })
        .remedy("check that the file is there and may be read", |f, _| {
            f.write_files();
            again(f)
        }),
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
    let with_own_split = Fixture::new(Blender, N_VIEWS);
    with_own_split.write_files();
    let said = |fixture: &Fixture, test_every| {
        let options = LoadOptions { test_every, ..LoadOptions::default() };
        fixture.load_with(&options).expect("a capture").1.to_string()
    };
    let warning = "a split of its own, so `--test-every 5` holds out nothing; leave it out";
    assert!(said(&with_own_split, 5).contains(warning) && !said(&with_own_split, 8).contains("leave it out"));
    assert!(!said(&fixture, 5).contains("leave it out"));
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
