//! Where the oracle's scenes come from.

use glam::DVec3;
use pocketsplat_core::bundle::{Halves, HeadView};
use pocketsplat_core::{Bundle, DecodeError};

use super::ReferenceScene;
use crate::ops::Real;
use crate::scene::{Head, Heads, ModelShape, Scene};

impl ReferenceScene {
    /// The scene that a trainer holds: every value widened, positions `lattice · voxel_size`.
    pub fn from_scene<R: Real>(scene: &Scene<R>) -> Self {
        let Scene { shape, voxel_size, anchors, heads, .. } = scene.cast::<f64>();
        let position = |cell: &[i32; 3]| DVec3::from(cell.map(f64::from)) * voxel_size;
        Self {
            shape,
            positions: anchors.lattice.iter().map(position).collect(),
            features: anchors.features,
            log_scales: anchors.log_scales,
            offsets: anchors.offsets,
            heads,
        }
    }

    /// The scene that a bundle holds: dequantised values and f16 weights, widened.
    ///
    /// Only the symbols come from the decoder, since there is one truth about those.
    ///
    /// # Errors
    /// [`DecodeError`] of the first chunk that does not decode.
    pub fn from_bundle(bundle: &Bundle<'_>) -> Result<Self, DecodeError> {
        let header = bundle.header();
        let shape = ModelShape {
            feature_dim: header.feature_dim.into(),
            n_offsets: header.n_offsets.into(),
            view_direction: header.effects.view_direction,
            view_distance: header.effects.view_distance,
            dilation_compensation: header.effects.dilation_compensation,
        };
        let wide = |weights: &Halves<'_>| weights.iter().map(f64::from).collect::<Vec<f64>>();
        let head = |h: &HeadView<'_>| Head {
            n_in: h.n_in,
            n_hidden: h.n_hidden,
            n_out: h.n_out,
            w1: wide(&h.w1),
            b1: wide(&h.b1),
            w2: wide(&h.w2),
            b2: wide(&h.b2),
        };
        let heads = bundle.heads();
        let mut scene = Self {
            shape,
            positions: Vec::new(),
            features: Vec::new(),
            log_scales: Vec::new(),
            offsets: Vec::new(),
            heads: Heads {
                opacity: head(&heads.opacity),
                covariance: head(&heads.covariance),
                colour: head(&heads.colour),
            },
        };
        for index in 0..header.n_chunks {
            let chunk = bundle.chunk(index)?;
            let mut lattice = vec![[0; 3]; chunk.n_anchors().into()];
            let mut symbols = vec![0i16; lattice.len() * shape.values_per_anchor()];
            chunk.decode_symbols(bundle.tables(), &mut lattice, &mut symbols)?;
            // The position itself is an f32 by definition of the format.
            let position = |cell: &[i32; 3]| DVec3::from(cell.map(|c| f64::from(c as f32 * header.voxel_size)));
            scene.positions.extend(lattice.iter().map(position));
            for symbols in symbols.chunks_exact(shape.values_per_anchor()) {
                // FORMAT.md, section 4: value = origin + symbol·step, both operations rounded to f32.
                let tables = bundle.tables().of_channels();
                let row: Vec<f32> =
                    symbols.iter().zip(tables).map(|(&s, t)| f32::from(s) * t.step + t.origin).collect();
                let (features, rest) = row.split_at(shape.feature_dim);
                let (log_scales, offsets) = rest.split_at(6);
                scene.features.extend(features.iter().map(|&v| f64::from(v)));
                scene.log_scales.extend(log_scales.iter().map(|&v| f64::from(v)));
                scene.offsets.extend(offsets.iter().map(|&v| f64::from(v)));
            }
        }
        Ok(scene)
    }
}
