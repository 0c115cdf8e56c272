//! The lens of a frame: each number from the nearest level that has it, the frame's own before the shared ones.
//!
//! What no level has follows from the rest where the rest determines it; where it does not, or where two numbers contradict each
//! other, the view cannot be used.

use std::path::Path;

use super::json::Intrinsics;
use super::{FISHEYE_MODELS, FULL_MODEL};
use crate::dataset::ViewFault;
use crate::dataset::image::ImageHeader;
use crate::dataset::lens::{Lens, Projection};

/// Largest distance of a principal point from the middle, in sides of the image, with which a size that is not given is still the
/// photograph's: an image reduced to half has it at 1.
const MAX_OFF_CENTRE: f64 = 0.25;
/// The same where the height follows from the width: a photograph cut to a square from 4:3 has it at 1/8.
const MAX_OFF_DERIVED: f64 = 0.1;
/// How far a focal length and a field of view may disagree: both are written with at least four digits.
const MAX_DISAGREEMENT: f64 = 0.01;

/// The checked lens of a frame for the image file `path`.
///
/// * `numbers_px`: the size that the numbers are for where they say none.
///
/// # Errors
/// [`ViewFault::Lens`] or [`ViewFault::Shape`].
pub(super) fn lens(
    own: &Intrinsics,
    shared: &Intrinsics,
    path: &Path,
    header: &ImageHeader,
    numbers_px: (u32, u32),
) -> Result<Lens, ViewFault> {
    let either = |number: fn(&Intrinsics) -> Option<f64>| number(own).or_else(|| number(shared));
    let size_px = size(own, shared, numbers_px)?;
    let focal_px = focal(own, shared, size_px)?;
    let central = Lens::central(size_px, focal_px);
    let lens = Lens {
        principal_px: [
            either(|i| i.cx).unwrap_or(central.principal_px[0]),
            either(|i| i.cy).unwrap_or(central.principal_px[1]),
        ],
        radial: [either(|i| i.k1), either(|i| i.k2), either(|i| i.k3), either(|i| i.k4)].map(Option::unwrap_or_default),
        tangential: [either(|i| i.p1), either(|i| i.p2)].map(Option::unwrap_or_default),
        ..central
    };
    let model = |i: &Intrinsics| i.camera_model.as_deref().map(str::to_ascii_uppercase);
    let model = model(own).or_else(|| model(shared));
    let is_fisheye = match model.as_deref() {
        Some(model) => FISHEYE_MODELS.contains(&model),
        None => own.is_fisheye.or(shared.is_fisheye) == Some(true),
    };
    let lens = if is_fisheye {
        Lens { projection: Projection::Fisheye, tangential: [0.0; 2], ..lens }
    } else if model.as_deref() == Some(FULL_MODEL) {
        let [k1, k2, k3, k4] = lens.radial;
        let below = [either(|i| i.k5), either(|i| i.k6)].map(Option::unwrap_or_default);
        Lens { radial: [k1, k2, k3, 0.0], divisor: [k4, below[0], below[1]], ..lens }
    } else {
        lens
    };
    lens.for_image(path, header.size_px)
}

fn fault(found: String) -> ViewFault {
    ViewFault::Lens { found }
}

/// A side as a whole number of pixels; 0, which no lens has, for what is none.
fn whole(side: f64) -> u32 {
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "checked on this line")]
    let whole = if side.fract() == 0.0 && (1.0..1e6).contains(&side) { side as u32 } else { 0 };
    whole
}

/// The size of the image that the numbers are for.
///
/// * `image_px`: of the photograph.
fn size(own: &Intrinsics, shared: &Intrinsics, image_px: (u32, u32)) -> Result<(u32, u32), ViewFault> {
    // A focal length and a field of view of one level give the side that they are for.
    let implied = |px: fn(&Intrinsics) -> Option<f64>, angle: fn(&Intrinsics) -> Option<f64>, side_px: u32| {
        let level = [own, shared].into_iter().find(|i| px(i).is_some() || angle(i).is_some())?;
        let side = 2.0 * px(level)? * (0.5 * angle(level)?).tan();
        let is_another = (side - f64::from(side_px)).abs() > MAX_DISAGREEMENT * side;
        is_another.then(|| side.round())
    };
    let w = own.w.or(shared.w).or_else(|| implied(|i| i.fl_x, |i| i.camera_angle_x, image_px.0));
    let h = own.h.or(shared.h).or_else(|| implied(|i| i.fl_y, |i| i.camera_angle_y, image_px.1));
    let (cx, cy) = (own.cx.or(shared.cx), own.cy.or(shared.cy));
    let off = |middle: Option<f64>, side: u32| middle.map_or(0.0, |at| (at / f64::from(side.max(1)) - 0.5).abs());
    match (w, h) {
        (Some(w), Some(h)) => {
            let size_px = (whole(w), whole(h));
            let is_another =
                |own: Option<f64>, shared: Option<f64>| matches!((own, shared), (Some(a), Some(b)) if a != b);
            let is_own_size = is_another(own.w, shared.w) || is_another(own.h, shared.h);
            let shared_px = (own.fl_x.is_none() && own.camera_angle_x.is_none() && shared.fl_x.is_some())
                || (own.cx.is_none() && shared.cx.is_some());
            if is_own_size && shared_px && size_px.0 > 0 && size_px.1 > 0 {
                return Err(fault(format!(
                    "its own `w` and `h` are {w} and {h}, but its focal length or principal point in pixels is that of all \
                     frames, whose `w` and `h` are {} and {}, needed: `fl_x`, `fl_y`, `cx` and `cy` of its own",
                    shared.w.unwrap_or(w),
                    shared.h.unwrap_or(h)
                )));
            }
            Ok(size_px)
        }
        (Some(side), None) | (None, Some(side)) => {
            let (given, missing, this_px, that_px, middle) = if w.is_some() {
                ("w", "h", image_px.0, image_px.1, cy)
            } else {
                ("h", "w", image_px.1, image_px.0, cx)
            };
            let derived = (side * f64::from(that_px) / f64::from(this_px)).round();
            let both = if w.is_some() { (whole(side), whole(derived)) } else { (whole(derived), whole(side)) };
            let off = off(middle, whole(derived));
            if whole(side) > 0 && off > MAX_OFF_DERIVED {
                return Err(fault(format!(
                    "`{given}` is {side} but `{missing}` is not given, and from the photograph's {}×{} px it would be {derived}, \
                     where the principal point {} lies {:.0} % off the middle, needed: `{missing}`",
                    image_px.0,
                    image_px.1,
                    middle.unwrap_or_default(),
                    100.0 * off
                )));
            }
            Ok(both)
        }
        (None, None) => {
            let (off_x, off_y) = (off(cx, image_px.0), off(cy, image_px.1));
            if off_x > MAX_OFF_CENTRE && off_y > MAX_OFF_CENTRE {
                return Err(fault(format!(
                    "`w` and `h` are not given, and the principal point ({}, {}) is not near the middle of the photograph's {}×{} \
                     px, so the numbers are for another size, needed: `w` and `h`",
                    cx.unwrap_or_default(),
                    cy.unwrap_or_default(),
                    image_px.0,
                    image_px.1
                )));
            }
            Ok(image_px)
        }
    }
}

/// The focal lengths: of each axis in pixels or as a field of view from the nearest level that has either, in pixels first; where one
/// axis has none, pixels are square.
fn focal(own: &Intrinsics, shared: &Intrinsics, size_px: (u32, u32)) -> Result<[f64; 2], ViewFault> {
    let axis = |name: &str, side_px: u32, px: fn(&Intrinsics) -> Option<f64>, angle: fn(&Intrinsics) -> Option<f64>| {
        let Some(level) = [own, shared].into_iter().find(|i| px(i).is_some() || angle(i).is_some()) else {
            return Ok(None);
        };
        let from_angle = match angle(level) {
            Some(angle) if !(angle > 0.0 && angle < std::f64::consts::PI) => {
                return Err(fault(format!("`camera_angle_{name}` is {angle}, needed: radians between 0 and π")));
            }
            angle => angle.map(|angle| 0.5 * f64::from(side_px) / (0.5 * angle).tan()),
        };
        if let (Some(px), Some(from_angle)) = (px(level), from_angle)
            && (px - from_angle).abs() > MAX_DISAGREEMENT * px.abs().max(from_angle)
            && side_px > 0
        {
            return Err(fault(format!(
                "`fl_{name}` is {px} px, but `camera_angle_{name}` makes it {from_angle:.3} px in an image of {side_px} px, needed: \
                 numbers that agree, or one of them"
            )));
        }
        Ok(px(level).or(from_angle))
    };
    let x = axis("x", size_px.0, |i| i.fl_x, |i| i.camera_angle_x)?;
    let y = axis("y", size_px.1, |i| i.fl_y, |i| i.camera_angle_y)?;
    Ok([x.or(y), y.or(x)].map(|focal| focal.unwrap_or(f64::NAN)))
}

#[cfg(test)]
mod tests {
    use super::*;

    const HEADER: ImageHeader = ImageHeader {
        size_px: (48, 36),
        has_alpha: false,
        is_grey: false,
        is_depth_like: false,
        exif_orientation: 1,
        has_other_primaries: false,
    };

    /// Size, focal lengths and principal point of the lens for an image of 48×36 px, or what is wrong.
    fn found(own: &str, shared: &str) -> Result<([f64; 2], [f64; 2]), String> {
        let read = |fields: &str| serde_json::from_str::<Intrinsics>(&format!("{{{fields}}}")).expect("intrinsics");
        let lens = lens(&read(own), &read(shared), Path::new("a.png"), &HEADER, HEADER.size_px)
            .map_err(|fault| fault.to_string())?;
        assert_eq!(lens.size_px, HEADER.size_px);
        Ok((lens.focal_px, lens.principal_px))
    }

    #[test]
    fn each_number_is_of_the_nearest_level_that_has_it() {
        let shared = r#""fl_x": 60, "fl_y": 200, "cx": 25, "cy": 17, "w": 48, "h": 36"#;
        assert_eq!(found("", shared), Ok(([60.0, 200.0], [25.0, 17.0])));
        assert_eq!(found(r#""fl_y": 61"#, shared), Ok(([60.0, 61.0], [25.0, 17.0])));
        assert_eq!(found(r#""fl_x": 59, "cy": 18"#, shared), Ok(([59.0, 200.0], [25.0, 18.0])));
        let angle = format!("\"camera_angle_x\": {}", 2.0 * (24.0_f64 / 50.0).atan());
        let ([x, y], _) = found(&angle, r#""fl_x": 60"#).expect("a lens");
        assert!((x - 50.0).abs() < 1e-9 && (y - 50.0).abs() < 1e-9, "the frame's own field of view: {x}, {y}");
        assert_eq!(found("", r#""fl_y": 61"#), Ok(([61.0; 2], [24.0, 18.0])), "square pixels");
    }

    #[test]
    fn what_is_missing_follows_where_the_rest_determines_it() {
        let twice = |more: &str| found("", &format!(r#""fl_x": 120, "cx": 48, "cy": 36{more}"#));
        let half = Ok(([60.0; 2], [24.0, 18.0]));
        for more in [r#", "w": 96, "h": 72"#, r#", "w": 96"#, r#", "h": 72"#] {
            assert_eq!(twice(more), half, "{more}");
        }
        let angle = 2.0 * (48.0_f64 / 120.0).atan();
        assert_eq!(twice(&format!(", \"camera_angle_x\": {angle}")), half, "96 px wide, as the field of view says");
        for (own, shared, says) in [
            ("", r#""fl_x": 120, "cx": 48, "cy": 36"#, "needed: `w` and `h`"),
            ("", r#""fl_x": 120, "cx": 48, "cy": 50, "w": 96"#, "needed: `h`"),
            ("", r#""fl_x": 120, "cx": 80, "cy": 36, "h": 72"#, "needed: `w`"),
            (r#""w": 96, "h": 72"#, r#""fl_x": 60, "w": 48, "h": 36"#, "of its own"),
            ("", r#""fl_x": 60, "camera_angle_x": 0.5, "w": 48, "h": 36"#, "numbers that agree"),
            (r#""camera_angle_x": 40"#, r#""fl_x": 60"#, "radians between 0 and π"),
            ("", "", "the focal length is NaN px"),
            ("", r#""fl_x": 60, "w": 0"#, "the image size is 0×0 px"),
        ] {
            let fault = found(own, shared).expect_err(says);
            assert!(fault.contains(says), "{own} {shared}: {fault}");
        }
    }
}
