//! What the context model says that values cost.

use pocketsplat_format::context::{Context, Group, N_GROUPS, N_LEVELS, Steps};
use rayon::prelude::*;

use pocketsplat_kernels::ops::heads::{head, mask};
use pocketsplat_kernels::ops::rate::{anchor_bits, hash_grid};
use pocketsplat_kernels::ops::simd::Level;
use pocketsplat_kernels::scene::{ContextModel, ContextNetwork, Scene};
use pocketsplat_kernels::step::parents::Parents;

/// Anchors that one task looks at.
const ROWS: usize = 512;

/// Bits of every anchor's values under the float model's means and scales and the integer model's steps.
///
/// Values need not be rounded: the cost is that of an interval as wide as a step around each.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Bits {
    /// `[n]` of features, log-scales and drawn offsets; 0 where no offset is drawn.
    pub of_anchors: Vec<[f64; N_GROUPS]>,
    /// `[n, K]` of the three values of each drawn offset; 0 where it is not.
    pub of_offsets: Vec<f32>,
}

impl Bits {
    /// Of a scene with a context model; empty without.
    ///
    /// * `context`: the integers of the scene's model.
    pub fn of(scene: &Scene<f32>, context: &Context<'_>) -> Self {
        let Some(model) = &scene.context else { return Self::default() };
        let parents = Parents::of_integers(scene, context);
        let (n, k) = (scene.anchors.len(), scene.shape.n_offsets);
        let mut bits = Self { of_anchors: vec![[0.0; N_GROUPS]; n], of_offsets: vec![0.0; n * k] };
        for level in 0..N_LEVELS {
            let anchors: Vec<u32> = (0u32..).take(n).filter(|anchor| parents.level(*anchor) == level).collect();
            let parts = anchors.par_chunks(ROWS).map(|rows| Self::of_rows(scene, model, context, &parents, rows));
            for (rows, part) in anchors.chunks(ROWS).zip(parts.collect::<Vec<Self>>()) {
                let found = part.of_anchors.into_iter().zip(part.of_offsets.chunks_exact(k));
                for (a, (of_anchor, of_offsets)) in rows.iter().map(|a| *a as usize).zip(found) {
                    bits.of_anchors[a] = of_anchor;
                    bits.of_offsets[a * k..][..k].copy_from_slice(of_offsets);
                }
            }
        }
        bits
    }

    /// * `rows`: anchors of one level.
    fn of_rows(
        scene: &Scene<f32>,
        model: &ContextModel<f32>,
        context: &Context<'_>,
        parents: &Parents<f32>,
        rows: &[u32],
    ) -> Self {
        let (shape, anchors) = (&scene.shape, &scene.anchors);
        let (widths, k) = ([shape.feature_dim, shape.n_log_scales(), 3 * shape.n_offsets], shape.n_offsets);
        let level = rows.first().map_or(0, |anchor| parents.level(*anchor));
        let ContextNetwork { mlp, n_taps, taps } = &model.networks[level];
        let (n, n_out) = (rows.len(), mlp.n_out);
        let mut inputs = Vec::with_capacity(n * mlp.n_in);
        if model.shifts.is_some() {
            rows.iter().for_each(|anchor| parents.push_inputs(*anchor, &mut inputs));
        } else {
            let units: Vec<[u16; 3]> = rows.iter().map(|a| model.frame.unit(anchors.lattice[*a as usize])).collect();
            inputs.resize(n * mlp.n_in, 0.0);
            hash_grid::forward(&model.levels, &model.rows, &units, &mut inputs);
        }
        let (mut hidden, mut outputs) = (vec![0.0; n * mlp.n_hidden], vec![0.0; n * n_out]);
        head::forward(mlp, &inputs, &mut hidden, &mut outputs);
        let mut bits = Self::default();
        for (a, output) in rows.iter().zip(outputs.chunks_exact_mut(n_out)) {
            let steps = values_of(parents.steps(context, scene, *a));
            let a = *a as usize;
            let exponents = &mut output[n_out - N_GROUPS..];
            for (exponent, (step, base)) in exponents.iter_mut().zip(steps.iter().zip(model.base_steps)) {
                *exponent = (step / base).log2();
            }
            let of = |values: &[f32], width: usize| values[a * width..(a + 1) * width].to_vec();
            let values =
                [of(&anchors.features, widths[0]), of(&anchors.log_scales, widths[1]), of(&anchors.offsets, widths[2])];
            let drawn: Vec<bool> = of(&anchors.mask_logits, k).into_iter().map(mask::is_open).collect();
            if !drawn.contains(&true) {
                bits.of_anchors.push([0.0; N_GROUPS]);
                bits.of_offsets.extend(std::iter::repeat_n(0.0, k));
                continue;
            }
            let values = values.each_ref().map(Vec::as_slice);
            let row = anchor_bits::Rows {
                shape,
                base_steps: model.base_steps,
                values,
                drawn: &drawn,
                outputs: output,
                n_taps: *n_taps,
                taps,
            };
            let (of_anchor, of_offsets) = anchor_bits::forward(Level::detect(), &row);
            bits.of_anchors.push(of_anchor);
            bits.of_offsets.extend(of_offsets);
        }
        bits
    }
}

/// Bits of all features, log-scales and drawn offsets.
pub fn of_scene(scene: &Scene<f32>, context: &Context<'_>) -> [f64; N_GROUPS] {
    let bits = Bits::of(scene, context);
    bits.of_anchors.iter().fold([0.0; N_GROUPS], |sum, bits| std::array::from_fn(|i| sum[i] + bits[i]))
}

/// The steps of all anchors, in the order of the channels, as the integer model has them.
pub(in crate::train) fn all_steps(scene: &Scene<f32>, context: &Context<'_>) -> Vec<[f32; N_GROUPS]> {
    let parents = Parents::of_integers(scene, context);
    let anchors: Vec<u32> = (0u32..).take(scene.anchors.len()).collect();
    anchors.par_iter().map(|anchor| values_of(parents.steps(context, scene, *anchor))).collect()
}

fn values_of(steps: Steps) -> [f32; N_GROUPS] {
    Group::ALL.map(|group| steps.value(group))
}
