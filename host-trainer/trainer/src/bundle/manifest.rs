//! The manifest: what each tier looks like and what drawing it takes, measured after the scene is coded.
//!
//! One pass over the views counts for all tiers, because tiers are nested: what an anchor adds to a frame is counted in
//! its tier, and tier t has the sum up to t.

mod frame;
mod orbit;

use pocketsplat_core::bundle::{MANIFEST_RECORD_LEN, TierMeasures, crc32};
use pocketsplat_core::{Bundle, DecodeError, SectionKind, chunks_in_view};
use rayon::prelude::*;

use super::decoded::decoded_scene;
use crate::metrics::psnr_db_masked;
use crate::ops::Pinhole;
use crate::render::decoder::core_image_of_tiers;
use crate::step::Workspace;
use frame::TierCounts;
use pocketsplat_capture::camera::Camera;
use pocketsplat_capture::dataset::View;

/// Most training cameras that are measured.
const MAX_TRAINING_CAMERAS: usize = 48;
/// The bits of "not measured".
const NOT_MEASURED: u32 = 0x7FC0_0000;

/// The section of a bundle that nobody has measured.
pub(super) fn unmeasured(n_tiers: usize) -> Vec<u8> {
    let mut record = [0; MANIFEST_RECORD_LEN];
    record[..4].copy_from_slice(&NOT_MEASURED.to_le_bytes());
    record.repeat(n_tiers)
}

/// Cameras worth measuring: at most 48 of those given, evenly picked, and 24 on an orbit around what they look at.
///
/// * `cameras`: in the normalised frame.
pub fn cameras_to_measure(cameras: &[Camera]) -> Vec<Camera> {
    let n = cameras.len().min(MAX_TRAINING_CAMERAS);
    let picked = (0..n).map(|i| cameras[i * cameras.len() / n].clone());
    picked.chain(orbit::around(cameras)).collect()
}

/// Measures every tier of a bundle.
///
/// Counts are those of the trainer's renderer, whose arithmetic differs from the decoder's in the last bits. Those of
/// anchors are of the prefilter alone, pixel evaluations are those inside the splats' ellipses, as if no pixel ended
/// early: both are upper bounds of what a decoder does. Cost: one frame a camera, one decoded frame a tier and held-out
/// view.
///
/// * `cameras`: over which maxima are taken. * `held_out`: views whose photographs the tiers are compared with.
///
/// # Errors
/// [`DecodeError`] of a damaged bundle or an unusable camera.
pub fn measure(bundle: &Bundle<'_>, cameras: &[Camera], held_out: &[View]) -> Result<Vec<TierMeasures>, DecodeError> {
    let scene = decoded_scene(bundle)?;
    let header = bundle.header();
    let ends: Vec<u32> =
        (0..bundle.n_tiers()).filter_map(|t| bundle.directory().tier(t)).map(|t| t.n_anchors).collect();
    let mut workspace = Workspace::new(&scene.shape);
    let background = header.background.map(|byte| f32::from(byte) / 255.0);
    let mut maxima = vec![TierCounts::default(); ends.len()];
    for camera in cameras {
        workspace.image(&scene, &Pinhole::new(camera), background);
        let counts = frame::count(&scene.shape, workspace.blocks(), &ends, camera);
        for (most, counts) in maxima.iter_mut().zip(counts) {
            most.raise_to(&counts);
        }
        let core = crate::camera::core_camera(camera)?;
        for (tier, most) in maxima.iter_mut().enumerate() {
            let in_view = chunks_in_view(bundle, &core, tier as u8 + 1)?;
            most.decoded_anchors = most.decoded_anchors.max(in_view.map(|chunk| u64::from(chunk.n_anchors())).sum());
        }
    }
    (0..)
        .zip(maxima)
        .map(|(tier, counts)| {
            let psnr_db = mean_psnr_db(bundle, tier + 1, held_out)?;
            Ok(counts.measures(psnr_db, held_out.len(), cameras.len()))
        })
        .collect()
}

/// Mean PSNR over views of 8-bit images, dB; `None` without views.
fn mean_psnr_db(bundle: &Bundle<'_>, n_tiers: u8, views: &[View]) -> Result<Option<f32>, DecodeError> {
    let psnr = views.par_iter().map(|view| {
        let frame = core_image_of_tiers(bundle, &view.camera, n_tiers)?;
        Ok(psnr_db_masked(&frame.image, &view.image, view.mask.as_ref()))
    });
    let psnr = psnr.collect::<Result<Vec<f64>, DecodeError>>()?;
    Ok((!psnr.is_empty()).then(|| (psnr.iter().sum::<f64>() / psnr.len() as f64) as f32).filter(|x| x.is_finite()))
}

/// Puts measures into a bundle in place of those it has.
///
/// # Errors
/// [`DecodeError`] when `bytes` is not a sound bundle.
///
/// # Panics
/// If there are not as many measures as tiers.
pub fn install(bytes: &mut [u8], measures: &[TierMeasures]) -> Result<(), DecodeError> {
    let bundle = Bundle::parse(bytes)?;
    assert_eq!(measures.len(), usize::from(bundle.header().n_tiers), "measures for each tier");
    let header_len = usize::from(bundle.header().header_len);
    let row = bundle.sections().position(|section| section.kind == SectionKind::Manifest);
    let section = bundle.sections().find(|section| section.kind == SectionKind::Manifest);
    let (Some(row), Some(section)) = (row, section) else { return Err(DecodeError::Internal) };
    let records: Vec<u8> = measures.iter().flat_map(record).collect();
    let (start, len) = (section.offset as usize, section.len as usize);
    bytes[start..start + len].copy_from_slice(&records);
    let crc_at = super::layout::section_crc_offset(row);
    bytes[crc_at..crc_at + 4].copy_from_slice(&crc32(&records).to_le_bytes());
    let crc = crc32(&bytes[..header_len - 4]);
    bytes[header_len - 4..header_len].copy_from_slice(&crc.to_le_bytes());
    Ok(())
}

/// A tier's record.
fn record(measures: &TierMeasures) -> Vec<u8> {
    let mut bytes = measures.psnr_db.map_or(NOT_MEASURED, f32::to_bits).to_le_bytes().to_vec();
    bytes.extend([measures.n_views, measures.n_cameras].iter().flat_map(|x| x.to_le_bytes()));
    let counts = [measures.max_visible_anchors, measures.max_splats]
        .into_iter()
        .chain(measures.max_strip_splats)
        .chain(measures.max_strip_pairs)
        .chain([measures.max_head_kilo_macs, measures.max_kilo_pixels, measures.max_decoded_anchors]);
    bytes.extend(counts.flat_map(u32::to_le_bytes));
    bytes
}
