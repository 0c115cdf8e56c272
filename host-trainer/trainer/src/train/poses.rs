//! Where each training camera stands, as its photograph says, against where the capture has it.
//!
//! Nothing of it is written: a bundle is drawn and judged in the capture's own frame.

use glam::DVec3;
use pocketsplat_capture::dataset::View;
use serde::{Deserialize, Serialize};

use super::views::TrainingViews;

/// Share of the run from which cameras move; earlier the scene shows too little to tell by.
const FROM: f64 = 0.05;
/// Length of a step at the start of the run, radians, and its share at the end.
const STEP_RAD: f64 = 1e-3;
const LAST_STEP: f64 = 0.01;
/// Normalised units that count as one radian: about as far as what a camera sees is away.
const UNITS_A_RADIAN: f64 = 3.0;
/// What moments keep of themselves from visit to visit.
const KEPT: [f64; 2] = [0.9, 0.99];
/// Visits of a view before its camera moves.
const LEAST_VISITS: i32 = 10;
/// A coordinate moves where the mean gradient, squared, exceeds this share of the mean squared one: where the visits agree. Gradients of
/// chance alone, which would lead the camera of a true pose astray, are at 0.11 after ten visits and at 0.05 after many.
const AGREEMENT: f64 = 0.2;

/// How far the cameras of a run's training views were moved.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Poses(Vec<Pose>);

/// Of one camera.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
struct Pose {
    /// [Twist](pocketsplat_kernels::ops::Pinhole::moved) from where the capture has it.
    twist: [f64; 6],
    /// Moments of the gradient.
    first: [f64; 6],
    second: [f64; 6],
    n_visits: i32,
}

impl Poses {
    /// Of cameras that were not moved.
    pub fn of_views(n: usize) -> Self {
        Self(vec![Pose::default(); n])
    }

    /// Views there are.
    pub fn len(&self) -> usize {
        self.0.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// The motion of each camera.
    pub fn twists(&self) -> impl Iterator<Item = [f64; 6]> {
        self.0.iter().map(|pose| pose.twist)
    }

    /// Takes in the [gradient](pocketsplat_kernels::step::Workspace::pose_gradient) of a step of view `place` after this share of the
    /// run, and returns the camera's motion.
    ///
    /// Adam's step (Kingma and Ba 2015) for each coordinate, times how far the visits agree. It is added to the twist, which for motions
    /// of a few degrees is to move the camera once more.
    pub fn follow(&mut self, place: usize, gradient: [f64; 6], progress: f64) -> [f64; 6] {
        let pose = &mut self.0[place];
        if progress < FROM || !gradient.iter().all(|by_axis| by_axis.is_finite()) {
            return pose.twist;
        }
        pose.n_visits += 1;
        let [first_bias, second_bias] = KEPT.map(|kept| 1.0 - kept.powi(pose.n_visits));
        for (axis, gradient) in gradient.into_iter().enumerate() {
            let (first, second) = (&mut pose.first[axis], &mut pose.second[axis]);
            *first += (1.0 - KEPT[0]) * (gradient - *first);
            *second += (1.0 - KEPT[1]) * (gradient * gradient - *second);
            let (mean, square) = (*first / first_bias, *second / second_bias);
            if pose.n_visits < LEAST_VISITS || square <= 0.0 {
                continue;
            }
            let agreement = (mean * mean / square - AGREEMENT).max(0.0) / (1.0 - AGREEMENT);
            let unit = if axis < 3 { 1.0 } else { UNITS_A_RADIAN };
            pose.twist[axis] -= STEP_RAD * LAST_STEP.powf(progress) * unit * agreement * mean / square.sqrt();
        }
        pose.twist
    }

    /// How far the cameras of the views that are trained on were turned, degrees, and moved, normalised units.
    pub fn changes<'v>(&self, views: &TrainingViews<'v>) -> Vec<(&'v View, [f64; 2])> {
        let of_place = |place: &u32| {
            let place = *place as usize;
            let (view, [x, y, z, ..]) = (&views.all[place], self.0[place].twist);
            let centre = DVec3::from_array(views.cameras[place].centre_world.map(f64::from));
            let moved = (centre - view.camera.centre_world()).length();
            (view, [DVec3::new(x, y, z).length().to_degrees(), moved])
        };
        views.trained.iter().map(of_place).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::train::test_capture::{many_views, tiny_config};
    use crate::train::{TrainConfig, Trainer};
    use pocketsplat_kernels::ops::Pinhole;
    use pocketsplat_kernels::scene::ModelShape;
    use pocketsplat_kernels::step::coding::Coding;
    use pocketsplat_kernels::step::example::{camera, scene};
    use pocketsplat_kernels::step::{Loss, LossWeights, TargetView, Workspace};

    #[test]
    fn gradients_that_agree_move_a_camera_and_those_of_chance_do_not() {
        let mut poses = Poses::of_views(2);
        for visit in 0..40 {
            // Without a mean over five visits.
            let chance = [1.0, -1.5, 1.0, 1.0, -1.5][visit as usize % 5];
            let twist = poses.follow(1, [2.0, chance, 0.0, -3e-4, chance, 0.0], 0.3);
            assert_eq!(twist == [0.0; 6], visit + 1 < LEAST_VISITS, "visit {visit}");
        }
        let moved = poses.twists().nth(1).unwrap();
        let whole = f64::from(41 - LEAST_VISITS) * STEP_RAD * LAST_STEP.powf(0.3);
        assert!((moved[0] + whole).abs() < 0.1 * whole, "against the gradient, whatever its size: {moved:?}");
        assert!((moved[3] - UNITS_A_RADIAN * whole).abs() < 0.1 * UNITS_A_RADIAN * whole, "{moved:?}");
        assert!(moved[1].abs() < 0.1 * whole && moved[2] == 0.0, "{moved:?}");
        assert_eq!(poses.twists().next(), Some([0.0; 6]), "the other camera stays");
        let mut early = Poses::of_views(1);
        assert!((0..40).all(|_| early.follow(0, [1.0; 6], 0.9 * FROM) == [0.0; 6]));
        assert_eq!(poses.follow(1, [f64::NAN; 6], 0.3), moved, "what is not finite says nothing");
    }

    #[test]
    fn a_camera_that_was_turned_finds_back_to_its_photograph() {
        let shape = ModelShape { view_colour: true, view_geometry: true, ..ModelShape::plain(6, 3) };
        let scene = scene(5, shape).cast::<f32>();
        let given = camera();
        let taken_from = Pinhole::new(&given);
        let mut workspace = Workspace::new(&shape);
        let photograph = workspace.image(&scene, &taken_from, [0.1, 0.2, 0.3]);
        // 0.6 degrees, and 2 % of the distance to the scene.
        let mut twist = [0.006, -0.008, 0.004, 0.03, -0.02, 0.02];
        let start = taken_from.moved(twist);
        let mut poses = Poses::of_views(1);
        let mut miss = Vec::new();
        for visit in 0..120 {
            let camera = start.moved(poses.twists().next().unwrap());
            let corner = |camera: &Pinhole<f32>| DVec3::from_array(camera.to_cam([0.3, -0.2, 0.1]).map(f64::from));
            miss.push((corner(&camera) - corner(&taken_from)).length());
            let target = TargetView::new(&camera, photograph.clone(), None, [0.1, 0.2, 0.3]);
            workspace.step(&scene, &target, &Loss::plain(LossWeights::default()), &Coding::Raw);
            twist = poses.follow(0, workspace.pose_gradient(&camera).map(f64::from), f64::from(visit) / 240.0 + FROM);
        }
        assert!(miss[119] < 0.2 * miss[0], "{} of {} left after {twist:?}", miss[119], miss[0]);
    }

    #[test]
    fn a_run_moves_the_cameras_that_it_trains_on_where_it_is_asked_to() {
        let capture = many_views(16);
        for refine_poses in [true, false] {
            let config = TrainConfig { refine_poses, validation_every: 8, ..tiny_config(400) };
            let mut run = Trainer::new(&capture, config).unwrap();
            while !run.is_done() {
                run.advance().unwrap();
            }
            for (place, (view, camera)) in capture.train.iter().zip(run.cameras()).enumerate() {
                let is_given = camera.rotation == Pinhole::<f32>::new(&view.camera).rotation;
                assert_eq!(is_given, !refine_poses || config.holds_out(place, 16), "{}", view.name);
            }
            let changes = run.pose_changes();
            assert_eq!(changes.as_ref().map(Vec::len), refine_poses.then_some(14));
            let turned = |(_, [turned, _]): &(&View, [f64; 2])| *turned > 1e-3;
            assert!(changes.iter().flatten().all(turned), "{changes:?}");
            let refined = run.refined_capture().map(|capture| capture.train);
            let drawn = |view: &View| Pinhole::<f32>::new(&view.camera).rotation;
            assert!(refined.iter().flatten().zip(run.cameras()).all(|(view, camera)| drawn(view) == camera.rotation));
        }
    }
}
