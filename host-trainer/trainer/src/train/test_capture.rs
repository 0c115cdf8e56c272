//! A capture of a few small views, made of nothing, and a run on it that grows and prunes within seconds.

use glam::{DMat3, DVec3};

use super::TrainConfig;
use super::config::{Backbone, Densification};
use pocketsplat_capture::camera::Camera;
use pocketsplat_capture::dataset::{Capture, Image, Photograph, View};
use pocketsplat_kernels::scene::ModelShape;

pub(crate) const SIZE_PX: u32 = 24;

/// Five cameras around coloured discs.
pub(crate) fn tiny_capture() -> Capture {
    many_views(5)
}

/// As [`tiny_capture`], with more cameras.
pub(crate) fn many_views(n: u32) -> Capture {
    let view = |i: u32| {
        let angle = f64::from(i) * 1.1;
        let rotation = DMat3::from_rotation_y(angle);
        let camera = Camera {
            rotation,
            translation: DVec3::new(0.0, 0.0, 3.0),
            focal_px: [26.0, 26.0],
            principal_px: [12.0, 12.0],
            width_px: SIZE_PX,
            height_px: SIZE_PX,
        };
        let rgb = (0..SIZE_PX * SIZE_PX)
            .flat_map(|p| {
                let (x, y) = (p % SIZE_PX, p / SIZE_PX);
                let inside = (x.abs_diff(12 + i % 5)).pow(2) + y.abs_diff(12).pow(2) < 60;
                let level = |c: u32| u8::try_from(40 + (x * 7 + y * 3 + c * 50 + i * 11) % 200).unwrap();
                if inside { [level(0), level(1), level(2)] } else { [0; 3] }
            })
            .collect();
        let image = Image { width_px: SIZE_PX, height_px: SIZE_PX, rgb };
        View::new(format!("view_{i}"), camera, Photograph { image, mask: None })
    };
    let points = (0..300).map(|i| {
        let t = f64::from(i);
        DVec3::new((t * 0.73).sin(), (t * 1.37).sin(), (t * 2.11).sin()) * 0.8
    });
    Capture::of_views((0..n).map(view).collect(), points.collect())
}

/// Changes the photograph of a view.
pub(crate) fn edit(view: &mut View, change: impl FnOnce(&mut Photograph)) {
    let mut photograph = Photograph::clone(&view.photograph().unwrap());
    change(&mut photograph);
    view.set_photograph(photograph);
}

/// `iterations` steps, with growth and pruning every seventh of them.
pub(crate) fn tiny_config(iterations: u32) -> TrainConfig {
    TrainConfig {
        shape: ModelShape { feature_dim: 8, n_offsets: 4, ..TrainConfig::default().shape },
        iterations,
        voxel_size: Some(0.02),
        densification: Densification {
            statistics_from: 0.05,
            from: 0.1,
            until: 0.9,
            interval: 7,
            gradient_threshold: 1e-4,
            min_opacity: 0.5,
            ..Densification::default()
        },
        ..TrainConfig::default()
    }
}

/// The same with the rate of HAC.
pub(crate) fn tiny_hac_config(iterations: u32) -> TrainConfig {
    TrainConfig { backbone: Backbone::Hac, ..tiny_config(iterations) }
}
