//! The way back through coding: to the values, the context's network and the grid's features, with the bits of the sample.

use pocketsplat_format::context::N_GROUPS;

use super::super::buffer::refill;
use super::{Coded, Network, Sample, Values, Weights, widths};
use crate::ops::heads::{head, mask};
use crate::ops::rate::{adaptive_step, anchor_bits, perturb};
use crate::ops::simd::Level;
use crate::real::Real;
use crate::scene::{ContextNetwork, Head, ModelShape};

/// A head of zeros as wide as `like`, in the place of whatever was there.
fn zeroed<'a, R: Real>(slot: &'a mut Option<Head<R>>, like: &Head<R>) -> &'a mut Head<R> {
    // Blocks are of another level now and then.
    *slot = slot.take().filter(|head| head.n_in == like.n_in);
    let head = slot.get_or_insert_with(|| Head::filled(like.n_in, like.n_hidden, like.n_out, R::ZERO));
    for group in head.groups_mut() {
        group.fill(R::ZERO);
    }
    head
}

impl<R: Real> Coded<R> {
    /// Adds the rate's share to the gradients of a block that coding with context drew, and takes all of them on to the
    /// network and the grid's features.
    ///
    /// `values` are as [`Self::forward`] left them, `d_values` those of image and volumes; mask logits stand beside their
    /// gradients, which are added to.
    pub(in crate::step) fn backward(
        &mut self,
        level: Level,
        shape: &ModelShape,
        network: Network<'_, R>,
        weights: Weights<R>,
        [values, d_values]: [Values<'_, R>; 2],
        (mask_logits, d_mask_logits): (&[R], &mut [R]),
    ) {
        let [features, log_scales, offsets] = values;
        let [d_features, d_log_scales, d_offsets] = d_values;
        let n = mask_logits.len() / shape.n_offsets;
        level.run(
            #[inline(always)]
            || {
                self.mask_term = mask::term(mask_logits, weights.mask, d_mask_logits);
                let rows = [&**features, &**log_scales, &**offsets];
                let d_rows = [&mut **d_features, &mut **d_log_scales, &mut **d_offsets];
                self.rate(shape, network, weights, rows, d_rows, mask_logits, d_mask_logits);
            },
        );
        self.d_steps.resize(n * N_GROUPS, R::ZERO);
        let gradients = [&**d_features, &**d_log_scales, &**d_offsets];
        for (group, (d_values, width)) in gradients.into_iter().zip(widths(shape)).enumerate() {
            let rows = d_values.chunks_exact(width).zip(self.residuals[group].chunks_exact(width));
            for ((d_values, residuals), d_steps) in rows.zip(self.d_steps.chunks_exact_mut(N_GROUPS)) {
                d_steps[group] = perturb::backward(d_values, residuals);
            }
        }
        refill(&mut self.d_exponents, n * N_GROUPS);
        adaptive_step::backward(&self.exponents, &self.steps, &self.d_steps, &mut self.d_exponents);

        refill(&mut self.d_inputs, self.inputs.len());
        self.d_hidden.resize(self.hidden.len(), R::ZERO);
        let (steps_head, mlp) = (&network.steps[self.anchor_level], &network.whole[self.anchor_level].mlp);
        let d_steps_head = zeroed(&mut self.d_steps_head, steps_head);
        head::backward(
            steps_head,
            &self.inputs,
            &self.hidden,
            &self.d_exponents,
            &mut self.d_hidden,
            &mut self.d_inputs,
            d_steps_head,
        );
        let sample = &mut self.sample;
        refill(&mut sample.d_inputs, sample.inputs.len());
        sample.d_hidden.resize(sample.hidden.len(), R::ZERO);
        let d_whole = zeroed(&mut self.d_whole, mlp);
        head::backward(
            mlp,
            &sample.inputs,
            &sample.hidden,
            &sample.d_outputs,
            &mut sample.d_hidden,
            &mut sample.d_inputs,
            d_whole,
        );
        let n_in = mlp.n_in;
        for (row, d_sample) in self.sampled.iter().zip(sample.d_inputs.chunks_exact(n_in)) {
            let d_inputs = &mut self.d_inputs[*row as usize * n_in..(*row as usize + 1) * n_in];
            for (d, d_sample) in d_inputs.iter_mut().zip(d_sample) {
                *d += *d_sample;
            }
        }
    }

    /// Bits of the sample, and their gradients.
    #[inline(always)]
    #[expect(clippy::too_many_arguments, reason = "one slice per input and per gradient")]
    fn rate(
        &mut self,
        shape: &ModelShape,
        network: Network<'_, R>,
        weights: Weights<R>,
        values: [&[R]; N_GROUPS],
        d_values: [&mut [R]; N_GROUPS],
        mask_logits: &[R],
        d_mask_logits: &mut [R],
    ) {
        let ContextNetwork { mlp, n_taps, taps } = &network.whole[self.anchor_level];
        let (k, n_out) = (shape.n_offsets, mlp.n_out);
        let widths = widths(shape);
        let base_steps = network.model.base_steps.map(|step| R::real(step.into()));
        refill(&mut self.d_taps, taps.len());
        let Sample { outputs, d_outputs, d_drawn, drawn, scratch, .. } = &mut self.sample;
        refill(d_outputs, outputs.len());
        self.bits = [0.0; N_GROUPS];
        let [d_features, d_log_scales, d_offsets] = d_values;
        let rows = self.sampled.iter().zip(outputs.chunks_exact(n_out)).zip(d_outputs.chunks_exact_mut(n_out));
        for ((row, outputs), d_outputs) in rows {
            let row = *row as usize;
            let of = |width: usize| row * width..(row + 1) * width;
            drawn.clear();
            drawn.extend(mask_logits[of(k)].iter().map(|logit| mask::is_open(*logit)));
            refill(d_drawn, k);
            let rows = anchor_bits::Rows {
                shape,
                base_steps,
                values: [&values[0][of(widths[0])], &values[1][of(widths[1])], &values[2][of(widths[2])]],
                drawn,
                outputs,
                n_taps: *n_taps,
                taps,
            };
            let mut gradients = anchor_bits::Gradients {
                values: [
                    &mut d_features[of(widths[0])],
                    &mut d_log_scales[of(widths[1])],
                    &mut d_offsets[of(widths[2])],
                ],
                outputs: d_outputs,
                taps: &mut self.d_taps,
                drawn: d_drawn,
            };
            let bits = anchor_bits::forward_backward(&rows, weights.bit, scratch, &mut gradients);
            for (sum, bits) in self.bits.iter_mut().zip(bits) {
                *sum += bits;
            }
            // What one mask more of the anchor adds to its own bits: a K-th part of features and log-scales.
            let [features, log_scales, _] = bits;
            let shared = weights.anchor * R::real((features + log_scales) / k as f64);
            let d_logits = d_mask_logits[of(k)].iter_mut().zip(&mask_logits[of(k)]);
            for ((d_logit, logit), d_drawn) in d_logits.zip(&*d_drawn) {
                *d_logit += (*d_drawn + shared) * mask::slope(*logit);
            }
        }
    }
}
