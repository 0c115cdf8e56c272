//! Hard splats of all kinds in one bundle, for tests that compare machines rather than arithmetics.

use pocketsplat_kernels::scene::Scene;

use super::blobs::{Blob, Blobs};
use super::picture::camera;
use super::{layers, scales, splats};
use crate::frame::bundle_of;

/// The bundle of a scene of needles, pancakes, specks, walls, stacks and rotations that are none; its preview sees them.
pub fn gathered() -> Vec<u8> {
    bundle_of(&scene(), &camera())
}

fn scene() -> Scene<f32> {
    let blobs = splats::hardest().into_iter().chain(layers::hardest()).chain(scales::hardest());
    // Anchors are voxels: no two share a cell.
    let apart = |(i, blob): (usize, Blob)| {
        let [x, y, z] = blob.position;
        Blob { position: [x, y, z + i as f64 / 512.0], ..blob }
    };
    Blobs::of(blobs.enumerate().map(apart)).scene()
}

#[cfg(test)]
mod tests {
    use pocketsplat_format::Bundle;

    use crate::frame::{BACKGROUND, draw, to_core};
    use crate::hard_cases::{Figures, Picture, picture::camera};

    #[test]
    fn the_preview_sees_the_gathered_cases_as_the_oracle_does() {
        let bytes = super::gathered();
        let bundle = Bundle::parse(&bytes).expect("the writer's bundle is sound");
        let (frame, report) = draw(&bundle, &to_core(&camera())).expect("drawn");
        assert!(report.splats > 100, "{} splats", report.splats);
        assert!(frame.rgb.as_chunks().0.iter().any(|&pixel| pixel != BACKGROUND), "something is seen");
        let (figures, _) = Picture::of(super::scene()).draw();
        // As other opaque stacks: one layer more or less at the end.
        let bounds = Figures { decoder: 4.0, tile: 3.1, trainer: 3.6, ..Figures::USUAL };
        assert_eq!(figures.exceeding(&bounds), Vec::<String>::new());
    }
}
