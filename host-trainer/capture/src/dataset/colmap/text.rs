//! Text models: one record a line (two for images), `#` before comments, as in COLMAP's documentation, "Output Format".

use std::collections::BTreeMap;
use std::str::FromStr;

use glam::DVec3;

use super::model::{CAMERA_MODELS, ModelCamera, ModelFault, ModelImage};
use crate::dataset::points::{Points, rgb8};

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
///
/// A line of observations is told by its grammar, `X Y POINT3D_ID` again and again: the third of a pose is no whole number, nor is a
/// name. A file without any, as some programs write it, holds poses alone.
pub(super) fn images(text: &str) -> Result<Vec<ModelImage>, ModelFault> {
    let mut images = Vec::new();
    let (mut has_observations, mut first_without) = (false, None);
    let mut lines = text.lines().enumerate().map(|(i, line)| (i + 1, line)).peekable();
    while let Some((line, record)) = lines.next() {
        if !is_record(record.trim()) {
            continue;
        }
        images.push(image(line, record)?);
        if let Some((_, next)) = lines.next_if(|(_, next)| next.trim().is_empty() || are_observations(next)) {
            has_observations |= !next.trim().is_empty();
        } else if let Some((line, next)) = lines.peek().filter(|(_, next)| is_record(next.trim())) {
            first_without.get_or_insert((*line, next.split_whitespace().count()));
        }
    }
    match first_without.filter(|_| has_observations) {
        Some((line, n)) => {
            let found =
                format!("{n} numbers of observations, needed: 3 for each; one of an image's two lines is missing");
            Err(fault(line, found))
        }
        None => Ok(images),
    }
}

/// A line of a pose. The name is all that stands behind the nine numbers, with the spaces in it.
fn image(line: usize, record: &str) -> Result<ModelImage, ModelFault> {
    const N_NUMBERS: usize = 9;
    let mut rest = record.trim();
    let mut numbers = Vec::with_capacity(N_NUMBERS);
    while numbers.len() < N_NUMBERS && !rest.is_empty() {
        let (word, behind) = rest.split_once(char::is_whitespace).unwrap_or((rest, ""));
        numbers.push(word);
        rest = behind.trim_start();
    }
    let mut words = numbers.into_iter();
    let _image_id: u32 = next(&mut words, line, "image number")?;
    let quaternion_wxyz = next_f64s(&mut words, line, "quaternion")?;
    let translation = next_f64s(&mut words, line, "translation")?;
    let camera_id = next(&mut words, line, "camera number")?;
    if rest.is_empty() {
        return Err(fault(line, "the line ends where the name is needed".to_owned()));
    }
    Ok(ModelImage { name: rest.to_owned(), quaternion_wxyz, translation, camera_id })
}

fn are_observations(line: &str) -> bool {
    let words: Vec<&str> = line.split_whitespace().collect();
    words.len().is_multiple_of(3)
        && words.chunks_exact(3).all(|triple| {
            triple[..2].iter().all(|word| word.parse::<f64>().is_ok()) && triple[2].parse::<i64>().is_ok()
        })
}

/// `points3D.txt`, `POINT3D_ID X Y Z R G B ERROR TRACK…`: positions, and colours where all have one.
pub(super) fn points(text: &str) -> Result<Points, ModelFault> {
    records(text)
        .map(|(line, record)| {
            let mut words = record.split_whitespace();
            let _point_id: u64 = next(&mut words, line, "point number")?;
            let at = DVec3::from_array(next_f64s(&mut words, line, "coordinate")?);
            let rgb: Vec<f64> = words.take(3).map_while(|word| word.parse().ok()).collect();
            Ok((at, rgb8(&rgb)))
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const POSE: &str = "0.5 0.5 -0.5 0.5 1.25 0 4.031 1";

    fn names(text: &str) -> Result<Vec<String>, String> {
        images(text).map(|images| images.into_iter().map(|image| image.name).collect()).map_err(|fault| fault.found)
    }

    #[test]
    fn names_hold_any_number_of_words_and_spaces() {
        for name in ["a.jpg", "my photo.jpg", "my photo 1.jpg", "a  b.jpg", "a b c d e.jpg", "1 2 3.jpg", "café.jpg"] {
            for observations in ["\n", "\n1.5 2.5 -1\n", "\n1.5 2.5 -1 3 4 17\r\n", "\n\n"] {
                let text = format!("# comment\n1 {POSE} {name}{observations}2 {POSE} {name}{observations}");
                assert_eq!(names(&text), Ok(vec![name.to_owned(); 2]), "{text:?}");
            }
        }
    }

    #[test]
    fn points_without_colours_are_points() {
        let coloured = points("# comment\n7 1 2 3 200 100 50 0.5 1 1\n8 4 5 6 0 0 255 0.5\n").expect("points");
        assert_eq!(
            (coloured.at[1], &coloured.rgb[..]),
            (DVec3::new(4.0, 5.0, 6.0), &[[200, 100, 50], [0, 0, 255]][..])
        );
        let bare = points("7 1 2 3\n8 4 5 6 0 0 255 0.5\n").expect("points");
        assert_eq!((bare.len(), bare.rgb.len()), (2, 0));
    }

    #[test]
    fn one_missing_line_of_observations_is_told() {
        let text = format!("1 {POSE} my photo 1.jpg\n1.5 2.5 -1\n2 {POSE} my photo 2.jpg\n3 {POSE} my photo 3.jpg\n");
        let found = names(&text).expect_err("a line is missing");
        assert!(found.ends_with("one of an image's two lines is missing"), "{found}");
        assert_eq!(names(&format!("1 {POSE}\n")), Err("the line ends where the name is needed".to_owned()));
    }
}
