//! Does a frame that is larger or smaller than those of training show the same picture?

use conformance::frame::{bundle_of, draw};
use conformance::scenes::{CASES, cameras, random_scene};
use pocketsplat_codec::render::reference::ReferenceScene;
use pocketsplat_core::Bundle;
use pocketsplat_kernels::camera::host_camera;

/// By how much such a frame is nearer to the trained picture than one with the dilation of training, decibels, mean of all cases.
const LEAST_GAIN_DB: f64 = 5.0;
/// How near it is, decibels, in every case.
const LEAST_PSNR_DB: f64 = 32.0;

/// A picture, RGB 0 to 255.
struct Picture {
    width: usize,
    rgb: Vec<[f64; 3]>,
}

impl Picture {
    /// Means of blocks of 2 × 2 pixels.
    fn halved(&self) -> Self {
        let width = self.width / 2;
        let rows = self.rgb.len() / self.width / 2;
        let mean = |i: usize| {
            let at = 2 * (i / width) * self.width + 2 * (i % width);
            let block = [at, at + 1, at + self.width, at + self.width + 1].map(|p| self.rgb[p]);
            std::array::from_fn(|channel| block.iter().map(|rgb| rgb[channel]).sum::<f64>() / 4.0)
        };
        Self { width, rgb: (0..width * rows).map(mean).collect() }
    }

    fn psnr_db(&self, other: &Self) -> f64 {
        let differences = self.rgb.as_flattened().iter().zip(other.rgb.as_flattened()).map(|(a, b)| (a - b) * (a - b));
        let mean = differences.sum::<f64>() / (3 * self.rgb.len()) as f64;
        10.0 * (255.0 * 255.0 / mean).log10()
    }
}

#[test]
fn larger_and_smaller_frames_show_the_picture_of_training() {
    for (name, size_px) in [("half", [80, 60]), ("double", [320, 240])] {
        let mut gains = Vec::new();
        for case in CASES {
            let bytes = bundle_of(&random_scene(&case), &cameras()[0].1);
            let bundle = Bundle::parse(&bytes).expect("the writer's bundle is sound");
            let preview = bundle.header().preview;
            let resized = preview.resized(size_px[0], size_px[1]);
            let drawn = |camera| {
                let (frame, _) = draw(&bundle, camera).expect("the worst case is planned for");
                let rgb = frame.rgb.chunks_exact(3).map(|rgb| [rgb[0], rgb[1], rgb[2]].map(f64::from)).collect();
                Picture { width: frame.width_px, rgb }
            };
            let undone =
                ReferenceScene { trained: None, ..ReferenceScene::from_bundle(&bundle).expect("sound chunks") };
            let background = bundle.header().background.map(|byte| f64::from(byte) / 255.0);
            let camera = host_camera(&resized);
            let as_trained = undone.render(&camera, background);
            let as_trained = Picture {
                width: size_px[0].into(),
                rgb: as_trained.iter().map(|rgb| rgb.map(|v| 255.0 * v.clamp(0.0, 1.0))).collect(),
            };
            let (trained, other) = (drawn(&preview), drawn(&resized));
            let psnr_db = |other: &Picture| match name {
                "half" => other.psnr_db(&trained.halved()),
                _ => other.halved().psnr_db(&trained),
            };
            let [found, without] = [&other, &as_trained].map(psnr_db);
            println!("{:>12} {name}: {found:.2} dB, {without:.2} with the dilation of training", case.name);
            assert!(found > LEAST_PSNR_DB, "{} at {name} size: {found} dB", case.name);
            gains.push(found - without);
        }
        let gain_db = gains.iter().sum::<f64>() / gains.len() as f64;
        assert!(gain_db > LEAST_GAIN_DB, "at {name} size: {gain_db} dB");
    }
}
