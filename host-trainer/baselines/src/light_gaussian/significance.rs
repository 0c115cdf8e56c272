//! How much a Gaussian gives the training views.

use pocketsplat_kernels::ops::Pinhole;
use pocketsplat_kernels::ops::simd::Level;
use pocketsplat_trainer::explicit::Cloud;
use pocketsplat_trainer::explicit::step::draw;

/// β: how much the volume counts.
const VOLUME_POWER: f64 = 0.1;

/// The share of Gaussians whose volume is at most V₉₀.
const FULL_VOLUME_SHARE: f64 = 0.9;

/// The global significance `[N]`: GSⱼ = γ(Σⱼ)·Σ over the views' pixels of αⱼ·Tⱼ (Fan et al. 2023).
///
/// α is the opacity where the pixel hits the Gaussian, T what comes through in front of it, and γ = clamp(V/V₉₀, 0, 1)^β of its volume
/// V; 90 % of the Gaussians have V₉₀ at most. Cost: each view drawn, and taken back to the splats.
pub(crate) fn significance(level: Level, cloud: &Cloud<f32>, cameras: &[Pinhole<f32>]) -> Vec<f64> {
    let mut light = vec![0.0; cloud.len()];
    for camera in cameras {
        let drawing = draw(level, cloud, camera, [0.0; 3]);
        for (index, given) in drawing.drawn.iter().zip(drawing.light(level, camera.size_px)) {
            light[*index as usize] += f64::from(given);
        }
    }
    light.iter().zip(volume_factors(&cloud.log_scales)).map(|(light, factor)| light * factor).collect()
}

/// γ `[N]`, by way of ln V, in which factors of all volumes fall out.
fn volume_factors(log_scales: &[[f32; 3]]) -> Vec<f64> {
    let log_volumes: Vec<f64> = log_scales.iter().map(|s| s.iter().map(|s| f64::from(*s)).sum()).collect();
    let mut sorted = log_volumes.clone();
    sorted.sort_by(f64::total_cmp);
    let full = sorted.get(share_of(sorted.len().saturating_sub(1), FULL_VOLUME_SHARE)).copied().unwrap_or_default();
    log_volumes.iter().map(|log_volume| (VOLUME_POWER * (log_volume - full).min(0.0)).exp()).collect()
}

/// Marks the least significant: so much of all, rounded down.
pub(crate) fn least_significant(significance: &[f64], share: f64) -> Vec<bool> {
    let mut order: Vec<usize> = (0..significance.len()).collect();
    order.sort_by(|a, b| significance[*a].total_cmp(&significance[*b]).then(a.cmp(b)));
    let mut marks = vec![false; significance.len()];
    order[..share_of(significance.len(), share)].iter().for_each(|i| marks[*i] = true);
    marks
}

#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a share of a count, cut to it")]
fn share_of(n: usize, share: f64) -> usize {
    ((n as f64 * share) as usize).min(n)
}

#[cfg(test)]
mod tests {
    use glam::{DMat3, DQuat, DVec3};
    use pocketsplat_capture::camera::Camera;
    use pocketsplat_gaussians::Gaussians;

    use super::*;
    use crate::test_scenes::{capture_of, gaussians};

    /// Σ α·T of each Gaussian in one view: every pixel by itself, in f64.
    fn light_of(gaussians: &Gaussians, camera: &Camera) -> Vec<f64> {
        let n = gaussians.len();
        let points: Vec<DVec3> = (0..n)
            .map(|i| camera.rotation * DVec3::from(gaussians.centres[i].map(f64::from)) + camera.translation)
            .collect();
        let mut order: Vec<usize> = (0..n).filter(|i| points[*i].z > 0.2).collect();
        order.sort_by(|a, b| points[*a].z.total_cmp(&points[*b].z));
        let [fx, fy] = camera.focal_px;
        let mut light = vec![0.0; n];
        for (x, y) in (0..camera.height_px).flat_map(|y| (0..camera.width_px).map(move |x| (x, y))) {
            let mut through = 1.0;
            for i in &order {
                let p = points[*i];
                let [w, qx, qy, qz] = gaussians.rotations[*i].map(f64::from);
                let axes = camera.rotation * DMat3::from_quat(DQuat::from_xyzw(qx, qy, qz, w).normalize());
                let scaled = axes * DMat3::from_diagonal(DVec3::from(gaussians.log_scales[*i].map(f64::from)).exp());
                let covariance = scaled * scaled.transpose();
                let rows = [
                    DVec3::new(fx / p.z, 0.0, -fx * p.x / (p.z * p.z)),
                    DVec3::new(0.0, fy / p.z, -fy * p.y / (p.z * p.z)),
                ];
                let entry = |a: usize, b: usize| rows[a].dot(covariance * rows[b]) + if a == b { 0.3 } else { 0.0 };
                let (a, b, c) = (entry(0, 0), entry(0, 1), entry(1, 1));
                let dx = f64::from(x) + 0.5 - (fx * p.x / p.z + camera.principal_px[0]);
                let dy = f64::from(y) + 0.5 - (fy * p.y / p.z + camera.principal_px[1]);
                let power = -0.5 * (c * dx * dx - 2.0 * b * dx * dy + a * dy * dy) / (a * c - b * b);
                let opacity = 1.0 / (1.0 + (-f64::from(gaussians.opacity_logits[*i])).exp());
                let alpha = (opacity * power.exp()).min(0.99);
                if alpha < 1.0 / 255.0 {
                    continue;
                }
                if through * (1.0 - alpha) < 1e-4 {
                    break;
                }
                light[*i] += through * alpha;
                through *= 1.0 - alpha;
            }
        }
        light
    }

    #[test]
    fn significance_is_what_the_definition_says() {
        let gaussians = gaussians(30);
        let capture = capture_of(&gaussians, 3);
        let cameras: Vec<_> = capture.train.iter().map(|view| Pinhole::new(&view.camera)).collect();
        let found = significance(Level::detect(), &Cloud::from(&gaussians), &cameras);
        let volumes: Vec<f64> = gaussians.log_scales.iter().map(|s| f64::from(s[0] + s[1] + s[2]).exp()).collect();
        let mut sorted = volumes.clone();
        sorted.sort_by(f64::total_cmp);
        let views: Vec<_> = capture.train.iter().map(|view| light_of(&gaussians, &view.camera)).collect();
        assert!(views.iter().flatten().filter(|light| **light > 1.0).count() > 30);
        for i in 0..30 {
            let light: f64 = views.iter().map(|view| view[i]).sum();
            let expected = light * (volumes[i] / sorted[26]).clamp(0.0, 1.0).powf(0.1);
            assert!((found[i] - expected).abs() <= 1e-3 * expected.max(0.1), "{i}: {}, expected {expected}", found[i]);
        }
    }

    #[test]
    fn the_least_significant_are_marked() {
        let significance = [3.0, 1.0, 0.0, 1.0, 9.0];
        assert_eq!(least_significant(&significance, 0.4), [false, true, true, false, false]);
        assert_eq!(least_significant(&significance, 1.0), [true; 5]);
        assert_eq!(least_significant(&[], 0.66), [false; 0]);
        assert_eq!(volume_factors(&[]), [0.0; 0]);
    }
}
