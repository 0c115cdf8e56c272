//! Remedies for views that are left out.

use super::*;

#[test]
fn remedies_for_views() {
    check_all(&[
        trouble("a missing image", ColmapText, |f| {
            f.write_files().remove("images/p_03.png");
        })
        .remedy("restore it or take the view out of the model", |f, _| {
            f.write_image("images/p_03.png", SIZE_PX);
            again(f)
        }),
        trouble("two folders in one", ColmapText, |f| {
            for i in 0..6 {
                for (j, side) in [(i, "left"), (i + 6, "right")] {
                    f.photos[j].name = format!("{side}/p_{i:02}.png");
                }
            }
            f.write_files();
        })
        .remedy("put each photograph where its name says", |f, _| {
            for photo in &f.photos {
                f.write_image(&format!("images/{}", photo.name), SIZE_PX);
            }
            again(f)
        }),
        trouble("a cut image", ColmapBinary, |f| {
            let bytes = std::fs::read(f.write_files().at("images/p_05.png")).expect("written");
            f.write("images/p_05.png", &bytes[..60]);
        })
        .remedy("replace it with a whole PNG, JPEG or WebP", |f, _| {
            f.write_image("images/p_05.png", SIZE_PX);
            again(f)
        }),
        // Git LFS, `git lfs pull`: "Download Git LFS objects for the currently checked out ref, and update the working copy with the
        // downloaded content if required": the pointer becomes the file.
        trouble("pointers of Git LFS", ColmapBinary, |f| {
            f.write_files()
                .write("images/p_05.png", "version https://git-lfs.github.com/spec/v1\noid sha256:0\nsize 9\n");
        })
        .remedy("run `git lfs pull` in its repository", |f, _| {
            f.write_image("images/p_05.png", SIZE_PX);
            again(f)
        }),
        // ImageMagick, `mogrify -format type`: "This option will convert any image to the image format you specify. … By default the file
        // is written to its original name. However, if the filename extension matches a supported format, the extension is replaced":
        // the converted file lies beside the first.
        trouble("HEIC", ColmapText, |f| {
            f.photos.iter_mut().for_each(|photo| photo.name = photo.name.replace(".png", ".JPG"));
            f.write_files();
            for photo in &f.photos {
                f.remove(&format!("images/{}", photo.name.replace(".JPG", ".png")));
                f.write(&format!("images/{}", photo.name), b"\0\0\0\x18ftypheic\0\0\0\0");
            }
        })
        .remedy("magick mogrify -format jpg -quality 95 '", |f, _| {
            for photo in &f.photos {
                f.write_image(&format!("images/{}", photo.name.replace(".JPG", ".jpg")), SIZE_PX);
            }
            again(f)
        }),
        trouble("an image of another size", Blender, |f| {
            f.write_files().write_image("images/p_06.png", (12, 8));
        })
        .remedy("export it again at that size", |f, _| {
            f.write_image("images/p_06.png", SIZE_PX);
            again(f)
        }),
        trouble("an image cut to another shape", Nerfstudio, |f| {
            f.write_files().write_image("images/p_06.png", (24, 10));
        })
        .remedy("use the images that the poses were made from", |f, _| {
            f.write_image("images/p_06.png", SIZE_PX);
            again(f)
        }),
        trouble("a distortion that is none", Nerfstudio, |f| {
            f.shared.push_str(", \"k1\": -44.85, \"k2\": 1017.4");
            f.write_files();
        })
        .remedy("needed: coefficients of a calibration that fits, or none", |f, _| {
            f.shared = f.shared.replace(", \"k1\": -44.85, \"k2\": 1017.4", "");
            f.write_files();
            again(f)
        }),
        // COLMAP, `image_undistorter`: "Undistort images and/or export them for MVS or to external dense reconstruction software": the
        // cameras of the model that it writes are of the kind PINHOLE.
        trouble("a camera that is not read", ColmapText, |f| {
            f.cameras[0].model = (12, "SIMPLE_DIVISION");
            f.write_files();
        })
        .remedy("undistort the capture first (COLMAP: image_undistorter)", |f, _| {
            f.cameras[0].model = (1, "PINHOLE");
            f.write_files();
            again(f)
        }),
        trouble("a mask that is not there", Nerfstudio, |f| {
            f.photos[2].extra = "\"mask_path\": \"masks/2.png\", ".to_owned();
            f.write_files();
        })
        .remedy("restore the mask or take it out of the capture", |f, _| {
            f.write_mask("masks/2.png", SIZE_PX);
            again(f)
        }),
        trouble("one mask for two", ColmapBinary, |f| {
            for (i, side) in [(2, "left"), (3, "right")] {
                f.photos[i].name = format!("{side}/p_02.png");
                f.write_image(&format!("images/{side}/p_02.png"), SIZE_PX);
            }
            f.write_files().write_mask("masks/p_02.png.png", SIZE_PX);
        })
        .remedy("restore the mask or take it out of the capture", |f, _| {
            f.remove("masks/p_02.png.png");
            f.photos.iter().for_each(|photo| f.write_mask(&format!("masks/{}.png", photo.name), SIZE_PX));
            again(f)
        }),
        trouble("masks that have other names", ColmapBinary, |f| {
            f.write_files().write_mask("masks/p_03.png.png", SIZE_PX);
            f.write_mask("masks/mask_04.png", SIZE_PX);
        })
        .remedy("name masks like their images, with `.png` behind the name", |f, _| {
            f.photos.iter().for_each(|photo| f.write_mask(&format!("masks/{}.png", photo.name), SIZE_PX));
            again(f)
        }),
        trouble("masks that nobody names", Nerfstudio, |f| {
            f.write_files().write_mask("masks/p_03.png", SIZE_PX);
        })
        .remedy("name the mask of each photograph in its frame as `mask_path`", |f, _| {
            f.photos[3].extra = "\"mask_path\": \"masks/p_03.png\", ".to_owned();
            f.write_files();
            again(f)
        }),
        trouble("masks that hide nothing", ColmapText, |f| {
            f.write_files();
            for photo in &f.photos {
                f.write_image(&format!("masks/{}", photo.name), SIZE_PX);
            }
        })
        .remedy("make what does not count black or transparent in them", |f, _| {
            f.photos.iter().for_each(|photo| f.write_mask(&format!("masks/{}", photo.name), SIZE_PX));
            again(f)
        }),
        trouble("a pose with NaN", Nerfstudio, |f| {
            f.photos[3].centre.x = f64::NAN;
            write_record3d(f, "metadata", "rgbd", 0);
        })
        .remedy("export it again", |f, _| {
            let numbers = std::fs::read_to_string(f.at("metadata")).expect("written");
            f.write("metadata", numbers.replace("NaN", &format!("{:?}", photo(3, DVec3::ZERO).centre.x)));
            again(f)
        }),
        trouble("cameras in one place", Nerfstudio, |f| {
            f.photos.iter_mut().for_each(|photo| photo.centre = DVec3::ONE);
            f.write_files();
        })
        .remedy("give views from different places", |f, _| {
            f.photos = (0..N_VIEWS).map(|i| photo(i, DVec3::ZERO)).collect();
            f.write_files();
            again(f)
        }),
    ]);
}

// FFmpeg, "-vf fps=2 … %04d.jpg" (image2 muxer): "The pattern may contain the string "%d" or "%0Nd", this string specifies the position of
// the characters representing a sequential number in the filenames": photographs 0001.jpg, … in `images`, as the next remedy needs them.
// unzip, `-d exdir`: "An optional directory to which to extract files": the capture's files in that folder.
// nerfstudio, `ns-process-data metashape --data {data directory} --xml {xml file} --output-dir {output directory}` ("Using custom data"):
// a folder with a `transforms.json`, which loads as any.
