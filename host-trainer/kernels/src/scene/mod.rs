//! The trainable scene: anchors on an integer lattice and the heads that turn them into Gaussians.
//!
//! Everything is in the normalised frame of [`pocketsplat_capture::dataset::Normalisation`].

mod context;
mod grid_record;
mod heads;
pub mod init;
mod steps;

pub use context::{ContextModel, ContextNetwork};
pub use heads::{Head, Heads, OutputLayout};
pub use steps::QuantisationSteps;

use crate::real::Real;

/// What a model consists of: its widths and the effects it pays for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct ModelShape {
    /// Feature width F of an anchor.
    pub feature_dim: usize,
    /// Offsets, that is Gaussians, K of an anchor.
    pub n_offsets: usize,
    /// The colour head sees the unit vector from the camera to the anchor.
    pub view_colour: bool,
    /// The opacity and the covariance head see it.
    pub view_geometry: bool,
    /// These heads see the distance from the camera to the anchor, in normalised units.
    pub view_distance: bool,
    /// Opacity is multiplied by √(det Σ / det(Σ + 0.3 I)) (Yu et al. 2024, Mip-Splatting, eq. 8).
    pub dilation_compensation: bool,
    /// Gaussians have three deviations and a rotation; without it one deviation, the same in every direction.
    pub anisotropic: bool,
    /// Hidden width of the colour head; 0: F, as that of the others.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub colour_hidden: usize,
    /// Hidden width of the detail head; 0: there is none.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub detail_hidden: usize,
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde calls it with a reference")]
fn is_zero(width: &usize) -> bool {
    *width == 0
}

impl ModelShape {
    /// F features, K offsets, anisotropic Gaussians, no other effect.
    pub const fn plain(feature_dim: usize, n_offsets: usize) -> Self {
        Self {
            feature_dim,
            n_offsets,
            view_colour: false,
            view_geometry: false,
            view_distance: false,
            dilation_compensation: false,
            anisotropic: true,
            colour_hidden: 0,
            detail_hidden: 0,
        }
    }

    /// Inputs of the opacity and of the covariance head: feature, then distance (1), then direction (3), the last two if these
    /// heads see them.
    pub fn geometry_inputs(&self) -> usize {
        self.inputs(self.view_geometry)
    }

    /// Inputs of the colour head, as [`Self::geometry_inputs`].
    pub fn colour_inputs(&self) -> usize {
        self.inputs(self.view_colour)
    }

    /// Inputs of the head among these three that sees most; one that sees less sees the first of them.
    pub fn head_inputs(&self) -> usize {
        self.inputs(self.sees_direction())
    }

    fn inputs(&self, sees_direction: bool) -> usize {
        self.feature_dim + usize::from(self.view_distance) + 3 * usize::from(sees_direction)
    }

    /// Whether any head sees the direction of view.
    pub fn sees_direction(&self) -> bool {
        self.view_colour || self.view_geometry
    }

    /// Whether the heads see anything of the view: if not, a Gaussian is the same in every frame.
    pub fn sees_view(&self) -> bool {
        self.sees_direction() || self.view_distance
    }

    /// Hidden width of the colour head.
    pub fn colour_width(&self) -> usize {
        if self.colour_hidden == 0 { self.feature_dim } else { self.colour_hidden }
    }

    /// Log-scales an anchor carries: three that scale its offsets, and as base size of its Gaussians three, or one where they
    /// are isotropic.
    pub const fn n_log_scales(&self) -> usize {
        if self.anisotropic { 6 } else { 4 }
    }

    /// Outputs of the covariance head an offset: three scale logits and a quaternion (w, x, y, z), or one scale logit.
    pub const fn covariance_outputs(&self) -> usize {
        if self.anisotropic { 7 } else { 1 }
    }

    /// Trained values an anchor carries: F features, log-scales, 3K offsets.
    pub fn values_per_anchor(&self) -> usize {
        self.feature_dim + self.n_log_scales() + 3 * self.n_offsets
    }
}

/// Mask logits above this are drawn: sigmoid(m) > 0.01.
pub const MASK_THRESHOLD: f64 = -4.595_119_850_134_59;
/// Where masks are switched off.
const MASKED: f64 = -11.5;
const _: () = assert!(MASKED < MASK_THRESHOLD);
/// Where mask logits start.
pub const INITIAL_MASK_LOGIT: f64 = 1.0;

/// Anchors as structure of arrays, one row an anchor.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Anchors<R> {
    /// `[n_anchors]` lattice coordinates; the position is `lattice · voxel_size`.
    pub lattice: Vec<[i32; 3]>,
    /// `[n_anchors, F]` features.
    pub features: Vec<R>,
    /// `[n_anchors, 6]`, or `[n_anchors, 4]` where Gaussians are isotropic, natural logarithms: 0..3 scale the offsets (and are
    /// the anchor's own size in the prefilter), those from 3 on are the base size of its Gaussians.
    pub log_scales: Vec<R>,
    /// `[n_anchors, K, 3]` offsets in units of `exp(log_scales[0..3])`.
    pub offsets: Vec<R>,
    /// `[n_anchors, K]` mask logits: an offset is drawn, and coded, only where its logit is above [`MASK_THRESHOLD`]
    /// (Chen et al. 2024, HAC, section 4.3).
    pub mask_logits: Vec<R>,
    /// `[n_anchors]`, or empty where nothing has ranked them: the share of the anchors that goes before this one when
    /// anchors are left out.
    pub prune_rank: Vec<f32>,
    /// `[n_anchors]`, or empty where nothing has counted: how many times as many training views show the mean anchor as this one.
    pub view_weights: Vec<f32>,
}

impl<R> Anchors<R> {
    /// Number of anchors.
    pub fn len(&self) -> usize {
        self.lattice.len()
    }

    /// Whether there is no anchor.
    pub fn is_empty(&self) -> bool {
        self.lattice.is_empty()
    }
}

impl<R: Real> Anchors<R> {
    /// Whether offset `offset` of all anchors' offsets, counted through, is drawn.
    #[inline]
    pub fn is_drawn(&self, offset: usize) -> bool {
        self.mask_logits[offset] > R::real(MASK_THRESHOLD)
    }

    /// Whether any offset of an anchor is drawn; an anchor without is invisible and costs nothing.
    #[inline]
    pub fn has_drawn(&self, anchor: usize) -> bool {
        let k = self.mask_logits.len() / self.len();
        (anchor * k..(anchor + 1) * k).any(|offset| self.is_drawn(offset))
    }

    /// Switches offsets off, counted through all anchors': sigmoid of their logits is 1e-5 then.
    pub fn mask(&mut self, offsets: &[usize]) {
        for offset in offsets {
            self.mask_logits[*offset] = R::real(MASKED);
        }
    }
}

/// A whole model: what the trainer optimises and the bundle stores.
#[derive(Clone, Debug, PartialEq)]
pub struct Scene<R> {
    /// Widths and effects.
    pub shape: ModelShape,
    /// Edge ε of a lattice cell, normalised units.
    pub voxel_size: f64,
    /// The anchors.
    pub anchors: Anchors<R>,
    /// The heads.
    pub heads: Heads<R>,
    /// What places say about values, once training has come to it; scenes without are coded with static tables.
    pub context: Option<ContextModel<R>>,
}

impl<R: Real> Scene<R> {
    /// Position of an anchor: its lattice coordinates times ε, the product rounded as the decoder rounds it.
    #[inline]
    pub fn position(&self, anchor: usize) -> [R; 3] {
        let voxel_size = R::real(self.voxel_size);
        self.anchors.lattice[anchor].map(|c| R::real(f64::from(c)) * voxel_size)
    }

    /// The same scene in another number type.
    pub fn cast<T: Real>(&self) -> Scene<T> {
        let all = |values: &[R]| values.iter().map(|v| T::real((*v).into())).collect::<Vec<T>>();
        let head = |h: &Head<R>| h.map(|w| T::real(w.into()));
        Scene {
            shape: self.shape,
            voxel_size: self.voxel_size,
            anchors: Anchors {
                lattice: self.anchors.lattice.clone(),
                features: all(&self.anchors.features),
                log_scales: all(&self.anchors.log_scales),
                offsets: all(&self.anchors.offsets),
                mask_logits: all(&self.anchors.mask_logits),
                prune_rank: self.anchors.prune_rank.clone(),
                view_weights: self.anchors.view_weights.clone(),
            },
            heads: self.heads.map(head),
            context: self.context.as_ref().map(|context| ContextModel {
                frame: context.frame,
                levels: context.levels.clone(),
                rows: all(&context.rows),
                networks: context.networks.iter().map(|network| network.map(|w| T::real(w.into()))).collect(),
                shifts: context.shifts,
                base_steps: context.base_steps,
            }),
        }
    }
}
