use glam::{DMat3, DVec3};
use pocketsplat_format::bundle::{CHUNK_RECORD_LEN, INK_FRAME_LEN, InkFrame, SectionBytes, TIER_RECORD_LEN};
use pocketsplat_format::{Bundle, SectionKind};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::{SMALL, TABLES, options, random_scene, write_bytes};
use crate::render::decoder::core_image;
use pocketsplat_capture::camera::Camera;
use pocketsplat_kernels::scene::{ModelShape, Scene};

/// Views tried.
const N_VIEWS: u32 = 1500;
/// Where a chunk's record has its ink box.
const INK_BOX: usize = 12;

/// The same bundle with ink boxes that no camera misses.
fn without_boxes(bytes: &[u8]) -> Vec<u8> {
    let bundle = Bundle::parse(bytes).expect("a sound bundle");
    let find = |wanted| bundle.sections().find(|section| section.kind == wanted);
    let section = |wanted| {
        let section = find(wanted).expect("the bundle has one");
        &bytes[section.offset as usize..][..section.len as usize]
    };
    let mut directory = section(SectionKind::Directory).to_vec();
    let frame = TIER_RECORD_LEN * usize::from(bundle.header().n_tiers);
    let (frame, records) = directory[frame..].split_at_mut(INK_FRAME_LEN);
    frame.copy_from_slice(&InkFrame { min: [-1e6; 3], step: [2e6 / 65535.0; 3] }.emit());
    for record in records.chunks_exact_mut(CHUNK_RECORD_LEN) {
        record[INK_BOX..INK_BOX + 6].fill(0);
        record[INK_BOX + 6..INK_BOX + 12].fill(0xFF);
    }
    let sections = SectionBytes {
        heads: section(SectionKind::Heads),
        lattice: section(SectionKind::Lattice),
        masks: bundle.masks().map(|_| section(SectionKind::Masks)),
        coder: section(SectionKind::Tables),
        manifest: section(SectionKind::Manifest),
        directory: &directory,
        gaussians: find(SectionKind::Gaussians).map(|_| section(SectionKind::Gaussians)),
        protocol: None,
        chunks: section(SectionKind::Chunks),
    };
    sections.emit(bundle.header()).collect()
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
    let boxed = write_bytes(&tightly_boxed_scene(), &options(TABLES, 1));
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
