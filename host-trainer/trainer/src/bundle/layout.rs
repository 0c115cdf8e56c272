//! Header, sections and their checksums, in file order.

use pocketsplat_core::bundle::{
    Effects, Features, HEADER_FIXED_LEN, MAGIC, MAX_ANCHORS, MAX_CHUNK_ANCHORS, MAX_FEATURE_DIM, MAX_OFFSETS,
    SECTION_LEN, VERSION, crc32, header_len,
};
use pocketsplat_core::context::N_GROUPS;

use super::{BundleInfo, WriteError};
use crate::camera::core_camera;
use crate::scene::Scene;

/// A section of the file; the numbers are the format's.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum SectionCode {
    Heads = 1,
    Lattice = 2,
    Masks = 3,
    Tables = 4,
    Context = 5,
    Manifest = 6,
    Directory = 7,
    Chunks = 8,
    Gaussians = 128,
}

/// Where the checksum of the section in row `row` of the section table lies.
pub(super) fn section_crc_offset(row: usize) -> usize {
    HEADER_FIXED_LEN + SECTION_LEN * row + 12
}

/// What the header says besides what follows from the scene.
pub(super) struct Counts {
    pub(super) features: Features,
    pub(super) n_anchors: usize,
    pub(super) n_chunks: usize,
    pub(super) max_chunk_anchors: u16,
    pub(super) n_tiers: usize,
    /// Bits of the symbols of features, log-scales and offsets.
    pub(super) symbol_bits: [u8; N_GROUPS],
}

/// What the scene takes into account.
pub(super) fn effects(scene: &Scene<f32>, info: &BundleInfo) -> Effects {
    Effects {
        view_colour: scene.shape.view_colour,
        view_geometry: scene.shape.view_geometry,
        view_distance: scene.shape.view_distance,
        dilation_compensation: scene.shape.dilation_compensation,
        detail: scene.heads.detail.is_some(),
        anisotropic: scene.shape.anisotropic,
        background: info.background != [0; 3],
    }
}

/// Puts the parts together; the chunks come last.
pub(super) fn assemble(
    scene: &Scene<f32>,
    info: &BundleInfo,
    counts: &Counts,
    sections: &[(SectionCode, Vec<u8>)],
) -> Result<Vec<u8>, WriteError> {
    let header_len = header_len(sections.len() as u8);
    let file_len = header_len + sections.iter().map(|(_, bytes)| bytes.len()).sum::<usize>();
    let file_len = count("file length", file_len, 0, u32::MAX as usize)?;
    let mut bytes = MAGIC.to_vec();
    bytes.extend([VERSION, header_len as u16].iter().flat_map(|x| x.to_le_bytes()));
    bytes.extend((file_len as u32).to_le_bytes());
    push_fields(&mut bytes, scene, info, counts, sections.len())?;
    let mut offset = header_len;
    for (code, section) in sections {
        // Chunks have their checksums in the directory.
        let crc = if *code == SectionCode::Chunks { 0 } else { crc32(section) };
        for word in [*code as u32, offset as u32, section.len() as u32, crc] {
            bytes.extend(word.to_le_bytes());
        }
        offset += section.len();
    }
    bytes.extend(crc32(&bytes).to_le_bytes());
    bytes.extend(sections.iter().flat_map(|(_, section)| section));
    Ok(bytes)
}

/// The header's fields from the required features to the section table.
fn push_fields(
    bytes: &mut Vec<u8>,
    scene: &Scene<f32>,
    info: &BundleInfo,
    counts: &Counts,
    n_sections: usize,
) -> Result<(), WriteError> {
    let feature_dim = count("feature width", scene.shape.feature_dim, 1, MAX_FEATURE_DIM.into())?;
    let n_offsets = count("number of offsets", scene.shape.n_offsets, 1, MAX_OFFSETS.into())?;
    let most_hidden = MAX_FEATURE_DIM.into();
    let colour_hidden = count("hidden width of the colour head", scene.heads.colour.n_hidden, 1, most_hidden)?;
    let detail_hidden = match &scene.heads.detail {
        Some(detail) => count("hidden width of the detail head", detail.n_hidden, 1, most_hidden)?,
        None => 0,
    };
    let n_anchors = count("number of anchors", counts.n_anchors, 0, MAX_ANCHORS as usize)?;
    let chunk_anchors = count("anchors of a chunk", counts.max_chunk_anchors.into(), 1, MAX_CHUNK_ANCHORS.into())?;
    let [width, height] = info.training_px.map(|px| px as usize);
    let training_px =
        [count("training width", width, 1, u16::MAX.into())?, count("training height", height, 1, u16::MAX.into())?];
    let normalisation = &info.normalisation;
    positive("voxel size", f64::from(scene.voxel_size as f32))?;
    positive("normalisation scale", normalisation.scale)?;
    let preview = core_camera(&info.preview).map_err(WriteError::Preview)?;

    // No optional features yet.
    bytes.extend([counts.features.to_bits(), 0].iter().flat_map(|x| x.to_le_bytes()));
    bytes.extend([feature_dim as u16, n_offsets as u16].iter().flat_map(|x| x.to_le_bytes()));
    bytes.extend([n_anchors as u32, counts.n_chunks as u32].iter().flat_map(|x| x.to_le_bytes()));
    bytes.extend((chunk_anchors as u16).to_le_bytes());
    // Camera convention OpenCV.
    bytes.extend([0, n_sections as u8]);
    bytes.extend(training_px.iter().flat_map(|&x| (x as u16).to_le_bytes()));
    bytes.extend(info.background);
    bytes.push(counts.n_tiers as u8);
    bytes.extend((scene.voxel_size as f32).to_le_bytes());
    bytes.extend([colour_hidden as u16, detail_hidden as u16].iter().flat_map(|x| x.to_le_bytes()));
    let [x, y, z] = normalisation.centre.to_array();
    bytes.extend([x, y, z, normalisation.scale].iter().flat_map(|x| x.to_le_bytes()));
    let pose = preview.rotation.iter().chain(&preview.translation);
    let floats = pose.chain(&preview.focal_px).chain(&preview.principal_px);
    bytes.extend(floats.flat_map(|x| x.to_le_bytes()));
    bytes.extend([preview.width_px, preview.height_px].iter().flat_map(|x| x.to_le_bytes()));
    bytes.extend(counts.symbol_bits);
    bytes.push(0);
    Ok(())
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
