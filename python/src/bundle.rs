//! A bundle in memory.

use std::sync::OnceLock;

use pocketsplat_codec::bundle::{check, decoded_scene};
use pocketsplat_codec::render::decoder::image_of;
use pocketsplat_core::{Budget, Bundle as Parsed, Camera, DecodeError, Decoder, MaxSplats, Plan, Quality};
use pocketsplat_kernels::camera::host_camera;
use pocketsplat_kernels::ops::Pinhole;
use pocketsplat_kernels::scene::Scene;
use pocketsplat_kernels::step::Workspace;
use pocketsplat_viewer::{SceneFile, page};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::{PyByteArray, PyDict, PyTuple};
use rayon::prelude::*;

use crate::camera::{CameraTuple, camera_of, tuple_of};
use crate::error::raised;

/// Width and height, pixels; bytes of memory; tiers at most; quality by name.
type Limits = ([u16; 2], Option<usize>, Option<u8>, String);

/// Of a tier and those before it: anchors, bytes of the file cut there, pruning rate, PSNR where it was measured.
type TierNumbers = (u32, u32, f64, Option<f32>);

/// Centres `[n, 3]`, rotations `[n, 4]` (w first), deviations `[n, 3]`, opacities `[n]` and colours `[n, 3]`, little-endian f32.
type GaussianArrays = [Vec<u8>; 5];

/// The bytes of a bundle, which were checked.
#[pyclass(frozen)]
pub(crate) struct Bundle {
    bytes: Vec<u8>,
    /// The scene as [`Bundle::gaussians`] evaluates it, decoded when it is first asked for.
    scene: OnceLock<Scene<f32>>,
}

impl Bundle {
    fn parsed(&self) -> PyResult<Parsed<'_>> {
        Parsed::parse(&self.bytes).map_err(raised)
    }
}

#[pymethods]
impl Bundle {
    #[new]
    fn new(py: Python<'_>, bytes: Vec<u8>) -> PyResult<Self> {
        py.detach(|| check(&bytes)).map_err(raised)?;
        Ok(Self { bytes, scene: OnceLock::new() })
    }

    /// What the header says.
    fn header<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let bundle = self.parsed()?;
        let header = bundle.header();
        let effects = header.features.effects;
        let out = PyDict::new(py);
        out.set_item("n_bytes", self.bytes.len())?;
        out.set_item("n_anchors", bundle.n_anchors())?;
        out.set_item("n_offsets", header.n_offsets)?;
        out.set_item("feature_dim", header.feature_dim)?;
        out.set_item("uses_context", header.features.context)?;
        out.set_item("view_colour", effects.view_colour)?;
        out.set_item("view_geometry", effects.view_geometry)?;
        out.set_item("view_distance", effects.view_distance)?;
        out.set_item("anisotropic", effects.anisotropic)?;
        out.set_item("dilation_compensation", effects.dilation_compensation)?;
        out.set_item("background", PyTuple::new(py, header.background)?)?;
        out.set_item("training_px", PyTuple::new(py, header.training_px)?)?;
        out.set_item("voxel_size", header.voxel_size)?;
        out.set_item("normalisation_centre", PyTuple::new(py, header.normalisation_centre)?)?;
        out.set_item("normalisation_scale", header.normalisation_scale)?;
        Ok(out)
    }

    /// The tiers, the smallest scene first.
    fn tiers(&self) -> PyResult<Vec<TierNumbers>> {
        let bundle = self.parsed()?;
        let chunks_start = bundle.sections().last().map_or(0, |section| section.offset);
        let all = f64::from(bundle.header().n_anchors.max(1));
        let tier = |number| {
            let (content, measures) = (bundle.tier(number)?, bundle.measures(number)?);
            let pruning_rate = 1.0 - f64::from(content.n_anchors) / all;
            Some((content.n_anchors, chunks_start + content.end, pruning_rate, measures.psnr_db))
        };
        Ok((0..bundle.n_tiers()).filter_map(tier).collect())
    }

    /// The camera that the bundle holds.
    fn preview(&self) -> PyResult<CameraTuple> {
        Ok(tuple_of(&self.parsed()?.header().preview))
    }

    /// What a decoder does within limits.
    fn plan<'py>(&self, py: Python<'py>, limits: Limits) -> PyResult<Bound<'py, PyDict>> {
        let plan = Plan::new(&self.parsed()?, &budget(&limits)?).map_err(raised)?;
        let out = PyDict::new(py);
        out.set_item("scratch_bytes", plan.scratch_len())?;
        out.set_item("n_tiers", plan.n_tiers())?;
        out.set_item("pruning_rate", plan.pruning_rate())?;
        out.set_item("n_strips", plan.n_strips())?;
        out.set_item("max_splats", plan.max_splats())?;
        out.set_item("is_resident", plan.is_resident())?;
        out.set_item("is_baked", plan.is_baked())?;
        Ok(out)
    }

    /// Pictures of cameras of one size, `[n, height, width, 3]`, by decoders bound to the same plan.
    fn render<'py>(
        &self,
        py: Python<'py>,
        cameras: Vec<CameraTuple>,
        limits: Limits,
    ) -> PyResult<Bound<'py, PyByteArray>> {
        let bundle = self.parsed()?;
        let budget = budget(&limits)?;
        let cameras = cameras.iter().map(camera_of).collect::<PyResult<Vec<Camera>>>()?;
        let pictures = py.detach(|| pictures(&bundle, &budget, &cameras)).map_err(raised)?;
        Ok(PyByteArray::new(py, &pictures))
    }

    /// The Gaussians that a camera sees.
    fn gaussians(&self, py: Python<'_>, camera: CameraTuple) -> PyResult<GaussianArrays> {
        let (bundle, camera) = (self.parsed()?, camera_of(&camera)?);
        py.detach(|| {
            let scene = match self.scene.get() {
                Some(scene) => scene,
                None => {
                    let decoded = decoded_scene(&bundle)?;
                    self.scene.get_or_init(|| decoded)
                }
            };
            Ok(seen(scene, &camera))
        })
        .map_err(raised)
    }

    /// The page of `pocketsplat view`.
    fn page(&self, title: &str) -> String {
        page(title, &[SceneFile { name: title, bytes: &self.bytes, spread: None }])
    }
}

fn budget((size_px, ram_bytes, tiers, quality): &Limits) -> PyResult<Budget> {
    let quality = match quality.as_str() {
        "exact" => Quality::EXACT,
        "balanced" => Quality::BALANCED,
        "draft" => Quality::DRAFT,
        other => {
            return Err(PyValueError::new_err(format!(
                "quality {other:?}: choose \"exact\", \"balanced\" or \"draft\""
            )));
        }
    };
    let [width_px, height_px] = *size_px;
    let budget = Budget::for_frame(width_px, height_px).with_quality(quality).with_tiers(tiers.unwrap_or(u8::MAX));
    Ok(match ram_bytes {
        Some(bytes) => budget.in_bytes(*bytes),
        // A PC has memory for every splat.
        None => budget.with_max_splats(MaxSplats::Worst),
    })
}

/// Each thread draws a run of the cameras with a decoder that it binds once.
fn pictures(bundle: &Parsed<'_>, budget: &Budget, cameras: &[Camera]) -> Result<Vec<u8>, DecodeError> {
    let plan = Plan::new(bundle, budget)?;
    let run = cameras.len().div_ceil(rayon::current_num_threads()).max(1);
    let parts: Result<Vec<Vec<u8>>, DecodeError> = cameras
        .par_chunks(run)
        .map(|cameras| {
            let mut scratch = vec![0; plan.scratch_len()];
            let mut decoder = Decoder::bind(bundle, plan, &mut scratch)?;
            let mut pixels = Vec::new();
            for camera in cameras {
                pixels.extend(image_of(&mut decoder, camera)?.0.rgb);
            }
            Ok(pixels)
        })
        .collect();
    Ok(parts?.concat())
}

/// What the trainer's renderer projects for a camera.
fn seen(scene: &Scene<f32>, camera: &Camera) -> GaussianArrays {
    let mut workspace = Workspace::new(&scene.shape);
    workspace.project(scene, &Pinhole::new(&host_camera(camera)));
    let mut arrays = GaussianArrays::default();
    for block in workspace.blocks() {
        for i in &block.drawn {
            let gaussian = &block.gaussians[*i as usize];
            let opacity = [gaussian.opacity];
            let parts: [&[f32]; 5] =
                [&gaussian.centre, &gaussian.rotation, &gaussian.scale, &opacity, &gaussian.colour];
            for (array, part) in arrays.iter_mut().zip(parts) {
                array.extend(part.iter().flat_map(|number| number.to_le_bytes()));
            }
        }
    }
    arrays
}
