//! A damaged bundle fails with an error about the file, or draws the very same picture: never another one, never a panic.

use conformance::frame::{Frame, bundle_of, draw, to_core};
use conformance::scenes::{TINY, cameras, random_scene};
use conformance::seal::reseal;
use pocketsplat_core::{Bundle, Camera, DecodeError, ErrorClass};

fn tiny() -> (Vec<u8>, Camera) {
    let mut camera = to_core(&cameras()[0].1);
    camera = camera.resized(24, 18);
    (bundle_of(&random_scene(&TINY), &cameras()[0].1), camera)
}

fn picture(bytes: &[u8], camera: &Camera) -> Result<Frame, DecodeError> {
    draw(&Bundle::parse(bytes)?, camera).map(|(frame, _)| frame)
}

/// Fails unless `damaged` is refused as a bad file or draws `sound`.
#[track_caller]
fn check(damaged: &[u8], camera: &Camera, sound: &Frame, what: &str) -> Option<DecodeError> {
    match picture(damaged, camera) {
        Ok(frame) => {
            assert!(frame == *sound, "{what}: another picture without notice");
            None
        }
        Err(error) => {
            let blamed = matches!(error.class(), ErrorClass::Malformed | ErrorClass::Unsupported);
            assert!(blamed, "{what}: {error} ({:?}), but the file is to blame", error.class());
            Some(error)
        }
    }
}

#[test]
fn every_truncation_is_refused() {
    let (bytes, camera) = tiny();
    let sound = picture(&bytes, &camera).expect("the writer's bundle is sound");
    for len in 0..bytes.len() {
        let what = format!("cut to {len} of {} bytes", bytes.len());
        assert!(check(&bytes[..len], &camera, &sound, &what).is_some(), "{what}: not noticed");
    }
}

#[test]
fn every_flipped_bit_is_noticed() {
    let (mut bytes, camera) = tiny();
    let sound = picture(&bytes, &camera).expect("the writer's bundle is sound");
    for byte in 0..bytes.len() {
        for bit in 0..8 {
            bytes[byte] ^= 1 << bit;
            let what = format!("bit {bit} of byte {byte} flipped");
            assert!(check(&bytes, &camera, &sound, &what).is_some(), "{what}: not noticed");
            bytes[byte] ^= 1 << bit;
        }
    }
}

#[test]
fn every_byte_set_to_a_border_value_is_noticed() {
    let (mut bytes, camera) = tiny();
    let sound = picture(&bytes, &camera).expect("the writer's bundle is sound");
    for byte in 0..bytes.len() {
        let before = bytes[byte];
        for value in [0x00, 0x7f, 0x80, 0xff] {
            bytes[byte] = value;
            let noticed = check(&bytes, &camera, &sound, &format!("byte {byte} set to {value:#04x}")).is_some();
            assert!(noticed || value == before, "byte {byte} set to {value:#04x} draws as if nothing had happened");
        }
        bytes[byte] = before;
    }
}

#[test]
fn a_sound_bundle_stays_as_it_is_when_sealed_again() {
    let (bytes, _) = tiny();
    let mut sealed = bytes.clone();
    reseal(&mut sealed);
    assert!(sealed == bytes, "the writer's checksums are the format's");
}

/// With its checksums made right a damaged bundle may be another scene, but nothing worse: the tests are built with
/// overflow checks, and `Internal` is a mistake of the decoder.
#[test]
fn damage_behind_right_checksums_is_an_error_or_another_scene() {
    let (sound, camera) = tiny();
    let mut n_refused = 0;
    for byte in 0..sound.len() {
        for damage in [1, 2, 4, 8, 16, 32, 64, 128, 0xff, sound[byte], !sound[byte], sound[byte] ^ 0x7f] {
            let mut bytes = sound.clone();
            bytes[byte] ^= damage;
            reseal(&mut bytes);
            if let Err(error) = picture(&bytes, &camera) {
                n_refused += 1;
                assert_ne!(error.class(), ErrorClass::Internal, "byte {byte} with {damage:#04x} flipped: {error}");
            }
        }
    }
    println!("{n_refused} of {} refused", 12 * sound.len());
    assert!(n_refused > sound.len(), "offsets, counts and limits are checked: {n_refused} refused");
}

#[test]
fn what_follows_a_bundle_in_flash_is_ignored() {
    let (mut bytes, camera) = tiny();
    let sound = picture(&bytes, &camera).expect("the writer's bundle is sound");
    bytes.extend([0xff; 100]);
    assert_eq!(picture(&bytes, &camera), Ok(sound), "erased flash after the bundle");
}

#[test]
fn bytes_of_other_files_are_not_bundles() {
    for bytes in [&b""[..], b"PSB", b"\x89PNG\r\n\x1a\n with something after it", &[0; 4096], &[0xff; 4096]] {
        let error = Bundle::parse(bytes).err();
        assert_eq!(error.map(|e| e.class()), Some(ErrorClass::Malformed), "{} bytes", bytes.len());
    }
}
