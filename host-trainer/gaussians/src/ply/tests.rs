use proptest::prelude::*;

use super::{read, write};
use crate::tests::{example, of_degree};
use crate::{Degree, Frame, Gaussians, Notes};

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
            let frame = Frame { offset: [0.0, -7.25, 5e6 * n as f64], scale: 1.0 };
            let notes = Notes { compensation: n == 1, comments, frame, ..Notes::default() };
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
    assert!(found(packed.as_bytes()).starts_with("is an incomplete compressed .ply: it has no element `chunk`"));
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
    assert!(found(&bytes[..bytes.len() - 1]).starts_with("is cut off: it holds 2 of the 3 vertices"));
    let absurd = with_header(&example(), |header| header.replace("vertex 3", "vertex 18446744073709551615"));
    assert!(found(&absurd).starts_with("is cut off: it holds 3 of the 18446744073709551615 vertices"));
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
fn a_gaussian_that_cannot_be_drawn_is_left_out() {
    let mut gaussians = example();
    gaussians.opacity_logits[2] = f32::NAN;
    let (left, notes) = read(&write(&gaussians, &Notes::default())).expect("two are left");
    assert_eq!(left, example().chosen(&[0, 1]));
    assert!(notes.warnings[0].contains("opacity of Gaussian 2 is NaN"), "{notes:?}");
}

#[test]
fn a_comment_may_be_in_any_code_page() {
    let bytes = with_header(&example(), |header| header.replace("comment SH", "comment of H?lle\ncomment SH"));
    let place = bytes.windows(7).position(|part| part == b"of H?ll").expect("the comment");
    let mut latin = bytes.clone();
    latin[place + 4] = 0xf6;
    let (gaussians, notes) = read(&latin).expect("only a comment");
    assert_eq!((gaussians, notes.comments), (example(), vec!["of H\u{fffd}lle".to_owned()]));
}

/// 300 Gaussians whose numbers hold LF and CR LF, as those of real files do.
fn with_line_feeds() -> Vec<u8> {
    let mut gaussians = of_degree(Degree::Zero, 300);
    for (index, centre) in gaussians.centres.iter_mut().enumerate() {
        centre[0] = f32::from_le_bytes(if index % 100 == 0 { *b"\x01\r\n\x40" } else { *b"\x01\x02\n\x40" });
    }
    write(&gaussians, &Notes::default())
}

#[test]
fn converted_line_endings_are_named_both_ways() {
    let whole = with_line_feeds();
    assert!(read(&whole).is_ok());
    let longer: Vec<u8> =
        whole.iter().flat_map(|&byte| if byte == b'\n' { vec![b'\r', b'\n'] } else { vec![byte] }).collect();
    let said = found(&longer);
    assert!(said.starts_with("is damaged by a conversion of line endings: it is 3"), "{said}");
    assert!(said.contains("bytes longer than the 20400"), "{said}");
    assert!(said.contains("copy it again as binary"), "{said}");
    let mut shorter = Vec::new();
    for (index, &byte) in whole.iter().enumerate() {
        if !(byte == b'\r' && whole.get(index + 1) == Some(&b'\n')) {
            shorter.push(byte);
        }
    }
    let said = found(&shorter);
    assert!(said.starts_with("is damaged by a conversion of line endings"), "{said}");
    assert!(said.contains("bytes shorter than the 20400"), "{said}");
    // A header of CR LF alone is no damage, nor is a file that is cut off.
    let end = whole.windows(11).position(|part| part == b"end_header\n").expect("a header") + 11;
    let head = String::from_utf8(whole[..end].to_vec()).expect("text").replace('\n', "\r\n");
    assert!(read(&[head.as_bytes(), &whole[end..]].concat()).is_ok());
    assert!(found(&whole[..whole.len() / 2]).starts_with("is cut off"));
}

#[test]
fn flat_disks_and_harmonics_of_degree_4_are_read() {
    let flat = with_header(&example(), |header| header.replace("float scale_2", "float unknown"));
    let (gaussians, notes) = read(&flat).expect("flat");
    let [first, second, third] = gaussians.log_scales[0];
    assert!((third - (first.min(second) - 7.0)).abs() < 1e-5);
    assert!(notes.warnings[0].starts_with("3 of 3 Gaussians have a deviation of 0"), "{notes:?}");
    let names: String = (0..72).map(|number| format!("property float f_rest_{number}\n")).collect();
    let rest: Vec<String> = (0..72).map(|number| number.to_string()).collect();
    let text = format!(
        "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\nproperty float f_dc_0\n\
         property float f_dc_1\nproperty float f_dc_2\n{names}property float opacity\nproperty float scale_0\nproperty float scale_1\n\
         property float scale_2\nproperty float rot_0\nproperty float rot_1\nproperty float rot_2\nproperty float rot_3\nend_header\n\
         0 0 0 1 2 3 {} inf -1 -nan(ind) -1 1 0 0 0\n",
        rest.join(" ")
    );
    assert!(found(text.as_bytes()).contains("scale_1 of Gaussian 0 is NaN"), "{}", found(text.as_bytes()));
    let (gaussians, notes) = read(text.replace("-nan(ind)", "-2").as_bytes()).expect("degree 4");
    assert_eq!((gaussians.degree, gaussians.harmonics[15]), (Degree::Three, [14.0, 38.0, 62.0]));
    assert_eq!(notes.ignored, ["spherical harmonics of degree 4"]);
}

/// Bounds of one chunk, then words: what SuperSplat's description says of them.
#[test]
fn a_compressed_one_is_read() {
    let floats = "min_x min_y min_z max_x max_y max_z min_scale_x min_scale_y min_scale_z max_scale_x max_scale_y \
        max_scale_z min_r min_g min_b max_r max_g max_b";
    let named =
        |kind: &str, names: &[String]| names.iter().map(|name| format!("property {kind} {name}\n")).collect::<String>();
    let header = format!(
        "ply\nformat binary_little_endian 1.0\nelement chunk 1\n{}element vertex 1\n{}element sh 1\n{}end_header\n",
        named("float", &floats.split(' ').map(str::to_owned).collect::<Vec<_>>()),
        named("uint", &["position", "rotation", "scale", "color"].map(|name| format!("packed_{name}"))),
        named("uchar", &(0..9).map(|number| format!("f_rest_{number}")).collect::<Vec<_>>()),
    );
    let bounds = [-1.0f32, -2.0, -3.0, 1.0, 2.0, 3.0, -5.0, -5.0, -5.0, -1.0, -1.0, -1.0, 0.0, 0.0, 0.0, 1.0, 1.0, 2.0];
    let mut file = header.clone().into_bytes();
    bounds.iter().for_each(|bound| file.extend(bound.to_le_bytes()));
    // All of x, none of y, all of z; the largest part second, then the middle, the least and the middle.
    for word in
        [2047u32 << 21 | 2047, 1 << 30 | 512 << 20 | 512, 2047u32 << 21 | 1023 << 11, 255u32 << 24 | 255 << 8 | 128]
    {
        file.extend(word.to_le_bytes());
    }
    file.extend([255, 0, 0, 0, 0, 0, 0, 0, 255]);
    let (gaussians, _) = read(&file).expect("whole");
    assert_eq!((gaussians.degree, gaussians.centres[0]), (Degree::One, [1.0, -2.0, 3.0]));
    assert_eq!(gaussians.log_scales[0], [-1.0, -1.0, -5.0]);
    let turned = gaussians.rotations[0];
    assert!(
        turned[0].abs() < 1e-3 && (turned[1] - 0.707).abs() < 1e-3 && (turned[2] + 0.707).abs() < 1e-3,
        "{turned:?}"
    );
    let constant = gaussians.harmonics[0];
    assert!(
        (constant[0] - 1.7725).abs() < 1e-3
            && (constant[1] + 1.7725).abs() < 1e-3
            && (constant[2] - 5.317).abs() < 1e-2
    );
    // Red's first, then blue's last.
    assert_eq!((gaussians.harmonics[1], gaussians.harmonics[3]), ([4.0, -4.0, -4.0], [-4.0, -4.0, 4.0]));
    assert!(gaussians.opacity_logits[0].abs() < 0.02);
    assert!(found(&file[..file.len() - 30]).starts_with("is cut off"));
    let many =
        String::from_utf8(header.into_bytes()).expect("text").replace("element vertex 1\n", "element vertex 300\n");
    let body = vec![0; 72 + 16 * 300 + 9];
    assert!(found(&[many.as_bytes(), &body].concat()).contains("300 Gaussians need 2 chunks, it has 1"));
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
