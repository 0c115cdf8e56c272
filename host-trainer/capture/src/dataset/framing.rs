//! At which size an image is loaded, and which part of it.

use super::{FrameSize, Image, LoadOptions, Mask};
use crate::camera::Camera;

/// How an image becomes a view: reduced by area, then cut.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Framing {
    /// Width and height after the reduction, pixels.
    scaled_px: (u32, u32),
    /// First column and row that are kept.
    corner_px: (u32, u32),
    /// Width and height of what is kept, pixels.
    pub(super) size_px: (u32, u32),
}

impl Framing {
    /// The framing of an image of `source_px` pixels; `None` when it is smaller than the frame asked for, because nothing is
    /// enlarged.
    ///
    /// For a frame w × h an image W × H is scaled by max(w/W, h/H), so that it just covers the frame, and its middle is kept.
    pub(super) fn of(source_px: (u32, u32), options: &LoadOptions) -> Option<Self> {
        if let Some(FrameSize { width_px, height_px }) = options.frame {
            // The larger of the two scales decides.
            let (numerator, denominator) = if scaled(source_px.1, width_px, source_px.0) >= height_px {
                (width_px, source_px.0)
            } else {
                (height_px, source_px.1)
            };
            let scaled_px = (
                scaled(source_px.0, numerator, denominator).max(width_px),
                scaled(source_px.1, numerator, denominator).max(height_px),
            );
            let corner_px = ((scaled_px.0 - width_px) / 2, (scaled_px.1 - height_px) / 2);
            return (numerator <= denominator).then_some(Self { scaled_px, corner_px, size_px: (width_px, height_px) });
        }
        let largest_px = source_px.0.max(source_px.1);
        let size_px = match options.max_resolution {
            Some(limit_px) if limit_px < largest_px => {
                let reduced = |side_px| scaled(side_px, limit_px, largest_px).max(1);
                (reduced(source_px.0), reduced(source_px.1))
            }
            _ => source_px,
        };
        Some(Self { scaled_px: size_px, corner_px: (0, 0), size_px })
    }

    /// The image as it is loaded.
    pub(super) fn image(&self, image: &Image) -> Image {
        let scaled = image.area_resized(self.scaled_px.0, self.scaled_px.1);
        Image { width_px: self.size_px.0, height_px: self.size_px.1, rgb: self.kept(&scaled.rgb, 3) }
    }

    /// Its mask, of the same size as it was.
    pub(super) fn mask(&self, mask: &Mask) -> Mask {
        let scaled = mask.area_resized(self.scaled_px.0, self.scaled_px.1);
        Mask { width_px: self.size_px.0, height_px: self.size_px.1, valid: self.kept(&scaled.valid, 1) }
    }

    /// Its camera.
    pub(super) fn camera(&self, camera: &Camera) -> Camera {
        let scaled = camera.resized(self.scaled_px.0, self.scaled_px.1);
        let [cx, cy] = scaled.principal_px;
        Camera {
            principal_px: [cx - f64::from(self.corner_px.0), cy - f64::from(self.corner_px.1)],
            width_px: self.size_px.0,
            height_px: self.size_px.1,
            ..scaled
        }
    }

    /// The values of the pixels that are kept, of `n` each.
    fn kept<T: Copy>(&self, values: &[T], n: usize) -> Vec<T> {
        let [(stride, _), (x, y), (width, height)] =
            [self.scaled_px, self.corner_px, self.size_px].map(|(a, b)| (a as usize, b as usize));
        let rows = values.chunks_exact(stride * n).skip(y).take(height);
        rows.flat_map(|row| row[x * n..(x + width) * n].iter().copied()).collect()
    }
}

/// side · numerator / denominator, rounded to the nearest; halves up.
fn scaled(side_px: u32, numerator: u32, denominator: u32) -> u32 {
    let [side, numerator, denominator] = [side_px, numerator, denominator].map(u64::from);
    u32::try_from((2 * side * numerator + denominator) / (2 * denominator)).unwrap_or(u32::MAX)
}

#[cfg(test)]
mod tests {
    use glam::{DMat3, DVec3};

    use super::*;
    use crate::dataset::NoFrameSize;

    fn limited(limit_px: u32, source_px: (u32, u32)) -> (u32, u32) {
        let options = LoadOptions { max_resolution: Some(limit_px), ..LoadOptions::default() };
        Framing::of(source_px, &options).expect("a limit fits every image").size_px
    }

    fn framed(frame: &str, source_px: (u32, u32)) -> Option<Framing> {
        let frame = Some(frame.parse().expect("a size"));
        Framing::of(source_px, &LoadOptions { frame, ..LoadOptions::default() })
    }

    #[test]
    fn the_larger_side_becomes_the_limit_and_none_is_enlarged() {
        assert_eq!(limited(400, (800, 800)), (400, 400));
        assert_eq!(limited(400, (540, 960)), (225, 400));
        assert_eq!(limited(400, (400, 20)), (400, 20));
        assert_eq!(limited(400, (10_000, 3)), (400, 1));
        let framing = Framing::of((801, 7), &LoadOptions::default()).expect("no limit");
        assert_eq!(framing.size_px, (801, 7));
    }

    #[test]
    fn a_frame_is_covered_and_the_middle_kept() {
        for (frame, source_px, scaled_px, corner_px) in [
            ("120x120", (800, 800), (120, 120), (0, 0)),
            ("160x120", (800, 600), (160, 120), (0, 0)),
            ("120x120", (800, 600), (160, 120), (20, 0)),
            ("160x120", (540, 960), (160, 284), (0, 82)),
            ("100x100", (101, 100), (101, 100), (0, 0)),
        ] {
            let framing = framed(frame, source_px).expect("large enough");
            assert_eq!((framing.scaled_px, framing.corner_px), (scaled_px, corner_px), "{source_px:?} in {frame}");
        }
        assert_eq!(framed("120x120", (800, 100)), None, "would be enlarged");
        assert_eq!(framed("120x120", (119, 200)), None, "would be enlarged");
    }

    #[test]
    fn a_frame_shows_what_its_camera_sees() {
        // Each pixel of a wide picture holds its own column; the camera says which direction that is.
        let source =
            Image { width_px: 64, height_px: 32, rgb: (0..64 * 32).flat_map(|i| [(i % 64) as u8; 3]).collect() };
        let camera = Camera {
            rotation: DMat3::IDENTITY,
            translation: DVec3::ZERO,
            focal_px: [50.0, 50.0],
            principal_px: [32.0, 16.0],
            width_px: 64,
            height_px: 32,
        };
        let framing = framed("16x16", (64, 32)).expect("large enough");
        let (image, seen) = (framing.image(&source), framing.camera(&camera));
        assert_eq!((image.width_px, image.height_px, seen.width_px, seen.height_px), (16, 16, 16, 16));
        for x in 0..16 {
            let direction = (f64::from(x) + 0.5 - seen.principal_px[0]) / seen.focal_px[0];
            // Pixel i has its centre at i + 0.5; the mean of two is rounded up to the larger.
            let column = direction * camera.focal_px[0] + camera.principal_px[0];
            assert_eq!(f64::from(image.rgb[3 * x as usize]), column.floor(), "column {x}");
        }
        let mask = Mask { width_px: 64, height_px: 32, valid: (0..64 * 32).map(|i| i % 64 >= 32).collect() };
        assert_eq!(framing.mask(&mask).valid[..16], [[false; 8], [true; 8]].concat(), "the middle of the mask");
    }

    #[test]
    fn frame_sizes_read_back() {
        assert_eq!("160x120".parse::<FrameSize>().map(|size| size.to_string()), Ok("160x120".to_owned()));
        for text in ["", "160", "x", "0x120", "160x-1", "160x120x3"] {
            assert_eq!(text.parse::<FrameSize>(), Err(NoFrameSize(text.to_owned())));
        }
    }
}
