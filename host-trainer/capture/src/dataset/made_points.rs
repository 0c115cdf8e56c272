//! Points for a capture that brings none, made once and kept in a file.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;
use std::time::Instant;

use glam::DVec3;

use super::listing::Shot;
use super::{LoadOptions, Normalisation, PointsChoice, PointsOrigin, SceneKind, depth_maps, matching, ply};

/// Fewer points than this outline no scene: random ones do better.
const LEAST_POINTS: usize = 100;
/// Of an object, so many pixels of a photograph that show it need a point: where it is smooth it has none, and random points reach there.
const PIXELS_A_POINT: f64 = 50.0;
/// Rises when the same photographs give other points than by an earlier version.
const REVISION: u32 = 1;

/// A point and the colour of its pixel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct ColouredPoint {
    pub(super) at: DVec3,
    pub(super) rgb: [u8; 3],
}

/// Points that no file of the capture holds.
pub(super) struct MadePoints {
    /// Capture units.
    pub(super) points_world: Vec<DVec3>,
    pub(super) origin: PointsOrigin,
    /// What it took; nothing where an earlier load made them.
    pub(super) seconds: Option<f64>,
}

/// The points that these photographs give, or `None` where they are to be drawn at random: as asked, or because too few are found.
///
/// * `shots`: those to train on, at least one.
/// * `shown`: what they show, and the mean share of their pixels that are not transparent.
pub(super) fn made(
    shots: &[Shot],
    (kind, shown): (SceneKind, f64),
    normalisation: &Normalisation,
    options: &LoadOptions,
) -> Option<MadePoints> {
    let origin = match options.points {
        Some(PointsChoice::Random) => return None,
        None if shots.iter().any(|shot| shot.depth.is_some()) => PointsOrigin::DepthMaps,
        None | Some(PointsChoice::Matched) => PointsOrigin::Matched,
    };
    let least = match (options.points, kind) {
        (None, SceneKind::Object) => LEAST_POINTS.max((shown * matching::mean_pixels(shots) / PIXELS_A_POINT) as usize),
        _ => LEAST_POINTS,
    };
    let file = options.made_points.as_deref();
    let made_from = file.and_then(|_| made_from(shots, origin, options).ok());
    let kept = file.zip(made_from.as_ref()).and_then(|(file, made_from)| read(file, made_from));
    if let Some(points_world) = kept {
        return (points_world.len() >= least).then_some(MadePoints { points_world, origin, seconds: None });
    }
    let began = Instant::now();
    let points = match origin {
        PointsOrigin::DepthMaps => depth_maps::unprojected(shots, normalisation, options),
        _ => matching::matched(shots, normalisation, options),
    };
    let seconds = Some(began.elapsed().as_secs_f64());
    let in_capture =
        |point: ColouredPoint| ColouredPoint { at: point.at / normalisation.scale + normalisation.centre, ..point };
    let points: Vec<ColouredPoint> = points.into_iter().map(in_capture).collect();
    if points.len() < LEAST_POINTS {
        return None;
    }
    if let (Some(file), Some(made_from)) = (file, made_from) {
        // Best effort: the next load makes them again.
        let _ = write(file, &made_from, &points);
    }
    let points_world: Vec<DVec3> = points.into_iter().map(|point| point.at).collect();
    (points_world.len() >= least).then_some(MadePoints { points_world, origin, seconds })
}

/// The line of a file that says what its points were made from: photographs, masks, cameras.
fn made_from(shots: &[Shot], origin: PointsOrigin, options: &LoadOptions) -> std::io::Result<String> {
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

fn read(file: &Path, made_from: &str) -> Option<Vec<DVec3>> {
    let bytes = fs::read(file).ok()?;
    let says = bytes.split(|byte| *byte == b'\n').take(8).any(|line| line == made_from.as_bytes());
    ply::parse(&bytes).ok().filter(|points| says && points.len() >= LEAST_POINTS)
}

/// Writes points as a PLY file, capture units, unless another program's file is in the way.
fn write(file: &Path, made_from: &str, points: &[ColouredPoint]) -> std::io::Result<()> {
    let is_ours =
        |bytes: Vec<u8>| bytes.windows(b"comment pocketsplat".len()).take(256).any(|w| w == b"comment pocketsplat");
    if file.exists() && !fs::read(file).is_ok_and(is_ours) {
        return Ok(());
    }
    let properties = ["double x", "double y", "double z", "uchar red", "uchar green", "uchar blue"];
    let mut bytes = format!("ply\nformat binary_little_endian 1.0\n{made_from}\nelement vertex {}\n", points.len());
    properties.iter().for_each(|property| bytes += &format!("property {property}\n"));
    bytes += "end_header\n";
    let mut bytes = bytes.into_bytes();
    for point in points {
        bytes.extend(point.at.to_array().into_iter().flat_map(f64::to_le_bytes).chain(point.rgb));
    }
    if let Some(folder) = file.parent() {
        fs::create_dir_all(folder)?;
    }
    pocketsplat_files::write_whole(file, |out| out.write_all(&bytes))
}
