//! COLMAP models whose files are missing, damaged, hostile, or of a camera that is not read.

use super::Harm::Fatal;
use super::{Case, case, cut, edit};
use crate::fixture::Fixture;
use crate::fixture::Kind::{ColmapBinary, ColmapText};

/// Overwrites bytes of a written file.
fn poke(fixture: &Fixture, name: &str, at: usize, with: &[u8]) {
    let mut bytes = std::fs::read(fixture.at(name)).expect("it was written");
    bytes[at..at + with.len()].copy_from_slice(with);
    fixture.write(name, bytes);
}

pub(super) fn cases() -> Vec<Case> {
    vec![
        case("images.bin missing", ColmapBinary, Fatal, "unreadable-file", |f| {
            f.write_files().remove("sparse/0/images.bin");
        })
        .says(&["sparse/0/images.bin`: "]),
        case("cameras.bin empty", ColmapBinary, Fatal, "bad-model", |f| {
            f.write_files().write("sparse/0/cameras.bin", "")
        })
        .says(&[
            "cameras.bin`: byte 0: the file has 0 bytes, needed: 8 for the count of cameras; export the model again",
        ]),
        case("a pointer of Git LFS for a model", ColmapBinary, Fatal, "bad-model", |f| {
            f.write_files().write("sparse/0/images.bin", "version https://git-lfs.github.com/spec/v1\noid sha256:0\n")
        })
        .says(&["images.bin` is a Git LFS pointer, not the file itself, needed: the file of a reconstruction; run \
                 `git lfs pull`"]),
        case("an equirectangular camera", ColmapBinary, Fatal, "camera-model", |f| {
            f.cameras[0].model.0 = 17;
            f.cameras[0].parameters.truncate(2);
            f.write_files();
        })
        .says(&["camera 1 has the camera model `EQUIRECTANGULAR`, needed: PINHOLE", "image_undistorter"]),
        case("a hostile count of cameras", ColmapBinary, Fatal, "bad-model", |f| {
            poke(f.write_files(), "sparse/0/cameras.bin", 0, &[255; 8])
        })
        .says(&["cameras.bin`: byte 0: 18446744073709551615 cameras are announced, but the 56 bytes that follow \
                 hold at most 2"]),
        case("a hostile count of observations", ColmapBinary, Fatal, "bad-model", |f| {
            // Behind the count, the number, seven doubles, the camera's number and `p_00.png\0`.
            poke(f.write_files(), "sparse/0/images.bin", 8 + 4 + 56 + 4 + 9, &(1_u64 << 63).to_le_bytes())
        })
        .says(&["images.bin`: image 1 of 12, byte 89: 9223372036854775808 observations are announced, but only "]),
        case("a hostile track", ColmapBinary, Fatal, "bad-model", |f| {
            poke(f.write_files(), "sparse/0/points3D.bin", 8 + 43, &(1_u64 << 61).to_le_bytes())
        })
        .says(&["points3D.bin`: point 1 of 120, byte 59: 2305843009213693952 track elements are announced"]),
        case("images.bin cut", ColmapBinary, Fatal, "bad-model", |f| {
            // Enough bytes for 12 of the smallest images.
            cut(f.write_files(), "sparse/0/images.bin", 1160);
        })
        .says(&[
            "images.bin`: image 9 of 12, byte 1",
            "bytes follow; export the model again, or copy it again if the file was cut",
        ]),
        case("a name without end", ColmapBinary, Fatal, "bad-model", |f| {
            f.photos[11].name = "n".repeat(5000);
            f.write_files();
        })
        .says(&["images.bin`: image 12 of 12, byte", "the name does not end within 4096 bytes or the file"]),
        case("a camera model of the future", ColmapBinary, Fatal, "bad-model", |f| {
            f.cameras[0].model.0 = 77;
            f.write_files();
        })
        .says(&["cameras.bin`: camera 1 of 1, byte 32: the camera model has the number 77, known: 0 to 17"]),
        case("a fisheye with prisms in a binary model", ColmapBinary, Fatal, "camera-model", |f| {
            f.cameras[0].model.0 = 10;
            f.cameras[0].parameters.resize(12, 0.0);
            f.write_files();
        })
        .says(&["camera 1 has the camera model `THIN_PRISM_FISHEYE`, needed: PINHOLE", "image_undistorter"]),
        case("an unheard-of model in a text model", ColmapText, Fatal, "camera-model", |f| {
            f.cameras[0].model.1 = "EUCM";
            f.cameras[0].parameters.resize(6, 0.0);
            f.write_files();
        })
        .says(&["cameras.txt`: camera 1 has the camera model `EUCM`, needed: PINHOLE", "OPENCV_FISHEYE"]),
        case("a parameter too few", ColmapText, Fatal, "bad-model", |f| {
            f.cameras[0].parameters.pop();
            f.write_files();
        })
        .says(&["cameras.txt`: line 2: PINHOLE has 3 parameters, needed: 4"]),
        case("a camera listed twice", ColmapText, Fatal, "bad-model", |f| {
            f.cameras.push(f.cameras[0].clone());
            f.write_files();
        })
        .says(&["line 3: camera 1 is listed twice"]),
        case("a word where a number is needed", ColmapText, Fatal, "bad-model", |f| {
            edit(f.write_files(), "sparse/0/images.txt", |text| {
                text.replacen("1 1.0", "1 east", 1).replacen("1 0.9", "1 east 0.9", 1)
            })
        })
        .says(&["images.txt`: line 2: `east` is no quaternion"]),
        case("the empty lines of images.txt taken out", ColmapText, Fatal, "bad-model", |f| {
            edit(f.write_files(), "sparse/0/images.txt", |text| text.replace("\n\n", "\n"))
        })
        .says(&["images.txt`: line 5: 10 numbers of observations, needed: 3 for each; one of an image's two lines \
                 is missing"]),
        case("a line cut", ColmapText, Fatal, "bad-model", |f| {
            edit(f.write_files(), "sparse/0/points3D.txt", |text| {
                text.lines().take(2).collect::<Vec<_>>().join("\n") + "\n0 1.5"
            });
        })
        .says(&["points3D.txt`: line 3: the line ends where the coordinate"]),
        case("no image posed", ColmapBinary, Fatal, "too-few-views", |f| {
            f.photos.clear();
            f.write_files();
        })
        .says(&["0 of 0 training views can be used, needed: at least 3"]),
    ]
}
