//! A capture made of explicit Gaussians: what cameras see of them, in place of photographs.

use glam::DVec3;
use pocketsplat_capture::camera::Camera;
use pocketsplat_capture::dataset::{Capture, Photograph, PointsOrigin, SceneKind, View};
use pocketsplat_gaussians::Gaussians;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

use super::bulk::{self, Bulk};
use super::frame;
use super::render::Renderer;
use super::views;

/// How pictures are taken.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pictures {
    /// Whether the file asks for dilation compensation.
    pub compensation: bool,
    /// What lies behind everything, RGB in 0..1.
    pub background: [f32; 3],
    /// Points to start from, at most.
    pub n_points: usize,
    /// Which points are taken follows from it.
    pub seed: u64,
}

/// What `train` and `test` see of the Gaussians, and some of their centres as points: more where they are opaque and large, and none
/// where strays are.
///
/// `None` where the training cameras all stand in one point, or no Gaussian is there.
///
/// * `train`, `test`: cameras in the frame of the Gaussians. * `bulk`: of the Gaussians. * `centre`: what becomes the origin, which a
///   device turns its camera around; without it the middle of the cameras.
pub fn capture(
    gaussians: &Gaussians,
    bulk: &Bulk,
    centre: Option<DVec3>,
    [train, test]: [&[Camera]; 2],
    how: &Pictures,
) -> Option<Capture> {
    let normalisation = views::normalisation_of(train, centre)?;
    let points: Vec<DVec3> = points(gaussians, bulk, how).into_iter().map(|p| normalisation.point(p)).collect();
    let mut normalised = gaussians.clone();
    frame::to_normalised(&mut normalised, &normalisation);
    if points.is_empty() {
        return None;
    }
    let renderer = Renderer::new(&normalised).with_compensation(how.compensation);
    let take = |(cameras, split): (&[Camera], &str)| -> Vec<View> {
        let view = |(i, camera): (usize, &Camera)| {
            let camera = normalisation.camera(camera);
            let image = renderer.image(&camera, how.background);
            View::new(format!("{split}_{i:04}"), camera, Photograph { image, mask: None })
        };
        cameras.par_iter().enumerate().map(view).collect()
    };
    Some(Capture {
        test: take((test, "test")),
        points_origin: PointsOrigin::Capture,
        scene: SceneKind::Room,
        normalisation,
        background: how.background,
        ..Capture::of_views(take((train, "train")), points)
    })
}

/// A draw without replacement, by opacity and size: the largest of u^(1/w) (Efraimidis and Spirakis 2006).
fn points(gaussians: &Gaussians, bulk: &Bulk, how: &Pictures) -> Vec<DVec3> {
    let mut rng = ChaCha8Rng::seed_from_u64(how.seed);
    // ln u / w, which orders them alike.
    let drawn = bulk::weights(gaussians).into_iter().map(|w| (1.0 - rng.random::<f64>()).ln() / w).enumerate();
    let place = |i: usize| DVec3::from(gaussians.centres[i].map(f64::from));
    let mut keys: Vec<(usize, f64)> = drawn.filter(|(i, key)| key.is_finite() && !bulk.is_stray(place(*i))).collect();
    keys.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
    keys.truncate(how.n_points);
    keys.sort_unstable_by_key(|(i, _)| *i);
    keys.into_iter().map(|(i, _)| place(i)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::explicit::test_scenes::{at, stand_around};

    #[test]
    fn pictures_show_the_gaussians_from_the_given_cameras() {
        let places = (0..200).map(|i| {
            let t = f64::from(i);
            DVec3::new(t.sin(), (1.7 * t).cos(), (0.3 * t).sin()) * 2.0 + 7.0
        });
        let mut gaussians = at(places.chain([DVec3::splat(1e6)]));
        gaussians.opacity_logits[3] = -40.0;
        let bulk = Bulk::of(&gaussians).unwrap();
        let cameras = stand_around(&gaussians).cameras(10, [24, 20]);
        let how = Pictures { compensation: false, background: [0.0; 3], n_points: 50, seed: 1 };
        let capture = capture(&gaussians, &bulk, Some(bulk.centre), [&cameras[..8], &cameras[8..]], &how).unwrap();
        assert_eq!((capture.train.len(), capture.test.len(), capture.points.len()), (8, 2, 50));
        assert!(capture.normalisation.point(bulk.centre).length() < 1e-12);
        let lit = |view: &View| view.photograph().unwrap().image.rgb.iter().filter(|v| **v > 60).count();
        assert!(capture.train.iter().chain(&capture.test).all(|view| lit(view) > 100));
        // As drawn in their own frame: the near plane aside, a similarity changes nothing.
        let own = Renderer::new(&gaussians).image(&cameras[9], [0.0; 3]);
        let differs =
            own.rgb.iter().zip(&capture.test[1].photograph().unwrap().image.rgb).map(|(a, b)| a.abs_diff(*b)).max();
        assert!(differs <= Some(1), "{differs:?}");
        // All but the one that is transparent and the stray.
        let all = Pictures { n_points: 1000, ..how };
        let points = super::capture(&gaussians, &bulk, None, [&cameras[..8], &[]], &all).unwrap().points;
        assert_eq!(points.len(), 199);
        assert!(points.iter().all(|point| point.length() < 10.0));
        assert!(super::capture(&gaussians, &bulk, None, [&cameras[..1], &[]], &how).is_none());
    }
}
