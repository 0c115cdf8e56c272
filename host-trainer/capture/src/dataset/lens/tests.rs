use super::*;

fn opencv() -> Lens {
    Lens {
        size_px: (540, 960),
        focal_px: [687.8, 687.2],
        principal_px: [277.3, 482.6],
        projection: Projection::Perspective,
        radial: [0.0578, -0.0805, 0.01, -0.002],
        divisor: [0.0; 3],
        tangential: [-9.8e-4, 1.6e-4],
    }
}

fn full_opencv() -> Lens {
    Lens { radial: [0.31, -0.12, 0.02, 0.0], divisor: [0.27, -0.05, 0.004], ..opencv() }
}

/// 118° from side to side.
fn fisheye() -> Lens {
    Lens {
        focal_px: [300.0, 290.0],
        projection: Projection::Fisheye,
        radial: [0.03, -0.02, 0.006, -0.001],
        tangential: [0.0; 2],
        ..opencv()
    }
}

/// [`Lens::distorted`] as the models are written down, each power by itself and the fisheye on the sphere.
fn slowly_distorted(lens: &Lens, [x, y]: [f64; 2]) -> [f64; 2] {
    let power = |k: &[f64], s: f64| {
        k.iter().zip(1..).map(|(k, i)| k * (0..i).map(|_| s).product::<f64>()).fold(1.0, |sum, term| sum + term)
    };
    if lens.projection == Projection::Fisheye {
        let length = (x * x + y * y + 1.0).sqrt();
        let (angle, turn) = ((1.0 / length).acos(), y.atan2(x));
        let bent = angle * power(&lens.radial, angle * angle);
        return [bent * turn.cos(), bent * turn.sin()];
    }
    let r = x.hypot(y);
    let d = power(&lens.radial, r * r) / power(&lens.divisor, r * r);
    let [p1, p2] = lens.tangential;
    let shift = [2.0 * p1 * x * y + p2 * (r * r + 2.0 * x * x), p1 * (r * r + 2.0 * y * y) + 2.0 * p2 * x * y];
    [x * d + shift[0], y * d + shift[1]]
}

#[test]
fn every_model_follows_the_slow_reference() {
    for lens in [opencv(), full_opencv(), fisheye()] {
        for i in -10..=10 {
            for j in -10..=10 {
                let direction = [0.09 * f64::from(i), 0.17 * f64::from(j)];
                let (found, expected) = (lens.distorted(direction), slowly_distorted(&lens, direction));
                let miss = (found[0] - expected[0]).hypot(found[1] - expected[1]);
                // The arc cosine loses half the digits near the axis.
                assert!(miss < 1e-8, "{:?} {direction:?}: {found:?}, {expected:?}", lens.projection);
            }
        }
    }
}

/// The direction that the lens sends to `target`, by Newton's iteration with a numerical Jacobian.
fn undistorted(lens: &Lens, target: [f64; 2]) -> [f64; 2] {
    let mut at = target;
    for _ in 0..20 {
        let (here, h) = (lens.distorted(at), 1e-7);
        let dx = lens.distorted([at[0] + h, at[1]]).map(|v| v / h);
        let dy = lens.distorted([at[0], at[1] + h]).map(|v| v / h);
        let (a, c) = (dx[0] - here[0] / h, dx[1] - here[1] / h);
        let (b, d) = (dy[0] - here[0] / h, dy[1] - here[1] / h);
        let (ex, ey) = (target[0] - here[0], target[1] - here[1]);
        let determinant = a * d - b * c;
        at = [at[0] + (d * ex - b * ey) / determinant, at[1] + (a * ey - c * ex) / determinant];
    }
    at
}

#[test]
fn the_inverse_undoes_the_distortion_all_over_the_image() {
    for (lens, most) in [(opencv(), 1e-12), (full_opencv(), 1e-12), (fisheye(), 1e-10)] {
        for i in 0..=10 {
            for j in 0..=10 {
                let direction = lens.direction([54.0 * f64::from(i), 96.0 * f64::from(j)]);
                let back = undistorted(&lens, lens.distorted(direction));
                let miss = (back[0] - direction[0]).hypot(back[1] - direction[1]);
                assert!(miss < most, "{:?}: {direction:?} came back as {back:?}", lens.projection);
            }
        }
    }
}

#[test]
fn a_point_off_the_axes_follows_the_formula_by_hand() {
    let lens = Lens { radial: [0.1, 0.01, 0.0, 0.0], tangential: [0.02, 0.03], ..opencv() };
    // r² = 0.25, d = 1 + 0.025 + 0.000625; x: 0.3·d + 2·0.02·0.12 + 0.03·(0.25 + 0.18).
    let [x, y] = lens.distorted([0.3, 0.4]);
    assert!((x - (0.3 * 1.025_625 + 0.0048 + 0.0129)).abs() < 1e-15, "{x}");
    assert!((y - (0.4 * 1.025_625 + 0.02 * 0.57 + 0.0072)).abs() < 1e-15, "{y}");
}

#[test]
fn the_fold_lies_where_the_slope_vanishes() {
    let lens = Lens { radial: [-0.5, 0.0, 0.0, 0.0], ..opencv() };
    assert!((lens.fold_squared(1.0) - 2.0 / 3.0).abs() < 1e-3, "1 − 1.5·r² = 0");
    assert_eq!(lens.fold_squared(0.5), f64::INFINITY);
    assert_eq!(opencv().fold_squared(0.7), f64::INFINITY);
    assert_eq!(full_opencv().fold_squared(0.7), f64::INFINITY);
    assert_eq!(fisheye().fold_squared(100.0), f64::INFINITY);
    // θ·(1 − 0.5·θ²) turns where 1 = 1.5·θ²; r/(1 + 2r²) where 1 = 2r²; and 1 − 2r² has no lens beyond its zero.
    let bent = Lens { radial: [-0.5, 0.0, 0.0, 0.0], ..fisheye() };
    assert!((bent.fold_squared(4.0) - (2.0_f64 / 3.0).sqrt().tan().powi(2)).abs() < 2e-3);
    for q1 in [2.0, -2.0] {
        let lens = Lens { radial: [0.0; 4], divisor: [q1, 0.0, 0.0], ..opencv() };
        assert!((lens.fold_squared(1.0) - 0.5).abs() < 1e-3, "{q1}");
    }
}

#[test]
fn scaling_keeps_ratios_and_refuses_other_shapes() {
    let lens = Lens { size_px: (3118, 2078), ..opencv() };
    let eighth = lens.scaled_to((389, 259)).expect("both sides rounded down");
    assert!((eighth.focal_px[0] - 687.8 * 389.0 / 3118.0).abs() < 1e-12);
    assert!(lens.scaled_to((390, 260)).is_some() && lens.scaled_to((1559, 1039)).is_some());
    assert_eq!(lens.scaled_to((2078, 3118)), None, "turned on its side");
    assert_eq!(lens.scaled_to((3118, 2000)), None, "cut");
}

#[test]
fn a_distortion_beyond_sense_is_no_lens() {
    let said = |lens: Lens| lens.fault().unwrap_or_default();
    for lens in [opencv(), full_opencv(), fisheye(), Lens { radial: [0.0; 4], ..fisheye() }] {
        assert_eq!(said(lens.clone()), "", "{lens:?}");
    }
    // 2/3 of the way as r², against r² = 0.64 in the corner.
    let folded = Lens { radial: [-0.9, 0.0, 0.0, 0.0], ..opencv() };
    assert!(said(folded).contains("turns back at 7"));
    for radial in [[-44.85, 1017.4, 0.0, 0.0], [500.0, 0.0, 0.0, 0.0], [1e300, 1e300, 1e300, 1e300]] {
        for lens in [opencv(), full_opencv(), fisheye()] {
            let found = said(Lens { radial, ..lens });
            assert!(found.starts_with("the distortion moves a ray by ") && found.contains("540×960 px"), "{found}");
        }
    }
    assert!(said(Lens { tangential: [0.9, 0.9], ..opencv() }).contains("moves a ray"));
    // Of a fisheye the projection is none of its distortion.
    assert!(fisheye().largest_shift_px() > 200.0);
}
