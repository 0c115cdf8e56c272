//! Runs that something goes wrong in: no parameter ever becomes infinite or NaN.

use glam::{DMat3, DVec3};
use pocketsplat_capture::camera::Camera;
use pocketsplat_capture::dataset::{Capture, Image, Photograph, View};
use pocketsplat_kernels::scene::ModelShape;
use pocketsplat_trainer::train::config::{Densification, LearningRate, Rates};
use pocketsplat_trainer::train::{TrainConfig, TrainError, Trainer};

use super::{Case, Family, error, n_not_finite, parameters};
use crate::difference::worse;

const ANSWER: &str = "\
Whatever the learning rates and photographs, every parameter stays finite. A run that cannot go on says why and keeps the scene it
had.";

const ANALYSIS: &str = "\
Nothing is measured here except that every parameter is finite after every iteration. The watchdog looks at loss and gradients before
they are applied and drops the step otherwise. Adam moves a parameter by at most a few rates whatever the gradient. So from finite
parameters and gradients below 10¹⁸ come finite parameters. A run whose steps are all dropped ends with an error that names the cause.";

const SIZE_PX: u32 = 24;
const ITERATIONS: u32 = 60;

/// Cameras around the origin and what each of them photographed.
fn capture(pixel: impl Fn(u32, u32, u32) -> [u8; 3], points: Vec<DVec3>) -> Capture {
    let view = |i: u32| {
        let camera = Camera {
            rotation: DMat3::from_rotation_y(f64::from(i) * 1.1),
            translation: DVec3::new(0.0, 0.0, 3.0),
            focal_px: [26.0, 26.0],
            principal_px: [12.0, 12.0],
            width_px: SIZE_PX,
            height_px: SIZE_PX,
        };
        let rgb = (0..SIZE_PX * SIZE_PX).flat_map(|p| pixel(i, p % SIZE_PX, p / SIZE_PX)).collect();
        let image = Image { width_px: SIZE_PX, height_px: SIZE_PX, rgb };
        View::new(format!("view_{i}"), camera, Photograph { image, mask: None })
    };
    Capture::of_views((0..5).map(view).collect(), points)
}

fn cloud() -> Vec<DVec3> {
    // A sequence without sines, which hosts compute differently.
    let fraction = |x: f64| 2.0 * x.fract() - 1.0;
    (0..200)
        .map(f64::from)
        .map(|i| DVec3::new(fraction(0.618_034 * i), fraction(0.754_878 * i), fraction(0.569_840 * i)) * 0.8)
        .collect()
}

fn gradient(i: u32, x: u32, y: u32) -> [u8; 3] {
    [x * 9 + i * 5, y * 9, (x + y) * 4 + 20].map(|v| v.min(255) as u8)
}

fn config() -> TrainConfig {
    TrainConfig {
        shape: ModelShape { view_colour: true, view_geometry: true, ..ModelShape::plain(8, 4) },
        iterations: ITERATIONS,
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

/// Parameters that were not finite after any iteration of a run.
fn run(capture: &Capture, config: TrainConfig) -> f64 {
    let mut trainer = Trainer::new(capture, config).expect("a capture to train on");
    let mut worst = 0.0_f64;
    while !trainer.is_done() {
        let ended = matches!(trainer.advance(), Err(TrainError::Diverged { .. }));
        worst = worse(worst, n_not_finite(parameters(trainer.scene())));
        if ended {
            break;
        }
    }
    worst
}

/// What a run on the edited capture ends with.
pub(super) fn diverging(edit: impl Fn(&mut Capture, &mut TrainConfig)) -> String {
    let (mut capture, mut config) = (capture(gradient, cloud()), TrainConfig { iterations: 1000, ..config() });
    edit(&mut capture, &mut config);
    let mut trainer = match Trainer::new(&capture, config) {
        Ok(trainer) => trainer,
        Err(error) => return error.to_string(),
    };
    while !trainer.is_done() {
        if let Err(error) = trainer.advance() {
            return error.to_string();
        }
    }
    "accepted".to_owned()
}

/// All rates multiplied.
fn spiked(factor: f64) -> Rates {
    let all = |rate: LearningRate| rate.times(factor);
    let Rates { offset, feature, log_scale, opacity_head, covariance_head, colour_head, .. } = Rates::default();
    let Rates { mask, grid, context, background, .. } = Rates::default();
    Rates {
        offset: all(offset),
        feature: all(feature),
        log_scale: all(log_scale),
        opacity_head: all(opacity_head),
        covariance_head: all(covariance_head),
        colour_head: all(colour_head),
        mask: all(mask),
        grid: all(grid),
        context: all(context),
        background: all(background),
    }
}

/// A scene whose anchors all lie behind every camera.
fn nothing_seen() -> Capture {
    let mut capture = capture(gradient, cloud());
    for view in &mut capture.train {
        view.camera.translation.z = -30.0;
    }
    capture
}

pub(super) fn family() -> Family {
    let numbers = "parameters not finite";
    let cases: Vec<Case> = vec![
        error("rates × 100", "every learning rate a hundred times too large", numbers, 0.0, || {
            run(&capture(gradient, cloud()), TrainConfig { rates: spiked(100.0), ..config() })
        }),
        error(
            "largest rates",
            "every learning rate at the largest that a configuration may have",
            numbers,
            0.0,
            || {
                let largest = LearningRate::falling(10.0, 10.0);
                let rates = Rates {
                    offset: largest,
                    feature: largest,
                    log_scale: largest,
                    opacity_head: largest,
                    covariance_head: largest,
                    colour_head: largest,
                    mask: largest,
                    grid: largest,
                    context: largest,
                    background: largest,
                };
                run(&capture(gradient, cloud()), TrainConfig { iterations: 200, rates, ..config() })
            },
        ),
        error("nothing seen", "every view looks away from the scene", numbers, 0.0, || run(&nothing_seen(), config())),
        error("black photographs", "0 everywhere", numbers, 0.0, || run(&capture(|_, _, _| [0; 3], cloud()), config())),
        error("white photographs", "255 everywhere on a black background", numbers, 0.0, || {
            run(&capture(|_, _, _| [255; 3], cloud()), config())
        }),
        error("saturated photographs", "a board of 0 and 255, pixel by pixel", numbers, 0.0, || {
            run(&capture(|i, x, y| [255 * ((i + x + y) % 2) as u8; 3], cloud()), config())
        }),
        error("contradicting photographs", "black in one view and white in the next", numbers, 0.0, || {
            run(&capture(|i, _, _| [255 * (i % 2) as u8; 3], cloud()), config())
        }),
        error("one point to start from", "a scene of a single anchor", numbers, 0.0, || {
            run(&capture(gradient, vec![DVec3::ZERO]), config())
        }),
        error("a line to start from", "anchors along one axis", numbers, 0.0, || {
            run(
                &capture(gradient, (0..50).map(|i| DVec3::new(0.02 * f64::from(i) - 0.5, 0.0, 0.0)).collect()),
                config(),
            )
        }),
        error("points at a camera", "anchors where a camera stands", numbers, 0.0, || {
            let sight = capture(gradient, cloud());
            let eye = sight.train[0].camera.centre_world();
            run(&capture(gradient, cloud().into_iter().map(|p| eye + 0.1 * p).chain([eye]).collect()), config())
        }),
    ];
    Family { title: "Training", answer: ANSWER, analysis: ANALYSIS, cases }
}
