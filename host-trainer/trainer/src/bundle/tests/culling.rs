use glam::{DMat3, DVec3};
use pocketsplat_core::bundle::{CHUNK_RECORD_LEN, INK_FRAME_LEN, TIER_RECORD_LEN, crc32};
use pocketsplat_core::{Bundle, SectionKind};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::{SMALL, options, random_scene, write_bytes};
use crate::bundle::Coder;
use crate::bundle::layout::section_crc_offset;
use crate::render::decoder::core_image;
use crate::scene::{ModelShape, Scene};
use pocketsplat_capture::camera::Camera;

/// Views tried.
const N_VIEWS: u32 = 1500;
/// Where a chunk's record has its ink box.
const INK_BOX: usize = 12;

/// The same bundle with ink boxes that no camera misses.
fn without_boxes(bytes: &[u8]) -> Vec<u8> {
    let bundle = Bundle::parse(bytes).expect("a sound bundle");
    let header_len = usize::from(bundle.header().header_len);
    let (row, section) =
        bundle.sections().enumerate().find(|(_, section)| section.kind == SectionKind::Directory).expect("a directory");
    let (start, len) = (section.offset as usize, section.len as usize);
    let frame = start + TIER_RECORD_LEN * usize::from(bundle.header().n_tiers);
    let mut bytes = bytes.to_vec();
    bytes[frame..frame + 12].copy_from_slice([(-1e6_f32).to_le_bytes(); 3].as_flattened());
    bytes[frame + 12..frame + 24].copy_from_slice([(2e6_f32 / 65535.0).to_le_bytes(); 3].as_flattened());
    for record in bytes[frame + INK_FRAME_LEN..start + len].chunks_exact_mut(CHUNK_RECORD_LEN) {
        record[INK_BOX..INK_BOX + 6].fill(0);
        record[INK_BOX + 6..INK_BOX + 12].fill(0xFF);
    }
    let crc_at = section_crc_offset(row);
    let crc = crc32(&bytes[start..start + len]);
    bytes[crc_at..crc_at + 4].copy_from_slice(&crc.to_le_bytes());
    let crc = crc32(&bytes[..header_len - 4]);
    bytes[header_len - 4..header_len].copy_from_slice(&crc.to_le_bytes());
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
    scene.anchors.mask_logits.fill(1.0);
    scene.heads.opacity.b2.fill(9.0);
    scene.heads.covariance.b2[..3].fill(12.0);
    scene
}

#[test]
fn culling_chunks_changes_no_pixel() {
    let boxed = write_bytes(&tightly_boxed_scene(), &options(Coder::Static, 1));
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
