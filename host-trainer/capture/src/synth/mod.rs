//! Synthetic captures: a small scene whose every pixel is known, ray-traced and written as a Blender capture.
//!
//! For tests, benchmarks and first steps without photographs. The scene has what a model must cope with: textures of
//! several frequencies, wires about a pixel thick, a highlight that moves with the view, and empty space around it all.

use std::path::{Path, PathBuf};

use rayon::prelude::*;
use serde::Serialize;

mod cameras;
mod scene;
mod surface;
mod texture;
mod trace;

use cameras::{CAMERA_ANGLE_X, Pose};
use scene::Scene;

/// How the scene's surfaces throw back the light.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum SurfaceFinish {
    /// All matt: a point of a surface has the same colour from everywhere.
    Matte,
    /// A narrow highlight on the ball, all else matt.
    #[default]
    Mixed,
    /// Broad highlights on ground and box besides the ball's; only the wires are matt.
    Glossy,
}

/// What to ray-trace.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SynthOptions {
    /// Width and height of the images, pixels.
    pub size_px: u32,
    /// Views to train on.
    pub n_train: u32,
    /// Views to hold out; their cameras are others.
    pub n_test: u32,
    /// Decides the textures' noise and where the cameras' spirals start.
    pub seed: u64,
    /// How surfaces throw back the light.
    pub finish: SurfaceFinish,
    /// Rays per pixel along each axis: 4 means 16 rays per pixel.
    pub samples_per_axis: u32,
}

impl Default for SynthOptions {
    fn default() -> Self {
        Self { size_px: 128, n_train: 60, n_test: 12, seed: 42, finish: SurfaceFinish::Mixed, samples_per_axis: 4 }
    }
}

/// What was written.
#[derive(Clone, Debug, PartialEq)]
pub struct SynthReport {
    /// Views to train on.
    pub n_train: u32,
    /// Views held out.
    pub n_test: u32,
    /// Width and height of the images, pixels.
    pub size_px: u32,
    /// Mean alpha of all images: the part of them that shows something.
    pub mean_alpha: f64,
}

/// Why no capture was written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
#[expect(missing_docs, reason = "each message names its fields")]
pub enum SynthError {
    /// An option has a value nothing can be traced with.
    #[error("`{name}` is {found}, needed: {min} to {max}")]
    Option { name: &'static str, found: u32, min: u32, max: u32 },
    /// The folder holds something already.
    #[error("`{}` is not empty: give a new folder, so that no capture is overwritten", path.display())]
    Occupied { path: PathBuf },
    /// The system does not let a file or folder be written.
    #[error("cannot write `{}`: {source}", path.display())]
    Write { path: PathBuf, source: std::io::Error },
    /// An image cannot be encoded or written.
    #[error("cannot write the image `{}`: {source}", path.display())]
    Image { path: PathBuf, source: image::ImageError },
}

#[derive(Serialize)]
struct Transforms {
    camera_angle_x: f64,
    frames: Vec<Frame>,
}

#[derive(Serialize)]
struct Frame {
    file_path: String,
    transform_matrix: [[f64; 4]; 4],
}

/// Ray-traces the scene and writes it to the folder `dir` as `transforms_{train,test}.json` and RGBA PNGs.
///
/// The images carry straight alpha, antialiased over `samples_per_axis²` rays per pixel. Same options, same bytes,
/// whatever the number of threads. The folder is made where it is missing. Work: `size² · samples² · (train + test)`
/// rays; the default is 19 million rays and takes three seconds on two cores.
///
/// # Errors
/// [`SynthError`]: an option out of range, a folder that is not empty, or files that cannot be written.
pub fn write_capture(dir: &Path, options: &SynthOptions) -> Result<SynthReport, SynthError> {
    let in_range = |name, found, min, max| {
        if (min..=max).contains(&found) { Ok(()) } else { Err(SynthError::Option { name, found, min, max }) }
    };
    in_range("size_px", options.size_px, 1, 4096)?;
    in_range("n_train", options.n_train, 3, 10_000)?;
    in_range("n_test", options.n_test, 0, 10_000)?;
    in_range("samples_per_axis", options.samples_per_axis, 1, 64)?;
    let cannot_write = |path: &Path| {
        let path = path.to_owned();
        move |source| SynthError::Write { path, source }
    };
    std::fs::create_dir_all(dir).map_err(cannot_write(dir))?;
    if std::fs::read_dir(dir).map_err(cannot_write(dir))?.next().is_some() {
        return Err(SynthError::Occupied { path: dir.to_owned() });
    }

    let scene = Scene::new(options.seed, options.finish);
    let mut alpha_sum = 0.0;
    let splits = [
        ("train", cameras::train(options.n_train, options.seed)),
        ("test", cameras::test(options.n_test, options.seed)),
    ];
    for (split, poses) in splits {
        let folder = dir.join(split);
        std::fs::create_dir(&folder).map_err(cannot_write(&folder))?;
        let numbered: Vec<(usize, &Pose)> = poses.iter().enumerate().collect();
        let mean_alphas = numbered.into_par_iter().map(|(i, pose)| {
            let rgba = trace::view(&scene, pose, options.size_px, options.samples_per_axis);
            let path = folder.join(format!("r_{i}.png"));
            let colour = image::ExtendedColorType::Rgba8;
            image::save_buffer(&path, &rgba, options.size_px, options.size_px, colour)
                .map_err(|source| SynthError::Image { path, source })?;
            let alphas: u64 = rgba.iter().skip(3).step_by(4).map(|&alpha| u64::from(alpha)).sum();
            Ok(alphas as f64 / (255.0 * f64::from(options.size_px) * f64::from(options.size_px)))
        });
        // Collected before it is summed, so that the sum has one order.
        alpha_sum += mean_alphas.collect::<Result<Vec<f64>, SynthError>>()?.iter().sum::<f64>();
        let frames = poses
            .iter()
            .enumerate()
            .map(|(i, pose)| Frame { file_path: format!("./{split}/r_{i}"), transform_matrix: pose.camera_to_world() });
        let transforms = Transforms { camera_angle_x: CAMERA_ANGLE_X, frames: frames.collect() };
        let path = dir.join(format!("transforms_{split}.json"));
        let json = serde_json::to_string_pretty(&transforms).map_err(std::io::Error::from);
        json.and_then(|json| std::fs::write(&path, json)).map_err(cannot_write(&path))?;
    }
    Ok(SynthReport {
        n_train: options.n_train,
        n_test: options.n_test,
        size_px: options.size_px,
        mean_alpha: alpha_sum / f64::from(options.n_train + options.n_test),
    })
}

#[cfg(test)]
mod tests;
