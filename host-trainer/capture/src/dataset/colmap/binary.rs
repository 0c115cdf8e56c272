//! Binary models: little-endian records behind a count, as in COLMAP's documentation, "Output Format".
//!
//! Counts are checked against the bytes that are there before anything is reserved or skipped.

use std::collections::BTreeMap;

use glam::DVec3;

use super::model::{CAMERA_MODELS, ModelCamera, ModelFault, ModelImage};
use crate::dataset::points::Points;

/// Longest image name accepted; it bounds the search for its end.
const MAX_NAME_BYTES: usize = 4096;

/// Smallest records: a camera without parameters, an image with an empty name and no observations, a point without
/// track.
const MIN_CAMERA_BYTES: usize = 4 + 4 + 8 + 8;
const MIN_IMAGE_BYTES: usize = 4 + 7 * 8 + 4 + 1 + 8;
const MIN_POINT_BYTES: usize = 8 + 3 * 8 + 3 + 8 + 8;
/// Bytes of an observation in an image and of an element of a point's track.
const OBSERVATION_BYTES: u64 = 8 + 8 + 8;
const TRACK_BYTES: u64 = 4 + 4;

/// The bytes not yet read, and what is being read from them.
struct Cursor<'a> {
    rest: &'a [u8],
    n_total: usize,
    /// What a record is, and the number of the current one.
    kind: &'static str,
    record: u64,
    n_records: u64,
}

impl<'a> Cursor<'a> {
    /// Reads the count of records and checks that as many can be there.
    fn new(bytes: &'a [u8], kind: &'static str, min_record_bytes: usize) -> Result<Self, ModelFault> {
        let mut cursor = Self { rest: bytes, n_total: bytes.len(), kind, record: 0, n_records: 0 };
        let Some((count, rest)) = bytes.split_first_chunk() else {
            let found = format!("the file has {} bytes, needed: 8 for the count of {kind}s", bytes.len());
            return Err(ModelFault { place: "byte 0".to_owned(), found });
        };
        (cursor.n_records, cursor.rest) = (u64::from_le_bytes(*count), rest);
        let possible = (rest.len() / min_record_bytes) as u64;
        if cursor.n_records > possible {
            let found = format!(
                "{} {kind}s are announced, but the {} bytes that follow hold at most {possible}",
                cursor.n_records,
                rest.len()
            );
            return Err(ModelFault { place: "byte 0".to_owned(), found });
        }
        Ok(cursor)
    }

    fn fault(&self, found: String) -> ModelFault {
        let at = self.n_total - self.rest.len();
        ModelFault { place: format!("{} {} of {}, byte {at}", self.kind, self.record + 1, self.n_records), found }
    }

    fn take<const N: usize>(&mut self) -> Result<[u8; N], ModelFault> {
        let Some((bytes, rest)) = self.rest.split_first_chunk() else {
            return Err(self.fault(format!("the file ends: {N} bytes needed, {} there", self.rest.len())));
        };
        self.rest = rest;
        Ok(*bytes)
    }

    fn u32(&mut self) -> Result<u32, ModelFault> {
        self.take().map(u32::from_le_bytes)
    }

    fn u64(&mut self) -> Result<u64, ModelFault> {
        self.take().map(u64::from_le_bytes)
    }

    fn f64s<const N: usize>(&mut self) -> Result<[f64; N], ModelFault> {
        let mut numbers = [0.0; N];
        for number in &mut numbers {
            *number = f64::from_le_bytes(self.take()?);
        }
        Ok(numbers)
    }

    /// Steps over `count` items of `item_bytes` each.
    fn skip(&mut self, what: &str, count: u64, item_bytes: u64) -> Result<(), ModelFault> {
        let there = self.rest.len() as u64;
        match count.checked_mul(item_bytes).filter(|&needed| needed <= there) {
            Some(needed) => {
                #[expect(clippy::cast_possible_truncation, reason = "at most the length of a slice")]
                let needed = needed as usize;
                self.rest = &self.rest[needed..];
                Ok(())
            }
            None => Err(self.fault(format!("{count} {what} are announced, but only {there} bytes follow"))),
        }
    }

    /// A name up to its zero byte: UTF-8, or where it is not, a byte a letter as programs on Windows write `ü`.
    fn name(&mut self) -> Result<String, ModelFault> {
        let Some(n) = self.rest.iter().take(MAX_NAME_BYTES).position(|&byte| byte == 0) else {
            return Err(self.fault(format!("the name does not end within {MAX_NAME_BYTES} bytes or the file")));
        };
        let (name, rest) = self.rest.split_at(n);
        self.rest = &rest[1..];
        Ok(match std::str::from_utf8(name) {
            Ok(name) => name.to_owned(),
            Err(_) => name.iter().map(|&byte| char::from(byte)).collect(),
        })
    }

    /// Reads all records one after the other.
    fn each(mut self, mut record: impl FnMut(&mut Self) -> Result<(), ModelFault>) -> Result<(), ModelFault> {
        while self.record < self.n_records {
            record(&mut self)?;
            self.record += 1;
        }
        Ok(())
    }
}

/// `cameras.bin`: by number.
pub(super) fn cameras(bytes: &[u8]) -> Result<BTreeMap<u32, ModelCamera>, ModelFault> {
    let mut cameras = BTreeMap::new();
    Cursor::new(bytes, "camera", MIN_CAMERA_BYTES)?.each(|cursor| {
        let (id, model_id) = (cursor.u32()?, cursor.u32()?);
        let (width_px, height_px) = (cursor.u64()?, cursor.u64()?);
        let Some(&(_, model, n_parameters)) = CAMERA_MODELS.iter().find(|(id, _, _)| *id == model_id) else {
            let known = CAMERA_MODELS.len() - 1;
            return Err(cursor.fault(format!("the camera model has the number {model_id}, known: 0 to {known}")));
        };
        let mut parameters = Vec::with_capacity(n_parameters);
        for _ in 0..n_parameters {
            parameters.extend(cursor.f64s::<1>()?);
        }
        // Sizes beyond u32 become 0, which no image has.
        let side = |px: u64| u32::try_from(px).unwrap_or(0);
        let camera = ModelCamera::new(model, (side(width_px), side(height_px)), &parameters);
        let camera = camera.ok_or_else(|| cursor.fault(format!("{model} with {n_parameters} parameters")))?;
        if cameras.insert(id, camera).is_some() {
            return Err(cursor.fault(format!("camera {id} is listed twice")));
        }
        Ok(())
    })?;
    Ok(cameras)
}

/// `images.bin`: the posed images; observations are stepped over.
pub(super) fn images(bytes: &[u8]) -> Result<Vec<ModelImage>, ModelFault> {
    let mut images = Vec::new();
    Cursor::new(bytes, "image", MIN_IMAGE_BYTES)?.each(|cursor| {
        let _image_id = cursor.u32()?;
        let (quaternion_wxyz, translation) = (cursor.f64s()?, cursor.f64s()?);
        let (camera_id, name) = (cursor.u32()?, cursor.name()?);
        let n_observations = cursor.u64()?;
        cursor.skip("observations", n_observations, OBSERVATION_BYTES)?;
        images.push(ModelImage { name, quaternion_wxyz, translation, camera_id });
        Ok(())
    })?;
    Ok(images)
}

/// `points3D.bin`: positions and colours.
pub(super) fn points(bytes: &[u8]) -> Result<Points, ModelFault> {
    let points = points_with_errors(bytes)?;
    Ok(points.into_iter().map(|(at, rgb, _)| (at, Some(rgb))).collect())
}

/// A point, its colour, and its error of reprojection in pixels.
type PointWithError = (DVec3, [u8; 3], f64);

/// `points3D.bin`: positions, colours and errors; tracks are stepped over.
pub(super) fn points_with_errors(bytes: &[u8]) -> Result<Vec<PointWithError>, ModelFault> {
    let mut points = Vec::new();
    Cursor::new(bytes, "point", MIN_POINT_BYTES)?.each(|cursor| {
        let _point_id = cursor.u64()?;
        let (at, rgb) = (DVec3::from_array(cursor.f64s()?), cursor.take::<3>()?);
        let [error_px] = cursor.f64s::<1>()?;
        points.push((at, rgb, error_px));
        let n_track = cursor.u64()?;
        cursor.skip("track elements", n_track, TRACK_BYTES)
    })?;
    Ok(points)
}
