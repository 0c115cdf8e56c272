//! The runs of a plan that are measured.

use std::path::Path;

use anyhow::{Context, Result};
use serde::Serialize;

use crate::command::eval::Evaluation;
use crate::command::workflow::{Place, Plan};

/// A run that is measured, and where it stands in tables.
pub(super) struct FinishedRun<'a> {
    pub(super) name: &'a str,
    pub(super) place: &'a Place,
    pub(super) evaluation: Evaluation,
}

/// One line of runs.csv: nothing in it depends on the machine or on the time.
#[derive(Serialize)]
pub(super) struct RunLine<'a> {
    run: &'a str,
    dataset: &'a str,
    scene: &'a str,
    size: &'a str,
    method: &'a str,
    rate: &'a str,
    seed: u64,
    #[serde(rename = "PSNR")]
    psnr_db: f64,
    #[serde(rename = "SSIM")]
    ssim: f64,
    #[serde(rename = "LPIPS")]
    lpips: Option<f64>,
    #[serde(rename = "Size [Bytes]")]
    size_bytes: usize,
    #[serde(rename = "#Gaussians")]
    n_gaussians: u64,
    n_anchors: u32,
    width_px: u32,
    height_px: u32,
    n_views: usize,
    /// Checksum of the bundle that was measured.
    bundle_crc: Option<u32>,
    program: &'a str,
}

/// The runs whose figures are there, in the order of the plan.
pub(super) fn runs<'a>(plan: &'a Plan, folder: &Path) -> Result<Vec<FinishedRun<'a>>> {
    let mut all = Vec::new();
    for run in &plan.runs {
        let path = folder.join(format!("{}.json", run.name));
        if !path.is_file() {
            continue;
        }
        let bytes = std::fs::read(&path).with_context(|| format!("could not read {}", path.display()))?;
        let evaluation = serde_json::from_slice(&bytes);
        let evaluation = evaluation.with_context(|| {
            format!(
                "{} has no figures of a run; remove it, and give `snakemake` or `plan-runs --run` again",
                path.display()
            )
        })?;
        all.push(FinishedRun { name: &run.name, place: &run.place, evaluation });
    }
    Ok(all)
}

impl FinishedRun<'_> {
    /// Width and height of the images that it was measured on.
    pub(super) fn size_px(&self) -> [u32; 2] {
        [self.evaluation.width_px, self.evaluation.height_px]
    }

    pub(super) fn line(&self) -> RunLine<'_> {
        let Place { dataset, scene, size, method, rate, seed } = self.place;
        let run = &self.evaluation;
        RunLine {
            run: self.name,
            dataset,
            scene,
            size,
            method,
            rate,
            seed: *seed,
            psnr_db: rounded(run.psnr_db),
            ssim: rounded(run.ssim),
            lpips: run.lpips.map(rounded),
            size_bytes: run.bundle_bytes,
            n_gaussians: run.n_gaussians,
            n_anchors: run.n_anchors,
            width_px: run.width_px,
            height_px: run.height_px,
            n_views: run.n_views,
            bundle_crc: run.bundle_crc,
            program: &run.program,
        }
    }
}

/// To the six decimals of tables.
pub(in crate::command) fn rounded(value: f64) -> f64 {
    (1e6 * value).round() / 1e6
}
