//! The views that a run trains on.

use glam::{DMat3, DVec3};
use pocketsplat_capture::dataset::{Image, Mask, Photograph, View};
use pocketsplat_kernels::ops::Pinhole;
use pocketsplat_kernels::step::TargetView;
use rayon::prelude::*;

/// The training views of a capture, and which of them the scene learns from.
#[derive(Clone, Debug)]
pub struct TrainingViews<'a> {
    /// All of them, held out or not.
    pub all: &'a [View],
    /// Their cameras, as [`Self::move_camera`] left them.
    pub cameras: Vec<Pinhole<f32>>,
    /// Places in both of the views that are not held out.
    pub trained: Vec<u32>,
}

impl<'a> TrainingViews<'a> {
    /// Those of `all`, without the places for which `is_held_out`.
    pub fn new(all: &'a [View], is_held_out: impl Fn(usize) -> bool) -> Self {
        Self {
            all,
            cameras: all.iter().map(|view| Pinhole::new(&view.camera)).collect(),
            trained: (0u32..).take(all.len()).filter(|place| !is_held_out(*place as usize)).collect(),
        }
    }

    /// Moves the camera of a view by a [twist](Pinhole::moved) from where the capture has it.
    pub fn move_camera(&mut self, place: usize, twist: [f64; 6]) {
        self.cameras[place] = Pinhole::new(&self.all[place].camera).moved(twist);
    }

    /// All views, as their cameras were moved.
    pub fn moved(&self) -> Vec<View> {
        let moved = |(view, camera): (&View, &Pinhole<f32>)| {
            let mut view = view.clone();
            view.camera.rotation =
                DMat3::from_cols_array_2d(&camera.rotation.map(|row| row.map(f64::from))).transpose();
            view.camera.translation = DVec3::from_array(camera.translation.map(f64::from));
            view
        };
        self.all.iter().zip(&self.cameras).map(moved).collect()
    }

    /// The cameras of the views that are not held out.
    pub fn trained_cameras(&self) -> Vec<&Pinhole<f32>> {
        self.trained.iter().map(|view| &self.cameras[*view as usize]).collect()
    }
}

/// What a photograph asks of the scene.
pub fn target<'v>(photograph: &'v Photograph, camera: &'v Pinhole<f32>, background: [f32; 3]) -> TargetView<'v, f32> {
    let mask = photograph.mask.as_ref().map(|mask| mask.valid.as_slice());
    TargetView::of_photograph(camera, &photograph.image, mask, background)
}

/// A photograph of half the width and height, and the camera that would have taken it: means of blocks of 2 × 2 pixels, rounded to 8 bit.
/// A last row or column that fills no block is left out; a block counts where all of its pixels do.
///
/// Cost: a look at every pixel, on all threads.
pub fn halved(photograph: &Photograph, camera: &Pinhole<f32>) -> (Photograph, Pinhole<f32>) {
    let [width, height] = camera.size_px;
    // A photograph never vanishes.
    let side = 2.min(width).min(height);
    let size_px = [width / side, height / side];
    let rows = |y: usize| y * side..(y + 1) * side;
    let mut rgb = vec![0; 3 * size_px[0] * size_px[1]];
    let n = (side * side) as u32;
    rgb.par_chunks_mut(3 * size_px[0]).enumerate().for_each(|(y, line)| {
        let mut sums = vec![n / 2; line.len()];
        for row in rows(y) {
            let pixels = photograph.image.rgb[3 * row * width..].chunks_exact(3 * side);
            for (sums, block) in sums.chunks_exact_mut(3).zip(pixels) {
                for rgb in block.chunks_exact(3) {
                    for (sum, value) in sums.iter_mut().zip(rgb) {
                        *sum += u32::from(*value);
                    }
                }
            }
        }
        for (value, sum) in line.iter_mut().zip(sums) {
            *value = u8::try_from(sum / n).expect("a mean of bytes");
        }
    });
    let counts =
        |valid: &[bool], x: usize, y: usize| rows(y).all(|row| valid[row * width..][rows(x)].iter().all(|v| *v));
    let [width_px, height_px] = size_px.map(|px| u32::try_from(px).expect("no larger than the photograph"));
    let by = |px: f32| px / side as f32;
    let (focal_px, principal_px) = (camera.focal_px.map(by), camera.principal_px.map(by));
    let mask = photograph.mask.as_ref().map(|mask| {
        let blocks = 0..size_px[0] * size_px[1];
        let valid = blocks.into_par_iter().map(|i| counts(&mask.valid, i % size_px[0], i / size_px[0])).collect();
        Mask { width_px, height_px, valid }
    });
    let image = Image { width_px, height_px, rgb };
    (Photograph { image, mask }, Pinhole { focal_px, principal_px, size_px, ..*camera })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::train::test_capture::tiny_capture;

    #[test]
    fn blocks_become_their_means_and_count_where_all_of_their_pixels_do() {
        // 5 × 4 pixels, of which the last column fills no block; red counts pixels, green rows, blue is white but for one.
        let rgb = (0..20u8).flat_map(|i| [i, 10 * (i / 5), if i == 7 { 0 } else { 255 }]).collect();
        let mut valid = vec![true; 20];
        valid[12] = false;
        let mask = Mask { width_px: 5, height_px: 4, valid };
        let photograph = Photograph { image: Image { width_px: 5, height_px: 4, rgb }, mask: Some(mask) };
        let camera = Pinhole::new(&tiny_capture().train[0].camera);
        let camera = Pinhole { size_px: [5, 4], focal_px: [6.0, 8.0], principal_px: [2.5, 2.0], ..camera };
        let (half, of_half) = halved(&photograph, &camera);
        assert_eq!((half.image.width_px, half.image.height_px), (2, 2));
        // (0 + 1 + 5 + 6)/4, (2 + 3 + 7 + 8)/4, …; three quarters of 255 are 191.25.
        assert_eq!(half.image.rgb, [3, 5, 255, 5, 5, 191, 13, 25, 255, 15, 25, 255]);
        assert_eq!(half.mask.map(|mask| mask.valid), Some(vec![true, true, true, false]));
        assert_eq!((of_half.size_px, of_half.focal_px, of_half.principal_px), ([2, 2], [3.0, 4.0], [1.25, 1.0]));
        assert_eq!((of_half.rotation, of_half.translation), (camera.rotation, camera.translation));
        let line = Photograph { image: Image { width_px: 3, height_px: 1, rgb: vec![9; 9] }, mask: None };
        let (line, _) = halved(&line, &Pinhole { size_px: [3, 1], ..camera });
        assert_eq!(line.image.rgb, [9; 9]);
    }
}
