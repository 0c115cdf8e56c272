use std::io::Write as _;

use flate2::Compression;
use flate2::write::GzEncoder;
use proptest::prelude::*;

use super::write;
use crate::tests::{example, of_degree};
use crate::{Degree, Frame, Gaussians, Notes, SpzAxes, Unreadable};

fn read(bytes: &[u8]) -> Result<(Gaussians, Notes), Unreadable> {
    super::read(bytes, None)
}

fn found(bytes: &[u8]) -> String {
    read(bytes).expect_err("broken").to_string()
}

fn gzip(bytes: &[u8]) -> Vec<u8> {
    let mut out = GzEncoder::new(Vec::new(), Compression::fast());
    out.write_all(bytes).expect("memory");
    out.finish().expect("memory")
}

fn header(version: u32, n_points: u32, degree: u8) -> Vec<u8> {
    [b"NGSP".as_slice(), &version.to_le_bytes(), &n_points.to_le_bytes(), &[degree, 12, 0, 0]].concat()
}

fn assert_near(found: &[f32], wanted: &[f32], tolerance: f32) {
    for (a, b) in found.iter().zip(wanted) {
        assert!((a - b).abs() <= tolerance, "{a} for {b}, within {tolerance}");
    }
}

#[test]
fn what_is_written_is_read_within_its_steps() {
    for degree in Degree::ALL {
        let gaussians = of_degree(degree, 20);
        let notes = Notes { compensation: true, ..Notes::default() };
        let (back, back_notes) = read(&write(&gaussians, &notes).expect("fits")).expect("readable");
        assert_eq!((back.len(), back.degree, back_notes.compensation), (20, degree, true));
        assert_eq!(back_notes.spz_axes, Some(SpzAxes::AsDescribed));
        for index in 0..20 {
            assert_near(&back.centres[index], &gaussians.centres[index], 0.5 / 65_536.0 + 1e-6);
            assert_near(&back.log_scales[index], &gaussians.log_scales[index], 0.5 / 16.0 + 1e-6);
            let opacity = |logit: f32| 1.0 / (1.0 + (-logit).exp());
            assert_near(
                &[opacity(back.opacity_logits[index])],
                &[opacity(gaussians.opacity_logits[index])],
                0.5 / 255.0 + 1e-6,
            );
            let dot: f32 = back.rotations[index].iter().zip(&gaussians.rotations[index]).map(|(a, b)| a * b).sum();
            let length = gaussians.rotations[index].iter().map(|part| part * part).sum::<f32>().sqrt();
            assert!(dot.abs() / length > 0.999_99, "rotation {index} turned: {dot} of {length}");
            let steps = [0.5 / (255.0 * 0.15), 0.5 / 64.0];
            for (number, (a, b)) in back.harmonics_of(index).iter().zip(gaussians.harmonics_of(index)).enumerate() {
                assert_near(a, b, steps[number.min(1)] + 1e-5);
            }
        }
    }
}

/// The body of a Gaussian that another program wrote, as its specification has it.
#[test]
fn the_layout_is_the_published_one() {
    let mut file = header(3, 1, 0);
    file.extend([0x00, 0x10, 0x00, 0x00, 0xe0, 0xff, 0x00, 0xd0, 0xff]); // 1, −2, −3 of 4096ths
    file.extend([128, 128, 147, 116, 96, 112, 128]);
    // The index of w, then x, y and z: 0.0996, −0.2006, −0.3736.
    file.extend((3u32 << 30 | 72 << 20 | (512 | 145) << 10 | 512 | 270).to_le_bytes());
    let (gaussians, notes) = read(&gzip(&file)).expect("readable");
    assert!(!notes.compensation);
    assert_eq!(gaussians.centres, [[1.0, 2.0, 3.0]]);
    assert_eq!(gaussians.log_scales, [[-4.0, -3.0, -2.0]]);
    assert_near(&gaussians.rotations[0], &[0.9, 0.1, 0.2, 0.374], 1e-3);
    assert_near(&gaussians.harmonics[0], &[0.0, 0.5, -0.3], 0.02);
    assert_near(&gaussians.opacity_logits, &[0.0], 0.01);
}

#[test]
fn version_2_has_rotations_of_three_bytes() {
    let mut file = header(2, 1, 0);
    file.extend([0; 9]);
    file.extend([128, 128, 128, 128, 96, 96, 96, 140, 102, 80]);
    let (gaussians, _) = read(&gzip(&file)).expect("readable");
    assert_near(&gaussians.rotations[0], &[0.901, 0.098, 0.2, 0.373], 2e-3);
}

#[test]
fn far_centres_take_bits_from_the_fraction() {
    let mut gaussians = example();
    gaussians.centres[0][1] = 100_000.0;
    let (back, _) = read(&write(&gaussians, &Notes::default()).expect("fits")).expect("readable");
    assert_near(&back.centres[0], &gaussians.centres[0], 0.5 / 64.0);
    gaussians.centres[0][1] = 1e7;
    let error = write(&gaussians, &Notes::default()).expect_err("too far").to_string();
    assert!(error.starts_with("would hold a centre 10000000 units out"), "{error}");
}

#[test]
fn version_1_has_centres_of_16_bits() {
    let mut file = header(1, 1, 0);
    file.extend([0x00, 0x3c, 0x00, 0xc0, 0x00, 0xc2]);
    file.extend([128, 128, 128, 128, 96, 96, 96, 140, 102, 80]);
    let (gaussians, _) = read(&gzip(&file)).expect("readable");
    assert_eq!(gaussians.centres, [[1.0, 2.0, 3.0]]);
    assert_near(&gaussians.rotations[0], &[0.901, 0.098, 0.2, 0.373], 2e-3);
}

#[test]
fn gzip_may_be_missing() {
    for version in 1..4 {
        let mut file = header(version, 1, 1);
        file.extend([7; 6 + 1 + 3 + 3 + 3 + 9]);
        file.extend(match version {
            1 => vec![],
            2 => vec![7; 3],
            _ => vec![7; 4],
        });
        assert_eq!(read(&file), read(&gzip(&file)), "version {version}");
        assert_eq!(read(&file).expect("whole").0.len(), 1);
        assert!(found(&file[..file.len() - 1]).starts_with("is cut off: it holds"));
    }
}

/// What `zstd` makes of bytes that are all stored: a frame of one raw block.
fn zstd(bytes: &[u8]) -> Vec<u8> {
    let size = bytes.len() as u32;
    let block = (size << 3 | 1).to_le_bytes();
    [&0xFD2F_B528u32.to_le_bytes()[..], &[0xa0], &size.to_le_bytes(), &block[..3], bytes].concat()
}

/// A file of version 4 out of the sections of one of version 3.
fn version_4(degree: u8, n: usize, records: &[u8], sections: &[Vec<u8>]) -> Vec<u8> {
    let packed: Vec<Vec<u8>> = sections.iter().map(|section| zstd(section)).collect();
    let mut file = header(4, n as u32, degree);
    file[14] = 2;
    file[15] = sections.len() as u8;
    file.extend((32 + records.len() as u32).to_le_bytes());
    file.extend([0; 12]);
    file.extend(records);
    for (packed, section) in packed.iter().zip(sections) {
        file.extend((packed.len() as u64).to_le_bytes());
        file.extend((section.len() as u64).to_le_bytes());
    }
    file.extend(packed.concat());
    file
}

#[test]
fn version_4_has_a_stream_for_each_section() {
    let n = 5;
    let sections = [9, 1, 3, 3, 4, 3 * 24]
        .map(|row: usize| (0..n * row).map(|index| (index * 37 % 251) as u8).collect::<Vec<u8>>());
    let three = [header(3, n as u32, 4), sections.concat()].concat();
    let four = version_4(4, n, &[], &sections);
    let ((a, notes), (b, _)) = (read(&four).expect("version 4"), read(&three).expect("version 3"));
    assert_eq!((&a, a.degree), (&b, Degree::Three));
    assert_eq!(notes.ignored, ["spherical harmonics of degree 4"]);
    // Axes as in the .ply, by the record.
    let record = super::records::write(SpzAxes::AsInPly, &Frame::default());
    let (kept, notes) = read(&version_4(4, n, &record, &sections)).expect("with a record");
    assert_eq!(notes.spz_axes, Some(SpzAxes::AsInPly));
    assert_eq!(kept.centres[0], [a.centres[0][0], -a.centres[0][1], -a.centres[0][2]]);
    assert!(found(&four[..four.len() - 1]).contains("ends outside of the file"));
    let mut table = four.clone();
    table[16..20].copy_from_slice(&9_999u32.to_le_bytes());
    assert!(found(&table).contains("table of streams at 9999"), "{}", found(&table));
    let mut size = four.clone();
    size[40] += 1;
    assert!(found(&size).contains("stream 0 says it unpacks to 46 bytes, 45 are needed"), "{}", found(&size));
    let mut body = four;
    let at = 32 + 6 * 16;
    body[at..at + 4].fill(0);
    assert!(found(&body).starts_with("is damaged or cut off: stream 0: "), "{}", found(&body));
}

#[test]
fn axes_and_frame_are_written_and_read() {
    let gaussians = of_degree(Degree::Three, 20);
    let frame = Frame { offset: [5e6, -1.0, 0.25], scale: 0.01 };
    for axes in [SpzAxes::AsDescribed, SpzAxes::AsInPly] {
        let notes = Notes { spz_axes: Some(axes), frame, ..Notes::default() };
        let bytes = write(&gaussians, &notes).expect("fits");
        let (back, notes) = read(&bytes).expect("ours");
        assert_eq!((notes.spz_axes, notes.frame), (Some(axes), frame));
        assert_near(&back.centres[3], &gaussians.centres[3], 1e-4);
        assert_near(back.harmonics.as_flattened(), gaussians.harmonics.as_flattened(), 0.02);
        let (turned, _) = super::read(&bytes, Some(axes.other())).expect("ours");
        assert_near(&turned.centres[3][1..], &gaussians.centres[3].map(|x| -x)[1..], 1e-4);
    }
}

#[test]
fn what_is_no_spz_is_named() {
    assert!(found(b"ply\n").contains("starts neither as gzip does nor"));
    assert!(found(b"NGSP\x04\0\0\0").starts_with("is cut off: it has 8 bytes"));
    assert!(found(&header(5, 0, 0)).starts_with("is a .spz of version 5, versions 1 to 4 are read"));
    assert!(found(&gzip(&header(4, 0, 0))).contains("version 4 within gzip"));
    assert!(found(&[0x1f, 0x8b]).contains("header of 16 bytes cannot be unpacked"));
    assert!(found(&gzip(b"ply\nformat ascii 1.0")).contains("does not start with `NGSP`"));
    assert!(found(&gzip(&header(3, 0, 5))).contains("degree 5"));
    assert!(found(&gzip(&header(3, 2, 0))).starts_with("is cut off: it holds 0 of the 40 bytes of its 2 Gaussians"));
    let whole = write(&example(), &Notes::default()).expect("fits");
    assert!(found(&whole[..whole.len() - 60]).starts_with("is damaged or cut off"));
}

#[test]
fn a_bomb_is_not_unpacked() {
    let error = found(&gzip(&header(3, u32::MAX, 3)));
    assert!(error.starts_with("says it holds 4294967295 Gaussians"), "{error}");
    // 64 MB of zeros pack into 64 kB.
    let bomb = gzip(&[header(3, 3_200_000, 0), vec![0; 64_000_000]].concat());
    assert!(bomb.len() < 400_000);
    assert!(found(&bomb).contains("at most"));
}

proptest! {
    #[test]
    fn no_bytes_panic(bytes in prop::collection::vec(any::<u8>(), 0..300)) {
        let _ = read(&bytes);
        let _ = read(&gzip(&bytes));
        let _ = read(&[b"NGSP\x04\0\0\0", bytes.as_slice()].concat());
    }

    #[test]
    fn no_body_panics(version in 0u32..5, degree in 0u8..5, body in prop::collection::vec(any::<u8>(), 0..200), n in 0u32..9) {
        let _ = read(&gzip(&[header(version, n, degree), body].concat()));
    }

    #[test]
    fn no_change_of_a_file_of_version_4_panics(changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..8), cut in any::<prop::sample::Index>()) {
        let record = super::records::write(SpzAxes::AsInPly, &Frame::default());
        let mut bytes = version_4(1, 3, &record, &[9, 1, 3, 3, 4, 9].map(|row: usize| vec![77; 3 * row]));
        for (place, value) in changes {
            let place = place.index(bytes.len());
            bytes[place] = value;
        }
        let _ = read(&bytes);
        let _ = read(&bytes[..cut.index(bytes.len())]);
    }
}
