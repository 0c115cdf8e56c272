//! How the loss of a view changes where its camera moves.

use rayon::prelude::*;

use super::{Block, Workspace};
use crate::ops::Pinhole;
use crate::ops::heads::neural_gaussians::Gaussian;
use crate::ops::image::project::cross;
use crate::real::Real;

impl<R: Real> Workspace<R> {
    /// dL/d(ω, τ) of the last step, for a camera that moves to [`Pinhole::moved`]`([ω, τ])`.
    ///
    /// To a fixed camera the Gaussians move. With g = R·∂L/∂centre and a Gaussian's place p in the camera frame, each gives g to τ, and to ω
    /// p × g and what turning its axes does. What the heads see of the view is taken as it is: a camera's place changes little in it.
    ///
    /// Cost: a look at each Gaussian that reached the image, on all threads.
    pub fn pose_gradient(&self, camera: &Pinhole<R>) -> [R; 6] {
        let of_blocks: Vec<[R; 6]> = self.blocks().par_iter().map(|block| block.pose_gradient(camera)).collect();
        of_blocks.into_iter().fold([R::ZERO; 6], added)
    }
}

impl<R: Real> Block<R> {
    fn pose_gradient(&self, camera: &Pinhole<R>) -> [R; 6] {
        let of_gaussian = |i: &u32| {
            let (gaussian, d) = (&self.gaussians[*i as usize], &self.d_gaussians[*i as usize]);
            let by_place = camera.turned(d.centre);
            let by_turn = cross(&camera.to_cam(gaussian.centre), &by_place);
            let by_axes = camera.turned(rotation_gradient(gaussian, d));
            let [x, y, z] = [0, 1, 2].map(|axis| by_turn[axis] + by_axes[axis]);
            [x, y, z, by_place[0], by_place[1], by_place[2]]
        };
        self.drawn.iter().map(of_gaussian).fold([R::ZERO; 6], added)
    }
}

fn added<R: Real>(a: [R; 6], b: [R; 6]) -> [R; 6] {
    std::array::from_fn(|i| a[i] + b[i])
}

/// dL/dφ of a Gaussian that turns by φ in the world: its rotation q = (w, v) becomes (1, φ/2)·q, so it is (w·dv − v·dw + v × dv)/2.
fn rotation_gradient<R: Real>(gaussian: &Gaussian<R>, d: &Gaussian<R>) -> [R; 3] {
    let ([w, x, y, z], [dw, dx, dy, dz]) = (gaussian.rotation, d.rotation);
    let (v, dv) = ([x, y, z], [dx, dy, dz]);
    let crossed = cross(&v, &dv);
    [0, 1, 2].map(|axis| R::real(0.5) * (w * dv[axis] - v[axis] * dw + crossed[axis]))
}

#[cfg(test)]
mod tests {
    use super::super::coding::Coding;
    use super::super::example::{camera, scene, truth};
    use super::super::{Loss, LossWeights, TargetView};
    use super::*;
    use crate::finite_difference::assert_piecewise_gradient;
    use crate::scene::ModelShape;

    #[test]
    fn the_gradient_of_a_pose_agrees_with_finite_differences() {
        // Heads that see nothing of the view, so that the gradient is whole.
        let plain = ModelShape::plain(6, 3);
        let compensated = ModelShape { dilation_compensation: true, ..plain };
        for (seed, shape) in (31..).zip([plain, compensated, ModelShape { anisotropic: false, ..plain }]) {
            let scene = scene(seed, shape);
            let given = Pinhole::new(&camera());
            let stepped = |twist: &[f64]| {
                let moved = given.moved(twist.try_into().unwrap());
                let mut workspace = Workspace::new(&shape);
                let target = TargetView::new(&moved, truth(), None, [0.1, 0.2, 0.3]);
                let report = workspace.step(&scene, &target, &Loss::plain(LossWeights::default()), &Coding::Raw);
                assert!(report.n_splats > 5, "the scene must be seen: {report:?}");
                (report.loss, workspace.pose_gradient(&moved))
            };
            let (_, analytic) = stepped(&[0.0; 6]);
            assert_piecewise_gradient("pose", &[0.0; 6], &analytic, |twist| stepped(twist).0);
        }
    }
}
