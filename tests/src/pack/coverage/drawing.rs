//! What the frames of a bundle show: cameras, and Gaussians at the limits of drawing.

use pocketsplat_codec::bundle::decoded_scene;
use pocketsplat_format::bundle::Header;
use pocketsplat_format::math::tanh;
use pocketsplat_format::{Bundle, Camera};
use pocketsplat_kernels::scene::{Head, Scene};

use super::Found;
use crate::frame::{budget_for, draw_by};
use crate::pack::sample::Sample;

pub(super) const OTHERS: &[&str] = &[
    "fewer tiers than the file has",
    "a frame of one pixel",
    "a width that tiles do not divide",
    "a height that tiles do not divide",
    "a principal point off the centre",
    "pixels that are not square",
    "a frame of the training size",
    "a frame of the training size, the other way up",
    "a frame larger than those of training",
    "a frame larger than those of training, compensated",
    "a frame smaller than those of training",
    "a frame smaller than those of training, compensated",
    "a camera among the anchors",
    "anchors that the prefilter leaves out",
    "a frame of background alone",
    "a frame that is black where nothing is",
    "Gaussians that are no splats",
    "Gaussians evaluated once",
    "Gaussians evaluated once, isotropic",
    "a Gaussian behind the camera",
    "a Gaussian at the camera",
    "a Gaussian at z = 0.2",
    "a Gaussian nearer than 0.25",
    "Gaussians of one depth",
    "a centre outside of the frame",
    "a centre so far outside that x/z is limited",
    "a needle of ratio 1000",
    "a Gaussian larger than the frame",
    "a Gaussian smaller than a thousandth of a pixel",
    "a scale beyond the largest half",
    "an opacity of 0.99 and more",
    "three opaque Gaussians in one place",
    "an opacity just above 1/255",
    "an opacity just below 1/255",
    "an opacity below 0",
    "forty Gaussians in one place",
];

pub(super) fn mark(found: &mut Found, bundle: &Bundle<'_>, sample: &Sample) {
    let header = bundle.header();
    let scene = decoded_scene(bundle).expect("sound chunks");
    let is_baked = bundle.n_gaussians(bundle.n_tiers()).is_some();
    for &(tiers, camera) in &sample.views {
        let (frame, report) = draw_by(&budget_for(&camera).with_tiers(tiers), bundle, &camera).expect("drawn");
        let [width, height] = [camera.width_px, camera.height_px];
        let ([fx, fy], [cx, cy]) = (camera.focal_px, camera.principal_px);
        found.mark(tiers < bundle.n_tiers(), "fewer tiers than the file has");
        found.mark([width, height] == [1, 1], "a frame of one pixel");
        found.mark(width % 16 != 0 && width > 16, "a width that tiles do not divide");
        found.mark(height % 16 != 0 && height > 16, "a height that tiles do not divide");
        found.mark([2.0 * cx, 2.0 * cy] != [width, height].map(f32::from), "a principal point off the centre");
        found.mark(fx != fy, "pixels that are not square");
        mark_size(found, header, &camera, report.splats);
        let eye = camera.centre();
        found.mark(eye.iter().all(|x| x.abs() < 0.4) && report.splats > 0 && tiers > 1, "a camera among the anchors");
        found.mark(!is_baked && report.anchors_visible < report.anchors_read, "anchors that the prefilter leaves out");
        let has_background = header.features.effects.background;
        let is_even = frame.rgb.as_chunks::<3>().0.iter().all(|pixel| *pixel == header.background);
        found.mark(has_background && report.splats == 0 && is_even, "a frame of background alone");
        let black = frame.rgb.as_chunks::<3>().0.contains(&[0; 3]);
        found.mark(!has_background && report.splats > 0 && black, "a frame that is black where nothing is");
        found.mark(report.splats < report.gaussians, "Gaussians that are no splats");
        found.mark(is_baked && report.splats > 0, "Gaussians evaluated once");
        found.mark(
            is_baked && report.splats > 0 && !header.features.effects.anisotropic,
            "Gaussians evaluated once, isotropic",
        );
        if !header.features.effects.see_view() && header.n_offsets == 1 && report.splats > 0 {
            mark_gaussians(found, &scene, &camera);
        }
    }
}

/// Which rule of dilation a frame falls under.
fn mark_size(found: &mut Found, header: &Header, camera: &Camera, n_splats: u32) {
    let ([width, height], [fx, fy]) = ([camera.width_px, camera.height_px], camera.focal_px);
    let [trained_fx, trained_fy] = header.preview.focal_px;
    let is_trained = [width, height] == header.training_px;
    let is_turned = width != height && [height, width] == header.training_px;
    let is_other = !is_trained && !is_turned && n_splats > 0;
    let size_2 = fx / trained_fx * (fy / trained_fy);
    let compensated = header.features.effects.dilation_compensation;
    found.mark(is_trained, "a frame of the training size");
    found.mark(is_turned && n_splats > 0, "a frame of the training size, the other way up");
    found.mark(is_other && !compensated && size_2 > 1.0, "a frame larger than those of training");
    found.mark(is_other && compensated && size_2 > 1.0, "a frame larger than those of training, compensated");
    found.mark(is_other && !compensated && size_2 < 1.0, "a frame smaller than those of training");
    found.mark(is_other && compensated && size_2 < 1.0, "a frame smaller than those of training, compensated");
}

/// One Gaussian of a scene of one offset an anchor that stands where its anchor stands.
struct Gaussian {
    /// In the camera's frame.
    z: f32,
    /// Of its mean in the image, over its depth.
    slope: [f32; 2],
    /// Half of the base scales, which are what sigmoid makes of a logit of 0.
    scales: Vec<f32>,
    opacity: f32,
}

fn gaussians(scene: &Scene<f32>, camera: &Camera) -> Vec<Gaussian> {
    let shape = &scene.shape;
    let at = |anchor: usize| {
        let p = scene.anchors.lattice[anchor].map(|cell| cell as f32 * scene.voxel_size as f32);
        let [x, y, z]: [f32; 3] = std::array::from_fn(|row| {
            camera.rotation.to_array()[3 * row..][..3].iter().zip(p).map(|(r, p)| r * p).sum()
        });
        let [tx, ty, tz] = camera.translation;
        let log_scales = &scene.anchors.log_scales[anchor * shape.n_log_scales()..][..shape.n_log_scales()];
        let feature = &scene.anchors.features[anchor * shape.feature_dim..][..shape.feature_dim];
        Gaussian {
            z: z + tz,
            slope: [(x + tx) / (z + tz), (y + ty) / (z + tz)],
            scales: log_scales[3..].iter().map(|s| 0.5 * s.exp()).collect(),
            opacity: tanh(first_output(&scene.heads.opacity, feature)),
        }
    };
    (0..scene.anchors.len()).map(at).collect()
}

fn first_output(head: &Head<f32>, inputs: &[f32]) -> f32 {
    let hidden =
        head.w1.chunks_exact(head.n_in).zip(&head.b1).map(|(row, bias)| {
            row.iter().zip(inputs).fold(*bias, |sum, (weight, input)| sum + weight * input).max(0.0)
        });
    hidden.zip(&head.w2).fold(head.b2[0], |sum, (hidden, weight)| sum + weight * hidden)
}

fn mark_gaussians(found: &mut Found, scene: &Scene<f32>, camera: &Camera) {
    let all = gaussians(scene, camera);
    let size = [camera.width_px, camera.height_px].map(f32::from);
    let mut places: Vec<[f32; 2]> = Vec::new();
    for (index, gaussian) in all.iter().enumerate() {
        let Gaussian { z, slope, ref scales, opacity } = *gaussian;
        found.mark(z < 0.0, "a Gaussian behind the camera");
        found.mark(z == 0.0, "a Gaussian at the camera");
        found.mark(z == 0.2, "a Gaussian at z = 0.2");
        found.mark(z > 0.2 && z < 0.25, "a Gaussian nearer than 0.25");
        found.mark(all[..index].iter().any(|other| other.z == z && z > 0.2), "Gaussians of one depth");
        found.mark(opacity < 0.0, "an opacity below 0");
        let least = 1.0 / 255.0;
        found.mark(opacity >= least && opacity < 1.25 * least, "an opacity just above 1/255");
        found.mark(opacity < least && opacity > 0.99 * least, "an opacity just below 1/255");
        if z <= 0.2 {
            continue;
        }
        let at: [f32; 2] = std::array::from_fn(|axis| camera.focal_px[axis] * slope[axis] + camera.principal_px[axis]);
        let outside =
            |margin: f32| (0..2).any(|axis| at[axis] < -margin * size[axis] || at[axis] > (1.0 + margin) * size[axis]);
        found.mark(outside(0.0), "a centre outside of the frame");
        found.mark(outside(0.15), "a centre so far outside that x/z is limited");
        let [least_scale, most_scale] = scales.iter().fold([f32::INFINITY, 0.0], |[a, b], &s| [s.min(a), s.max(b)]);
        found.mark(most_scale > 1000.0 * least_scale, "a needle of ratio 1000");
        found.mark(most_scale * camera.focal_px[0] / z > 2.0 * size[0], "a Gaussian larger than the frame");
        found.mark(most_scale * camera.focal_px[0] / z < 1e-3, "a Gaussian smaller than a thousandth of a pixel");
        found.mark(most_scale > 65504.0, "a scale beyond the largest half");
        found.mark(opacity >= 0.99, "an opacity of 0.99 and more");
        let near = |other: &[f32; 2]| (0..2).all(|axis| (other[axis] - at[axis]).abs() < 8.0);
        if opacity >= 0.99 {
            places.push(at);
            found.mark(places.iter().filter(|other| near(other)).count() >= 3, "three opaque Gaussians in one place");
        }
        let here = all.iter().filter(|other| other.z > 0.2).filter(|other| {
            near(&std::array::from_fn(|axis| camera.focal_px[axis] * other.slope[axis] + camera.principal_px[axis]))
        });
        found.mark(here.count() >= 40, "forty Gaussians in one place");
    }
}
