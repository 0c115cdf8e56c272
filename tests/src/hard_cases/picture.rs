//! A scene and a camera, drawn by decoder and trainer, coded and decoded, and compared with the f64 oracle.

use glam::{DMat3, DVec3};
use pocketsplat_capture::camera::Camera;
use pocketsplat_codec::bundle::{self, WriteOptions, decoded_scene};
use pocketsplat_codec::render::reference::ReferenceScene;
use pocketsplat_format::Bundle;
use pocketsplat_kernels::camera::host_camera;
use pocketsplat_kernels::ops::Pinhole;
use pocketsplat_kernels::scene::QuantisationSteps;
use pocketsplat_kernels::scene::Scene;
use pocketsplat_kernels::step::Workspace;

use super::gradient;
use crate::difference::{Difference, worse};
use crate::frame::{BACKGROUND, draw, info_for, to_core};

/// Edge of a decoder's tile, pixels.
const TILE_PX: usize = 16;

/// What is drawn.
#[derive(Clone, Debug)]
pub struct Picture {
    /// The scene, as a trainer holds it.
    pub scene: Scene<f32>,
    /// The camera.
    pub camera: Camera,
    /// Cameras that no f32 arithmetic can be asked to tell from it: the picture may be that of any of them.
    pub nearby: Vec<Camera>,
}

/// Errors of a picture, or what they must not exceed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Figures {
    /// Decoder against oracle, worst channel, steps of 8 bits.
    pub decoder: f64,
    /// The same, mean of the worst tile.
    pub tile: f64,
    /// Trainer in f32 against oracle, worst channel, steps of 8 bits.
    pub trainer: f64,
    /// Values decoded against values written, worst, quantisation steps.
    pub codec: f64,
    /// Trainer's gradients in f32 against those in f64, worst, of the largest of their kind.
    pub rounding: f64,
    /// Trainer's gradients in f64 against differences, worst direction, of the direction's terms.
    pub differences: f64,
}

impl Figures {
    /// Bounds of a picture whose hard part should not show.
    pub const USUAL: Self =
        Self { decoder: 1.5, tile: 0.6, trainer: 1.05, codec: 0.505, rounding: 1e-3, differences: 1e-5 };

    /// What the numbers of [`Self::columns`] are, for a head of a table.
    pub const COLUMNS: [&str; 6] =
        ["decoder, worst", "decoder, worst tile", "trainer, worst", "codec", "gradient, f32", "gradient, f64"];

    /// The numbers in the order of the page's columns.
    pub fn columns(&self) -> [f64; 6] {
        let Self { decoder, tile, trainer, codec, rounding, differences } = *self;
        [decoder, tile, trainer, codec, rounding, differences]
    }

    /// What is larger than it may be, or no number.
    pub fn exceeding(&self, bounds: &Self) -> Vec<String> {
        let figures = self.columns().into_iter().zip(bounds.columns()).zip(Self::COLUMNS);
        // Not `>`: NaN has to be found.
        let exceeding = figures.filter(|((found, bound), _)| !(found <= bound));
        exceeding.map(|((found, bound), what)| format!("{what}: {found:.3e} of {bound:e}")).collect()
    }
}

/// The camera of most cases: at the origin, looking along z, 60 px focal length, 48 × 32 px.
pub fn camera() -> Camera {
    Camera {
        rotation: DMat3::IDENTITY,
        translation: DVec3::ZERO,
        focal_px: [60.0, 60.0],
        principal_px: [24.25, 15.75],
        width_px: 48,
        height_px: 32,
    }
}

impl Picture {
    /// A scene as the usual camera sees it.
    pub fn of(scene: Scene<f32>) -> Self {
        Self { scene, camera: camera(), nearby: Vec::new() }
    }

    /// The same through another camera.
    pub fn through(self, camera: Camera) -> Self {
        Self { camera, ..self }
    }

    /// Draws, codes and differentiates it.
    ///
    /// * returns the errors, and whether the oracle sees more than background.
    ///
    /// # Panics
    /// If the bundle cannot be written or drawn, or a pixel is not delivered once.
    pub fn measure(&self) -> (Figures, bool) {
        let (figures, seen) = self.draw();
        let camera = host_camera(&to_core(&self.camera));
        let [rounding, differences] = gradient::errors(&self.scene, &camera, background());
        (Figures { rounding, differences, ..figures }, seen)
    }

    /// [`Self::measure`] without gradients, whose errors are 0.
    ///
    /// # Panics
    /// As [`Self::measure`].
    pub fn draw(&self) -> (Figures, bool) {
        let camera = to_core(&self.camera);
        let background = background();
        // The oracle draws with the decoder's camera, rounded as it is.
        let oracle_cameras: Vec<Camera> =
            std::iter::once(&self.camera).chain(&self.nearby).map(|camera| host_camera(&to_core(camera))).collect();
        let nearest = |oracle: &ReferenceScene, error: &dyn Fn(&[[f64; 3]]) -> [f64; 2]| {
            let errors = oracle_cameras.iter().map(|camera| error(&oracle.render(camera, background)));
            errors.min_by(|a, b| a[0].total_cmp(&b[0])).expect("one camera at least")
        };
        let mut figures =
            Figures { decoder: 0.0, tile: 0.0, trainer: 0.0, codec: 0.0, rounding: 0.0, differences: 0.0 };
        // Heads as halves and as coded ones, each its own scene.
        for head_fraction_bits in [None, Some([9, 9])] {
            let options = WriteOptions { head_fraction_bits, ..WriteOptions::default() };
            let written = bundle::write(&self.scene, &info_for(&self.camera), &options).expect("a scene to be written");
            let bundle = Bundle::parse(&written.bytes).expect("the writer's bundle is sound");
            let (frame, _) = draw(&bundle, &camera).expect("the worst case is planned for");
            assert!(frame.deliveries.iter().all(|&n| n == 1), "every pixel once");
            let oracle = ReferenceScene::from_bundle(&bundle).expect("its chunks decode");
            let [worst, tile] = nearest(&oracle, &|expected| {
                let difference = Difference::of(&frame.rgb, expected, frame.width_px);
                [difference.worst_steps, worst_tile(&frame.rgb, expected, frame.width_px)]
            });
            figures.decoder = worse(figures.decoder, worst);
            figures.tile = worse(figures.tile, tile);
            figures.codec = worse(figures.codec, codec_error(&self.scene, &bundle));
        }

        let pinhole = Pinhole::<f32>::new(&oracle_cameras[0]);
        let planes = Workspace::new(&self.scene.shape).image(&self.scene, &pinhole, background.map(|c| c as f32));
        let n = planes.len() / 3;
        let oracle = ReferenceScene::from_scene(&self.scene);
        [figures.trainer, _] = nearest(&oracle, &|expected| {
            let channels = (0..3 * n).map(|i| (planes[i / n * n + i % n], expected[i % n][i / n]));
            let steps = channels.map(|(found, exact)| 255.0 * distance(f64::from(found), exact));
            [steps.fold(0.0, worse), 0.0]
        });
        let seen = oracle.render(&oracle_cameras[0], background).iter().any(|&colour| colour != background);
        (figures, seen)
    }
}

pub(super) fn background() -> [f64; 3] {
    BACKGROUND.map(|byte| f64::from(byte) / 255.0)
}

/// Difference of two channels as they would be shown; infinite for what is no number.
fn distance(found: f64, exact: f64) -> f64 {
    if found.is_finite() { (found.clamp(0.0, 1.0) - exact.clamp(0.0, 1.0)).abs() } else { f64::INFINITY }
}

/// The largest of the tiles' mean errors, steps of 8 bits.
pub(super) fn worst_tile(found: &[u8], exact: &[[f64; 3]], width_px: usize) -> f64 {
    let height_px = exact.len() / width_px;
    let error_at = |x: usize, y: usize| {
        let i = y * width_px + x;
        let channels = found[3 * i..3 * i + 3].iter().zip(exact[i]);
        channels.map(|(&byte, colour)| (f64::from(byte) - 255.0 * colour.clamp(0.0, 1.0)).abs()).sum::<f64>() / 3.0
    };
    let mut worst = 0.0_f64;
    for top in (0..height_px).step_by(TILE_PX) {
        for left in (0..width_px).step_by(TILE_PX) {
            let (bottom, right) = ((top + TILE_PX).min(height_px), (left + TILE_PX).min(width_px));
            let sum: f64 = (top..bottom).flat_map(|y| (left..right).map(move |x| error_at(x, y))).sum();
            worst = worse(worst, sum / ((bottom - top) * (right - left)) as f64);
        }
    }
    worst
}

/// The largest difference of a drawn value before and after coding, in steps of its kind; infinite where an anchor is lost.
pub fn codec_error(scene: &Scene<f32>, bundle: &Bundle<'_>) -> f64 {
    let decoded = decoded_scene(bundle).expect("its chunks decode");
    let steps = QuantisationSteps::default();
    let (shape, mut worst) = (scene.shape, 0.0_f64);
    for (a, cell) in scene.anchors.lattice.iter().enumerate() {
        if !scene.anchors.has_drawn(a) {
            continue;
        }
        let Some(b) = decoded.anchors.lattice.iter().position(|other| other == cell) else { return f64::INFINITY };
        let [before, after] = [&scene.anchors, &decoded.anchors];
        for (values, decoded, width, step) in [
            (&before.features, &after.features, shape.feature_dim, steps.feature),
            (&before.log_scales, &after.log_scales, shape.n_log_scales(), steps.log_scale),
            (&before.offsets, &after.offsets, 3 * shape.n_offsets, steps.offset),
        ] {
            for i in 0..width {
                // Offsets that are not drawn are not coded.
                let of_offset = width == 3 * shape.n_offsets && std::ptr::eq(values, &before.offsets);
                if of_offset && !before.is_drawn(a * shape.n_offsets + i / 3) {
                    continue;
                }
                let error = f64::from(values[a * width + i]) - f64::from(decoded[b * width + i]);
                worst = worse(worst, error.abs() / f64::from(step));
            }
        }
    }
    worst
}
