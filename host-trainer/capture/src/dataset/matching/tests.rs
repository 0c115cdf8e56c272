use glam::{DMat3, DVec3};

use super::picture::Picture;
use super::*;
use crate::dataset::{Image, Mask};

const SIDE_PX: u32 = 256;

/// Brightness of a plane: smooth and nowhere alike.
fn brightness(x: f64, y: f64, scale: f64) -> f64 {
    let waves = [(3.1, 5.3), (7.7, -2.9), (-4.3, 9.1), (13.7, 6.1), (2.3, -15.1), (17.9, 11.3)];
    let sum: f64 = waves.iter().map(|(a, b)| (scale * (a * x + b * y)).sin()).sum();
    127.0 + 20.0 * sum
}

/// Of the wall z = 5, and of the board z = 3, |x| < 0.6 and |y| < 0.6 before it: as fine to the cameras.
const WALL: f64 = 1.0;
const BOARD: f64 = 2.0;

/// What a camera at `centre` that looks along z sees, its exposure times `gain`, and which of it counts: not the left eighth.
fn view(centre: DVec3, turn: f64, gain: f64) -> (Picture, Vec<Corner>) {
    let rotation = DMat3::from_rotation_y(turn);
    let camera = Camera {
        rotation,
        translation: -(rotation * centre),
        focal_px: [300.0; 2],
        principal_px: [128.0; 2],
        width_px: SIDE_PX,
        height_px: SIDE_PX,
    };
    let colour = |x: u32, y: u32| {
        let at = [f64::from(x) + 0.5, f64::from(y) + 0.5];
        let direction = (frusta::along_ray(&camera, at, 1.0) - centre).normalize();
        let on = |z: f64| centre + direction * ((z - centre.z) / direction.z);
        let board = on(3.0);
        let (point, scale) = if board.x.abs() < 0.6 && board.y.abs() < 0.6 { (board, BOARD) } else { (on(5.0), WALL) };
        (gain * brightness(point.x, point.y, scale)).clamp(0.0, 255.0) as u8
    };
    let rgb =
        (0..SIDE_PX).flat_map(|y| (0..SIDE_PX).map(move |x| (x, y))).flat_map(|(x, y)| [colour(x, y); 3]).collect();
    let image = Image { width_px: SIDE_PX, height_px: SIDE_PX, rgb };
    let valid = (0..SIDE_PX * SIDE_PX).map(|i| i % SIDE_PX >= SIDE_PX / 8).collect();
    let mask = Some(Mask { width_px: SIDE_PX, height_px: SIDE_PX, valid });
    seen(&Photograph { image, mask }, camera, None)
}

fn wall_and_board() -> Vec<ColouredPoint> {
    let views = (0..8).map(|i| {
        let along = f64::from(i) * 0.25 - 0.875;
        view(DVec3::new(along, 0.1 * f64::from(i % 3), 0.0), 0.15 * along, if i % 2 == 0 { 1.0 } else { 0.7 })
    });
    between(views.unzip())
}

#[test]
fn points_lie_on_what_the_photographs_show_whatever_their_exposure() {
    let points = wall_and_board();
    // A pixel is 0.14 of the wall's depth, and 0.05 of the board's.
    let on_wall = |p: &&ColouredPoint| (p.at.z - 5.0).abs() < 0.14;
    let on_board = |p: &&ColouredPoint| (p.at.z - 3.0).abs() < 0.05 && p.at.x.abs() < 0.65 && p.at.y.abs() < 0.65;
    let (n_wall, n_board) = (points.iter().filter(on_wall).count(), points.iter().filter(on_board).count());
    assert!(n_wall > 400 && n_board > 100, "{n_wall} on the wall, {n_board} on the board of {}", points.len());
    let n_astray = points.len() - n_wall - n_board;
    assert!(n_astray * 25 < points.len(), "{n_astray} of {} lie nowhere", points.len());
    let like_it = |p: &ColouredPoint| {
        let scale = if p.at.z < 4.0 { BOARD } else { WALL };
        // Half of the photographs are darker, and a pixel is a mean.
        f64::from(p.rgb[0]) < 1.2 * brightness(p.at.x, p.at.y, scale) + 25.0
    };
    assert!(points.iter().filter(|p| like_it(p)).count() * 20 > points.len() * 19, "colours of other places");
}

#[test]
fn the_same_photographs_give_the_same_points_with_any_number_of_threads() {
    let with = |n: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(n).build().expect("threads");
        pool.install(wall_and_board)
    };
    assert!(with(1) == with(3));
}

#[test]
fn what_does_not_count_gives_no_corner() {
    let (_, corners) = view(DVec3::ZERO, 0.0, 1.0);
    let least = corners.iter().map(|corner| corner.at[0]).fold(f64::INFINITY, f64::min);
    assert!(corners.len() > 500 && least > f64::from(SIDE_PX / 8), "{} corners from {least} on", corners.len());
}

#[test]
fn a_pixel_and_its_neighbours_are_seen_where_their_points_are() {
    let [from, to] = [view(DVec3::ZERO, 0.0, 1.0), view(DVec3::new(0.6, -0.2, 0.1), 0.1, 1.0)].map(|(p, _)| p.camera);
    let (at, depth) = ([140.0, 90.0], 4.0);
    let seen = |at: [f64; 2]| {
        let point = to.rotation * frusta::along_ray(&from, at, depth) + to.translation;
        glam::DVec2::new(point.x, point.y) * 300.0 / point.z + 128.0
    };
    let window = ray::Ray::new(&from, at, &to, 1.0).window(1.0 / depth as f32).expect("before the camera");
    assert!((window.middle.as_dvec2() - seen(at)).length() < 1e-3, "{:?}", window.middle);
    for (step, d) in [(window.column, [1e-3, 0.0]), (window.row, [0.0, 1e-3])] {
        let difference = (seen([at[0] + d[0], at[1] + d[1]]) - seen([at[0] - d[0], at[1] - d[1]])) / 2e-3;
        assert!((step.as_dvec2() - difference).length() < 1e-3, "{step} is not {difference}");
    }
}

#[test]
fn the_derivative_of_a_miss_agrees_with_finite_differences() {
    let camera = view(DVec3::new(0.3, -0.1, 0.2), 0.2, 1.0).0.camera;
    let (at, point, h) = (glam::DVec2::new(90.0, 150.0), DVec3::new(0.4, 0.3, 4.0), 1e-5);
    let miss = |point| triangulate::miss_of(&camera, at, point).expect("before the camera");
    let (_, [u, v]) = miss(point);
    for (axis, [du, dv]) in [DVec3::X, DVec3::Y, DVec3::Z].into_iter().zip([0, 1, 2].map(|i| [u[i], v[i]])) {
        let difference = (miss(point + h * axis).0 - miss(point - h * axis).0) / (2.0 * h);
        assert!((difference - glam::DVec2::new(du, dv)).length() < 1e-5, "{difference} along {axis}");
    }
}

#[test]
fn too_few_photographs_give_nothing() {
    assert_eq!(between((0..2).map(|i| view(DVec3::X * 0.4 * f64::from(i), 0.0, 1.0)).unzip()), []);
}
