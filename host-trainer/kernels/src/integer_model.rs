//! A trained context model as integers: the context section of a bundle, and what its integers mean in floats.
//!
//! Weights become i8 with a power-of-two scale a row; the scale is the largest that keeps the row's largest weight and its
//! bias in range. Inputs are in 2⁻¹⁴, hidden units in 2⁻¹⁰, outputs in the units of [`pocketsplat_format::context`].

use pocketsplat_format::DecodeError;
use pocketsplat_format::context::{
    Context, ContextHead, GridLevel, MAX_BIAS, MAX_CONTEXT_HIDDEN, MAX_CONTEXT_LEVELS, MAX_TAPS, MEAN_PARTS, TAP_BITS,
};
use pocketsplat_format::entropy::EIGHTHS;

use crate::scene::{ContextModel, ContextNetwork, Head, ModelShape};

/// Bits of the fraction of an input: [`pocketsplat_format::context::FEATURE_ONE`].
const INPUT_BITS: i32 = 14;
/// Bits of the fraction of a hidden unit, which reaches up to 32.
const HIDDEN_BITS: i32 = 10;
/// Finest scale of a weight; beyond it every weight of the row would be below 0.008.
const MAX_WEIGHT_BITS: i32 = 13;
/// Coarsest: the shift by [`HIDDEN_BITS`] less the output's fraction bits, 6 at most, must not become negative.
const MIN_WEIGHT_BITS: i32 = -4;

/// Why a context model has no integer form.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
#[expect(missing_docs, reason = "each message names its fields")]
pub enum IntegerModelError {
    /// More levels or hidden units than the format has.
    #[error("{what} are {found}; the format holds 1 to {most}")]
    Count { what: &'static str, found: usize, most: usize },
    /// A weight or bias is not finite, or too large for eight bits at any scale.
    #[error("context model, row {row}: {value} does not fit eight bits (weights up to 2032, biases up to 16384)")]
    Weight { row: usize, value: f32 },
    /// A tap is not finite.
    #[error("context model: a tap's weight is {value}")]
    Tap { value: f32 },
}

/// What a tap's weight of one stands for.
const TAP_UNIT: f32 = 1.0 / (1 << TAP_BITS) as f32;

/// One row of a layer in integers.
struct IntegerRow {
    /// Bits of the fraction of its weights.
    weight_bits: i32,
    weights: Vec<i8>,
    bias: i32,
    shift: u8,
}

/// The context of a section, for anchors of a shape.
///
/// # Errors
/// Those of [`Context::parse`].
pub fn parse<'s>(section: &'s [u8], shape: &ModelShape) -> Result<Context<'s>, DecodeError> {
    Context::parse(section, shape.feature_dim, shape.n_log_scales(), shape.values_per_anchor())
}

/// The context section of a bundle.
///
/// # Errors
/// [`IntegerModelError::Count`] when the model has more levels or hidden units than the format, [`IntegerModelError::Weight`] for a
/// weight that is not finite or too large.
pub fn section(model: &ContextModel<f32>, n_channels: usize) -> Result<Vec<u8>, IntegerModelError> {
    let within = |what, found: usize, most: usize| match found {
        1.. if found <= most => Ok(()),
        _ => Err(IntegerModelError::Count { what, found, most }),
    };
    if model.shifts.is_none() {
        within("grid levels of the context", model.levels.len(), MAX_CONTEXT_LEVELS.into())?;
    }
    let first = &model.networks[0];
    within("hidden units of the context", first.mlp.n_hidden, MAX_CONTEXT_HIDDEN.into())?;
    within("taps of the context", first.n_taps.max(1), MAX_TAPS.into())?;

    let head = ContextHead {
        frame: model.frame,
        base_steps: model.base_steps,
        n_levels: model.levels.len() as u8,
        n_taps: first.n_taps as u8,
        n_hidden: first.mlp.n_hidden as u16,
    };
    let mut bytes = head.emit().to_vec();
    bytes.extend(model.levels.iter().flat_map(GridLevel::emit));
    if let Some(shifts) = model.shifts {
        bytes.extend(shifts);
        bytes.push(0);
    }
    // The coarsest level first.
    for network in model.networks.iter().rev() {
        push_network(network, n_channels, &mut bytes)?;
        bytes.extend(tap_integers(network)?.into_iter().map(i8::cast_unsigned));
    }
    bytes.extend(grid_bytes(&model.rows));
    Ok(bytes)
}

/// Appends shifts, biases and weights of a network.
fn push_network(
    network: &ContextNetwork<f32>,
    n_channels: usize,
    bytes: &mut Vec<u8>,
) -> Result<(), IntegerModelError> {
    let [hidden, output] = rows(&network.mlp, n_channels)?;
    for layer in [&hidden, &output] {
        bytes.extend(layer.iter().map(|row| row.shift));
    }
    for layer in [&hidden, &output] {
        bytes.extend(layer.iter().flat_map(|row| row.bias.to_le_bytes()));
    }
    for layer in [&hidden, &output] {
        bytes.extend(layer.iter().flat_map(|row| &row.weights).map(|weight| weight.cast_unsigned()));
    }
    Ok(())
}

/// The networks whose floats are exactly what the section's integers stand for: what gradients pass straight through.
///
/// # Errors
/// As [`section`].
pub fn rounded(model: &ContextModel<f32>, n_channels: usize) -> Result<Vec<ContextNetwork<f32>>, IntegerModelError> {
    model.networks.iter().map(|network| rounded_network(network, n_channels)).collect()
}

fn rounded_network(network: &ContextNetwork<f32>, n_channels: usize) -> Result<ContextNetwork<f32>, IntegerModelError> {
    let [hidden, output] = rows(&network.mlp, n_channels)?;
    let weights = |layer: &[IntegerRow]| -> Vec<f32> {
        let row = |row: &IntegerRow| {
            let unit = power_of_two(-row.weight_bits) as f32;
            row.weights.iter().map(move |weight| f32::from(*weight) * unit).collect::<Vec<_>>()
        };
        layer.iter().flat_map(row).collect()
    };
    let (w1, w2) = (weights(&hidden), weights(&output));
    let ContextNetwork { mlp, n_taps, .. } = network;
    let taps = tap_integers(network)?.into_iter().map(|tap| f32::from(tap) * TAP_UNIT).collect();
    Ok(ContextNetwork { mlp: Head { w1, w2, ..mlp.clone() }, n_taps: *n_taps, taps })
}

/// Both layers in integers.
fn rows(mlp: &Head<f32>, n_channels: usize) -> Result<[Vec<IntegerRow>; 2], IntegerModelError> {
    // Fraction bits of what goes in and of what comes out.
    let layer = |weights: &[f32], n_in: usize, biases: &[f32], bits_in: i32, bits_out: &dyn Fn(usize) -> i32| {
        let rows = weights.chunks_exact(n_in).zip(biases).enumerate();
        rows.map(|(index, (row, bias))| integer_row(index, row, *bias, bits_in, bits_out(index)))
            .collect::<Result<Vec<_>, _>>()
    };
    let output_bits = |index: usize| if index < n_channels { MEAN_PARTS.ilog2() } else { EIGHTHS.ilog2() } as i32;
    Ok([
        layer(&mlp.w1, mlp.n_in, &mlp.b1, INPUT_BITS, &|_| HIDDEN_BITS)?,
        layer(&mlp.w2, mlp.n_hidden, &mlp.b2, HIDDEN_BITS, &output_bits)?,
    ])
}

fn integer_row(
    index: usize,
    weights: &[f32],
    bias: f32,
    bits_in: i32,
    bits_out: i32,
) -> Result<IntegerRow, IntegerModelError> {
    let largest = weights.iter().fold(0.0_f32, |largest, weight| largest.max(weight.abs()));
    if let Some(&value) = weights.iter().chain([&bias]).find(|w| !w.is_finite()) {
        return Err(IntegerModelError::Weight { row: index, value });
    }
    // Room for the half that rounds the shift.
    let bias_room = f64::from(MAX_BIAS / 2);
    let weight_bits = (MIN_WEIGHT_BITS..=MAX_WEIGHT_BITS).rev().find(|&bits| {
        f64::from(largest) * power_of_two(bits) <= f64::from(i8::MAX)
            && f64::from(bias.abs()) * power_of_two(bits + bits_in) <= bias_room
    });
    let too_large = IntegerModelError::Weight { row: index, value: largest.max(bias.abs()) };
    let weight_bits = weight_bits.ok_or(too_large)?;
    let shift = weight_bits + bits_in - bits_out;
    let half = if shift > 0 { 1 << (shift - 1) } else { 0 };
    let weights = weights.iter().map(|w| (f64::from(*w) * power_of_two(weight_bits)).round() as i8).collect();
    let bias = (f64::from(bias) * power_of_two(weight_bits + bits_in)).round() as i32 + half;
    Ok(IntegerRow { weight_bits, weights, bias, shift: shift as u8 })
}

/// The taps' weights in units of [`TAP_UNIT`]; those beyond −1 … 127/128 end there.
fn tap_integers(network: &ContextNetwork<f32>) -> Result<Vec<i8>, IntegerModelError> {
    let integer = |tap: &f32| {
        // A cast of a float ends at the type's ends.
        if tap.is_finite() { Ok((tap / TAP_UNIT).round() as i8) } else { Err(IntegerModelError::Tap { value: *tap }) }
    };
    network.taps.iter().map(integer).collect()
}

fn power_of_two(exponent: i32) -> f64 {
    f64::from(exponent).exp2()
}

/// Four bits a row, set for +1; two rows a byte, the first in the low half.
fn grid_bytes(rows: &[f32]) -> impl Iterator<Item = u8> + '_ {
    let nibble = |row: &[f32]| (0..).zip(row).fold(0, |bits, (i, v)| bits | u8::from(*v >= 0.0) << i);
    rows.chunks(8).map(move |pair| nibble(&pair[..4]) | pair.get(4..).map_or(0, nibble) << 4)
}

#[cfg(test)]
mod tests {
    use pocketsplat_format::context::{FEATURE_ONE, GridFrame, Group, LevelKind};

    use super::*;
    use crate::finite_difference::random;
    use crate::ops::heads::head;
    use crate::scene::ModelShape;

    const SHAPE: ModelShape = ModelShape { view_colour: true, ..ModelShape::plain(5, 2) };

    fn model(seed: u64, width: f64) -> ContextModel<f32> {
        let levels = vec![
            GridLevel { kind: LevelKind::Volume, resolution: 5, n_rows: 125 },
            GridLevel { kind: LevelKind::Volume, resolution: 60, n_rows: 256 },
            GridLevel { kind: LevelKind::Xz, resolution: 90, n_rows: 64 },
        ];
        let frame = GridFrame::spanning([-40, -30, 7], [200, 70, 90]);
        let mut model = ContextModel::filled(&SHAPE, frame, levels, 16, [1.0, 0.1, 0.2], 0.0);
        let fill = |values: &mut [f32], seed: u64, width: f64| {
            let numbers = random(seed, values.len());
            values.iter_mut().zip(numbers).for_each(|(value, x)| *value = (x * width) as f32);
        };
        fill(&mut model.rows, seed, 1.0);
        for (group, values) in (1..).zip(model.networks[0].mlp.groups_mut()) {
            fill(values, seed + group, width);
        }
        model
    }

    #[test]
    fn the_integers_compute_what_the_floats_do() {
        let n_channels = SHAPE.values_per_anchor();
        for seed in 0..20 {
            let model = model(100 * seed, 0.5);
            let bytes = section(&model, n_channels).expect("a sound model");
            let context = parse(&bytes, &SHAPE).expect("a sound section");
            let rounded = rounded(&model, n_channels).expect("a sound model");
            for lattice in [[-40, -30, 7], [0, 0, 50], [199, 69, 89], [500, -500, 33]] {
                let (mut features, mut hidden) = (vec![0; context.n_inputs()], vec![0; context.n_hidden()]);
                context.features(lattice, &mut features);
                let network = context.network(0);
                network.hidden(&features, &mut hidden);
                let input: Vec<f32> = features.iter().map(|f| f32::from(*f) / f32::from(FEATURE_ONE)).collect();
                let (mut float_hidden, mut expected) = (vec![0.0; 16], vec![0.0; context.n_outputs()]);
                head::forward(&rounded[0].mlp, &input, &mut float_hidden, &mut expected);
                for (row, expected) in expected.iter().enumerate() {
                    let parts = if row < n_channels { 64.0 } else { 8.0 };
                    let found = f32::from(network.output(row, &hidden)) / parts;
                    // Half a part, and sixteen hidden units that are half of 2⁻¹⁰ off.
                    let tolerance = 0.51 / parts + 16.0 * 0.5 / 2048.0;
                    assert!((found - expected).abs() < tolerance, "row {row}: {found} against {expected}");
                }
                let steps = network.steps(&hidden);
                for (group, base, output) in
                    [(Group::Feature, 1.0, 0), (Group::LogScale, 0.1, 1), (Group::Offset, 0.2, 2)]
                {
                    let exponent = expected[2 * n_channels + output].clamp(-3.0, 0.875);
                    let ratio = steps.value(group) / (base * exponent.exp2());
                    assert!((ratio.log2() * 8.0).abs() < 0.6, "{group:?}: {ratio}");
                }
            }
        }
    }

    #[test]
    fn features_are_the_interpolated_signs() {
        let model = model(7, 0.5);
        let n_channels = SHAPE.values_per_anchor();
        let bytes = section(&model, n_channels).expect("a sound model");
        let context = parse(&bytes, &SHAPE).expect("a sound section");
        let mut features = vec![0; context.n_inputs()];
        for lattice in [[-40, -30, 7], [3, 21, 50], [111, 69, 89]] {
            context.features(lattice, &mut features);
            let unit = model.frame.unit(lattice);
            let mut first = 0;
            for (level, found) in model.levels.iter().zip(features.chunks_exact(4)) {
                for (f, found) in found.iter().enumerate() {
                    let expected: f64 = level
                        .corners(unit)
                        .iter()
                        .map(|(row, weight)| {
                            let sign = if model.rows[(first + row as usize) * 4 + f] >= 0.0 { 1.0 } else { -1.0 };
                            sign * f64::from(weight) / f64::from(1 << 24)
                        })
                        .sum();
                    let found = f64::from(*found) / f64::from(FEATURE_ONE);
                    assert!((found - expected).abs() <= 0.5 / f64::from(FEATURE_ONE), "{found} against {expected}");
                }
                first += level.n_rows as usize;
            }
        }
    }

    #[test]
    fn weights_out_of_range_are_named() {
        let mut model = model(1, 0.5);
        model.networks[0].mlp.w2[3 * 16] = f32::NAN;
        let error = section(&model, SHAPE.values_per_anchor()).expect_err("not a number");
        assert!(matches!(error, IntegerModelError::Weight { row: 3, .. }), "{error}");
        model.networks[0].mlp.w2[3 * 16] = 1e6;
        assert!(section(&model, SHAPE.values_per_anchor()).is_err(), "no shift is left for it");
    }
}
