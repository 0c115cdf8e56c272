use super::*;
use pocketsplat_kernels::scene::{Anchors, Scene};

const BACKGROUND: [f64; 3] = [0.1, 0.2, 0.3];
const COLOUR: [f64; 3] = [0.9, 0.5, 0.2];

/// One Gaussian as a test thinks of it.
#[derive(Clone, Copy)]
struct Ball {
    position: [f64; 3],
    scale: [f64; 3],
    quaternion: [f64; 4],
    opacity: f64,
    colour: [f64; 3],
}

impl Default for Ball {
    fn default() -> Self {
        Self {
            position: [0.0, 0.0, 2.0],
            scale: [0.1; 3],
            quaternion: [1.0, 0.0, 0.0, 0.0],
            opacity: 0.8,
            colour: COLOUR,
        }
    }
}

fn logit(p: f64) -> f64 {
    (p / (1.0 - p)).ln()
}

/// A scene with one anchor a ball. Feature i of anchor i is 1 and all others 0; hidden unit i passes feature i on, so
/// column i of W2 holds the outputs of anchor i.
fn scene_of(balls: &[Ball]) -> ReferenceScene {
    let n = balls.len();
    let shape = ModelShape { ..ModelShape::plain(n, 1) };
    let mut heads = Heads::filled(&shape, 0.0);
    let mut features = vec![0.0; n * n];
    let mut log_scales = Vec::new();
    for (i, ball) in balls.iter().enumerate() {
        features[i * n + i] = 1.0;
        for head in heads.each_mut() {
            head.w1[i * n + i] = 1.0;
        }
        // The sigmoid of a zero logit halves the base size.
        log_scales.extend([0.0; 3]);
        log_scales.extend(ball.scale.map(|s| (2.0 * s).ln()));
        heads.opacity.w2[i] = ball.opacity.atanh();
        for (row, q) in ball.quaternion.iter().enumerate() {
            heads.covariance.w2[(3 + row) * n + i] = *q;
        }
        for (row, c) in ball.colour.iter().enumerate() {
            heads.colour.w2[row * n + i] = logit(*c);
        }
    }
    let positions = balls.iter().map(|b| DVec3::from(b.position)).collect();
    let (offsets, drawn) = (vec![0.0; 3 * n], vec![true; n]);
    ReferenceScene { shape, prefilters: true, positions, features, log_scales, offsets, drawn, heads, trained: None }
}

fn camera() -> Camera {
    Camera {
        rotation: DMat3::IDENTITY,
        translation: DVec3::ZERO,
        focal_px: [100.0, 100.0],
        principal_px: [16.5, 16.5],
        width_px: 33,
        height_px: 33,
    }
}

fn blend(colour: [f64; 3], alpha: f64, behind: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|c| colour[c] * alpha + behind[c] * (1.0 - alpha))
}

#[track_caller]
fn assert_close(found: [f64; 3], expected: [f64; 3]) {
    let error = found.iter().zip(expected).map(|(f, e)| (f - e).abs()).fold(0.0, f64::max);
    assert!(error < 1e-12, "found {found:?}, expected {expected:?}");
}

fn at(frame: &[[f64; 3]], x: usize, y: usize) -> [f64; 3] {
    frame[y * 33 + x]
}

#[test]
fn an_empty_scene_is_background() {
    let mut scene = scene_of(&[Ball::default()]);
    scene.positions.clear();
    assert_eq!(scene.render(&camera(), BACKGROUND), vec![BACKGROUND; 33 * 33], "every pixel is the background");
}

#[test]
fn one_ball_is_its_gaussian() {
    let frame = scene_of(&[Ball::default()]).render(&camera(), BACKGROUND);
    // On the axis J is diagonal with 100/2 px a unit: (50·0.1)² + 0.3 px².
    let variance = 25.3_f64;
    assert_close(at(&frame, 16, 16), blend(COLOUR, 0.8, BACKGROUND));
    assert_close(at(&frame, 21, 13), blend(COLOUR, 0.8 * (-0.5 * 34.0 / variance).exp(), BACKGROUND));
    // alpha falls below 1/255 where d² > 2·25.3·ln(204) = 269.1; the corner pixels have 2·16² = 512.
    assert_close(at(&frame, 0, 0), BACKGROUND);
    assert_close(at(&frame, 0, 16), blend(COLOUR, 0.8 * (-0.5 * 256.0 / variance).exp(), BACKGROUND));
    assert_close(at(&frame, 0, 20), BACKGROUND);
}

#[test]
fn the_near_ball_covers_the_far_one() {
    let near = Ball { colour: [0.7, 0.1, 0.1], ..Ball::default() };
    let far = Ball { position: [0.0, 0.0, 3.0], colour: [0.1, 0.1, 0.7], opacity: 0.5, ..Ball::default() };
    let expected = blend(near.colour, 0.8, blend(far.colour, 0.5, BACKGROUND));
    assert_close(at(&scene_of(&[near, far]).render(&camera(), BACKGROUND), 16, 16), expected);
    assert_close(at(&scene_of(&[far, near]).render(&camera(), BACKGROUND), 16, 16), expected);
}

#[test]
fn equal_depths_keep_the_order_of_anchors() {
    let first = Ball { colour: [0.7, 0.1, 0.1], ..Ball::default() };
    let second = Ball { colour: [0.1, 0.1, 0.7], ..Ball::default() };
    let expected = blend(first.colour, 0.8, blend(second.colour, 0.8, BACKGROUND));
    assert_close(at(&scene_of(&[first, second]).render(&camera(), BACKGROUND), 16, 16), expected);
}

#[test]
fn a_pixel_ends_before_the_splat_that_would_exhaust_it() {
    let ball = |z: f64, opacity: f64, red: f64| Ball {
        position: [0.0, 0.0, z],
        opacity,
        colour: [red, 0.5, 0.5],
        ..Ball::default()
    };
    let frame =
        scene_of(&[ball(1.0, 0.999, 0.9), ball(2.0, 0.98, 0.8), ball(3.0, 0.98, 0.7)]).render(&camera(), BACKGROUND);
    // Alpha is held at 0.99, so transmittance is 0.01, then 2e-4; the third would leave 4e-6 and is dropped, so the background shows with 2e-4.
    let red = 0.9 * 0.99 + 0.8 * 0.98 * 0.01 + 2e-4 * BACKGROUND[0];
    assert!((at(&frame, 16, 16)[0] - red).abs() < 1e-12, "found {}, expected {red}", at(&frame, 16, 16)[0]);
}

#[test]
fn a_centre_at_the_near_plane_is_not_drawn() {
    let ball = |z: f64| Ball { position: [0.0, 0.0, z], scale: [0.001; 3], ..Ball::default() };
    assert_close(at(&scene_of(&[ball(0.2)]).render(&camera(), BACKGROUND), 16, 16), BACKGROUND);
    assert_close(at(&scene_of(&[ball(-2.0)]).render(&camera(), BACKGROUND), 16, 16), BACKGROUND);
    let just_beyond = scene_of(&[ball(0.2001)]).render(&camera(), BACKGROUND);
    assert_close(at(&just_beyond, 16, 16), blend(COLOUR, 0.8, BACKGROUND));
}

#[test]
fn an_offset_moves_its_gaussian_in_units_of_the_anchor() {
    let mut scene = scene_of(&[Ball::default()]);
    scene.log_scales[0] = 0.5_f64.ln();
    scene.offsets = vec![0.2, 0.0, 0.0];
    // 0.2 · 0.5 = 0.1 to the right: 5 px.
    let frame = scene.render(&camera(), BACKGROUND);
    let expected = 25.0 * (1.0 + 0.05_f64.powi(2)) + 0.3;
    assert_close(at(&frame, 21, 16), blend(COLOUR, 0.8, BACKGROUND));
    assert_close(at(&frame, 19, 16), blend(COLOUR, 0.8 * (-0.5 * 4.0 / expected).exp(), BACKGROUND));
}

#[test]
fn a_centre_outside_the_image_still_reaches_in_with_its_jacobian_held_at_the_margin() {
    // u = 16.5 + 100·0.6/2 = 46.5; the slope 0.3 is held at (16.5 + 0.15·33)/100 = 0.2145.
    let ball = Ball { position: [0.6, 0.0, 2.0], scale: [0.3; 3], ..Ball::default() };
    let frame = scene_of(&[ball]).render(&camera(), BACKGROUND);
    let variance = 50.0_f64.powi(2) * 0.09 * (1.0 + 0.2145_f64.powi(2)) + 0.3;
    let alpha = 0.8 * (-0.5 * 14.0_f64.powi(2) / variance).exp();
    assert_close(at(&frame, 32, 16), blend(COLOUR, alpha, BACKGROUND));
}

#[test]
fn the_prefilter_drops_an_anchor_whose_own_size_misses_the_image() {
    let ball = Ball { position: [0.6, 0.0, 2.0], scale: [0.3; 3], ..Ball::default() };
    let mut scene = scene_of(&[ball]);
    scene.log_scales[..3].fill(0.01_f64.ln());
    assert_close(at(&scene.render(&camera(), BACKGROUND), 32, 16), BACKGROUND);
}

#[test]
fn compensation_dims_a_small_splat_by_the_area_that_dilation_adds() {
    let mut scene = scene_of(&[Ball { scale: [0.01; 3], ..Ball::default() }]);
    scene.shape.dilation_compensation = true;
    let frame = scene.render(&camera(), BACKGROUND);
    // Variance (50·0.01)² = 0.25 in both directions: √(0.25² / 0.55²).
    assert_close(at(&frame, 16, 16), blend(COLOUR, 0.8 * 0.25 / 0.55, BACKGROUND));
}

#[test]
fn moving_world_and_camera_together_changes_nothing() {
    let turn = DQuat::from_scaled_axis(DVec3::new(0.3, -0.8, 0.5));
    let shift = DVec3::new(0.4, -1.0, 2.0);
    let quaternion = DQuat::from_scaled_axis(DVec3::new(1.0, 0.2, -0.4));
    let ball = |q: DQuat, p: DVec3| Ball {
        position: p.to_array(),
        scale: [0.2, 0.05, 0.1],
        // The length of a quaternion means nothing.
        quaternion: [q.w, q.x, q.y, q.z].map(|c| 3.0 * c),
        ..Ball::default()
    };
    let at_rest = DVec3::new(0.1, -0.05, 2.0);
    // The prefilter's ellipsoid has the world's axes, but `scene_of` makes it a sphere.
    let resting = scene_of(&[ball(quaternion, at_rest)]);
    let moved = scene_of(&[ball(turn * quaternion, turn * at_rest + shift)]);
    let rotation = DMat3::from_quat(turn).transpose();
    let follower = Camera { rotation, translation: -(rotation * shift), ..camera() };
    let before = resting.render(&camera(), BACKGROUND);
    let after = moved.render(&follower, BACKGROUND);
    let worst = before.as_flattened().iter().zip(after.as_flattened()).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    assert!(worst < 1e-12, "worst difference {worst}");
    assert_ne!(at(&before, 16, 16), BACKGROUND, "the ball is in the picture");
}

#[test]
fn heads_see_distance_and_direction_after_the_feature() {
    let mut scene = scene_of(&[Ball { position: [0.3, 0.0, 2.0], ..Ball::default() }]);
    scene.shape.view_colour = true;
    scene.shape.view_distance = true;
    // The direction is the colour head's alone.
    for (head, n_in) in scene.heads.each_mut().zip([2, 2, 5]) {
        head.n_in = n_in;
        head.w1 = vec![0.0; n_in];
        head.w1[0] = 1.0;
    }
    // The hidden unit of the colour head is relu(0.5·feature + 2·dx − dist + 4).
    scene.heads.colour.w1 = vec![0.5, -1.0, 2.0, 0.0, 0.0];
    scene.heads.colour.b1 = vec![4.0];
    scene.heads.colour.w2 = vec![1.0, -1.0, 0.0];
    scene.heads.colour.b2 = vec![0.0, 0.25, 0.5];
    // From x = −0.6 the anchor is 45 px to the right of the axis; the principal point moves it to the middle.
    let eye = DVec3::new(-0.6, 0.0, 0.0);
    let to_anchor = DVec3::new(0.9, 0.0, 2.0);
    let looking = Camera { translation: -eye, principal_px: [-28.5, 16.5], ..camera() };
    let frame = scene.render(&looking, BACKGROUND);
    let hidden = 0.5 + 2.0 * 0.9 / to_anchor.length() - to_anchor.length() + 4.0;
    let colour = [hidden, -hidden + 0.25, 0.5].map(sigmoid);
    assert_close(at(&frame, 16, 16), blend(colour, 0.8, BACKGROUND));
}

#[test]
fn a_scene_is_widened_value_by_value() {
    let shape = ModelShape { view_distance: true, ..ModelShape::plain(1, 1) };
    let scene = Scene::<f32> {
        shape,
        voxel_size: 0.25,
        anchors: Anchors {
            lattice: vec![[4, -2, 0]],
            features: vec![0.5],
            log_scales: vec![0.1; 6],
            offsets: vec![1.0, 2.0, 3.0],
            mask_logits: vec![1.0],
            prune_rank: Vec::new(),
            view_weights: Vec::new(),
        },
        heads: Heads::filled(&shape, 0.125),
        context: None,
    };
    let wide = ReferenceScene::from_scene(&scene);
    assert_eq!(wide.positions, [DVec3::new(1.0, -0.5, 0.0)], "lattice times voxel size");
    assert_eq!(wide.log_scales, [f64::from(0.1_f32); 6], "values are widened, not rounded");
    assert_eq!(wide.heads, Heads::filled(&shape, 0.125), "weights too");
}

#[test]
fn eight_bits_round_to_nearest_and_clamp() {
    let image = to_image(&[[-1.0, 0.5 / 255.0, 0.49 / 255.0], [1.0, 2.0, 127.4 / 255.0]], 2, 1);
    assert_eq!(image.rgb, [0, 1, 0, 255, 255, 127], "half a step rounds up");
}
