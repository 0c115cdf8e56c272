use std::io::Write as _;

use flate2::Compression;
use flate2::write::DeflateEncoder;
use proptest::prelude::*;

use super::{Meta, read, write, zip};
use crate::tests::{example, of_degree};
use crate::{Degree, Gaussians, Notes};

fn found(bytes: &[u8]) -> String {
    read(bytes).expect_err("broken").to_string()
}

/// The files of what [`write`] makes of `gaussians`, its `meta.json` changed.
fn changed(gaussians: &Gaussians, change: impl Fn(&mut Meta)) -> Vec<u8> {
    let bytes = write(gaussians, &Notes::default()).expect("fits");
    let archive = zip::Archive::open(&bytes).expect("ours");
    let mut meta = Meta::parse(&archive.file("meta.json").expect("there")).expect("ours");
    let mut names: Vec<String> =
        [&meta.means.files[..], &meta.quats.files, &meta.scales.files, &meta.sh0.files].concat();
    names.extend(meta.others.iter().flat_map(|others| others.files.clone()));
    let mut files: Vec<_> = names.into_iter().map(|name| (name.clone(), archive.file(&name).expect("there"))).collect();
    change(&mut meta);
    files.push(("meta.json".to_owned(), serde_json::to_vec(&meta).expect("plain")));
    zip::write(&files).expect("small")
}

#[test]
fn what_is_written_is_read_within_its_steps() {
    for degree in Degree::ALL {
        let gaussians = of_degree(degree, 50);
        let notes = Notes { compensation: true, ..Notes::default() };
        let (back, back_notes) = read(&write(&gaussians, &notes).expect("fits")).expect("readable");
        assert_eq!((back.len(), back.degree, back_notes), (50, degree, notes));
        let order = super::morton::order(&gaussians.centres);
        for (index, &original) in order.iter().enumerate() {
            let near = |a: &[f32], b: &[f32], tolerance: f32| a.iter().zip(b).all(|(a, b)| (a - b).abs() <= tolerance);
            assert!(near(&back.centres[index], &gaussians.centres[original], 3e-4));
            assert!(near(&back.log_scales[index], &gaussians.log_scales[original], 0.02));
            assert!(near(&back.harmonics_of(index)[0], &gaussians.harmonics_of(original)[0], 0.02));
            assert!(near(&[back.opacity_logits[index]], &[gaussians.opacity_logits[original]], 0.05));
            let dot: f32 = back.rotations[index].iter().zip(&gaussians.rotations[original]).map(|(a, b)| a * b).sum();
            let length = gaussians.rotations[original].iter().map(|part| part * part).sum::<f32>().sqrt();
            assert!(dot.abs() / length > 0.999_9, "rotation {index} turned: {dot} of {length}");
        }
    }
}

/// Four of five Gaussians alike: the palette keeps them, and the fifth.
#[test]
fn like_harmonics_share_an_entry() {
    let mut gaussians = of_degree(Degree::Two, 5);
    let first = gaussians.harmonics_of(0).to_vec();
    for index in 1..4 {
        gaussians.harmonics[9 * index..9 * (index + 1)].copy_from_slice(&first);
    }
    let (back, _) = read(&write(&gaussians, &Notes::default()).expect("fits")).expect("readable");
    for (index, original) in super::morton::order(&gaussians.centres).into_iter().enumerate() {
        for (a, b) in
            back.harmonics_of(index)[1..].iter().flatten().zip(gaussians.harmonics_of(original)[1..].iter().flatten())
        {
            assert!((a - b).abs() < 1e-6, "{a} for {b}");
        }
    }
}

#[test]
fn deflated_files_and_the_other_order_of_the_palette_are_read() {
    let gaussians = example();
    let bytes = write(&gaussians, &Notes::default()).expect("fits");
    let swapped = changed(&gaussians, |meta| meta.others.as_mut().expect("degree 3").files.reverse());
    assert_eq!(read(&swapped), read(&bytes));
}

#[test]
fn what_is_no_sog_is_named() {
    assert!(found(b"ply\n").contains("does not start as zip does"));
    let whole = write(&example(), &Notes::default()).expect("fits");
    assert!(found(&whole[..whole.len() / 2]).starts_with("is cut off: the directory"));
    let other = zip::write(&[("word/document.xml".to_owned(), b"<xml/>".to_vec())]).expect("small");
    assert!(found(&other).starts_with("holds no meta.json"));
    assert!(
        found(&changed(&example(), |meta| meta.version = 3))
            .starts_with("has a meta.json of version 3, versions 1 and 2")
    );
    assert!(found(&changed(&example(), |meta| meta.count = 1_000_000_000)).contains("1000000000 are needed"));
    assert!(
        found(&changed(&example(), |meta| meta.scales.codebook.truncate(9)))
            .contains("a codebook of 9 entries for scales")
    );
    assert!(
        found(&changed(&example(), |meta| meta.others.as_mut().expect("degree 3").bands = 4)).contains("of degree 4")
    );
    assert!(
        found(&changed(&example(), |meta| meta.others.as_mut().expect("degree 3").bands = 2)).contains("pixels wide")
    );
    assert!(
        found(&changed(&example(), |meta| [meta.means.mins[0], meta.means.maxs[0]] = [500.0; 2]))
            .contains("cannot be drawn: 3 of its 3 Gaussians")
    );
    assert!(
        found(&changed(&example(), |meta| meta.quats.files[0] = "sh0.webp".to_owned())).contains("kind of rotation")
    );
    let mut damaged = whole.clone();
    damaged[60] ^= 1;
    assert!(found(&damaged).starts_with("is damaged: means_l.webp does not match"));
    let error = write(&Gaussians::default(), &Notes::default()).expect_err("none").to_string();
    assert!(error.contains("no Gaussian"), "{error}");
}

/// Version 1 says no version, and has the least and the largest number of each channel in place of codebooks.
#[test]
fn version_1_is_read() {
    let bytes = write(&of_degree(Degree::One, 20), &Notes::default()).expect("fits");
    let folder = tempfile::tempdir().expect("a folder");
    super::unpack_for_tests(&bytes, folder.path());
    let json = folder.path().join("meta.json");
    let mut meta: serde_json::Value = serde_json::from_slice(&std::fs::read(&json).expect("there")).expect("JSON");
    let object = meta.as_object_mut().expect("an object");
    object.remove("version");
    object.remove("count");
    object["means"]["shape"] = serde_json::json!([20, 3]);
    object["scales"] = serde_json::json!({"shape": [20, 3], "mins": [-5.0, -4.0, -3.0], "maxs": [0.1, 1.0, 2.0], "files": ["scales.webp"]});
    object["sh0"] =
        serde_json::json!({"mins": [-2.0, -2.0, -2.0, -6.0], "maxs": [2.0, 2.0, 2.0, 6.0], "files": ["sh0.webp"]});
    object["shN"] = serde_json::json!({
        "shape": [20, 3], "mins": -1.0, "maxs": 1.0, "quantization": 8, "files": ["shN_centroids.webp", "shN_labels.webp"]
    });
    std::fs::write(&json, meta.to_string()).expect("room");
    let (second, (first, _)) = (read(&bytes).expect("ours").0, super::read_folder(folder.path()).expect("version 1"));
    assert_eq!((first.len(), first.degree, &first.centres), (20, Degree::One, &second.centres));
    let byte = |value: f32, least: f32, largest: f32| (value - least) / (largest - least) * 255.0;
    for index in 0..20 {
        for (value, [least, largest]) in [
            (first.log_scales[index][1], [-4.0, 1.0]),
            (first.harmonics_of(index)[0][2], [-2.0, 2.0]),
            (first.harmonics_of(index)[3][0], [-1.0, 1.0]),
            (first.opacity_logits[index], [-6.0, 6.0]),
        ] {
            let byte = byte(value, least, largest);
            assert!((0.0..=255.0).contains(&byte) && (byte - byte.round()).abs() < 1e-3, "{value} is byte {byte}");
        }
        // Bytes of codebooks are in ascending order, as are those of a line.
        let order = |a: f32, b: f32| a.total_cmp(&b);
        let (a, b) = (index, (index + 7) % 20);
        if second.log_scales[a][0] != second.log_scales[b][0] {
            assert_eq!(
                order(first.log_scales[a][0], first.log_scales[b][0]),
                order(second.log_scales[a][0], second.log_scales[b][0])
            );
        }
    }
    std::fs::write(&json, meta.to_string().replace("[20,3]", "[]")).expect("room");
    let said = super::read_folder(folder.path()).expect_err("no shape").to_string();
    assert!(said.contains("neither a version nor the shape"), "{said}");
}

/// A zip of one deflated file with the sizes that it claims.
fn deflated(name: &str, bytes: &[u8], claimed: u32) -> Vec<u8> {
    let mut encoder = DeflateEncoder::new(Vec::new(), Compression::best());
    encoder.write_all(bytes).expect("memory");
    let packed = encoder.finish().expect("memory");
    let stored = zip::write(&[(name.to_owned(), packed)]).expect("small");
    let mut out = stored;
    let central = out.windows(4).position(|window| window == b"PK\x01\x02").expect("a directory");
    out[central + 10] = 8;
    out[central + 16..central + 20].copy_from_slice(&crc32fast::hash(bytes).to_le_bytes());
    out[central + 24..central + 28].copy_from_slice(&claimed.to_le_bytes());
    out
}

#[test]
fn a_zip_bomb_is_not_unpacked() {
    let zeros = vec![0; 40_000_000];
    assert!(found(&deflated("meta.json", &zeros, 40_000_000)).contains("at most 16777216 are unpacked"));
    // One that lies about its size is cut one byte after what it says.
    assert!(found(&deflated("meta.json", &zeros, 1000)).contains("does not match its length"));
    assert!(found(&deflated("meta.json", b"{\"version\":2}", 13)).contains("missing field `count`"));
}

#[test]
fn an_image_bomb_is_not_unpacked() {
    // A lossless image of one colour, 16,383 pixels to each side, takes a few bytes.
    let header: u32 = (16_382 << 14) | 16_382;
    let mut vp8l = vec![0x2f];
    vp8l.extend(header.to_le_bytes());
    vp8l.extend([0x88, 0x88, 0x08, 0, 0, 0, 0, 0, 0]);
    let mut webp = b"RIFF".to_vec();
    webp.extend((vp8l.len() as u32 + 12).to_le_bytes());
    webp.extend(b"WEBPVP8L");
    webp.extend((vp8l.len() as u32).to_le_bytes());
    webp.extend(&vp8l);
    let error = super::Pixels::from_webp("sh0.webp", &webp, webp.len()).err().expect("a bomb").to_string();
    assert!(error.contains("16383 × 16383 pixels"), "{error}");
}

proptest! {
    #[test]
    fn no_bytes_panic(bytes in prop::collection::vec(any::<u8>(), 0..300)) {
        let _ = read(&bytes);
        let _ = read(&[b"PK\x03\x04", bytes.as_slice(), b"PK\x05\x06", bytes.as_slice()].concat());
        let _ = super::Pixels::from_webp("any", &bytes, bytes.len());
    }

    #[test]
    fn no_change_of_a_file_panics(changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..8)) {
        let mut bytes = write(&of_degree(Degree::One, 3), &Notes::default()).expect("fits");
        for (place, value) in changes {
            let place = place.index(bytes.len());
            bytes[place] = value;
        }
        let _ = read(&bytes);
    }
}
