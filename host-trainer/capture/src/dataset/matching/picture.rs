//! What is matched: a photograph's brightness at several sizes, and small patches of it.

use glam::Vec2;

use crate::camera::Camera;
use crate::dataset::Photograph;

/// A patch reaches this many pixels to either side of its middle.
const HALF: f32 = 3.0;
/// The coarsest size has at most so many pixels on its larger side: there a search of the whole ray is cheap.
const COARSEST_PX: usize = 200;
/// Patches whose brightness varies less than this (standard deviation, of 255) look like any other.
const LEAST_CONTRAST: f32 = 1.5;

/// A photograph's brightness at one size; 0 where a pixel does not count, else 1 to 255.
pub(super) struct Level {
    pub(super) width_px: usize,
    pub(super) height_px: usize,
    pub(super) grey: Vec<u8>,
}

/// A photograph's brightness at every size, each half of the one before, and its camera at the first.
pub(super) struct Picture {
    pub(super) camera: Camera,
    pub(super) levels: Vec<Level>,
}

/// Brightness less its mean, of length 1: the product of two is their normalised cross-correlation, which exposure does not change.
///
/// `N` rows of as many values, evenly over the same square: fewer are faster and find what is to be looked at with more.
pub(super) struct Patch<const N: usize>([[f32; N]; N]);

/// Where a patch lies in an image: its middle, and how far its next column and next row are from there, pixels.
#[derive(Clone, Copy)]
pub(super) struct Window {
    pub(super) middle: Vec2,
    pub(super) column: Vec2,
    pub(super) row: Vec2,
}

impl Picture {
    /// * `camera`: for the photograph's size.
    /// * `nothing`: the colour of pixels that show nothing, where there are such.
    pub(super) fn new(photograph: &Photograph, camera: Camera, nothing: Option<[u8; 3]>) -> Self {
        let image = &photograph.image;
        let counted = |i: usize, rgb: &[u8]| {
            photograph.mask.as_ref().is_none_or(|mask| mask.valid[i]) && nothing.is_none_or(|colour| rgb != colour)
        };
        let brightness = |rgb: &[u8]| {
            let [r, g, b] = [rgb[0], rgb[1], rgb[2]].map(u32::from);
            // Rec. 601.
            u8::try_from((299 * r + 587 * g + 114 * b) / 1000).unwrap_or(255).max(1)
        };
        let pixels = image.rgb.chunks_exact(3).enumerate();
        let grey = pixels.map(|(i, rgb)| if counted(i, rgb) { brightness(rgb) } else { 0 }).collect();
        let mut levels = vec![Level { width_px: image.width_px as usize, height_px: image.height_px as usize, grey }];
        while let Some(last) = levels.last()
            && last.width_px.max(last.height_px) > COARSEST_PX
        {
            levels.push(last.halved());
        }
        Self { camera, levels }
    }
}

impl Level {
    fn halved(&self) -> Self {
        let (width_px, height_px) = ((self.width_px / 2).max(1), (self.height_px / 2).max(1));
        let pixel = |x: usize, y: usize| {
            let at = |dx: usize, dy: usize| {
                let (x, y) = ((2 * x + dx).min(self.width_px - 1), (2 * y + dy).min(self.height_px - 1));
                u32::from(self.grey[y * self.width_px + x])
            };
            let four = [at(0, 0), at(1, 0), at(0, 1), at(1, 1)];
            if four.contains(&0) { 0 } else { u8::try_from((four.iter().sum::<u32>() + 2) / 4).unwrap_or(255) }
        };
        let grey = (0..height_px).flat_map(|y| (0..width_px).map(move |x| (x, y))).map(|(x, y)| pixel(x, y)).collect();
        Self { width_px, height_px, grey }
    }

    /// The patch in a window, read bilinearly; `None` where it leaves the image, touches a pixel that does not count, or is flat.
    pub(super) fn patch<const N: usize>(&self, window: &Window) -> Option<Patch<N>> {
        // Pixel (i, j) has its centre at (i + ½, j + ½).
        let middle = window.middle - 0.5;
        let reach = HALF * (window.column.abs() + window.row.abs());
        let (low, high) = (middle - reach, middle + reach);
        let inside =
            low.min_element() >= 0.0 && high.x < self.width_px as f32 - 1.0 && high.y < self.height_px as f32 - 1.0;
        if !inside {
            return None;
        }
        let stride = 2.0 * HALF / (N as f32 - 1.0);
        let (column, row) = (stride * window.column, stride * window.row);
        let first = middle - HALF * (window.column + window.row);
        let mut values = [[0.0_f32; N]; N];
        let mut counts = true;
        let (mut sum, mut squares) = (0.0, 0.0);
        for (j, values) in values.iter_mut().enumerate() {
            let start = first + j as f32 * row;
            for (i, value) in values.iter_mut().enumerate() {
                let at = start + i as f32 * column;
                #[expect(clippy::cast_possible_truncation, reason = "within the image")]
                let (x, y) = (at.x as i32, at.y as i32);
                let (fx, fy) = (at.x - x as f32, at.y - y as f32);
                #[expect(clippy::cast_sign_loss, reason = "within the image")]
                let index = y as usize * self.width_px + x as usize;
                let [Some(&[a, b]), Some(&[c, d])] =
                    [index, index + self.width_px].map(|i| self.grey.get(i..).and_then(<[u8]>::first_chunk))
                else {
                    return None;
                };
                counts &= a != 0 && b != 0 && c != 0 && d != 0;
                let [a, b, c, d] = [a, b, c, d].map(f32::from);
                let (top, bottom) = (a + fx * (b - a), c + fx * (d - c));
                *value = top + fy * (bottom - top);
                sum += *value;
                squares += *value * *value;
            }
        }
        let n = (N * N) as f32;
        let mean = sum / n;
        let squares = squares - sum * mean;
        if !counts || squares < n * LEAST_CONTRAST * LEAST_CONTRAST {
            return None;
        }
        let scale = squares.sqrt().recip();
        Some(Patch(values.map(|row| row.map(|value| (value - mean) * scale))))
    }
}

impl<const N: usize> Patch<N> {
    /// Normalised cross-correlation, −1 to 1.
    pub(super) fn likeness(&self, other: &Self) -> f32 {
        self.0.as_flattened().iter().zip(other.0.as_flattened()).map(|(a, b)| a * b).sum()
    }
}
