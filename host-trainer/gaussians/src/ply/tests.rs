use proptest::prelude::*;

use super::{read, write};
use crate::tests::{example, of_degree};
use crate::{Degree, Gaussians, Notes};

fn found(bytes: &[u8]) -> String {
    read(bytes).expect_err("broken").to_string()
}

/// A header of ours with other lines in place of some.
fn with_header(gaussians: &Gaussians, change: impl Fn(String) -> String) -> Vec<u8> {
    let bytes = write(gaussians, &Notes::default());
    let end = bytes.windows(11).position(|window| window == b"end_header\n").expect("a header") + 11;
    let header = change(String::from_utf8(bytes[..end].to_vec()).expect("text"));
    [header.as_bytes(), &bytes[end..]].concat()
}

#[test]
fn what_is_written_is_read() {
    for degree in Degree::ALL {
        for n in [0, 1, 7] {
            let gaussians = of_degree(degree, n);
            let comments = vec!["Made for a test".to_owned()];
            let notes = Notes { compensation: n == 1, comments, ignored: Vec::new() };
            let bytes = write(&gaussians, &notes);
            assert_eq!(read(&bytes), Ok((gaussians, notes)));
        }
    }
}

#[test]
fn the_layout_is_the_published_one() {
    let mut gaussians = example();
    gaussians.harmonics[1] = [0.25, 0.5, 0.75];
    let bytes = write(&gaussians, &Notes::default());
    let text = String::from_utf8_lossy(&bytes);
    let header = text.split("end_header\n").next().expect("a header");
    let names: Vec<&str> = header.lines().filter_map(|line| line.strip_prefix("property float ")).collect();
    assert_eq!(names.len(), 62);
    assert_eq!(
        (names[0], names[6], names[9], names[54], names[55], names[58]),
        ("x", "f_dc_0", "f_rest_0", "opacity", "scale_0", "rot_0")
    );
    assert!(header.contains("comment SplatRenderMode: default\ncomment SH degree: 3\nelement vertex 3\n"));
    let body = &bytes[bytes.len() - 3 * 62 * 4..];
    let number = |index: usize| f32::from_le_bytes(body[4 * index..4 * index + 4].try_into().expect("4 bytes"));
    // Channel after channel, 15 coefficients each.
    assert_eq!([number(9), number(9 + 15), number(9 + 30)], [0.25, 0.5, 0.75]);
    assert_eq!(number(58), gaussians.rotations[0][0]);
}

#[test]
fn order_type_and_encoding_do_not_matter() {
    let header = |format: &str| {
        format!(
            "ply\r\nformat {format} 1.0\r\nelement camera 1\r\nproperty int id\r\nelement vertex 1\r\nproperty uchar rot_3\r\nproperty double x\r\n\
             property float y\r\nproperty short z\r\nproperty float rot_0\r\nproperty float rot_1\r\nproperty float rot_2\r\n\
             property int opacity\r\nproperty char f_dc_0\r\nproperty ushort f_dc_1\r\nproperty uint f_dc_2\r\nproperty float scale_2\r\n\
             property float scale_1\r\nproperty float scale_0\r\nproperty uchar red\r\nend_header\r\n"
        )
    };
    let ascii = format!("{}7\r\n9 1.5 -2 3 0.5 0.25 0.125 -4 -5 600 70000 -1 -2 -3e0 255\r\n", header("ascii"));
    let mut big = header("binary_big_endian").into_bytes();
    let mut little = header("binary_little_endian").into_bytes();
    macro_rules! put {
        ($($number:expr),*) => { $( big.extend($number.to_be_bytes()); little.extend($number.to_le_bytes()); )* };
    }
    put!(
        7i32, 9u8, 1.5f64, -2.0f32, 3i16, 0.5f32, 0.25f32, 0.125f32, -4i32, -5i8, 600u16, 70_000u32, -1.0f32, -2.0f32,
        -3.0f32, 255u8
    );
    let expected = Gaussians {
        degree: Degree::Zero,
        centres: vec![[1.5, -2.0, 3.0]],
        log_scales: vec![[-3.0, -2.0, -1.0]],
        rotations: vec![[0.5, 0.25, 0.125, 9.0]],
        opacity_logits: vec![-4.0],
        harmonics: vec![[-5.0, 600.0, 70_000.0]],
    };
    let ignored = vec!["property red".to_owned(), "element camera".to_owned()];
    let notes = Notes { ignored, ..Notes::default() };
    for bytes in [ascii.as_bytes(), &big, &little] {
        assert_eq!(read(bytes), Ok((expected.clone(), notes.clone())));
    }
}

#[test]
fn what_is_no_gaussians_is_named() {
    assert!(found(b"solid").contains("does not start with `ply`"));
    assert!(found(b"ply\nformat ascii 1.0\n").contains("has no line `end_header`"));
    let points = "element vertex 1\nproperty float x\nproperty float y\nproperty float z\n";
    let cloud = format!("ply\nformat ascii 1.0\n{points}end_header\n1 2 3\n");
    assert!(
        found(cloud.as_bytes())
            .starts_with("is a bare point cloud, not Gaussians: its vertices have no property `f_dc_0`")
    );
    let mesh = format!(
        "ply\nformat ascii 1.0\n{points}element face 1\nproperty list uchar int vertex_index\nend_header\n1 2 3\n3 0 0 0\n"
    );
    assert!(found(mesh.as_bytes()).starts_with("is a mesh, not Gaussians"));
    let packed = "ply\nformat binary_little_endian 1.0\nelement vertex 0\nproperty uint packed_position\nend_header\n";
    assert!(found(packed.as_bytes()).starts_with("is a compressed .ply"));
    let without = with_header(&example(), |header| header.replace(" rot_2", " rot_9"));
    assert_eq!(found(&without), "is no complete file of Gaussians: its vertices have no property `rot_2`");
    let surfels = with_header(&example(), |header| header.replace("Mode: default", "Mode: 2dgs"));
    assert!(found(&surfels).starts_with("says `SplatRenderMode: 2dgs`"));
    let twice = with_header(&example(), |header| header.replace("f_rest_8\n", "f_rest_7\n"));
    assert!(found(&twice).starts_with("lists the property `f_rest_7` of its vertices twice"));
    let gap = with_header(&example(), |header| header.replace("f_rest_8\n", "f_rest_99\n"));
    assert_eq!(found(&gap), "has 45 properties `f_rest_…`, and `f_rest_8` is not among them");
    let few = with_header(&example(), |header| header.replace("property float f_rest_44\n", ""));
    assert!(found(&few).starts_with("has 44 properties `f_rest_…`; spherical harmonics"));
}

#[test]
fn a_cut_file_and_an_absurd_count_say_how_many_there_are() {
    let bytes = write(&example(), &Notes::default());
    assert!(found(&bytes[..bytes.len() - 1]).starts_with("is cut off: it holds 2 of the 3 Gaussians"));
    let absurd = with_header(&example(), |header| header.replace("vertex 3", "vertex 18446744073709551615"));
    assert!(found(&absurd).starts_with("is cut off: it holds 3 of the 18446744073709551615 Gaussians"));
    let beyond = with_header(&example(), |header| header.replace("vertex 3", "vertex 99999999999999999999"));
    assert!(found(&beyond).contains("whose count is no whole number"));
    let ascii = with_header(&example(), |header| {
        header.replace("binary_little_endian", "ascii").replace("vertex 3", "vertex 4000000000")
    });
    found(&ascii);
    let before = with_header(&example(), |header| {
        header.replace("element vertex", "element other 4000000000\nproperty double d\nelement vertex")
    });
    assert!(found(&before).starts_with("is cut off within its 4000000000 rows of the element `other`"));
}

#[test]
fn numbers_that_cannot_be_drawn_are_refused() {
    let mut gaussians = example();
    gaussians.opacity_logits[2] = f32::NAN;
    assert!(found(&write(&gaussians, &Notes::default())).starts_with("cannot be drawn: opacity of Gaussian 2 is NaN"));
}

proptest! {
    #[test]
    fn no_bytes_panic(bytes in prop::collection::vec(any::<u8>(), 0..300)) {
        let _ = read(&bytes);
        let _ = read(&[b"ply\n", bytes.as_slice()].concat());
    }

    #[test]
    fn no_change_of_a_file_panics(changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..8), cut in any::<prop::sample::Index>()) {
        let mut bytes = write(&of_degree(Degree::One, 3), &Notes::default());
        for (place, value) in changes {
            let place = place.index(bytes.len());
            bytes[place] = value;
        }
        let _ = read(&bytes);
        let _ = read(&bytes[..cut.index(bytes.len())]);
    }
}
