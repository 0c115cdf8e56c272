use glam::{DMat3, DVec3};
use pocketsplat_core::Bundle;
use pocketsplat_core::bundle::{HEADER_LEN, crc32};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::{SMALL, STEPS, info, random_scene};
use crate::bundle::write_chunked;
use crate::camera::Camera;
use crate::render::decoder::core_image;
use crate::scene::{ModelShape, Scene};

/// Views tried.
const N_VIEWS: u32 = 1500;
/// Where the directory's row of the section table lies, and its length.
const DIRECTORY_ROW: usize = 148 + 2 * 16;
/// Length of a record, and where its ink box lies.
const RECORD_LEN: usize = 40;
const INK_BOX: usize = 16;

/// The same bundle with ink boxes that no camera misses.
fn without_boxes(bytes: &[u8]) -> Vec<u8> {
    let mut bytes = bytes.to_vec();
    let word = |bytes: &[u8], at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().expect("four bytes")) as usize;
    let [start, len] = [4, 8].map(|field| word(&bytes, DIRECTORY_ROW + field));
    for record in bytes[start..start + len].chunks_exact_mut(RECORD_LEN) {
        for (corner, value) in record[INK_BOX..].chunks_exact_mut(12).zip([-1e6_f32, 1e6]) {
            corner.copy_from_slice([value.to_le_bytes(); 3].as_flattened());
        }
    }
    let crc = crc32(&bytes[start..start + len]);
    bytes[DIRECTORY_ROW + 12..DIRECTORY_ROW + 16].copy_from_slice(&crc.to_le_bytes());
    let crc = crc32(&bytes[..HEADER_LEN - 4]);
    bytes[HEADER_LEN - 4..HEADER_LEN].copy_from_slice(&crc.to_le_bytes());
    bytes
}

/// Cameras in and around the scene, looking anywhere, some with a principal point off the image.
fn any_camera(rng: &mut ChaCha8Rng) -> Camera {
    let angles: [f64; 3] = std::array::from_fn(|_| rng.random_range(-3.2..3.2));
    let rotation = DMat3::from_euler(glam::EulerRot::XYZ, angles[0], angles[1], angles[2]);
    let centre = DVec3::from_array(std::array::from_fn(|_| rng.random_range(-4.0..4.0)));
    let (width_px, height_px) = (rng.random_range(1..80), rng.random_range(1..60));
    Camera {
        rotation,
        translation: -(rotation * centre),
        focal_px: std::array::from_fn(|_| rng.random_range(10.0..200.0)),
        principal_px: std::array::from_fn(|_| rng.random_range(-20.0..80.0)),
        width_px,
        height_px,
    }
}

/// A scene whose splats fill their ink boxes: opaque, as large as their base scales, one offset at its anchor.
fn tightly_boxed_scene() -> Scene<f32> {
    let mut scene = random_scene(ModelShape { n_offsets: 1, dilation_compensation: false, ..SMALL }, 200, 31);
    scene.anchors.offsets.fill(0.0);
    scene.heads.opacity.b2.fill(9.0);
    scene.heads.covariance.b2[..3].fill(12.0);
    scene
}

#[test]
fn culling_chunks_changes_no_pixel() {
    let boxed = write_chunked(&tightly_boxed_scene(), &info(), &STEPS, 1).expect("sound");
    let unboxed = without_boxes(&boxed);
    let (boxed, unboxed) = (Bundle::parse(&boxed).expect("sound"), Bundle::parse(&unboxed).expect("sealed again"));
    let mut rng = ChaCha8Rng::seed_from_u64(32);
    let (mut decoded, mut all) = (0, 0);
    for view in 0..N_VIEWS {
        let camera = any_camera(&mut rng);
        let culled = core_image(&boxed, &camera).expect("a frame");
        let whole = core_image(&unboxed, &camera).expect("a frame");
        assert_eq!(culled.report.splats, whole.report.splats, "view {view}: {camera:?}");
        assert!(culled.image == whole.image, "view {view}: {camera:?}");
        decoded += culled.report.chunks_decoded;
        all += whole.report.chunks_decoded;
    }
    assert_eq!(all, N_VIEWS * 200, "every chunk of the bundle without boxes is decoded");
    assert!(decoded < all / 2, "{decoded} of {all} chunks decoded: the boxes should spare most");
}
