//! A splat: what remains of a Gaussian once projected, in the form in which rows of pixels are drawn.

use bytemuck::{Pod, Zeroable};
use pocketsplat_format::bundle::Effects;
use pocketsplat_format::rules::NEAR;

use super::covariance::Covariance;
use super::tile::TileRect;
use super::view::View;
use crate::functions::Functions;
use crate::scene::Gaussian;

/// A projected Gaussian.
///
/// Completing the square, dᵀΣ'⁻¹d = (dx − shear·dy)²·det⁻¹Σ'yy + dy²/Σ'yy: along a row of pixels the exponent is one
/// parabola around `u + shear·dy`. No term cancels another, which the usual conic does for long thin splats.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Splat {
    /// Centre, pixels.
    pub(crate) mean: [f32; 2],
    /// Σ'xy/Σ'yy: how far the row's centre moves per row.
    pub(crate) shear: f32,
    /// Σ'yy/det Σ': inverse variance along a row, px⁻².
    pub(crate) row_precision: f32,
    /// 1/Σ'yy: inverse variance across rows, px⁻².
    pub(crate) column_precision: f32,
    /// Natural logarithm of the opacity, compensation included.
    pub(crate) log_opacity: f32,
    /// RGB, 0 to 1.
    pub(crate) colour: [f32; 3],
    /// z in the camera frame, positive.
    pub(crate) depth: f32,
}

impl View {
    /// Projects a Gaussian; `None` when it is too near, too faint, or draws no pixel of the image.
    ///
    /// # Budget
    /// About 150 multiplications, 80 where Gaussians are isotropic, one logarithm, two square roots, three where splats fade, constant.
    pub(crate) fn project<F: Functions>(&self, gaussian: &Gaussian, effects: Effects) -> Option<(Splat, TileRect)> {
        let point = self.to_camera(gaussian.centre);
        let [_, _, depth] = point;
        // Not `depth <= NEAR`: NaN leaves as well, here and below.
        let in_front = depth > NEAR;
        if !in_front {
            return None;
        }
        let covariance = if cfg!(feature = "anisotropy") && effects.anisotropic {
            Covariance::from_rows(self.sphere_to_image(point, gaussian), self.dilation)
        } else {
            let [deviation, ..] = gaussian.scale;
            Covariance::of_isotropic(self.slopes(point), self.focal_px.map(|f| f / depth * deviation), self.dilation)
        };
        let mut opacity = gaussian.opacity;
        if self.dilation.fades {
            opacity *= pocketsplat_half::sqrt(covariance.det_trained / covariance.det);
        }
        let log_opacity = F::ln(opacity + self.lost_opacity);
        // Squared Mahalanobis radius at which alpha is the least that draws.
        let reach = 2.0 * (log_opacity + self.log_cut);
        if !(reach >= 0.0 && covariance.det.is_finite()) {
            return None;
        }
        let mean = self.to_image(point);
        let half_extent =
            [pocketsplat_half::sqrt(reach * covariance.xx), pocketsplat_half::sqrt(reach * covariance.yy)];
        let rect = TileRect::covering(mean, half_extent, self.size_px)?;
        let splat = Splat {
            mean,
            shear: covariance.xy / covariance.yy,
            row_precision: covariance.yy / covariance.det,
            column_precision: 1.0 / covariance.yy,
            log_opacity,
            colour: gaussian.colour,
            depth,
        };
        Some((splat, rect))
    }

    /// The rows of J·R·Q·S, Q being the Gaussian's rotation and S its scales.
    #[inline]
    fn sphere_to_image(&self, point_cam: [f32; 3], gaussian: &Gaussian) -> [[f32; 3]; 2] {
        let [w, x, y, z] = gaussian.rotation;
        let [s0, s1, s2] = gaussian.scale;
        let columns = [
            [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y + w * z), 2.0 * (x * z - w * y)],
            [2.0 * (x * y - w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z + w * x)],
            [2.0 * (x * z + w * y), 2.0 * (y * z - w * x), 1.0 - 2.0 * (x * x + y * y)],
        ];
        self.jacobian(point_cam).map(|row| {
            let [c0, c1, c2] = columns.map(|column| super::view::dot(row, column));
            [c0 * s0, c1 * s1, c2 * s2]
        })
    }
}

#[cfg(test)]
mod tests {
    use crate::functions::Reference;
    use crate::project::{View, log_cut};
    use crate::scene::Gaussian;
    use pocketsplat_format::bundle::Effects;
    use pocketsplat_format::{Camera, Rotation};

    #[test]
    fn a_splat_cut_earlier_keeps_its_sum() {
        let camera = Camera {
            rotation: Rotation::IDENTITY,
            translation: [0.0; 3],
            focal_px: [100.0; 2],
            principal_px: [50.0; 2],
            width_px: 100,
            height_px: 100,
        };
        let gaussian = Gaussian {
            centre: [0.0, 0.0, 2.0],
            scale: [0.2, 0.3, 0.1],
            rotation: [1.0, 0.0, 0.0, 0.0],
            opacity: 0.3,
            colour: [1.0; 3],
        };
        let effects = Effects { anisotropic: cfg!(feature = "anisotropy"), ..Effects::default() };
        let sum_at = |steps: u8| {
            let view = View::new(&camera).expect("sound").cutting_at(steps);
            let (splat, _) = view.project::<Reference>(&gaussian, effects).expect("in view");
            let least = (-f64::from(log_cut(steps))).exp();
            let mut sum = 0.0;
            for y in 0..100 {
                for x in 0..100 {
                    let dy = f64::from(y) + 0.5 - f64::from(splat.mean[1]);
                    let dx = f64::from(x) + 0.5 - f64::from(splat.mean[0]) - f64::from(splat.shear) * dy;
                    let square = dx * dx * f64::from(splat.row_precision) + dy * dy * f64::from(splat.column_precision);
                    let alpha = (f64::from(splat.log_opacity) - 0.5 * square).exp();
                    sum += if alpha >= least { alpha } else { 0.0 };
                }
            }
            sum
        };
        let exact = sum_at(1);
        for steps in [2, 4, 8, 16] {
            let cut = sum_at(steps);
            assert!((cut / exact - 1.0).abs() < 0.01, "{steps}/255: {cut} against {exact}");
        }
    }
}
