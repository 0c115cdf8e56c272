//! Header, sections and their checksums, in file order.

use half::f16;
use pocketsplat_core::Bundle;
use pocketsplat_core::bundle::{
    Effects, HEADER_LEN, MAGIC, MAX_ANCHORS, MAX_CHUNK_ANCHORS, MAX_FEATURE_DIM, MAX_OFFSETS, VERSION, crc32,
};

use super::chunk::EncodedChunk;
use super::table::TableSet;
use super::{BundleInfo, WriteError};
use crate::render::decoder::core_camera;
use crate::scene::{Heads, Scene};

/// Puts the parts together, and parses the result once: everything but the chunks' words is checked again.
pub(super) fn assemble(
    scene: &Scene<f32>,
    info: &BundleInfo,
    chunk_anchors: u16,
    tables: &TableSet,
    chunks: &[EncodedChunk],
) -> Result<Vec<u8>, WriteError> {
    let sections = [
        heads_section(&scene.heads)?,
        tables_section(tables),
        directory_section(chunks),
        chunks.iter().flat_map(|chunk| chunk.bytes.iter().copied()).collect(),
    ];
    let file_len = HEADER_LEN + sections.iter().map(Vec::len).sum::<usize>();
    let file_len = count("file length", file_len, 0, u32::MAX as usize)?;
    let mut bytes = header_fields(scene, info, chunk_anchors, chunks.len(), file_len as u32)?;
    let mut offset = HEADER_LEN;
    for (kind, section) in (1_u32..).zip(&sections) {
        // Chunks have their checksums in the directory.
        let crc = if kind == 4 { 0 } else { crc32(section) };
        for word in [kind, offset as u32, section.len() as u32, crc] {
            bytes.extend(word.to_le_bytes());
        }
        offset += section.len();
    }
    bytes.extend(crc32(&bytes).to_le_bytes());
    bytes.extend(sections.into_iter().flatten());
    Bundle::parse(&bytes).map_err(WriteError::ReadBack)?;
    Ok(bytes)
}

/// The header up to its section table.
fn header_fields(
    scene: &Scene<f32>,
    info: &BundleInfo,
    chunk_anchors: u16,
    n_chunks: usize,
    file_len: u32,
) -> Result<Vec<u8>, WriteError> {
    let shape = &scene.shape;
    let effects = Effects {
        view_direction: shape.view_direction,
        view_distance: shape.view_distance,
        dilation_compensation: shape.dilation_compensation,
    };
    let feature_dim = count("feature width", shape.feature_dim, 1, MAX_FEATURE_DIM.into())?;
    let n_offsets = count("number of offsets", shape.n_offsets, 1, MAX_OFFSETS.into())?;
    let n_anchors = count("number of anchors", scene.anchors.len(), 0, MAX_ANCHORS as usize)?;
    let chunk_anchors = count("anchors of a chunk", chunk_anchors.into(), 1, MAX_CHUNK_ANCHORS.into())?;
    let [width, height] = info.training_px.map(|px| px as usize);
    let training_px =
        [count("training width", width, 1, u16::MAX.into())?, count("training height", height, 1, u16::MAX.into())?];
    let normalisation = &info.normalisation;
    positive("voxel size", f64::from(scene.voxel_size as f32))?;
    positive("normalisation scale", normalisation.scale)?;
    let preview = core_camera(&info.preview).map_err(WriteError::Preview)?;

    let mut bytes = MAGIC.to_vec();
    bytes.extend([VERSION, HEADER_LEN as u16].iter().flat_map(|x| x.to_le_bytes()));
    bytes.extend([file_len, effects.to_bits()].iter().flat_map(|x| x.to_le_bytes()));
    bytes.extend([feature_dim as u16, n_offsets as u16].iter().flat_map(|x| x.to_le_bytes()));
    bytes.extend([n_anchors as u32, n_chunks as u32].iter().flat_map(|x| x.to_le_bytes()));
    bytes.extend((chunk_anchors as u16).to_le_bytes());
    // Camera convention OpenCV, four sections.
    bytes.extend([0, 4]);
    bytes.extend(training_px.iter().flat_map(|&x| (x as u16).to_le_bytes()));
    bytes.extend(info.background);
    bytes.push(0);
    bytes.extend((scene.voxel_size as f32).to_le_bytes());
    let [x, y, z] = normalisation.centre.to_array();
    bytes.extend([x, y, z, normalisation.scale].iter().flat_map(|x| x.to_le_bytes()));
    let pose = preview.rotation.iter().chain(&preview.translation);
    let floats = pose.chain(&preview.focal_px).chain(&preview.principal_px);
    bytes.extend(floats.flat_map(|x| x.to_le_bytes()));
    bytes.extend([preview.width_px, preview.height_px].iter().flat_map(|x| x.to_le_bytes()));
    Ok(bytes)
}

fn heads_section(heads: &Heads<f32>) -> Result<Vec<u8>, WriteError> {
    let mut bytes = Vec::new();
    for (head, name) in heads.each().into_iter().zip(["opacity", "covariance", "colour"]) {
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

fn tables_section(set: &TableSet) -> Vec<u8> {
    let mut bytes = Vec::new();
    let u16_bytes = |x: usize| (x as u16).to_le_bytes();
    bytes.extend(u16_bytes(set.tables.len()));
    bytes.extend(u16_bytes(set.channel_tables.len()));
    bytes.extend(set.channel_tables.iter().flat_map(|&table| u16_bytes(table)));
    let mut offset = bytes.len() + 4 * set.tables.len();
    for table in &set.tables {
        bytes.extend((offset as u32).to_le_bytes());
        offset += 12 + 2 * table.ends.len();
    }
    for table in &set.tables {
        // The origin is 0: symbol 0 is the value 0, and channels of equal step can share a table.
        bytes.extend([0.0, table.step].iter().flat_map(|x| x.to_le_bytes()));
        bytes.extend(table.min_symbol.to_le_bytes());
        bytes.extend(u16_bytes(table.ends.len()));
        bytes.extend(table.ends.iter().flat_map(|end| end.to_le_bytes()));
    }
    bytes
}

fn directory_section(chunks: &[EncodedChunk]) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut offset = 0_u32;
    for chunk in chunks {
        let len = chunk.bytes.len() as u32;
        bytes.extend([offset, len, chunk.crc].iter().flat_map(|x| x.to_le_bytes()));
        bytes.extend([chunk.n_anchors, 0].iter().flat_map(|x| x.to_le_bytes()));
        bytes.extend(chunk.ink_min.iter().chain(&chunk.ink_max).flat_map(|x| x.to_le_bytes()));
        offset += len;
    }
    bytes
}

fn count(what: &'static str, found: usize, least: usize, most: usize) -> Result<usize, WriteError> {
    if found < least || found > most {
        return Err(WriteError::Count { what, found, least, most });
    }
    Ok(found)
}

fn positive(what: &'static str, value: f64) -> Result<(), WriteError> {
    if value.is_finite() && value > 0.0 { Ok(()) } else { Err(WriteError::NotPositive { what, value }) }
}
