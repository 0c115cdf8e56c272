//! The oracle: the rules of a frame, written once more in f64 and as plainly as they can be.
//!
//! Nothing here is shared with the trainer's or the decoder's projection, networks or blending, so agreement means
//! something. There are no tiles, no tables and no approximations; a pixel sees every splat in one global depth order.

mod load;

use glam::{DMat3, DQuat, DVec2, DVec3};
use pocketsplat_core::Quality;

use pocketsplat_capture::camera::Camera;
use pocketsplat_capture::dataset::Image;
use pocketsplat_kernels::scene::{Head, Heads, ModelShape};

/// A centre at this depth or nearer is not drawn, normalised units: the f32 nearest to 0.2, since a jump has no tolerance.
const NEAR: f64 = 0.2_f32 as f64;
/// Variance of the screen-space low-pass filter of training, px² (Zwicker et al. 2001).
const DILATION: f64 = 0.3;
/// One step of an 8-bit channel: a fainter contribution is skipped, here as in training.
const ALPHA_MIN: f64 = 1.0 / 255.0;
/// Keeps every transmittance positive.
const ALPHA_MAX: f64 = 0.99;
/// A splat that would take a pixel's transmittance below this ends the pixel and is itself not drawn.
const TRANSMITTANCE_MIN: f64 = 1e-4;

/// A scene in f64, with positions instead of lattice coordinates.
#[derive(Clone, Debug, PartialEq)]
pub struct ReferenceScene {
    /// Widths and effects.
    pub shape: ModelShape,
    /// Whether anchors whose own ellipsoid misses the image draw nothing.
    pub prefilters: bool,
    /// `[n_anchors]` anchor positions, normalised frame.
    pub positions: Vec<DVec3>,
    /// `[n_anchors, F]` features.
    pub features: Vec<f64>,
    /// `[n_anchors, 6]`, or 4 where Gaussians are isotropic, natural logarithms, as in [`pocketsplat_kernels::scene::Anchors`].
    pub log_scales: Vec<f64>,
    /// `[n_anchors, K, 3]` offsets in units of `exp(log_scales[0..3])`.
    pub offsets: Vec<f64>,
    /// `[n_anchors, K]` whether an offset is drawn at all.
    pub drawn: Vec<bool>,
    /// The heads.
    pub heads: Heads<f64>,
    /// What its training images were like; where it is not said, every frame is drawn as a training image.
    pub trained: Option<TrainedFrame>,
}

/// The images that a scene was trained on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrainedFrame {
    /// Width and height, pixels.
    pub size_px: [u32; 2],
    /// Product of the focal lengths of one of them that is as large, px².
    pub focal_area_px2: f64,
}

/// What is added to a splat's variances, and which part of it opacities were trained with, px².
#[derive(Clone, Copy)]
struct Dilation {
    added: f64,
    trained: f64,
}

/// One Gaussian on the image plane.
struct Splat {
    depth: f64,
    mean_px: DVec2,
    /// Inverse covariance `[xx, xy, yy]`, px⁻².
    conic: [f64; 3],
    /// Half extents of the box around the ellipse where alpha reaches the least that is drawn, px.
    reach_px: DVec2,
    opacity: f64,
    colour: DVec3,
}

impl ReferenceScene {
    /// Draws the scene.
    ///
    /// `C = Σᵢ cᵢ αᵢ Tᵢ + T·background`, front to back, `Tᵢ = Πⱼ₍ⱼ<ᵢ₎ (1 − αⱼ)` (Kerbl et al. 2023, eq. 3).
    ///
    /// * `background`: RGB in 0..1.
    /// * returns: `[height, width]` RGB, not clamped.
    ///
    /// # Budget
    /// All Gaussians of the view in memory; work proportional to the area of their ellipses.
    pub fn render(&self, camera: &Camera, background: [f64; 3]) -> Vec<[f64; 3]> {
        self.render_with(Quality::EXACT, camera, background)
    }

    /// As [`Self::render`] by the rules of another quality: with an alpha cut of c/255 a splat keeps its sum by gaining (c − 1)/255 of
    /// opacity.
    pub fn render_with(&self, quality: Quality, camera: &Camera, background: [f64; 3]) -> Vec<[f64; 3]> {
        let alpha_min = f64::from(quality.alpha_cut) * ALPHA_MIN;
        let (width, height) = (camera.width_px as usize, camera.height_px as usize);
        let dilation = self.dilation(camera);
        let splats_of = |a| self.splats_of(a, camera, dilation, quality);
        let mut splats: Vec<Splat> = (0..self.positions.len()).flat_map(splats_of).collect();
        // Stable: equal depths stay in the order of anchor, then offset.
        splats.sort_by(|a, b| a.depth.total_cmp(&b.depth));
        let mut colour = vec![DVec3::ZERO; width * height];
        let mut transmittance = vec![1.0_f64; width * height];
        let mut ended = vec![false; width * height];
        for splat in &splats {
            // A pixel more on each side, so that the alpha test alone decides, never the box.
            let low = (splat.mean_px - splat.reach_px - 1.5).max(DVec2::ZERO);
            let high = splat.mean_px + splat.reach_px + 1.5;
            for y in low.y as usize..(high.y.max(0.0) as usize).min(height) {
                for x in low.x as usize..(high.x.max(0.0) as usize).min(width) {
                    let i = y * width + x;
                    let d = DVec2::new(x as f64 + 0.5, y as f64 + 0.5) - splat.mean_px;
                    let [xx, xy, yy] = splat.conic;
                    let distance_squared = xx * d.x * d.x + 2.0 * xy * d.x * d.y + yy * d.y * d.y;
                    let alpha = (splat.opacity * (-0.5 * distance_squared).exp()).min(ALPHA_MAX);
                    if ended[i] || alpha < alpha_min {
                        continue;
                    }
                    let next = transmittance[i] * (1.0 - alpha);
                    if next < TRANSMITTANCE_MIN {
                        ended[i] = true;
                        continue;
                    }
                    colour[i] += splat.colour * (alpha * transmittance[i]);
                    transmittance[i] = next;
                }
            }
        }
        let background = DVec3::from(background);
        colour.iter().zip(&transmittance).map(|(&c, &t)| (c + background * t).to_array()).collect()
    }

    /// DRAWING.md, section 6.
    fn dilation(&self, camera: &Camera) -> Dilation {
        let [width, height] = [camera.width_px, camera.height_px];
        let as_trained = |frame: &TrainedFrame| frame.size_px == [width, height] || frame.size_px == [height, width];
        let size_squared = match self.trained.filter(|frame| !as_trained(frame)) {
            Some(TrainedFrame { focal_area_px2, .. }) => {
                (camera.focal_px[0] * camera.focal_px[1] / focal_area_px2).clamp(1.0 / 4096.0, 4096.0)
            }
            None => 1.0,
        };
        let trained = DILATION * size_squared;
        let added = trained + (1.0 - size_squared).max(0.0) / 6.0;
        Dilation { added, trained: if self.shape.dilation_compensation { 0.0 } else { trained } }
    }

    /// The Gaussians of one anchor that this view draws, in the order of their offsets.
    fn splats_of(&self, anchor: usize, camera: &Camera, dilation: Dilation, quality: Quality) -> Vec<Splat> {
        let (n_features, n_offsets) = (self.shape.feature_dim, self.shape.n_offsets);
        let position = self.positions[anchor];
        let n_log_scales = if self.shape.anisotropic { 6 } else { 4 };
        let log_scales = &self.log_scales[anchor * n_log_scales..][..n_log_scales];
        // DRAWING.md, section 3: arguments outside this range are clamped to it.
        let size = |log: &[f64]| DVec3::from_slice(log).clamp(DVec3::splat(-87.0), DVec3::splat(88.0)).exp();
        let anchor_size = size(&log_scales[..3]);
        let base_size = if self.shape.anisotropic { size(&log_scales[3..]) } else { size(&[log_scales[3]; 3]) };
        if self.prefilters && !anchor_is_visible(position, anchor_size, dilation, camera) {
            return Vec::new();
        }

        let from_camera = position - camera.centre_world();
        let feature = &self.features[anchor * n_features..][..n_features];
        let mut without_direction = feature.to_vec();
        if self.shape.view_distance {
            without_direction.push(from_camera.length());
        }
        let with_direction = [&without_direction[..], &from_camera.normalize_or_zero().to_array()].concat();
        let seen = |sees_direction: bool| if sees_direction { &with_direction } else { &without_direction };
        let opacities = evaluate(&self.heads.opacity, seen(self.shape.view_geometry));
        let covariances = evaluate(&self.heads.covariance, seen(self.shape.view_geometry));
        let colours = evaluate(&self.heads.colour, seen(self.shape.view_colour));

        let mut splats = Vec::new();
        for k in 0..n_offsets {
            let opacity = opacities[k].tanh();
            if !self.drawn[anchor * n_offsets + k] || opacity <= 0.0 {
                continue;
            }
            let offset = DVec3::from_slice(&self.offsets[(anchor * n_offsets + k) * 3..]);
            let covariance = if self.shape.anisotropic {
                let logits = &covariances[k * 7..][..7];
                let scale = base_size * DVec3::from_slice(logits).map(sigmoid);
                let [w, x, y, z] = [logits[3], logits[4], logits[5], logits[6]];
                let norm = (w * w + x * x + y * y + z * z).sqrt().max(1e-12);
                let rotation = rotation_of([w / norm, x / norm, y / norm, z / norm]);
                let axes = rotation * DMat3::from_diagonal(scale);
                axes * axes.transpose()
            } else {
                let deviation = base_size * sigmoid(covariances[k]);
                DMat3::from_diagonal(deviation * deviation)
            };
            let mut colour = DVec3::from_slice(&colours[k * 3..]).map(sigmoid);
            if let Some(detail) = self.heads.detail.as_ref().filter(|_| quality.detail) {
                colour += DVec3::from_slice(&evaluate(detail, &[feature, &colour.to_array()].concat()));
            }
            splats.extend(splat(
                position + offset * anchor_size,
                covariance,
                opacity,
                colour,
                dilation,
                camera,
                f64::from(quality.alpha_cut),
            ));
        }
        splats
    }
}

/// `W2·relu(W1·x + b1) + b2`.
fn evaluate(head: &Head<f64>, input: &[f64]) -> Vec<f64> {
    let affine = |weights: &[f64], bias: &[f64], x: &[f64]| -> Vec<f64> {
        let dot = |row: &[f64]| row.iter().zip(x).map(|(w, v)| w * v).sum::<f64>();
        weights.chunks_exact(x.len()).zip(bias).map(|(row, b)| dot(row) + b).collect()
    };
    let hidden: Vec<f64> = affine(&head.w1, &head.b1, input).iter().map(|v| v.max(0.0)).collect();
    affine(&head.w2, &head.b2, &hidden)
}

fn sigmoid(x: f64) -> f64 {
    1.0 / (1.0 + (-x).exp())
}

/// The rotation of the unit quaternion `[w, x, y, z]`.
fn rotation_of([w, x, y, z]: [f64; 4]) -> DMat3 {
    DMat3::from_quat(DQuat::from_xyzw(x, y, z, w))
}

/// Mean (px), depth and covariance `[xx, xy, yy]` (px², not dilated) of a Gaussian on the image plane; `None` if it is
/// too near.
///
/// Σ' = J R Σ Rᵀ Jᵀ (Zwicker et al. 2001), the Jacobian J taken at a point held 15 % of the image outside its border at
/// most, where the linearisation would explode; the mean stays where it is.
fn project(position: DVec3, covariance: DMat3, camera: &Camera) -> Option<(DVec2, f64, [f64; 3])> {
    let p = camera.rotation * position + camera.translation;
    if p.z <= NEAR {
        return None;
    }
    let ([fx, fy], [cx, cy]) = (camera.focal_px, camera.principal_px);
    let (width, height) = (f64::from(camera.width_px), f64::from(camera.height_px));
    let clamp = |slope: f64, f: f64, c: f64, size: f64| {
        let margin = 0.15 * size / f;
        slope.clamp(-(c / f + margin), (size - c) / f + margin)
    };
    let tx = clamp(p.x / p.z, fx, cx, width);
    let ty = clamp(p.y / p.z, fy, cy, height);
    let row_x = DVec3::new(fx / p.z, 0.0, -fx * tx / p.z);
    let row_y = DVec3::new(0.0, fy / p.z, -fy * ty / p.z);
    let in_camera = camera.rotation * covariance * camera.rotation.transpose();
    let flat = [row_x.dot(in_camera * row_x), row_x.dot(in_camera * row_y), row_y.dot(in_camera * row_y)];
    Some((DVec2::new(fx * p.x / p.z + cx, fy * p.y / p.z + cy), p.z, flat))
}

/// The prefilter: whether the square around an anchor's own ellipsoid, three standard deviations far, meets the image.
fn anchor_is_visible(position: DVec3, size: DVec3, dilation: Dilation, camera: &Camera) -> bool {
    let Some((mean, _, [xx, xy, yy])) = project(position, DMat3::from_diagonal(size * size), camera) else {
        return false;
    };
    let (xx, yy) = (xx + dilation.added, yy + dilation.added);
    let middle = 0.5 * (xx + yy);
    let largest_variance = middle + (middle * middle - (xx * yy - xy * xy)).max(0.1).sqrt();
    let radius = (3.0 * largest_variance.sqrt()).ceil();
    let (width, height) = (f64::from(camera.width_px), f64::from(camera.height_px));
    mean.x + radius > 0.0 && mean.x - radius < width && mean.y + radius > 0.0 && mean.y - radius < height
}

/// The splat of one Gaussian, unless it is too near, degenerate or too faint.
fn splat(
    position: DVec3,
    covariance: DMat3,
    opacity: f64,
    colour: DVec3,
    dilation: Dilation,
    camera: &Camera,
    alpha_cut: f64,
) -> Option<Splat> {
    let (mean_px, depth, [xx, xy, yy]) = project(position, covariance, camera)?;
    let dilated_by = |added: f64| [xx + added, yy + added];
    let determinant_of = |[xx, yy]: [f64; 2]| xx * yy - xy * xy;
    let trained_determinant = determinant_of(dilated_by(dilation.trained));
    let [xx, yy] = dilated_by(dilation.added);
    let determinant = determinant_of([xx, yy]);
    // What no f32 holds is not drawn, a deviation of 4·10⁹ px.
    if determinant <= 0.0 || determinant > f64::from(f32::MAX) {
        return None;
    }
    // The dilated splat keeps the energy of the one that was trained (Yu et al. 2024, Mip-Splatting, eq. 8).
    let compensation = (trained_determinant / determinant).max(0.0).sqrt();
    let opacity = opacity * compensation;
    if opacity < ALPHA_MIN {
        return None;
    }
    let opacity = opacity + (alpha_cut - 1.0) * ALPHA_MIN;
    // Where alpha is large enough is an ellipse; its box is √(reach²·Σ'xx) by √(reach²·Σ'yy).
    let reach_squared = 2.0 * (opacity / (alpha_cut * ALPHA_MIN)).ln();
    Some(Splat {
        depth,
        mean_px,
        conic: [yy / determinant, -xy / determinant, xx / determinant],
        reach_px: DVec2::new((reach_squared * xx).sqrt(), (reach_squared * yy).sqrt()),
        opacity,
        colour,
    })
}

/// Rounds a frame to 8 bits: `⌊clamp(c, 0, 1)·255 + 0.5⌋`.
///
/// * `frame`: `[height_px, width_px]`, as [`ReferenceScene::render`] returns it.
pub fn to_image(frame: &[[f64; 3]], width_px: u32, height_px: u32) -> Image {
    let rgb = frame.as_flattened().iter().map(|c| (c.clamp(0.0, 1.0) * 255.0 + 0.5) as u8).collect();
    Image { width_px, height_px, rgb }
}

#[cfg(test)]
mod tests;
