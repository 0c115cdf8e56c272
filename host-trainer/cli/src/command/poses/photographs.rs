//! Photographs as they lie in a capture: upright, and of a format that is read.
//!
//! Poses and lenses are those of the pixels as they are stored: neither COLMAP nor the loader of captures turns them. So a photograph
//! whose metadata ask to be turned is stored turned, without the tag, and everybody agrees.

use std::fs;
use std::path::Path;
use std::sync::Mutex;

use anyhow::{Context, Result, anyhow, bail};
use image::metadata::Orientation;
use image::{DynamicImage, ImageDecoder as _, ImageEncoder as _, ImageReader};
use pocketsplat_files::{FileKind, beside, shell_word, shown};
use rayon::prelude::*;

use super::child::{Ended, Work};
use super::inputs::Photograph;
use super::kinds::{Treatment, extension};
use super::programs::{FFMPEG, HEIF_CONVERT, HEIF_DEC};
use super::progress::Progress;
use super::taking::{FEWEST, Taken};
use crate::command::outputs::keep;
use crate::say::say;

/// Of 100: compression that the eye does not see.
const JPEG_QUALITY: u8 = 95;

/// Refuses photographs of which no capture can be made.
///
/// * `in_place`: they lie in the folder `capture` already.
pub(super) fn check(given: &[Photograph], in_place: bool, capture: &Path) -> Result<()> {
    if given.len() < FEWEST {
        bail!("there are {} photographs, needed: at least {FEWEST}, and better 20; take more", given.len());
    }
    let unfit =
        |photograph: &&Photograph| photograph.path.file_name().is_none_or(|name| name != photograph.name.as_str());
    if let Some(unfit) = given.iter().find(unfit).filter(|_| in_place) {
        bail!(
            "`{}` has to be converted, and photographs that lie in the capture are left as they are; choose another \
             --output, as `{}`",
            shown(&unfit.path),
            shell_word(&beside(capture, "-capture"))
        );
    }
    Ok(())
}

/// Puts photographs into the folder `images`; `None` where it was stopped.
///
/// * `in_place`: they lie there already, and are left as they are.
pub(super) fn prepared(
    given: &[Photograph],
    images: &Path,
    in_place: bool,
    work: Work<'_>,
) -> Result<Option<Vec<Taken>>> {
    let taken = |photograph: &Photograph, name: String| Taken {
        name,
        from: photograph.path.file_name().map_or_else(String::new, |name| name.to_string_lossy().into_owned()),
        at_s: None,
    };
    if in_place {
        return Ok(Some(given.iter().map(|photograph| taken(photograph, photograph.name.clone())).collect()));
    }
    let progress = Mutex::new((Progress::new("photographs", given.len()), 0));
    let one = |photograph: &Photograph| -> Result<Option<(Taken, bool)>> {
        if work.is_stopped() {
            return Ok(None);
        }
        let Some((name, is_turned)) = put(photograph, images, work)? else { return Ok(None) };
        let mut progress = progress.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        progress.1 += 1;
        let n_done = progress.1;
        progress.0.reached(n_done);
        Ok(Some((taken(photograph, name), is_turned)))
    };
    let Some(done) = given.par_iter().map(one).collect::<Result<Option<Vec<_>>>>()? else { return Ok(None) };
    let n_turned = done.iter().filter(|(_, is_turned)| *is_turned).count();
    if n_turned > 0 {
        say!("{n_turned} photographs are turned upright, as their metadata ask");
    }
    Ok(Some(done.into_iter().map(|(taken, _)| taken).collect()))
}

/// Puts one photograph there; returns its name and whether it was turned, or `None` where it was stopped.
fn put(photograph: &Photograph, images: &Path, work: Work<'_>) -> Result<Option<(String, bool)>> {
    let Photograph { path, name, treatment } = photograph;
    let to = images.join(name);
    let damaged = || format!("`{}` cannot be read as a photograph; copy it again, or take it out", shown(path));
    if *treatment == Treatment::Copied {
        let bytes = fs::read(path).with_context(|| format!("could not read {}", path.display()))?;
        let Some(turned) = upright(&bytes).with_context(damaged)? else {
            keep(&to, &bytes)?;
            return Ok(Some((name.clone(), false)));
        };
        // Another name may be that of another photograph.
        let is_named = turned.is_jpeg || extension(name) == "png";
        let name = if is_named { name.clone() } else { format!("{name}.png") };
        keep(&images.join(&name), &turned.bytes)?;
        return Ok(Some((name, true)));
    }
    if !is_converted(photograph, &to, work)? {
        return Ok(None);
    }
    // Pixels of HEIC are turned as they are decoded; old versions leave the tag of the photograph in the JPEG all the same.
    let bytes = fs::read(&to).with_context(damaged)?;
    if let Some(turned) = untagged(&bytes).with_context(damaged)? {
        keep(&to, &turned)?;
    }
    Ok(Some((name.clone(), false)))
}

/// Converts a photograph to JPEG; `false` where it was stopped.
fn is_converted(photograph: &Photograph, to: &Path, work: Work<'_>) -> Result<bool> {
    let heif = [HEIF_CONVERT, HEIF_DEC].into_iter().find(|program| program.is_there());
    let command = match heif {
        Some(program) => {
            let mut command = program.command();
            command.args(["-q", &JPEG_QUALITY.to_string()]).arg(&photograph.path).arg(to);
            command
        }
        None if photograph.treatment == Treatment::Avif => {
            let mut command = FFMPEG.command();
            command.args(["-nostdin", "-v", "error", "-y", "-i"]).arg(super::film::path_argument(&photograph.path));
            command.args(["-frames:v", "1", "-q:v", "2", "-update", "1"]).arg(super::film::path_argument(to));
            command
        }
        None => return Err(HEIF_CONVERT.is_missing()),
    };
    match work.run(command, |_| {})? {
        Ended::Stopped => Ok(false),
        Ended::Well if FileKind::of_file(to).ok().flatten() == Some(FileKind::Jpeg) => Ok(true),
        _ => bail!(
            "`{}` could not be converted; the reason is in {}; copy the photograph again, or take it out",
            shown(&photograph.path),
            work.log.path().display()
        ),
    }
}

struct Upright {
    bytes: Vec<u8>,
    is_jpeg: bool,
}

/// The photograph turned as its metadata ask, and none of that in them; `None` where they ask for nothing.
fn upright(bytes: &[u8]) -> Result<Option<Upright>> {
    let (mut decoder, is_jpeg) = decoder(bytes)?;
    let orientation = decoder.orientation()?;
    if orientation == Orientation::NoTransforms {
        return Ok(None);
    }
    // The focal length in it is what COLMAP begins with.
    let exif = decoder.exif_metadata()?;
    let mut picture = DynamicImage::from_decoder(decoder)?;
    picture.apply_orientation(orientation);
    let bytes = if is_jpeg { jpeg(&picture, exif)? } else { png(&picture)? };
    Ok(Some(Upright { bytes, is_jpeg }))
}

/// A JPEG whose pixels are upright already, without a tag that asks to turn them; `None` where it has none.
fn untagged(bytes: &[u8]) -> Result<Option<Vec<u8>>> {
    let (mut decoder, _) = decoder(bytes)?;
    if decoder.orientation()? == Orientation::NoTransforms {
        return Ok(None);
    }
    let exif = decoder.exif_metadata()?;
    Ok(Some(jpeg(&DynamicImage::from_decoder(decoder)?, exif)?))
}

fn decoder(bytes: &[u8]) -> Result<(impl image::ImageDecoder + '_, bool)> {
    let reader = ImageReader::new(std::io::Cursor::new(bytes)).with_guessed_format()?;
    let is_jpeg = reader.format() == Some(image::ImageFormat::Jpeg);
    Ok((reader.into_decoder()?, is_jpeg))
}

fn jpeg(picture: &DynamicImage, exif: Option<Vec<u8>>) -> Result<Vec<u8>> {
    let rgb = picture.to_rgb8();
    let mut bytes = Vec::new();
    let mut encoder = image::codecs::jpeg::JpegEncoder::new_with_quality(&mut bytes, JPEG_QUALITY);
    if let Some(mut exif) = exif {
        // Where the tag cannot be taken out, neither can the rest stay.
        if Orientation::remove_from_exif_chunk(&mut exif).is_some() {
            encoder.set_exif_metadata(exif).map_err(|error| anyhow!("{error}"))?;
        }
    }
    encoder.write_image(rgb.as_raw(), rgb.width(), rgb.height(), image::ExtendedColorType::Rgb8)?;
    Ok(bytes)
}

fn png(picture: &DynamicImage) -> Result<Vec<u8>> {
    let mut bytes = std::io::Cursor::new(Vec::new());
    picture.write_to(&mut bytes, image::ImageFormat::Png)?;
    Ok(bytes.into_inner())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// EXIF with an orientation and a focal length of 26 mm on 35 mm film.
    fn exif(orientation: u8) -> Vec<u8> {
        let mut bytes = b"II*\0\x08\0\0\0\x02\0".to_vec();
        bytes.extend([0x12, 1, 3, 0, 1, 0, 0, 0, orientation, 0, 0, 0]);
        bytes.extend([0x05, 0xa4, 3, 0, 1, 0, 0, 0, 26, 0, 0, 0]);
        bytes.extend([0; 4]);
        bytes
    }

    /// Left half dark, right half bright.
    fn photograph(orientation: u8) -> Vec<u8> {
        let picture = image::RgbImage::from_fn(32, 16, |x, _| image::Rgb([if x < 16 { 20 } else { 220 }; 3]));
        let mut bytes = Vec::new();
        let mut encoder = image::codecs::jpeg::JpegEncoder::new_with_quality(&mut bytes, 95);
        encoder.set_exif_metadata(exif(orientation)).unwrap();
        encoder.write_image(picture.as_raw(), 32, 16, image::ExtendedColorType::Rgb8).unwrap();
        bytes
    }

    #[test]
    fn a_photograph_on_its_side_is_stored_upright_and_keeps_its_focal_length() {
        assert!(upright(&photograph(1)).unwrap().is_none());
        // 6: the first row is the right side, so a quarter turn clockwise shows it upright.
        let turned = upright(&photograph(6)).unwrap().unwrap();
        assert!(turned.is_jpeg);
        let picture = image::load_from_memory(&turned.bytes).unwrap().into_rgb8();
        assert_eq!(picture.dimensions(), (16, 32));
        assert!(picture.get_pixel(8, 4).0[0] < 60 && picture.get_pixel(8, 28).0[0] > 180);
        let (mut decoder, _) = decoder(&turned.bytes).unwrap();
        assert_eq!(decoder.orientation().unwrap(), Orientation::NoTransforms);
        let kept = decoder.exif_metadata().unwrap().unwrap();
        assert_eq!(kept, exif(1), "all but the tag");
        // As libheif leaves it: turned already.
        let pixels = image::load_from_memory(&untagged(&photograph(6)).unwrap().unwrap()).unwrap();
        assert_eq!((pixels.width(), pixels.height()), (32, 16));
    }

    #[test]
    fn photographs_of_telephones_are_converted() {
        let home = tempfile::tempdir().unwrap();
        let picture = home.path().join("picture.png");
        image::RgbImage::from_fn(64, 48, |x, y| image::Rgb([4 * x as u8, 5 * y as u8, 99])).save(&picture).unwrap();
        let log = super::super::log::Log::open(&home.path().join("poses.log")).unwrap();
        let stop = std::sync::atomic::AtomicBool::new(false);
        for (ending, treatment) in [("heic", Treatment::Heif), ("avif", Treatment::Avif)] {
            let path = home.path().join("photograph").with_extension(ending);
            let mut encoder = std::process::Command::new("heif-enc");
            if ending == "avif" {
                encoder.arg("--avif");
            }
            let made = encoder.args(["-q", "90"]).arg(&picture).arg("-o").arg(&path).output();
            if !made.is_ok_and(|made| made.status.success()) {
                assert!(std::env::var_os("POCKETSPLAT_NEEDS_COLMAP").is_none(), "no heif-enc makes {ending}");
                say!("SKIPPED: there is no heif-enc that makes {ending}; `apt-get install libheif-examples`");
                continue;
            }
            let photograph = Photograph { path, name: format!("{ending}.jpg"), treatment };
            let given = [photograph.clone(), photograph.clone(), photograph];
            let refused = |n: usize, in_place| check(&given[..n], in_place, home.path()).unwrap_err().to_string();
            assert!(refused(2, false).contains("there are 2 photographs, needed: at least 3"));
            assert!(refused(3, true).contains("has to be converted") && refused(3, true).contains("-capture"));
            let work = Work { log: &log, stop: &stop };
            let (name, is_turned) = put(&given[0], home.path(), work).unwrap().unwrap();
            assert_eq!((name.as_str(), is_turned), (format!("{ending}.jpg").as_str(), false));
            let found = image::open(home.path().join(name)).unwrap().into_rgb8();
            let [r, g, b] = found.get_pixel(32, 24).0;
            assert!(r.abs_diff(128) < 12 && g.abs_diff(120) < 12 && b.abs_diff(99) < 12, "{r} {g} {b}");
        }
    }
}
