use std::io::Write as _;

use flate2::Compression;
use flate2::write::GzEncoder;
use proptest::prelude::*;

use super::{read, write};
use crate::tests::{example, of_degree};
use crate::{Degree, Notes};

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
        assert_eq!((back.len(), back.degree, back_notes), (20, degree, notes));
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
fn what_is_no_spz_is_named() {
    assert!(found(b"ply\n").contains("does not start as gzip does"));
    assert!(
        found(b"NGSP\x04\0\0\0").starts_with("is a .spz of version 4, versions 2 and 3 are read; `splat-transform")
    );
    assert!(found(&[0x1f, 0x8b]).contains("header of 16 bytes cannot be unpacked"));
    assert!(found(&gzip(b"ply\nformat ascii 1.0")).contains("does not start with `NGSP`"));
    assert!(found(&gzip(&header(1, 0, 0))).contains("version 1"));
    assert!(found(&gzip(&header(3, 0, 4))).contains("degree 4"));
    assert!(found(&gzip(&header(3, 2, 0))).starts_with("is cut off: it holds 0 of the 40 bytes of its 2 Gaussians"));
    let whole = write(&example(), &Notes::default()).expect("fits");
    assert!(found(&whole[..whole.len() - 40]).starts_with("is damaged or cut off"));
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
    }

    #[test]
    fn no_body_panics(version in 0u32..5, degree in 0u8..5, body in prop::collection::vec(any::<u8>(), 0..200), n in 0u32..9) {
        let _ = read(&gzip(&[header(version, n, degree), body].concat()));
    }
}
