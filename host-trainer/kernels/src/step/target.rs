//! The photograph that a step compares with.

use std::sync::OnceLock;

use pocketsplat_capture::dataset::Image;
use rayon::prelude::*;

use super::Exposure;
use crate::ops::Pinhole;
use crate::ops::loss::l1::BLOCK;
use crate::real::Real;

/// A photograph, the camera that took it, and where it shows the scene.
#[derive(Clone, Debug)]
pub struct TargetView<'a, R> {
    /// The camera that took it.
    pub camera: &'a Pinhole<R>,
    /// `[height, width]` pixels that count; all of them without a mask.
    pub mask: Option<&'a [bool]>,
    /// What lies behind everything.
    pub background: [R; 3],
    /// The number of the photograph in its capture, by which a device knows it again.
    pub index: Option<usize>,
    /// How it was exposed, where that counts.
    pub exposure: Option<Exposure<R>>,
    photograph: Option<&'a Image>,
    truth: OnceLock<Vec<R>>,
}

impl<'a, R: Real> TargetView<'a, R> {
    /// * `truth`: planes `[3, height, width]`, 0 to 1; pixels that do not count become 0, as they do in what is drawn.
    pub fn new(camera: &'a Pinhole<R>, mut truth: Vec<R>, mask: Option<&'a [bool]>, background: [R; 3]) -> Self {
        clear_masked(&mut truth, mask);
        Self { camera, mask, background, index: None, exposure: None, photograph: None, truth: truth.into() }
    }

    /// The same of a photograph, whose planes are made when they are asked for: a device that has it does not.
    pub fn of_photograph(
        camera: &'a Pinhole<R>,
        photograph: &'a Image,
        mask: Option<&'a [bool]>,
        background: [R; 3],
    ) -> Self {
        Self {
            camera,
            mask,
            background,
            index: None,
            exposure: None,
            photograph: Some(photograph),
            truth: OnceLock::new(),
        }
    }

    /// The same, of this number in its capture.
    #[must_use]
    pub fn numbered(self, index: usize) -> Self {
        Self { index: Some(index), ..self }
    }

    /// The same, exposed like this.
    #[must_use]
    pub fn exposed(self, exposure: Option<Exposure<R>>) -> Self {
        Self { exposure, ..self }
    }

    /// Planes `[3, height, width]`, 0 to 1; 0 where pixels do not count.
    pub fn truth(&self) -> &[R] {
        self.truth.get_or_init(|| {
            let mut truth = self.photograph.map(planes).unwrap_or_default();
            clear_masked(&mut truth, self.mask);
            truth
        })
    }

    /// Σ over pixels and channels of the squared difference to `image`, planes that are 0 where pixels do not count.
    pub fn squared_sum(&self, image: &[R]) -> f64 {
        let blocks = image.par_chunks(BLOCK).zip(self.truth().par_chunks(BLOCK));
        let squares = |(a, b): (&[R], &[R])| a.iter().zip(b).map(|(x, y)| ((*x - *y) * (*x - *y)).into()).sum::<f64>();
        blocks.map(squares).collect::<Vec<_>>().into_iter().sum()
    }

    /// Pixels that count, at least 1.
    pub fn n_counted(&self) -> usize {
        self.mask
            .map_or(self.camera.size_px.iter().product(), |mask| mask.iter().filter(|valid| **valid).count())
            .max(1)
    }
}

/// Makes the pixels that do not count zero in every plane: as in the photograph, so that no loss sees them.
pub fn clear_masked<R: Real>(planes: &mut [R], mask: Option<&[bool]>) {
    let Some(mask) = mask else { return };
    for plane in planes.chunks_exact_mut(mask.len()) {
        for (value, valid) in plane.iter_mut().zip(mask) {
            *value = if *valid { *value } else { R::ZERO };
        }
    }
}

/// Planes `[3, height, width]` of an image, 0 to 1, rounded to f32 in every number type.
pub fn planes<R: Real>(image: &Image) -> Vec<R> {
    let n = (image.width_px * image.height_px) as usize;
    let of_byte: [R; 256] = std::array::from_fn(|byte| R::real((byte as f32 / 255.0).into()));
    let mut planes = vec![R::ZERO; 3 * n];
    for (channel, plane) in planes.chunks_exact_mut(n).enumerate() {
        plane.par_chunks_mut(BLOCK).zip(image.rgb.par_chunks(3 * BLOCK)).for_each(|(plane, rgb)| {
            for (out, rgb) in plane.iter_mut().zip(rgb.chunks_exact(3)) {
                *out = of_byte[usize::from(rgb[channel])];
            }
        });
    }
    planes
}

/// The 8-bit image of planes `[3, height, width]`, values beyond 0 to 1 cut off.
pub fn image_of_planes(planes: &[f32], size_px: [usize; 2]) -> Image {
    let [width_px, height_px] = size_px.map(|side| u32::try_from(side).expect("the size of an image"));
    let n = planes.len() / 3;
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped to 0..=1")]
    let byte = |v: f32| (v.clamp(0.0, 1.0) * 255.0 + 0.5) as u8;
    let rgb = (0..n).flat_map(|i| [byte(planes[i]), byte(planes[n + i]), byte(planes[2 * n + i])]).collect();
    Image { width_px, height_px, rgb }
}
