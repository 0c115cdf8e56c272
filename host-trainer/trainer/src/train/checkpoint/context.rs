//! A context model and its moments to a checkpoint and back.

use std::io::{self, Write};

use pocketsplat_core::context::{GridFrame, GridLevel, LevelKind, N_GROUPS};

use super::CheckpointFault;
use super::codec::{Decoder, Encoder};
use crate::ops::adam::Moments;
use crate::scene::{ContextModel, Head, ModelShape};
use crate::train::optimiser::ContextMoments;

type WithMoments = (ContextModel<f32>, ContextMoments<f32>);

/// Writes whether there is a model, and it.
pub(super) fn encode<W: Write>(
    out: &mut Encoder<W>,
    model: Option<&ContextModel<f32>>,
    moments: Option<&ContextMoments<f32>>,
) -> io::Result<()> {
    let (Some(model), Some(moments)) = (model, moments) else { return out.value(0u32) };
    out.value(u32::try_from(model.mlp.n_hidden).map_err(io::Error::other)?)?;
    out.value(model.frame.min)?;
    out.value(model.frame.scale)?;
    out.value(model.base_steps)?;
    let levels = model.levels.iter().map(|l| [u32::from(l.kind.code()), u32::from(l.resolution), l.n_rows]);
    out.values(&levels.collect::<Vec<_>>())?;
    out.value(moments.n_steps)?;
    for rows in [&model.rows, &moments.rows.first, &moments.rows.second] {
        out.values(rows)?;
    }
    for group in [&model.mlp, &moments.mlp[0], &moments.mlp[1]].into_iter().flat_map(Head::groups) {
        out.values(group)?;
    }
    Ok(())
}

/// Reads what [`encode`] wrote.
pub(super) fn decode(from: &mut Decoder<'_>, shape: &ModelShape) -> Result<Option<WithMoments>, CheckpointFault> {
    let n_hidden: u32 = from.value("hidden units of the context")?;
    if n_hidden == 0 {
        return Ok(None);
    }
    let frame = GridFrame { min: from.value("frame of the grid")?, scale: from.value("frame of the grid")? };
    let base_steps: [f32; N_GROUPS] = from.value("base steps")?;
    let records: Vec<[u32; 3]> = from.values("levels of the grid")?;
    let level = |[kind, resolution, n_rows]: [u32; 3]| {
        let kind = u8::try_from(kind).ok().and_then(LevelKind::from_code);
        Some(GridLevel { kind: kind?, resolution: u16::try_from(resolution).ok()?, n_rows })
    };
    let levels: Option<Vec<GridLevel>> = records.iter().copied().map(level).collect();
    let unknown = CheckpointFault::Content { what: "kind of a grid level", found: u64::MAX, needed: 0 };
    let mut model = ContextModel::filled(shape, frame, levels.ok_or(unknown)?, n_hidden as usize, base_steps, 0.0);
    let mut moments = ContextMoments::zeros(&model);
    moments.n_steps = from.value("steps of the context")?;
    let n_rows = model.rows.len();
    model.rows = from.exactly("rows of the grid", n_rows)?;
    moments.rows =
        Moments { first: from.exactly("rows of the grid", n_rows)?, second: from.exactly("rows of the grid", n_rows)? };
    let [first, second] = &mut moments.mlp;
    for group in [&mut model.mlp, first, second].into_iter().flat_map(|head| head.groups_mut()) {
        *group = from.exactly("network of the context", group.len())?;
    }
    Ok(Some((model, moments)))
}
