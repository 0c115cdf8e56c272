//! The header and the sections of a coded scene, and the file that they make.

use pocketsplat_core::{Bundle, DecodeError, count_gaussians, count_scratch_len};
use pocketsplat_format::bundle::{
    Effects, Features, Header, MAX_ANCHORS, MAX_CHUNK_ANCHORS, MAX_FEATURE_DIM, MAX_OFFSETS, SectionBytes, TierMeasures,
};
use pocketsplat_format::context::N_GROUPS;
use pocketsplat_instructions::level::Level;

use super::{BundleInfo, MAX_PROTOCOL_LEN, SizeReport, WriteError};
use pocketsplat_kernels::camera::core_camera;
use pocketsplat_kernels::scene::Scene;

/// A bundle just written.
#[derive(Clone, Debug, PartialEq)]
pub struct Written {
    /// The file.
    pub bytes: Vec<u8>,
    /// Where its bytes went.
    pub report: SizeReport,
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

/// The header of a coded scene, all but its lengths, which the file fills in.
///
/// # Errors
/// [`WriteError::Count`], [`WriteError::NotPositive`], [`WriteError::Preview`].
pub(super) fn header(scene: &Scene<f32>, info: &BundleInfo, counts: &Counts) -> Result<Header, WriteError> {
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

    Ok(Header {
        header_len: 0,
        file_len: 0,
        features: counts.features,
        feature_dim: feature_dim as u16,
        n_offsets: n_offsets as u16,
        n_anchors: n_anchors as u32,
        n_chunks: counts.n_chunks as u32,
        max_chunk_anchors: chunk_anchors as u16,
        n_tiers: counts.n_tiers as u8,
        training_px: training_px.map(|px| px as u16),
        background: info.background,
        voxel_size: scene.voxel_size as f32,
        colour_hidden: colour_hidden as u16,
        detail_hidden: detail_hidden as u16,
        symbol_bits: counts.symbol_bits,
        normalisation_centre: normalisation.centre.to_array(),
        normalisation_scale: normalisation.scale,
        preview,
    })
}

/// A coded scene that is no file yet: the sections of its bundle, nothing measured but how many Gaussians it has.
#[derive(Clone, Debug, PartialEq)]
pub struct CodedScene {
    header: Header,
    parts: Parts,
    manifest: Vec<u8>,
    gaussians: Option<Vec<u8>>,
    protocol: Option<String>,
}

/// Sections that say what a scene is.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Parts {
    pub(super) heads: Vec<u8>,
    pub(super) lattice: Vec<u8>,
    pub(super) masks: Option<Vec<u8>>,
    /// Tables or context.
    pub(super) coder: Vec<u8>,
    pub(super) directory: Vec<u8>,
    pub(super) chunks: Vec<u8>,
}

impl CodedScene {
    /// Joins the sections and counts the Gaussians of a scene that looks the same from everywhere.
    ///
    /// # Errors
    /// [`WriteError::Count`] for a file of 4 GiB, [`WriteError::ReadBack`].
    pub(super) fn new(header: Header, parts: Parts, protocol: Option<String>) -> Result<Self, WriteError> {
        count("length of the protocol, bytes", protocol.as_ref().map_or(0, String::len), 0, MAX_PROTOCOL_LEN)?;
        let manifest =
            vec![TierMeasures::default(); header.n_tiers.into()].iter().flat_map(TierMeasures::emit).collect();
        let mut coded = Self { header, parts, manifest, gaussians: None, protocol };
        if !header.features.effects.see_view() {
            // What the decoder itself makes of it: it plans by these counts.
            coded.gaussians = Some(coded.gaussian_counts().map_err(WriteError::ReadBack)?);
        }
        count("file length", coded.file_len(), 0, u32::MAX as usize)?;
        Ok(coded)
    }

    fn gaussian_counts(&self) -> Result<Vec<u8>, DecodeError> {
        let bundle = self.bundle()?;
        let counts = count_gaussians(&bundle, &mut vec![0; count_scratch_len(&bundle)])?;
        Ok(counts.iter().take(bundle.n_tiers().into()).flat_map(|count| count.to_le_bytes()).collect())
    }

    /// What a decoder draws of it.
    ///
    /// # Errors
    /// [`DecodeError`] where the decoder refuses it: a mistake in the writer.
    pub fn bundle(&self) -> Result<Bundle<'_>, DecodeError> {
        Bundle::of_sections(self.header, &self.sections())
    }

    /// Length of its file, bytes.
    pub fn file_len(&self) -> usize {
        self.sections().file_len()
    }

    /// Assembles the file and reads it back. Each tier declares the least level that it keeps.
    ///
    /// * `measures`: `[n_tiers]`, or none at all for a scene that is not measured.
    ///
    /// # Errors
    /// [`WriteError::Length`] for another number of measures, [`WriteError::ReadBack`].
    pub fn into_file(mut self, measures: &[TierMeasures]) -> Result<Written, WriteError> {
        let (needed, found) = (self.header.n_tiers.into(), measures.len());
        if found == needed {
            self.manifest = measures.iter().flat_map(TierMeasures::emit).collect();
            let levels = self.levels()?;
            let declared = measures.iter().zip(levels).map(|(measures, level)| TierMeasures { level, ..*measures });
            self.manifest = declared.flat_map(|measures| measures.emit()).collect();
        } else if found > 0 {
            return Err(WriteError::Length { array: "measures", needed, found });
        }
        let bytes: Vec<u8> = self.sections().emit(&self.header).collect();
        let bundle = Bundle::parse(&bytes).map_err(WriteError::ReadBack)?;
        let report = SizeReport::of(&bundle).map_err(WriteError::ReadBack)?;
        Ok(Written { bytes, report })
    }

    /// The least level that each tier keeps; 0 for none.
    fn levels(&self) -> Result<Vec<u8>, WriteError> {
        let bytes: Vec<u8> = self.sections().emit(&self.header).collect();
        let bundle = Bundle::parse(&bytes).map_err(WriteError::ReadBack)?;
        Ok((0..bundle.n_tiers()).map(|tier| Level::least(&bundle, tier)).collect())
    }

    fn sections(&self) -> SectionBytes<'_> {
        let Parts { heads, lattice, masks, coder, directory, chunks } = &self.parts;
        SectionBytes {
            heads,
            lattice,
            masks: masks.as_deref(),
            coder,
            manifest: &self.manifest,
            directory,
            gaussians: self.gaussians.as_deref(),
            protocol: self.protocol.as_ref().map(String::as_bytes),
            chunks,
        }
    }
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
