//! The views that a run trains on.

use pocketsplat_capture::dataset::{Photograph, View};
use pocketsplat_kernels::ops::Pinhole;
use pocketsplat_kernels::step::TargetView;

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
