//! From rays to pixels.

use glam::DVec3;

use super::cameras::{CAMERA_ANGLE_X, Pose};
use super::scene::Scene;
use super::surface::Ray;

/// The image of `size_px × size_px` that a camera sees, RGBA with straight alpha, `[size, size, 4]`.
///
/// Each pixel holds the mean colour of those of its `samples_per_axis²` rays that meet something, and as alpha their
/// share; so colour times alpha is the mean over all rays with black behind.
pub(super) fn view(scene: &Scene, pose: &Pose, size_px: u32, samples_per_axis: u32) -> Vec<u8> {
    let focal_px = 0.5 * f64::from(size_px) / (0.5 * CAMERA_ANGLE_X).tan();
    let centre_px = 0.5 * f64::from(size_px);
    let ray_through = |u_px: f64, v_px: f64| {
        let (x, y) = ((u_px - centre_px) / focal_px, (v_px - centre_px) / focal_px);
        let direction = pose.right * x - pose.up * y - pose.backward;
        Ray { origin: pose.centre, direction: direction.normalize() }
    };
    // Where the rays cross a pixel: the middles of even cells.
    let within: Vec<f64> = (0..samples_per_axis).map(|i| (f64::from(i) + 0.5) / f64::from(samples_per_axis)).collect();
    let mut rgba = Vec::with_capacity(size_px as usize * size_px as usize * 4);
    for y in 0..size_px {
        for x in 0..size_px {
            let (mut sum, mut n_met) = (DVec3::ZERO, 0_u32);
            for dy in &within {
                for dx in &within {
                    if let Some(colour) = scene.colour(&ray_through(f64::from(x) + dx, f64::from(y) + dy)) {
                        sum += colour;
                        n_met += 1;
                    }
                }
            }
            let mean = sum / f64::from(n_met.max(1));
            let alpha = f64::from(n_met) / f64::from(samples_per_axis * samples_per_axis);
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "values lie in [0, 1]")]
            rgba.extend([mean.x, mean.y, mean.z, alpha].map(|value| (value * 255.0 + 0.5) as u8));
        }
    }
    rgba
}
