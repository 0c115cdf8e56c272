//! Random initial points where the cameras look, for captures that bring no points.

use glam::DVec3;

use super::apart::quantile;
use super::normalise::unit_numbers;
use super::{EXTENT, SceneKind};
use crate::camera::{Camera, MIN_DETERMINANT, nearest_to_axes};

/// Half the side of the cube of points, in half-widths of the cameras' view at the focus.
///
/// The published cube of Synthetic-NeRF, ±1.3 seen from 4.03 at 0.6911 rad, is 0.9 half-widths.
const CUBE_HALF_WIDTHS: f64 = 0.9;
/// Points behind the focus reach to this many times its distance.
const FAR_DISTANCES: f64 = 4.0;
/// Where the cameras share no focus, points start at this part of the distance that stands in for it.
const NEAR_DISTANCES: f64 = 0.25;
/// Cameras look at a cube where theirs is at least so much of it, and at most the inverse.
const LIKE_CUBE: f64 = 0.5;

/// `n` points of the volume that the cameras see, in their frame; the same for the same seed on every machine.
///
/// Cameras around something: half of the points fill a cube at the focus, the point nearest to all optical axes in the
/// least-squares sense, as wide as what a middling camera sees there; the other half lie behind it along the rays of
/// random pixels, evenly in 1/depth up to four times its distance, for what stands behind. Behind an object nothing stands,
/// so all of its points are in the cube. Cameras without a common focus (side by side, or looking outwards): all points along
/// such rays around one extent away.
///
/// * `cameras`: normalised, at least one.
pub(super) fn random_points(cameras: &[&Camera], kind: SceneKind, n: usize, seed: u64) -> Vec<DVec3> {
    let mut unit = unit_numbers(seed);
    let focus = focus(cameras);
    let cube = focus.map(|focus| (focus, cube_half(cameras, focus)));
    (0..n)
        .map(|i| {
            if let Some((focus, half)) = cube
                && (kind == SceneKind::Object || i.is_multiple_of(2))
            {
                return focus + half * DVec3::new(2.0 * unit() - 1.0, 2.0 * unit() - 1.0, 2.0 * unit() - 1.0);
            }
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "below the count of cameras")]
            let camera = cameras[((unit() * cameras.len() as f64) as usize).min(cameras.len() - 1)];
            let (distance, near) = match focus {
                Some(focus) => (depth(camera, focus).max(f64::MIN_POSITIVE), 1.0),
                None => (EXTENT, NEAR_DISTANCES),
            };
            let inverse = 1.0 / FAR_DISTANCES + unit() * (1.0 / near - 1.0 / FAR_DISTANCES);
            let pixel = [unit() * f64::from(camera.width_px), unit() * f64::from(camera.height_px)];
            along_ray(camera, pixel, distance / inverse)
        })
        .collect()
}

/// Whether the cameras look at the cube of ±`half` around `centre`: their focus lies in it, and they see half to twice as much there.
pub(super) fn look_at_cube(cameras: &[&Camera], centre: DVec3, half: f64) -> bool {
    focus(cameras).is_some_and(|focus| {
        let seen = cube_half(cameras, focus) / half;
        (focus - centre).abs().max_element() <= half && (LIKE_CUBE..=1.0 / LIKE_CUBE).contains(&seen)
    })
}

/// The depth of the cameras' focus in each; `None` where they share none or one does not see it.
pub(super) fn distances(cameras: &[&Camera]) -> Option<Vec<f64>> {
    let focus = focus(cameras)?;
    cameras.iter().map(|camera| Some(depth(camera, focus)).filter(|depth| *depth > 0.0)).collect()
}

/// The point at depth `z` on the ray of a pixel position.
pub(super) fn along_ray(camera: &Camera, [u, v]: [f64; 2], z: f64) -> DVec3 {
    let x = (u - camera.principal_px[0]) / camera.focal_px[0];
    let y = (v - camera.principal_px[1]) / camera.focal_px[1];
    camera.rotation.transpose() * (DVec3::new(x, y, 1.0) * z - camera.translation)
}

fn depth(camera: &Camera, point: DVec3) -> f64 {
    (camera.rotation * point + camera.translation).z
}

/// The point nearest to all optical axes; `None` where the axes do not fix it or it is not in front of at least three quarters
/// of the cameras.
fn focus(cameras: &[&Camera]) -> Option<DVec3> {
    let point = nearest_to_axes(cameras.iter().copied(), MIN_DETERMINANT)?;
    let n_in_front = cameras.iter().filter(|camera| depth(camera, point) > 0.0).count();
    (4 * n_in_front >= 3 * cameras.len()).then_some(point)
}

/// 0.9 × the median over the cameras of half the smaller side of what they see at the focus's depth.
fn cube_half(cameras: &[&Camera], focus: DVec3) -> f64 {
    let half_width = |camera: &&Camera| {
        let across =
            (f64::from(camera.width_px) / camera.focal_px[0]).min(f64::from(camera.height_px) / camera.focal_px[1]);
        0.5 * across * depth(camera, focus)
    };
    CUBE_HALF_WIDTHS * quantile(cameras.iter().map(half_width), 0.5)
}

#[cfg(test)]
mod tests {
    use glam::DMat3;

    use super::*;

    fn camera(rotation: DMat3, centre: DVec3) -> Camera {
        let focal_px = 400.0 / (0.5 * 0.691_1_f64).tan();
        Camera {
            rotation,
            translation: -(rotation * centre),
            focal_px: [focal_px; 2],
            principal_px: [400.0; 2],
            width_px: 800,
            height_px: 800,
        }
    }

    /// Cameras on a circle of radius 4.03 around `focus`, looking at it from a little above.
    fn around(focus: DVec3) -> Vec<Camera> {
        (0..12)
            .map(|i| {
                let turn = DMat3::from_rotation_y(0.5 * f64::from(i)) * DMat3::from_rotation_x(-0.5);
                camera(turn.transpose(), focus + turn * DVec3::new(0.0, 0.0, -4.031))
            })
            .collect()
    }

    #[test]
    fn cameras_as_published_get_the_published_cube() {
        let focus_world = DVec3::new(1.0, -2.0, 0.5);
        let cameras = around(focus_world);
        let cameras: Vec<&Camera> = cameras.iter().collect();
        let found = focus(&cameras).expect("the axes meet");
        assert!((found - focus_world).length() < 1e-9, "{found}");
        assert!((cube_half(&cameras, found) - 1.3).abs() < 0.01);
        let points = random_points(&cameras, SceneKind::Room, 1000, 1);
        assert!(points.iter().step_by(2).all(|p| (*p - found).abs().max_element() <= 1.31));
        for point in points.iter().skip(1).step_by(2) {
            let seen = |camera: &&&Camera| (4.03..=16.13).contains(&depth(camera, *point));
            assert!(cameras.iter().any(|camera| seen(&camera)), "{point} lies behind the focus of no camera");
        }
        assert_eq!(points, random_points(&cameras, SceneKind::Room, 1000, 1));
        assert_ne!(points, random_points(&cameras, SceneKind::Room, 1000, 2));
        let object = random_points(&cameras, SceneKind::Object, 1000, 1);
        assert!(object.iter().all(|p| (*p - found).abs().max_element() <= 1.31), "nothing lies behind an object");
    }

    #[test]
    fn cameras_look_at_a_cube_where_it_is_and_as_large_as_it_is() {
        let cameras = around(DVec3::new(0.1, 0.0, -0.1));
        let cameras: Vec<&Camera> = cameras.iter().collect();
        assert!(look_at_cube(&cameras, DVec3::ZERO, 1.3));
        assert!(!look_at_cube(&cameras, DVec3::X * 3.0, 1.3), "beside it");
        assert!(
            !look_at_cube(&cameras, DVec3::ZERO, 5.0) && !look_at_cube(&cameras, DVec3::ZERO, 0.2),
            "of another size"
        );
    }

    #[test]
    fn cameras_side_by_side_see_points_in_front_of_them() {
        let cameras: Vec<Camera> = (0..5).map(|i| camera(DMat3::IDENTITY, DVec3::X * f64::from(i))).collect();
        let cameras: Vec<&Camera> = cameras.iter().collect();
        assert_eq!(focus(&cameras), None);
        let points = random_points(&cameras, SceneKind::Room, 200, 1);
        assert!(points.iter().all(|p| (0.25 * EXTENT..=4.0 * EXTENT).contains(&p.z)), "depths");
    }

    #[test]
    fn cameras_looking_outwards_share_no_focus() {
        let cameras: Vec<Camera> = around(DVec3::ZERO)
            .into_iter()
            .map(|c| camera(DMat3::from_rotation_y(std::f64::consts::PI) * c.rotation, c.centre_world()))
            .collect();
        assert_eq!(focus(&cameras.iter().collect::<Vec<_>>()), None);
    }
}
