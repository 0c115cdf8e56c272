//! Exports of Record3D: `metadata` with lens and poses of a film beside the folder of its pictures.
//!
//! A pose is a quaternion, its real part last, and a position: camera to world in ARKit's axes, which are those of OpenGL.
//! `K` is written by columns.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use glam::{DMat3, DQuat, DVec3};
use serde::Deserialize;

use super::depth_map::DepthMap;
use super::image_names::is_image_name;
use super::listing::{Listing, every_nth};
use super::quaternion::{long_quaternions, rotation_of};
use super::transforms::{Frame, Intrinsics, list_frames};
use super::{DatasetError, Layout, LoadOptions, non_finite};

/// The file of poses: of an unpacked `.r3d`, and of an export as EXR and JPEG.
const METADATA: [&str; 2] = ["metadata", "metadata.json"];
/// The folder of pictures, of either kind.
const PICTURES: [&str; 2] = ["rgbd", "rgb"];

/// A number, or `null` for one that is none.
type Number = Option<f64>;

#[derive(Deserialize)]
struct Metadata {
    w: Number,
    h: Number,
    #[serde(rename = "K")]
    k: [Number; 9],
    /// `[qx, qy, qz, qw, x, y, z]` of each picture.
    poses: Vec<[Number; 7]>,
    /// `[fx, fy, cx, cy, …]` of each picture.
    #[serde(default, rename = "perFrameIntrinsicCoeffs")]
    lenses: Vec<Vec<Number>>,
}

pub(super) fn files(folder: &Path) -> Option<(PathBuf, PathBuf)> {
    let metadata = METADATA.iter().map(|name| folder.join(name)).find(|path| path.is_file())?;
    let pictures = PICTURES.iter().map(|name| folder.join(name)).find(|path| path.is_dir())?;
    Some((metadata, pictures))
}

/// Lists the capture in `folder`, views in the order of the film.
///
/// # Errors
/// As [`super::load`], as far as files but no pixels tell.
pub(super) fn list(folder: &Path, options: &LoadOptions) -> Result<Listing, DatasetError> {
    let Some((path, pictures)) = files(folder) else {
        return Err(DatasetError::NotAFolder { path: folder.join(PICTURES[0]) });
    };
    let needs = "`w`, `h`, `K` of 9 numbers and `poses` of 7 numbers each";
    let metadata: Metadata = non_finite::read_export(&path, "metadata of Record3D", needs)?;
    let [fl_x, _, _, _, fl_y, _, cx, cy, _] = metadata.k;
    let Metadata { w, h, .. } = metadata;
    // A pose with a number that is none is a fault of its picture.
    let poses: Vec<[f64; 7]> =
        metadata.poses.iter().map(|pose| pose.map(|number| number.unwrap_or(f64::NAN))).collect();
    let names = names_by_number(&pictures);
    // From 0 or from 1, whichever picture is missing.
    let first = usize::from(!names.contains_key(&0) && names.contains_key(&poses.len()));
    let quaternion = |&[x, y, z, w, ..]: &[f64; 7]| DQuat::from_xyzw(x, y, z, w);
    let rotations: Vec<_> = poses.iter().map(|pose| rotation_of(quaternion(pose))).collect();
    let frame = |(i, &[.., x, y, z]): (usize, &[f64; 7])| {
        // A fault takes the place of the view below.
        let rotation = rotations[i].as_ref().copied().unwrap_or(DMat3::IDENTITY);
        // Where a picture has no number of its own, that of all counts.
        let [fl_x, fl_y, cx, cy] = match metadata.lenses.get(i).map(Vec::as_slice) {
            Some(&[Some(own_x), own_y, own_cx, own_cy, ..]) if own_x > 0.0 => {
                [Some(own_x), own_y.or(fl_y), own_cx.or(cx), own_cy.or(cy)]
            }
            _ => [fl_x, fl_y, cx, cy],
        };
        let lens = Intrinsics { fl_x, fl_y, cx, cy, w, h, ..Intrinsics::default() };
        let name = names.get(&(first + i)).cloned().unwrap_or_else(|| (first + i).to_string());
        Frame::of_pose(name, rotation, DVec3::new(x, y, z), lens)
    };
    let frames: Vec<Frame> = poses.iter().enumerate().map(frame).collect();
    let notes = long_quaternions(&path, frames.iter().map(Frame::name).zip(poses.iter().map(quaternion)));
    let split = |i| Some(every_nth(options.test_every, i));
    let mut listing = list_frames(Layout::Record3d, path, &pictures, &frames, None, notes.into_iter().collect(), split);
    for (view, rotation) in listing.views.iter_mut().zip(rotations) {
        if let Ok(shot) = &mut view.shot {
            shot.depth = DepthMap::at(shot.path.with_extension("depth"), shot.path.with_extension("conf"));
        }
        if let Err(fault) = rotation {
            view.shot = Err(fault);
        }
    }
    Ok(listing)
}

/// The images in a folder whose names are numbers, by these.
fn names_by_number(folder: &Path) -> BTreeMap<usize, String> {
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let names = entries.map(|entry| entry.file_name().to_string_lossy().into_owned());
    let numbered = names.filter(|name| is_image_name(name)).filter_map(|name| {
        let number = name.rsplit_once('.')?.0.parse().ok()?;
        Some((number, name))
    });
    numbered.collect()
}
