//! The cameras that see what is exported: a capture's, or generated ones.

use std::f64::consts::TAU;

use anyhow::{Result, bail};
use glam::{DMat3, DVec3};
use pocketsplat_capture::camera::Camera;
use pocketsplat_capture::dataset::{Capture, Image, Normalisation, Split, View};
use pocketsplat_format::Bundle;
use pocketsplat_gaussians::{Frame, Gaussians};
use pocketsplat_kernels::camera::host_camera;
use pocketsplat_metrics::psnr_db_masked;

use super::super::bundle::BundleFile;
use super::super::capture::views_of;

/// Generated cameras of each height.
const N_AROUND: u32 = 32;
/// Heights of generated cameras, turned up from that of the bundle's own one, parts of a turn.
const HEIGHTS: [f64; 4] = [-0.04, 0.0, 0.04, 0.1];
/// No camera looks down or up more steeply, parts of a turn.
const STEEPEST: f64 = 0.22;
/// Every eighth camera is held out, as with captures.
const HELD_OUT_EVERY: usize = 8;

/// Cameras to fit to, and cameras to judge by; all in the bundle's frame.
pub(super) struct Cameras<'a> {
    pub(super) fitted: Vec<Camera>,
    pub(super) judged: Vec<Camera>,
    /// Which cameras `judged` are.
    pub(super) split: String,
    /// The photographs of `judged`, where there are any.
    photographs: Option<&'a [View]>,
    /// How far the cameras are apart, as [`Capture::extent`] has it.
    pub(super) extent: f64,
}

impl<'a> Cameras<'a> {
    /// Those of a capture; without held-out views the training views judge.
    pub(super) fn of_capture(file: &BundleFile, bundle: &Bundle<'_>, capture: &'a Capture) -> Result<Self> {
        let split = if capture.test.is_empty() { Split::Train } else { Split::Test };
        let judged = views_of(capture, split)?;
        let of =
            |views: &[View]| -> Vec<Camera> { views.iter().map(|view| file.camera(bundle, capture, view)).collect() };
        Ok(Self {
            fitted: of(views_of(capture, Split::Train)?),
            judged: of(judged),
            split: split.to_string(),
            photographs: Some(judged),
            extent: capture.extent,
        })
    }

    /// Circles of several heights around what the bundle's own camera looks at.
    pub(super) fn generated(bundle: &Bundle<'_>) -> Result<Self> {
        let (all, distance) = around(&host_camera(&bundle.header().preview))?;
        let of = |held_out: bool| {
            let chosen = all.iter().enumerate().filter(|(i, _)| (i % HELD_OUT_EVERY == 0) == held_out);
            chosen.map(|(_, camera)| camera.clone()).collect()
        };
        Ok(Self {
            fitted: of(false),
            judged: of(true),
            split: "generated".to_owned(),
            photographs: None,
            extent: distance,
        })
    }

    /// Mean PSNR of the pictures of `judged` to their photographs; `None` where there are none.
    pub(super) fn psnr_db(&self, pictures: &[Image]) -> Result<Option<f64>> {
        let Some(views) = self.photographs else { return Ok(None) };
        let mut sum = 0.0;
        for (picture, view) in pictures.iter().zip(views) {
            let photograph = view.photograph()?;
            sum += psnr_db_masked(picture, &photograph.image, photograph.mask.as_ref());
        }
        Ok(Some(sum / views.len() as f64))
    }
}

/// Cameras that see the bulk of a file's Gaussians.
pub(super) struct Around {
    pub(super) cameras: Vec<Camera>,
    /// From the scene's frame to theirs, where the bulk is at the origin.
    pub(super) normalisation: Normalisation,
}

/// Size of pictures of a file's Gaussians, px.
const SIZE_PX: [u32; 2] = [240, 180];
/// Their distance, radii of the bulk.
const DISTANCE: f64 = 2.5;

/// Every eighth of the generated cameras, around the median centre at two and a half times the radius, which is twice the median distance
/// from there: up to half of the Gaussians may lie anywhere.
///
/// * `frame`: that of `gaussians`.
pub(super) fn around_gaussians(gaussians: &Gaussians, frame: &Frame) -> Around {
    let centres: Vec<DVec3> = gaussians.centres.iter().map(|centre| DVec3::from(centre.map(f64::from))).collect();
    let middle = DVec3::from([0, 1, 2].map(|axis: usize| median(centres.iter().map(|centre| centre[axis]).collect())));
    let radius = 2.0 * median(centres.iter().map(|centre| centre.distance(middle)).collect());
    let radius = if radius > 0.0 { radius } else { 1.0 };
    let normalisation =
        Normalisation { centre: DVec3::from(frame.offset) + frame.scale * middle, scale: 1.0 / (radius * frame.scale) };
    let [width_px, height_px] = SIZE_PX;
    let lens = Camera {
        rotation: DMat3::IDENTITY,
        translation: DVec3::ZERO,
        focal_px: [0.5 * f64::from(height_px) * DISTANCE; 2],
        principal_px: SIZE_PX.map(|side| 0.5 * f64::from(side)),
        width_px,
        height_px,
    };
    let own = lens.looking_at(DVec3::new(0.0, 0.0, -DISTANCE), DVec3::ZERO, DVec3::NEG_Y);
    let cameras = around(&own).map(|(cameras, _)| cameras).unwrap_or_default();
    Around { cameras: cameras.into_iter().step_by(HELD_OUT_EVERY).collect(), normalisation }
}

/// 0 of nothing.
fn median(mut values: Vec<f64>) -> f64 {
    let middle = values.len() / 2;
    if values.is_empty() { 0.0 } else { *values.select_nth_unstable_by(middle, f64::total_cmp).1 }
}

/// Cameras with the lens of `own` on circles around the point of its axis that is nearest to the scene's origin, and their distance to it.
fn around(own: &Camera) -> Result<(Vec<Camera>, f64)> {
    let (eye, forward) = (own.centre_world(), own.rotation.row(2));
    let target = eye - eye.dot(forward) * forward;
    let distance = eye.distance(target);
    if !(distance > 1e-3) {
        bail!(
            "the bundle's own camera stands where it looks, so there is nothing to turn around; give the folder of the capture"
        );
    }
    let up = nearest_axis(-own.rotation.row(1));
    let side = up.any_orthonormal_vector();
    let front = up.cross(side);
    let own_height = ((eye - target).dot(up) / distance).clamp(-1.0, 1.0).asin() / TAU;
    let cameras = HEIGHTS
        .into_iter()
        .flat_map(|height| {
            let (rise, reach) = (TAU * (own_height + height).clamp(-STEEPEST, STEEPEST)).sin_cos();
            (0..N_AROUND).map(move |i| {
                let (sin, cos) = (TAU * f64::from(i) / f64::from(N_AROUND)).sin_cos();
                let eye = target + distance * (reach * (cos * side + sin * front) + rise * up);
                own.looking_at(eye, target, up)
            })
        })
        .collect();
    Ok((cameras, distance))
}

/// The coordinate axis nearest to `direction`, as a firmware that turns the camera takes it for up.
fn nearest_axis(direction: DVec3) -> DVec3 {
    let axis = direction
        .abs()
        .to_array()
        .iter()
        .enumerate()
        .fold((0, 0.0), |best, (axis, part)| if *part > best.1 { (axis, *part) } else { best });
    let mut nearest = DVec3::ZERO;
    nearest[axis.0] = direction[axis.0].signum();
    nearest
}

#[cfg(test)]
mod tests {
    use glam::{DMat3, DVec3};
    use pocketsplat_capture::camera::Camera;

    use pocketsplat_gaussians::{Frame, Gaussians};

    use super::{around, around_gaussians};

    const LENS: Camera = Camera {
        rotation: DMat3::IDENTITY,
        translation: DVec3::ZERO,
        focal_px: [50.0, 50.0],
        principal_px: [20.0, 15.0],
        width_px: 40,
        height_px: 30,
    };

    #[test]
    fn generated_cameras_look_at_one_point_from_one_distance() {
        let target = DVec3::new(0.1, 0.0, 0.2);
        let own = LENS.looking_at(DVec3::new(3.0, 1.0, 2.0), target, DVec3::Z);
        let (cameras, distance) = around(&own).expect("a view to turn");
        assert_eq!(cameras.len(), 128);
        let pivot = own.centre_world() + distance * own.rotation.row(2);
        for camera in &cameras {
            let seen = camera.rotation * pivot + camera.translation;
            assert!(seen.truncate().length() < 1e-9 && (seen.z - distance).abs() < 1e-9, "{seen}");
            assert!(camera.rotation.row(1).z < 0.0, "upright");
        }
    }

    #[test]
    fn strays_do_not_move_the_cameras_of_a_file() {
        let wave = |i: usize, phase: f64| ((i as f64 * 0.7 + phase).sin() + 5e3) as f32;
        let mut centres: Vec<[f32; 3]> = (0..1000).map(|i| [0.1, 1.3, 2.9].map(|phase| wave(i, phase))).collect();
        let of = |centres: &[[f32; 3]]| {
            let gaussians = Gaussians { centres: centres.to_vec(), ..Gaussians::default() };
            around_gaussians(&gaussians, &Frame { offset: [1e6, 0.0, 0.0], scale: 10.0 }).normalisation
        };
        let clean = of(&centres);
        centres.iter_mut().step_by(10).for_each(|centre| *centre = [1e8; 3]);
        let dirty = of(&centres);
        assert!((clean.centre - DVec3::new(1.05e6, 5e4, 5e4)).length() < 10.0, "{clean:?}");
        assert!(
            (clean.centre - dirty.centre).length() < 5.0 && (clean.scale / dirty.scale - 1.0).abs() < 0.2,
            "{dirty:?}"
        );
        assert_eq!(around_gaussians(&Gaussians::default(), &Frame::default()).cameras.len(), 16);
    }

    #[test]
    fn a_camera_in_the_middle_is_refused() {
        assert!(around(&LENS).expect_err("nothing to turn").to_string().contains("give the folder of the capture"));
    }
}
