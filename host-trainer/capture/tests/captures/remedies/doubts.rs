//! Remedies for what `doctor` doubts.

use super::*;

#[test]
fn remedies_for_doubtful_captures() {
    check_all(&[
        trouble("a camera far away", ColmapBinary, |f| {
            f.photos.push(photo(N_VIEWS, DVec3::ZERO));
            f.photos[N_VIEWS].centre *= 100.0;
            f.write_image("images/p_12.png", SIZE_PX);
            f.write_files();
        })
        .remedy("its pose is probably wrong: mend it, or take the view out", |f, _| {
            f.photos.pop();
            f.write_files();
            again(f)
        }),
        trouble("coordinates of a map", ColmapText, |f| move_by(f, DVec3::new(5e6, 5e6, 0.0))).remedy(
            "subtract a common offset from all poses and points",
            |f, _| {
                move_by(f, -DVec3::new(5e6, 5e6, 0.0));
                again(f)
            },
        ),
        trouble("an image listed twice", ColmapBinary, |f| {
            f.photos[6].name = f.photos[5].name.clone();
            f.write_files();
        })
        .remedy("list each image once", |f, _| {
            f.photos[6].name = "p_06.png".to_owned();
            f.write_files();
            again(f)
        }),
        trouble("a principal point outside", ColmapText, |f| {
            f.cameras[0].parameters[2] = 48.0;
            f.write_files();
        })
        .remedy("check cx and cy: they are pixels from the image's corner", |f, _| {
            f.cameras[0].parameters[2] = 12.0;
            f.write_files();
            again(f)
        }),
        trouble("few points", ColmapText, |f| {
            f.points.truncate(7);
            f.write_files();
        })
        .remedy("or take the file out, and training makes points", |f, _| {
            f.remove("sparse/0/points3D.txt");
            again(f)
        }),
        trouble("several models", ColmapBinary, |f| {
            f.write_files();
            std::fs::rename(f.at("sparse/0"), f.at("sparse/1")).expect("a model");
            let photos = f.photos.clone();
            f.photos.truncate(5);
            f.write_files();
            f.photos = photos;
        })
        .remedy("choose another with `--model N`", |f, _| {
            with(f, LoadOptions { model: Some(1), ..LoadOptions::default() })
        }),
        trouble("several folders of images", ColmapText, |f| {
            f.write_files().write_image("images_2/p_00.png", (12, 8));
        })
        .remedy("choose another folder with `--images`", |f, _| {
            with(f, LoadOptions { images: Some("images".to_owned()), ..LoadOptions::default() })
        }),
        trouble("renderings without a test split", Blender, |f| {
            f.write_files().write("transforms_test.json", "{\"camera_angle_x\": 0.7, \"frames\": []}")
        })
        .remedy("move some frames of `transforms_train.json` into it", |f, _| {
            f.write_files();
            again(f)
        }),
        trouble("names that no frame has", Nerfstudio, |f| {
            let names: Vec<String> = (1..N_VIEWS).map(|i| format!("\"images/p_{i:02}.png\"")).collect();
            let split =
                format!(", \"train_filenames\": [{}], \"test_filenames\": [\"pictures/p_00.png\"]", names.join(", "));
            f.shared.push_str(&split);
            f.write_files();
        })
        .remedy("they must be spelt like `file_path`", |f, _| {
            replace(f, "transforms.json", "pictures/p_00.png", "images/p_00.png");
            again(f)
        }),
        trouble("a pose with scale", Nerfstudio, |f| {
            f.photos[2].rotation *= 2.0;
            f.write_files();
        })
        .remedy("apply the camera's scale before exporting", |f, _| {
            f.photos[2].rotation *= 0.5;
            f.write_files();
            again(f)
        }),
        trouble("a mirrored pose", Nerfstudio, |f| {
            f.photos[2].rotation *= DMat3::from_diagonal(DVec3::new(-1.0, 1.0, 1.0));
            f.write_files();
        })
        .remedy("negate one axis of the camera", |f, _| {
            f.photos[2].rotation *= DMat3::from_diagonal(DVec3::new(-1.0, 1.0, 1.0));
            f.write_files();
            again(f)
        }),
        trouble("a skew", Nerfstudio, |f| write_nsvf(f, &NSVF_MATRIX.replacen("20.0 0 ", "20.0 4 ", 1), |_| ""))
            .remedy("remove it from the photographs first", |f, _| {
                f.write("intrinsics.txt", NSVF_MATRIX);
                again(f)
            }),
    ]);
}

/// Moves cameras and points, and writes them.
fn move_by(fixture: &mut Fixture, offset: DVec3) {
    fixture.photos.iter_mut().for_each(|photo| photo.centre += offset);
    fixture.points.iter_mut().for_each(|point| *point += offset);
    fixture.write_files();
}
