//! The figures of a bundle or a file of Gaussians, as tables and other commands read them.

use serde::{Deserialize, Serialize};

use crate::config::Protocol;
use crate::plot::ResultRow;

/// Figures of a bundle over a split of a capture; PSNR, SSIM and LPIPS are means over views of 8-bit images.
#[derive(Debug, Serialize, Deserialize)]
pub(crate) struct Evaluation {
    /// What trained the bundle, and what measured it where that is another program.
    #[serde(default)]
    pub(crate) program: String,
    pub(crate) psnr_db: f64,
    /// With the colours of each frame brought to its photograph's by an affine map: the field's "cc".
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) cc_psnr_db: Option<f64>,
    pub(crate) ssim: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) lpips: Option<f64>,
    /// Which LPIPS: a figure of another network or range is another figure.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) lpips_of: Option<String>,
    /// Of a copy of each photograph at half the size, enlarged again: what no detail at all scores.
    pub(crate) half_size_copy_psnr_db: f64,
    /// Of the file, bundle or not.
    pub(crate) bundle_bytes: usize,
    /// Checksum of a bundle: the figures are of this file and no other.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) bundle_crc: Option<u32>,
    /// 0 where there are explicit Gaussians.
    pub(crate) n_anchors: u32,
    /// What there is to draw: offsets that no mask takes away.
    pub(crate) n_gaussians: u64,
    pub(crate) n_views: usize,
    pub(crate) split: String,
    pub(crate) renderer: String,
    pub(crate) width_px: u32,
    pub(crate) height_px: u32,
    pub(crate) background: String,
    /// From the bytes to what every view is drawn of, in memory: Gaussians, or the anchors whose heads give them view by view. The
    /// fastest of a few times; `eval` of a file of Gaussians takes the one time in which it was read.
    pub(crate) decode_s: f64,
    /// Of the first view, which is drawn alone.
    pub(crate) render_s_per_view: f64,
    pub(crate) scratch_bytes: usize,
    /// Of a .spz that shows another scene: with the other axes.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) psnr_with_other_axes_db: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) psnr_to_reference_db: Option<f64>,
    /// The scene of each tier and those before it, where asked for.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub(crate) tiers: Vec<TierEvaluation>,
    /// How the photographs were prepared, and the fingerprint of the capture.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) protocol: Option<Protocol>,
    /// Each view by itself, in the order of the capture.
    #[serde(default)]
    pub(crate) views: Vec<ViewEvaluation>,
}

/// Figures of one view.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct ViewEvaluation {
    pub(crate) name: String,
    pub(crate) psnr_db: f64,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) cc_psnr_db: Option<f64>,
    pub(crate) ssim: f64,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) lpips: Option<f64>,
}

/// Figures of the scene that consists of a tier and those before it.
#[derive(Debug, Serialize, Deserialize)]
pub(crate) struct TierEvaluation {
    /// Share of the anchors that it leaves out.
    pub(crate) pruning_rate: f64,
    pub(crate) psnr_db: f64,
}

impl Evaluation {
    /// The figures as a row of results.
    pub(crate) fn result_row(&self, submethod: String) -> ResultRow {
        ResultRow {
            submethod,
            psnr_db: self.psnr_db,
            ssim: Some(self.ssim),
            lpips: self.lpips,
            size_bytes: self.bundle_bytes as f64,
            n_gaussians: Some(self.n_gaussians as f64),
            program: Some(self.program.clone()),
        }
    }
}
