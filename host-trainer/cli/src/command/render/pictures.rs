//! Pictures as files: one picture, a numbered sequence, an animation, a contact sheet.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use image::codecs::gif::{GifEncoder, Repeat};
use image::{Delay, Frame, RgbImage};
use pocketsplat_capture::dataset::Image;
use pocketsplat_files::{Output, Outputs};

use super::super::outputs::{GIF, JPEG, PNG, command_that_makes, marked_jpeg, marked_png};
use crate::say::say;

/// Pictures of an animation a second.
const FRAMES_PER_S: u16 = 15;
/// Most pixels of a side of a contact sheet.
const SHEET_PX: u32 = 2400;
/// Between the pictures of a contact sheet.
const GAP_PX: u32 = 4;
/// 1 to 30: higher is faster and has worse colours.
const GIF_SPEED: i32 = 10;

/// What pictures become, by the name of the file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Format {
    Png,
    Jpeg,
    Gif,
    Apng,
    /// A folder of numbered PNGs.
    Folder,
}

impl Format {
    /// * `source`: what is drawn.
    pub(super) fn of(path: &Path, source: &Path) -> Result<Self> {
        let Some(extension) = path.extension() else { return Ok(Self::Folder) };
        match extension.to_string_lossy().to_ascii_lowercase().as_str() {
            "png" => Ok(Self::Png),
            "jpg" | "jpeg" => Ok(Self::Jpeg),
            "gif" => Ok(Self::Gif),
            "apng" => Ok(Self::Apng),
            _ => {
                let command = command_that_makes(path, source);
                let command = command.map_or_else(String::new, |command| format!("; `{command}` makes such a file"));
                bail!(
                    "{}: a picture is a .png or .jpg, several are a .gif, an .apng or a folder (a name without a dot){command}",
                    path.display()
                )
            }
        }
    }

    /// Fails, before anything is drawn, where so many pictures are no such file.
    pub(super) fn check(self, n_pictures: usize, as_sheet: bool, path: &Path) -> Result<()> {
        let path = path.display();
        match (self, as_sheet, n_pictures) {
            (Self::Png | Self::Jpeg, true, _) | (Self::Png | Self::Jpeg, false, ..=1) => Ok(()),
            (_, true, _) => bail!("{path}: a contact sheet is a .png or a .jpg; end the name in one of these"),
            (Self::Png | Self::Jpeg, ..) => bail!(
                "{path}: {n_pictures} pictures do not go into one; name a .gif, an .apng or a folder, or add --contact-sheet"
            ),
            (Self::Gif | Self::Apng | Self::Folder, _, ..=1) => {
                bail!("{path}: one picture is a .png or a .jpg; end the name in one of these")
            }
            _ => Ok(()),
        }
    }
}

/// Where pictures go: a file, or numbered ones in a folder.
pub(super) enum Target {
    File(Output, Format),
    /// Which of them there will be is known when they are drawn.
    Folder(PathBuf, Outputs),
}

impl Target {
    /// Checks that pictures can be written to `path`.
    pub(super) fn checked(path: &Path, format: Format, outputs: &mut Outputs) -> Result<Self> {
        let content = match format {
            Format::Png | Format::Apng => PNG,
            Format::Jpeg => JPEG,
            Format::Gif => GIF,
            Format::Folder => {
                Outputs::folder(path)?;
                // At once where somebody's pictures are numbered alike.
                outputs.clone().file(&numbered(path, 0), PNG)?;
                return Ok(Self::Folder(path.to_owned(), outputs.clone()));
            }
        };
        Ok(Self::File(outputs.file(path, content)?, format))
    }

    /// Writes all pictures, on one sheet with `as_sheet`; the format must [take them](Format::check).
    pub(super) fn write(self, pictures: &[Image], as_sheet: bool) -> Result<()> {
        if as_sheet {
            return self.write(&[contact_sheet(pictures)], false);
        }
        let (output, format) = match self {
            Self::File(output, format) => (output, format),
            Self::Folder(folder, outputs) => return write_numbered(pictures, &folder, outputs),
        };
        let one = || pictures.first().context("there is no view to draw");
        let bytes = match format {
            Format::Png => one()?.to_png().map(|png| marked_png(&png)).map_err(anyhow::Error::from),
            Format::Jpeg => one()?.to_jpeg().map(|jpeg| marked_jpeg(&jpeg)).map_err(anyhow::Error::from),
            Format::Gif => gif(pictures),
            Format::Apng | Format::Folder => apng(pictures).map(|png| marked_png(&png)),
        };
        Ok(output.write(&bytes.with_context(|| format!("could not write {}", output.path().display()))?)?)
    }
}

fn numbered(folder: &Path, i: usize) -> PathBuf {
    folder.join(format!("{i:04}.png"))
}

/// All are checked before the first is written.
fn write_numbered(pictures: &[Image], folder: &Path, mut outputs: Outputs) -> Result<()> {
    let checked = (0..pictures.len()).map(|i| outputs.file(&numbered(folder, i), PNG));
    let checked = checked.collect::<Result<Vec<_>, _>>()?;
    for (output, picture) in checked.iter().zip(pictures) {
        let png = picture.to_png().with_context(|| format!("could not write {}", output.path().display()))?;
        output.write(&marked_png(&png))?;
    }
    let n = pictures.len();
    let n_older = (n..).take_while(|&i| numbered(folder, i).exists()).count();
    if n_older > 0 {
        say!(
            "warning: {} also holds {n_older} numbered pictures that are not of this command, from {} on; remove them if you do not want them",
            folder.display(),
            numbered(Path::new(""), n).display()
        );
    }
    Ok(())
}

/// Fails where they are not all of one size, which an animation asks for.
fn size_of_all(pictures: &[Image]) -> Result<[u32; 2]> {
    let size = |picture: &Image| [picture.width_px, picture.height_px];
    let first = pictures.first().map_or([1, 1], size);
    match pictures.iter().position(|picture| size(picture) != first) {
        Some(i) => {
            let ([w, h], [w0, h0]) = (size(&pictures[i]), first);
            bail!("picture {i} has {w}×{h} px and the first {w0}×{h0}; an animation has one size, a folder takes all")
        }
        None => Ok(first),
    }
}

fn gif(pictures: &[Image]) -> Result<Vec<u8>> {
    size_of_all(pictures)?;
    let mut bytes = Vec::new();
    let mut encoder = GifEncoder::new_with_speed(&mut bytes, GIF_SPEED);
    encoder.set_repeat(Repeat::Infinite)?;
    let delay = Delay::from_numer_denom_ms(1000, FRAMES_PER_S.into());
    for picture in pictures {
        let rgb = RgbImage::from_raw(picture.width_px, picture.height_px, picture.rgb.clone());
        let rgb = rgb.context("an image has three bytes a pixel")?;
        let rgba = image::DynamicImage::ImageRgb8(rgb).into_rgba8();
        encoder.encode_frame(Frame::from_parts(rgba, 0, 0, delay))?;
    }
    drop(encoder);
    Ok(bytes)
}

fn apng(pictures: &[Image]) -> Result<Vec<u8>> {
    let [width_px, height_px] = size_of_all(pictures)?;
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, width_px, height_px);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_animated(u32::try_from(pictures.len())?, 0)?;
    encoder.set_frame_delay(1, FRAMES_PER_S)?;
    let mut writer = encoder.write_header()?;
    pictures.iter().try_for_each(|picture| writer.write_image_data(&picture.rgb))?;
    writer.finish()?;
    Ok(bytes)
}

/// All pictures in rows on white, about as wide as high; reduced where the sheet would be larger than [`SHEET_PX`].
fn contact_sheet(pictures: &[Image]) -> Image {
    let cell = |side: fn(&Image) -> u32| pictures.iter().map(side).max().unwrap_or(1);
    let [width, height] = [cell(|picture| picture.width_px), cell(|picture| picture.height_px)];
    let n = pictures.len() as f64;
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "at least 1 and at most the pictures")]
    let n_columns = (n * f64::from(height) / f64::from(width)).sqrt().ceil().clamp(1.0, n.max(1.0)) as u32;
    let n_rows = u32::try_from(pictures.len()).unwrap_or(u32::MAX).div_ceil(n_columns).max(1);
    let fitting = |n_cells: u32, px: u32| f64::from((SHEET_PX / n_cells).saturating_sub(GAP_PX).max(1)) / f64::from(px);
    let scale = fitting(n_columns, width).min(fitting(n_rows, height)).min(1.0);
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a share of a side that fits")]
    let reduced = |px: u32| ((f64::from(px) * scale) as u32).max(1);
    let step = [reduced(width) + GAP_PX, reduced(height) + GAP_PX];
    let (width_px, height_px) = (n_columns * step[0] + GAP_PX, n_rows * step[1] + GAP_PX);
    let mut sheet = Image { width_px, height_px, rgb: vec![255; 3 * width_px as usize * height_px as usize] };
    for (i, picture) in (0u32..).zip(pictures) {
        let small = picture.area_resized(reduced(picture.width_px), reduced(picture.height_px));
        let corner = [GAP_PX + i % n_columns * step[0], GAP_PX + i / n_columns * step[1]];
        for (y, row) in (0u32..).zip(small.rgb.chunks_exact(3 * small.width_px as usize)) {
            let start = 3 * ((corner[1] + y) as usize * width_px as usize + corner[0] as usize);
            sheet.rgb[start..start + row.len()].copy_from_slice(row);
        }
    }
    sheet
}

#[cfg(test)]
mod tests {
    use std::io::Cursor;

    use image::AnimationDecoder as _;

    use super::*;

    fn plain(width_px: u32, height_px: u32, rgb: [u8; 3]) -> Image {
        Image { width_px, height_px, rgb: rgb.repeat((width_px * height_px) as usize) }
    }

    #[test]
    fn an_animation_has_every_picture_in_its_order() {
        let pictures = [plain(6, 4, [200, 0, 0]), plain(6, 4, [0, 200, 0]), plain(6, 4, [0, 0, 200])];
        let of = |frames: Vec<Frame>| -> Vec<[u8; 3]> {
            frames.iter().map(|frame| frame.buffer().get_pixel(3, 2).0).map(|[r, g, b, _]| [r, g, b]).collect()
        };
        let expected = pictures.each_ref().map(|picture| [picture.rgb[0], picture.rgb[1], picture.rgb[2]]);
        let decoder = image::codecs::gif::GifDecoder::new(Cursor::new(gif(&pictures).unwrap())).unwrap();
        assert_eq!(of(decoder.into_frames().collect_frames().unwrap()), expected);
        let decoder = image::codecs::png::PngDecoder::new(Cursor::new(apng(&pictures).unwrap())).unwrap();
        assert_eq!(of(decoder.apng().unwrap().into_frames().collect_frames().unwrap()), expected);
        let error = apng(&[pictures[0].clone(), plain(4, 6, [0; 3])]).unwrap_err().to_string();
        assert!(error.contains("picture 1 has 4×6 px and the first 6×4"), "{error}");
    }

    #[test]
    fn a_contact_sheet_shows_every_picture_whole() {
        let pictures: Vec<Image> = (0..7).map(|i| plain(6, 4, [i, 0, 0])).collect();
        let sheet = contact_sheet(&pictures);
        let n_of = |value: u8| sheet.rgb.chunks(3).filter(|pixel| **pixel == [value, 0, 0]).count();
        assert!((0..7).all(|i| n_of(i) == 24), "24 pixels each");
        let large = contact_sheet(&vec![plain(1000, 500, [9; 3]); 30]);
        assert!(large.width_px <= SHEET_PX + GAP_PX && large.height_px <= SHEET_PX + GAP_PX);
        assert_eq!(contact_sheet(&[plain(3, 3, [1; 3])]).width_px, 3 + 2 * GAP_PX);
    }

    #[test]
    fn the_name_of_the_file_decides_the_format() {
        let of = |name: &str| Format::of(Path::new(name), Path::new("a.psb")).ok();
        assert_eq!(of("a.PNG"), Some(Format::Png));
        assert_eq!(
            (of("a.jpeg"), of("a.gif"), of("a.apng")),
            (Some(Format::Jpeg), Some(Format::Gif), Some(Format::Apng))
        );
        assert_eq!((of("frames"), of("a.bmp")), (Some(Format::Folder), None));
        let fits = |name: &str, n, as_sheet| {
            Format::of(Path::new(name), Path::new("a.psb")).unwrap().check(n, as_sheet, Path::new(name)).is_ok()
        };
        assert_eq!([1, 2].map(|n| fits("a.png", n, false)), [true, false]);
        assert_eq!([1, 2].map(|n| fits("a.gif", n, false)), [false, true]);
        assert_eq!(["a.jpg", "a.gif", "frames"].map(|name| fits(name, 9, true)), [true, false, false]);
    }
}
