//! Where the oracle's scenes come from.

use glam::DVec3;
use pocketsplat_format::bundle::{AnchorSite, Coder, Header};
use pocketsplat_format::context::{Context, Group};
use pocketsplat_format::{Bundle, DecodeError};

use super::{ReferenceScene, TrainedFrame};
use crate::bundle::{ContextWork, decoded_heads, shape_of};
use pocketsplat_kernels::real::Real;
use pocketsplat_kernels::scene::Scene;

impl ReferenceScene {
    /// The scene that a trainer holds: every value widened, positions `lattice · voxel_size`.
    pub fn from_scene<R: Real>(scene: &Scene<R>) -> Self {
        let Scene { shape, voxel_size, anchors, heads, .. } = scene.cast::<f64>();
        let position = |cell: &[i32; 3]| DVec3::from(cell.map(f64::from)) * voxel_size;
        Self {
            shape,
            prefilters: shape.sees_view(),
            positions: anchors.lattice.iter().map(position).collect(),
            drawn: (0..anchors.mask_logits.len()).map(|offset| anchors.is_drawn(offset)).collect(),
            features: anchors.features,
            log_scales: anchors.log_scales,
            offsets: anchors.offsets,
            heads,
            trained: None,
        }
    }

    /// The scene that a bundle holds: dequantised values and weights, widened.
    ///
    /// Only the symbols, and the integers behind an anchor's steps, come from the decoder, since there is one truth about
    /// those.
    ///
    /// # Errors
    /// [`DecodeError`] of the first chunk that does not decode.
    pub fn from_bundle(bundle: &Bundle<'_>) -> Result<Self, DecodeError> {
        let (header, shape) = (bundle.header(), shape_of(bundle));
        let n_channels = shape.values_per_anchor();
        let mut scene = Self {
            shape,
            prefilters: bundle.n_gaussians(0).is_none(),
            positions: Vec::new(),
            features: Vec::new(),
            log_scales: Vec::new(),
            offsets: Vec::new(),
            drawn: Vec::new(),
            heads: decoded_heads(bundle).map(|head| head.map(f64::from)),
            trained: Some(TrainedFrame {
                size_px: header.training_px.map(u32::from),
                focal_area_px2: focal_area_px2(header),
            }),
        };
        let mut words = vec![0; bundle.anchor_scratch_words()];
        let mut models = bundle.anchor_models(&mut words)?;
        for chunk in bundle.chunks() {
            let mut work = ContextWork::default();
            let mut sites = vec![AnchorSite::default(); chunk.n_anchors().into()];
            let mut symbols = vec![0i16; sites.len() * n_channels];
            chunk.decode_symbols(&mut models, &mut sites, &mut symbols)?;
            for (site, symbols) in sites.iter().zip(symbols.chunks_exact(n_channels)) {
                // The position itself is an f32 by definition of the format.
                let position = site.lattice.map(|c| f64::from(c as f32 * header.voxel_size));
                scene.positions.push(DVec3::from(position));
                scene.drawn.extend((0..shape.n_offsets).map(|k| (site.mask >> k) & 1 == 1));
                let row: Vec<f64> = match bundle.coder() {
                    Coder::Static(tables) => {
                        // value = origin + symbol·step, both operations rounded to f32.
                        let values =
                            symbols.iter().zip(tables.of_channels()).map(|(&s, t)| f32::from(s) * t.step + t.origin);
                        values.map(f64::from).collect()
                    }
                    Coder::Context(context) => {
                        let steps = steps(context, &mut work, site.lattice, symbols);
                        let step_of = |channel: usize| match channel.checked_sub(shape.feature_dim) {
                            None => steps[0],
                            Some(log_scale) if log_scale < shape.n_log_scales() => steps[1],
                            Some(_) => steps[2],
                        };
                        symbols.iter().enumerate().map(|(channel, &s)| f64::from(s) * step_of(channel)).collect()
                    }
                };
                let (features, rest) = row.split_at(shape.feature_dim);
                let (log_scales, offsets) = rest.split_at(shape.n_log_scales());
                scene.features.extend(features);
                scene.log_scales.extend(log_scales);
                scene.offsets.extend(offsets);
            }
        }
        Ok(scene)
    }
}

/// Product of the preview's focal lengths, were it of the training size.
fn focal_area_px2(header: &Header) -> f64 {
    let preview = &header.preview;
    let area = |[width, height]: [u16; 2]| f64::from(width) * f64::from(height);
    let larger_by = area(header.training_px) / area([preview.width_px, preview.height_px]);
    preview.focal_px.map(f64::from).iter().product::<f64>() * larger_by
}

/// base·2^(q/8) of the three groups, exact where the decoder multiplies tabulated factors.
fn steps<'c>(context: &Context<'c>, work: &mut ContextWork<'c>, lattice: [i32; 3], symbols: &[i16]) -> [f64; 3] {
    let steps = work.enter(context, lattice);
    work.leave(&steps, symbols);
    let exponents = Group::ALL.map(|group| steps.exponent(group));
    std::array::from_fn(|i| f64::from(context.base_steps()[i]) * (f64::from(exponents[i]) / 8.0).exp2())
}
