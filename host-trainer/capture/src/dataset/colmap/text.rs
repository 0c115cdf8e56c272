//! Text models: one record a line (two for images), `#` before comments, as in COLMAP's documentation, "Output Format".

use std::collections::BTreeMap;
use std::str::FromStr;

use glam::DVec3;

use super::model::{CAMERA_MODELS, ModelCamera, ModelFault, ModelImage};

/// A line that is neither empty nor a comment, with its number from 1.
fn records(text: &str) -> impl Iterator<Item = (usize, &str)> {
    let numbered = text.lines().enumerate().map(|(i, line)| (i + 1, line.trim()));
    numbered.filter(|(_, line)| is_record(line))
}

fn is_record(line: &str) -> bool {
    !line.is_empty() && !line.starts_with('#')
}

fn fault(line: usize, found: String) -> ModelFault {
    ModelFault { place: format!("line {line}"), found }
}

/// The next word of a line as a value of type `T`.
fn next<'a, T: FromStr>(words: &mut impl Iterator<Item = &'a str>, line: usize, what: &str) -> Result<T, ModelFault> {
    let word = words.next().ok_or_else(|| fault(line, format!("the line ends where the {what} is needed")))?;
    word.parse().map_err(|_| fault(line, format!("`{word}` is no {what}")))
}

fn next_f64s<'a, const N: usize>(
    words: &mut impl Iterator<Item = &'a str>,
    line: usize,
    what: &str,
) -> Result<[f64; N], ModelFault> {
    let mut numbers = [0.0; N];
    for number in &mut numbers {
        *number = next(words, line, what)?;
    }
    Ok(numbers)
}

/// `cameras.txt`, `CAMERA_ID MODEL WIDTH HEIGHT PARAMS…`: by number.
pub(super) fn cameras(text: &str) -> Result<BTreeMap<u32, ModelCamera>, ModelFault> {
    let mut cameras = BTreeMap::new();
    for (line, record) in records(text) {
        let mut words = record.split_whitespace();
        let id: u32 = next(&mut words, line, "camera number")?;
        let model: String = next(&mut words, line, "camera model")?;
        let size_px = (next(&mut words, line, "width")?, next(&mut words, line, "height")?);
        let mut parameters = Vec::new();
        for word in words {
            parameters.push(word.parse().map_err(|_| fault(line, format!("`{word}` is no camera parameter")))?);
        }
        let camera = ModelCamera::new(&model, size_px, &parameters).ok_or_else(|| {
            let needed = CAMERA_MODELS.iter().find(|(_, name, _)| *name == model).map_or(0, |&(_, _, count)| count);
            fault(line, format!("{model} has {} parameters, needed: {needed}", parameters.len()))
        })?;
        if cameras.insert(id, camera).is_some() {
            return Err(fault(line, format!("camera {id} is listed twice")));
        }
    }
    Ok(cameras)
}

/// `images.txt`, `IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME` and a line of observations, which may be empty.
pub(super) fn images(text: &str) -> Result<Vec<ModelImage>, ModelFault> {
    let mut images = Vec::new();
    let mut lines = text.lines().enumerate().map(|(i, line)| (i + 1, line.trim()));
    while let Some((line, record)) = lines.next() {
        if !is_record(record) {
            continue;
        }
        let mut words = record.split_whitespace();
        let _image_id: u32 = next(&mut words, line, "image number")?;
        let quaternion_wxyz = next_f64s(&mut words, line, "quaternion")?;
        let translation = next_f64s(&mut words, line, "translation")?;
        let camera_id = next(&mut words, line, "camera number")?;
        // A name may hold spaces.
        let name = words.collect::<Vec<_>>().join(" ");
        if name.is_empty() {
            return Err(fault(line, "the line ends where the name is needed".to_owned()));
        }
        images.push(ModelImage { name, quaternion_wxyz, translation, camera_id });
        if let Some((line, observations)) = lines.next() {
            let n = observations.split_whitespace().count();
            if !n.is_multiple_of(3) {
                let found =
                    format!("{n} numbers of observations, needed: 3 for each; one of an image's two lines is missing");
                return Err(fault(line, found));
            }
        }
    }
    Ok(images)
}

/// `points3D.txt`, `POINT3D_ID X Y Z R G B ERROR TRACK…`: positions.
pub(super) fn points(text: &str) -> Result<Vec<DVec3>, ModelFault> {
    records(text)
        .map(|(line, record)| {
            let mut words = record.split_whitespace();
            let _point_id: u64 = next(&mut words, line, "point number")?;
            Ok(DVec3::from_array(next_f64s(&mut words, line, "coordinate")?))
        })
        .collect()
}
