//! What is added to the variances of a frame's splats.

use pocketsplat_format::Camera;
use pocketsplat_format::bundle::Header;
use pocketsplat_format::rules::{DILATION_PX2, DILATION_REACH_PX, SHRUNK_DILATION_PX2};

/// Limits of the frame's size over the training size, squared.
const LEAST_SIZE_2: f32 = 1.0 / 4096.0;
const MOST_SIZE_2: f32 = 4096.0;

/// The dilation of a frame: d = 0.3·s² + max(0, 1 − s²)/6 px² for a frame of s times the training size.
///
/// Training draws the scene blurred by 0.3 px² of its own pixels, which are 0.3·s² of the frame's. A larger frame so shows what was
/// trained, in finer samples, and not gaps. Pixels of a smaller one are wider than that blur: what they miss is added, and splats fade
/// as they widen, so that each keeps its sum (Yu et al. 2024, Mip-Splatting, eq. 8). A frame of the training size is as trained.
#[derive(Clone, Copy, Debug)]
pub(super) struct Dilation {
    /// d.
    pub(super) added_px2: f32,
    /// The part of d that opacities were trained with: 0.3·s², or 0 where training compensated for it.
    pub(super) trained_px2: f32,
    /// Whether these differ, so that opacities fade.
    pub(super) fades: bool,
    /// How far it makes a splat reach beyond its extent in space, pixels.
    pub(super) reach_px: f32,
}

impl Dilation {
    /// In frames of the training size, of a scene without compensation.
    pub(super) const AS_TRAINED: Self = Self {
        added_px2: DILATION_PX2 as f32,
        trained_px2: DILATION_PX2 as f32,
        fades: false,
        reach_px: DILATION_REACH_PX as f32,
    };

    /// In frames of this camera.
    ///
    /// s² is the ratio of fx·fy to that of the preview, which is a training camera, brought to the training size. Cameras of the training
    /// size, either way up, are drawn as training drew them, whatever their focal lengths.
    pub(super) fn of(header: &Header, camera: &Camera) -> Self {
        let is_compensated = header.features.effects.dilation_compensation;
        Self::for_frame(is_compensated, header.training_px, &header.preview, camera)
    }

    fn for_frame(is_compensated: bool, training_px: [u16; 2], preview: &Camera, camera: &Camera) -> Self {
        let [width_px, height_px] = training_px;
        let size_px = [camera.width_px, camera.height_px];
        let mut dilation = Self::AS_TRAINED;
        if size_px != training_px && size_px != [height_px, width_px] {
            let [[fx, fy], [preview_fx, preview_fy]] = [camera.focal_px, preview.focal_px];
            let area = |[width, height]: [u16; 2]| (u32::from(width) * u32::from(height)) as f32;
            let to_training = area([preview.width_px, preview.height_px]) / area(training_px);
            dilation = Self::at(fx / preview_fx * (fy / preview_fy) * to_training);
        }
        if is_compensated {
            (dilation.trained_px2, dilation.fades) = (0.0, true);
        }
        dilation
    }

    /// In frames of √`size_2` times the training size, of a scene without compensation.
    pub(super) fn at(size_2: f32) -> Self {
        // The least also of NaN, from absurd cameras.
        let size_2 = if size_2 > LEAST_SIZE_2 { size_2.min(MOST_SIZE_2) } else { LEAST_SIZE_2 };
        let as_trained = Self::AS_TRAINED;
        let trained_px2 = as_trained.trained_px2 * size_2;
        let fades = size_2 < 1.0;
        let added_px2 = trained_px2 + if fades { (1.0 - size_2) * SHRUNK_DILATION_PX2 } else { 0.0 };
        let reach_px = as_trained.reach_px * pocketsplat_half::sqrt(added_px2 / as_trained.added_px2);
        Self { added_px2, trained_px2, fades, reach_px }
    }
}

#[cfg(test)]
mod tests {
    use pocketsplat_format::{Camera, Rotation};

    use super::Dilation;

    /// Of a scene that was trained at 400×300 px.
    fn of(trained: [f32; 2], focal_px: [f32; 2], size_px: [u16; 2]) -> Dilation {
        Dilation::for_frame(false, [400, 300], &camera(trained, [400, 300]), &camera(focal_px, size_px))
    }

    fn camera(focal_px: [f32; 2], [width_px, height_px]: [u16; 2]) -> Camera {
        Camera {
            rotation: Rotation::IDENTITY,
            translation: [0.0; 3],
            focal_px,
            principal_px: [1.0; 2],
            width_px,
            height_px,
        }
    }

    #[test]
    fn frames_of_the_training_size_are_as_trained_whatever_their_lens() {
        for (focal, size) in [([500.0; 2], [400, 300]), ([900.0; 2], [400, 300]), ([500.0; 2], [300, 400])] {
            let found = of([500.0; 2], focal, size);
            assert_eq!((found.added_px2, found.trained_px2, found.fades), (0.3, 0.3, false));
        }
        // Of another size, but of the same pixels: a part of the frame.
        let part = of([500.0; 2], [500.0; 2], [80, 60]);
        assert_eq!((part.added_px2, part.trained_px2, part.fades, part.reach_px), (0.3, 0.3, false, 1.9));
    }

    #[test]
    fn larger_frames_have_the_blur_of_training_and_smaller_ones_that_of_their_pixels_too() {
        let double = of([500.0, 480.0], [1000.0, 960.0], [800, 600]);
        assert_eq!((double.added_px2, double.trained_px2, double.fades, double.reach_px), (1.2, 1.2, false, 3.8));
        let half = of([500.0, 480.0], [250.0, 240.0], [200, 150]);
        assert!((half.added_px2 - 0.2).abs() < 1e-7 && (half.trained_px2 - 0.075).abs() < 1e-7 && half.fades);
        let small_preview = camera([125.0, 120.0], [100, 75]);
        let compensated = Dilation::for_frame(true, [400, 300], &small_preview, &camera([250.0, 240.0], [200, 150]));
        assert_eq!((compensated.added_px2, compensated.trained_px2, compensated.fades), (half.added_px2, 0.0, true));
    }

    #[test]
    fn absurd_lenses_give_a_finite_dilation() {
        for (trained, drawn) in [(1e-40, 1e14), (1e14, 1e-40), (1e-40, 1e-40), (3.0, f32::MIN_POSITIVE)] {
            let found = of([trained, 1e14], [drawn, 1e-40], [7, 7]);
            assert!(
                (0.1..2000.0).contains(&found.added_px2) && found.reach_px.is_finite(),
                "{trained} {drawn}: {found:?}"
            );
        }
    }
}
