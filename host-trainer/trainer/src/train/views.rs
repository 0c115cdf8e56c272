//! The views that a run trains on.

use pocketsplat_capture::dataset::{Photograph, View};
use pocketsplat_kernels::ops::Pinhole;
use pocketsplat_kernels::step::{TargetView, planes};

/// The training views of a capture, and which of them the scene learns from.
#[derive(Clone, Debug)]
pub struct TrainingViews<'a> {
    /// All of them, held out or not.
    pub all: &'a [View],
    /// Their cameras.
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

/// A photograph at a fraction of its size, and its camera.
pub struct Reduced {
    camera: Pinhole<f32>,
    planes: Vec<f32>,
    mask: Option<Vec<bool>>,
}

impl Reduced {
    /// Means of blocks of `side × side` pixels, of which the last row and column are left out where they are cut; a block counts where all
    /// of its pixels do. The image has at least one pixel.
    pub fn new(photograph: &Photograph, camera: &Pinhole<f32>, side: usize) -> Self {
        let [width, height] = camera.size_px;
        let side = side.min(width).min(height);
        let size_px = [width / side, height / side];
        let block = move |i: usize| {
            let (x, y) = (side * (i % size_px[0]), side * (i / size_px[0]));
            (0..side).flat_map(move |row| (0..side).map(move |column| (y + row) * width + x + column))
        };
        let n = size_px[0] * size_px[1];
        let scale = 1.0 / (side * side) as f32;
        let whole = planes(&photograph.image);
        let planes = whole
            .chunks_exact(width * height)
            .flat_map(|plane| (0..n).map(move |i| scale * block(i).map(|at| plane[at]).sum::<f32>()))
            .collect();
        let mask = photograph.mask.as_ref().map(|mask| (0..n).map(|i| block(i).all(|at| mask.valid[at])).collect());
        let by = |px: f32| px / side as f32;
        let (focal_px, principal_px) = (camera.focal_px.map(by), camera.principal_px.map(by));
        Self { camera: Pinhole { focal_px, principal_px, size_px, ..*camera }, planes, mask }
    }

    /// What it asks of the scene, once: the planes go with it.
    pub fn target(&mut self, background: [f32; 3]) -> TargetView<'_, f32> {
        let planes = std::mem::take(&mut self.planes);
        TargetView::new(&self.camera, planes, self.mask.as_deref(), background)
    }
}
