//! The weights of the heads: halves, or steps of a fixed size under two tables.

use half::f16;

use super::WriteError;
use super::stream::SlotList;
use super::table::TableDraft;
use pocketsplat_kernels::ops::rate::perturb;
use pocketsplat_kernels::scene::{Head, Heads};

/// Coded matrices are worth their decoding if the section is at most so many times as long as raw halves.
const WORTHWHILE: f64 = 0.9;

/// The heads section, and whether its matrices are coded.
pub(super) struct HeadsSection {
    pub(super) bytes: Vec<u8>,
    pub(super) is_coded: bool,
}

/// Matrices as symbols where that saves a tenth, else as halves; biases are always halves.
///
/// * `fraction_bits`: of the coded weights of W1 and of W2, 0 to 24: a weight is a multiple of 2^−bits. Without it nothing
///   is coded.
///
/// # Errors
/// [`WriteError::Weight`].
pub(super) fn section(heads: &Heads<f32>, fraction_bits: Option<[u8; 2]>) -> Result<HeadsSection, WriteError> {
    let raw = raw(heads)?;
    if let Some(coded) = fraction_bits.and_then(|bits| coded(heads, bits))
        && coded.len() as f64 <= WORTHWHILE * raw.len() as f64
    {
        return Ok(HeadsSection { bytes: coded, is_coded: true });
    }
    Ok(HeadsSection { bytes: raw, is_coded: false })
}

fn raw(heads: &Heads<f32>) -> Result<Vec<u8>, WriteError> {
    let mut bytes = Vec::new();
    for (head, name) in heads.each().zip(heads.names()) {
        for (index, &value) in head.groups().into_iter().flatten().enumerate() {
            let weight = f16::from_f32(value);
            if !weight.is_finite() {
                return Err(WriteError::Weight { head: name, index, value });
            }
            bytes.extend(weight.to_le_bytes());
        }
    }
    Ok(bytes)
}

/// Both tables, the biases, and one stream of W1 and W2 of each head; `None` when a weight is beyond 32767 steps.
fn coded(heads: &Heads<f32>, fraction_bits: [u8; 2]) -> Option<Vec<u8>> {
    let [steps_1, steps_2] = fraction_bits.map(|bits| (-f32::from(bits)).exp2());
    let symbols = |weights: &[f32], step: f32| {
        let symbol = |weight: &f32| {
            let symbol = perturb::symbol(*weight, step);
            (symbol.abs() <= f32::from(i16::MAX)).then_some(symbol as i16)
        };
        weights.iter().map(symbol).collect::<Option<Vec<i16>>>()
    };
    let matrices: Vec<[Vec<i16>; 2]> = heads
        .each()
        .map(|Head { w1, w2, .. }| Some([symbols(w1, steps_1)?, symbols(w2, steps_2)?]))
        .collect::<Option<_>>()?;
    let table = |layer: usize, step: f32| TableDraft::of(step, matrices.iter().flat_map(|head| &head[layer]).copied());
    let tables = [table(0, steps_1), table(1, steps_2)];
    let mut bytes: Vec<u8> = tables.iter().flat_map(|table| table.view().emit()).collect();
    let biases = heads.each().flat_map(|head| head.b1.iter().chain(&head.b2));
    bytes.extend(biases.flat_map(|&bias| f16::from_f32(bias).to_le_bytes()));
    let mut list = SlotList::default();
    for head in &matrices {
        for (layer, table) in head.iter().zip(&tables) {
            layer.iter().flat_map(|&symbol| table.slots(symbol)).for_each(|slot| list.append(&slot));
        }
    }
    bytes.extend(list.into_bytes());
    Some(bytes)
}
