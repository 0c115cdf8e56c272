//! Points for a capture that brings none, made once and kept in a file.

use std::fmt::Write as _;
use std::path::Path;
use std::time::Instant;
use std::{fs, io};

use super::listing::Shot;
use super::points::{ColouredPoint, Points};
use super::{LoadOptions, Normalisation, PointsChoice, PointsOrigin, SceneKind, matching, ply, unprojected};

/// Fewer points than this outline no scene: random ones do better.
const LEAST_POINTS: usize = 100;
/// Of an object, so many pixels of a photograph that show it need a point: where it is smooth it has none, and random points reach there.
const PIXELS_A_POINT: f64 = 35.0;
/// A capture that brings fewer points than this starts from made ones, where these are [`TIMES_OWN`] as many: what lies between few points
/// is not found by growth (`docs/experiments/2026-11-27-points.md`).
pub(super) const FEW_OWN_POINTS: usize = 1000;
const TIMES_OWN: usize = 3;
/// Rises when the same photographs give other points than by an earlier version.
const REVISION: u32 = 1;

/// Points that no file of the capture holds.
pub(super) struct MadePoints {
    /// Capture units.
    pub(super) points_world: Points,
    pub(super) origin: PointsOrigin,
    /// What it took; nothing where an earlier load made them.
    pub(super) seconds: Option<f64>,
    pub(super) file: PointsFile,
}

/// Points that were made for a capture, as a PLY file in capture units that says what they were made from.
#[derive(Clone, Debug, PartialEq)]
pub struct PointsFile(Vec<u8>);

/// The points that these photographs give; `None` where they are to be drawn at random, as asked or because too few are found: that is
/// said in `notes`.
///
/// * `shots`: those to train on, at least one.
/// * `shown`: what they show, and the mean share of their pixels that are not transparent.
/// * `n_own`: points that the capture brings, which made ones would replace.
pub(super) fn made(
    shots: &[Shot],
    (kind, shown): (SceneKind, f64),
    n_own: usize,
    normalisation: &Normalisation,
    options: &LoadOptions,
    notes: &mut Vec<String>,
) -> Option<MadePoints> {
    let n_maps = shots.iter().filter(|shot| shot.depth.is_some()).count();
    let origins: &[PointsOrigin] = match options.points {
        Some(PointsChoice::Random) => &[],
        None if n_maps > 0 => &[PointsOrigin::DepthMaps, PointsOrigin::Matched],
        None | Some(PointsChoice::Matched) => &[PointsOrigin::Matched],
    };
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a part of a photograph's pixels")]
    let needed = match (options.points, kind) {
        (None, SceneKind::Object) => LEAST_POINTS.max((shown * matching::mean_pixels(shots) / PIXELS_A_POINT) as usize),
        _ => LEAST_POINTS,
    };
    let needed = needed.max(TIMES_OWN * n_own);
    for &origin in origins {
        let made = kept_or_made(shots, origin, normalisation, options);
        let found = made.points_world.len();
        if found >= needed {
            if n_own > 0 {
                notes.push(format!("points of the capture: {n_own}, needed: {FEW_OWN_POINTS}, so others are made"));
            }
            return Some(made);
        }
        if n_own > 0 {
            continue;
        }
        notes.push(match origin {
            PointsOrigin::DepthMaps => format!("depth maps: {n_maps}, which give {found} points, needed: {needed}"),
            _ => format!(
                "points matched between the photographs: {found}, needed: {needed}, so training starts from random ones; take more \
                 photographs that overlap, or `--points matched` starts from {LEAST_POINTS} on"
            ),
        });
    }
    None
}

/// The points of a file that was made from these photographs, or new ones.
fn kept_or_made(
    shots: &[Shot],
    origin: PointsOrigin,
    normalisation: &Normalisation,
    options: &LoadOptions,
) -> MadePoints {
    // Photographs that were just read and now are not: nothing is found again.
    let made_from = made_from(shots, origin, options).unwrap_or_default();
    let earlier = options.made_points.iter().find_map(|path| PointsFile::read(path, &made_from));
    if let Some((points_world, file)) = earlier {
        return MadePoints { points_world, origin, seconds: None, file };
    }
    let began = Instant::now();
    let mut points = match origin {
        PointsOrigin::DepthMaps => unprojected::unprojected(shots, normalisation, options),
        _ => matching::matched(shots, normalisation, options),
    };
    let seconds = Some(began.elapsed().as_secs_f64());
    points.iter_mut().for_each(|point| point.at = point.at / normalisation.scale + normalisation.centre);
    let file = PointsFile::new(&made_from, &points);
    let points_world = points.into_iter().map(|point| (point.at, Some(point.rgb))).collect();
    MadePoints { points_world, origin, seconds, file }
}

/// The line of a file that says what its points were made from: photographs, masks, cameras.
fn made_from(shots: &[Shot], origin: PointsOrigin, options: &LoadOptions) -> io::Result<String> {
    let mut text = format!("{REVISION} {origin:?} {:?}", options.background);
    for shot in shots {
        let Shot { header, rotation, translation, lens, .. } = shot;
        // Writing to a string does not fail.
        let _ = write!(text, "{header:?} {rotation:?} {translation:?} {lens:?}");
        let masks = shot.masks.iter().map(|mask| mask.path.as_path());
        let depth = shot.depth.iter().flat_map(|depth| depth.files());
        for path in std::iter::once(shot.path.as_path()).chain(masks).chain(depth) {
            let _ = write!(text, " {:08x}", crc32fast::hash(&fs::read(path)?));
        }
    }
    Ok(format!("comment pocketsplat made from {:08x}", crc32fast::hash(text.as_bytes())))
}

impl PointsFile {
    fn new(made_from: &str, points: &[ColouredPoint]) -> Self {
        let properties = ["double x", "double y", "double z", "uchar red", "uchar green", "uchar blue"];
        let mut head = format!("ply\nformat binary_little_endian 1.0\n{made_from}\nelement vertex {}\n", points.len());
        properties.iter().for_each(|property| head += &format!("property {property}\n"));
        let mut bytes = (head + "end_header\n").into_bytes();
        for point in points {
            bytes.extend(point.at.to_array().into_iter().flat_map(f64::to_le_bytes).chain(point.rgb));
        }
        Self(bytes)
    }

    /// The points of the file `path`, capture units, where it says that they were made from the same.
    fn read(path: &Path, made_from: &str) -> Option<(Points, Self)> {
        let bytes = fs::read(path).ok()?;
        let says = bytes.split(|byte| *byte == b'\n').take(8).any(|line| line == made_from.as_bytes());
        let points = ply::parse(&bytes).ok().filter(|_| says)?;
        Some((points, Self(bytes)))
    }

    /// Keeps the points in the file `path` of a folder that is the program's own.
    ///
    /// # Errors
    /// What the system says.
    pub fn write(&self, path: &Path) -> io::Result<()> {
        if fs::read(path).is_ok_and(|there| there == self.0) {
            return Ok(());
        }
        pocketsplat_files::write_whole(path, |out| out.write_all(&self.0))
    }
}
