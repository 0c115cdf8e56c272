//! From trained floats to integer symbols.

use pocketsplat_format::context::{Context, Group, N_GROUPS};
use rayon::prelude::*;

use super::WriteError;
use super::channels::{ChannelName, ContextWork};
use super::order::Placement;
use pocketsplat_kernels::ops::rate::perturb;
use pocketsplat_kernels::scene::{ModelShape, QuantisationSteps, Scene};

/// Where an anchor's steps come from.
#[derive(Clone, Copy)]
pub(super) enum StepSource<'c> {
    /// The same for all: of features, log-scales, offsets.
    Fixed([f32; 3]),
    /// The context model, anchor by anchor.
    Context(&'c Context<'c>),
}

/// The anchors of a bundle as integers, in file order.
pub(super) struct SymbolRows {
    pub(super) n_channels: usize,
    /// `[n]`.
    pub(super) lattice: Vec<[i32; 3]>,
    /// `[n]` bit k is set iff offset k is drawn.
    pub(super) drawn: Vec<u32>,
    /// `[n, n_channels]`; those of offsets that are not drawn are 0.
    pub(super) symbols: Vec<i16>,
    /// `[n]` steps of features, log-scales, offsets.
    pub(super) steps: Vec<[f32; 3]>,
}

impl SymbolRows {
    /// The symbols of anchor `anchor`.
    pub(super) fn symbols_of(&self, anchor: usize) -> &[i16] {
        &self.symbols[anchor * self.n_channels..][..self.n_channels]
    }

    /// Bits that hold every symbol of a feature, of a log-scale, of a coordinate of an offset as a signed number.
    pub(super) fn symbol_bits(&self, shape: &ModelShape) -> [u8; N_GROUPS] {
        let group_of: Vec<usize> = (0..self.n_channels).map(|c| ChannelName::of(shape, c).group()).collect();
        let mut bits = [1; N_GROUPS];
        for row in self.symbols.chunks_exact(self.n_channels) {
            for (&symbol, &group) in row.iter().zip(&group_of) {
                // A sign, and what is not all sign.
                let magnitude = if symbol < 0 { !symbol } else { symbol };
                bits[group] = bits[group].max(17 - magnitude.leading_zeros() as u8);
            }
        }
        bits
    }
}

/// Checks that the scene's arrays have the lengths its shape calls for.
pub(super) fn check_lengths(scene: &Scene<f32>) -> Result<(), WriteError> {
    let (shape, anchors, n) = (&scene.shape, &scene.anchors, scene.anchors.len());
    let arrays = [
        ("features", anchors.features.len(), shape.feature_dim),
        ("log-scales", anchors.log_scales.len(), shape.n_log_scales()),
        ("offsets", anchors.offsets.len(), 3 * shape.n_offsets),
        ("masks", anchors.mask_logits.len(), shape.n_offsets),
    ];
    for (array, found, width) in arrays {
        let needed = n * width;
        if found != needed {
            return Err(WriteError::Length { array, needed, found });
        }
    }
    Ok(())
}

/// Checks that steps are finite and positive.
///
/// # Errors
/// [`WriteError::NotPositive`].
pub fn check_steps(steps: QuantisationSteps) -> Result<(), WriteError> {
    let QuantisationSteps { feature, log_scale, offset } = steps;
    for (what, step) in [("feature step", feature), ("log-scale step", log_scale), ("offset step", offset)] {
        if !(step.is_finite() && step > 0.0) {
            return Err(WriteError::NotPositive { what, value: step.into() });
        }
    }
    Ok(())
}

/// The [symbol](perturb::symbol) of every value that is coded.
///
/// # Errors
/// [`WriteError::NotFinite`], [`WriteError::BeyondSymbols`].
pub(super) fn quantise(
    scene: &Scene<f32>,
    placement: &Placement,
    steps: StepSource<'_>,
) -> Result<SymbolRows, WriteError> {
    let n_channels = scene.shape.values_per_anchor();
    let lattice: Vec<[i32; 3]> = placement.order.iter().map(|&anchor| scene.anchors.lattice[anchor]).collect();
    let parts = placement.chunks.par_iter().map(|chunk| {
        let mut work = ContextWork::default();
        let mut rows = (Vec::with_capacity(chunk.len() * n_channels), Vec::with_capacity(chunk.len()));
        for row in chunk.clone() {
            let (own, values) = match steps {
                StepSource::Fixed(steps) => (None, steps),
                StepSource::Context(context) => {
                    let steps = work.enter(context, lattice[row]);
                    (Some(steps), Group::ALL.map(|group| steps.value(group)))
                }
            };
            let first = rows.0.len();
            push_symbols(scene, placement.order[row], placement.drawn[row], values, &mut rows.0)?;
            if let Some(steps) = own {
                work.leave(&steps, &rows.0[first..]);
            }
            rows.1.push(values);
        }
        Ok(rows)
    });
    let mut rows = SymbolRows {
        n_channels,
        lattice: Vec::new(),
        drawn: placement.drawn.clone(),
        symbols: Vec::new(),
        steps: Vec::new(),
    };
    for (symbols, steps) in parts.collect::<Result<Vec<_>, WriteError>>()? {
        rows.symbols.extend(symbols);
        rows.steps.extend(steps);
    }
    Ok(SymbolRows { lattice, ..rows })
}

/// Appends the symbols of one anchor of the scene.
fn push_symbols(
    scene: &Scene<f32>,
    anchor: usize,
    drawn: u32,
    steps: [f32; 3],
    symbols: &mut Vec<i16>,
) -> Result<(), WriteError> {
    let (shape, anchors) = (&scene.shape, &scene.anchors);
    let arrays = [
        (&anchors.features, shape.feature_dim),
        (&anchors.log_scales, shape.n_log_scales()),
        (&anchors.offsets, 3 * shape.n_offsets),
    ];
    let values = arrays.into_iter().flat_map(|(values, width)| &values[anchor * width..][..width]);
    for (channel, &value) in values.enumerate() {
        let channel = ChannelName::of(shape, channel);
        symbols.push(if channel.is_coded(drawn) { symbol(value, steps[channel.group()], anchor, channel)? } else { 0 });
    }
    Ok(())
}

fn symbol(value: f32, step: f32, anchor: usize, channel: ChannelName) -> Result<i16, WriteError> {
    if !value.is_finite() {
        return Err(WriteError::NotFinite { anchor, channel, value });
    }
    let symbol = perturb::symbol(value, step);
    if symbol.abs() > f32::from(i16::MAX) {
        return Err(WriteError::BeyondSymbols { anchor, channel, value, step });
    }
    Ok(symbol as i16)
}
