//! How much a conversion may lose.

use std::path::Path;
use std::process::ExitCode;

use anyhow::{Result, bail};

use crate::say::say;

/// PSNR of the scene whose loss [`loss_at_30_db`] says, dB: what photographs of rooms reach.
const SCENE_DB: f64 = 30.0;

/// A bound on the loss.
#[derive(clap::Args)]
pub(super) struct LossArgs {
    /// Exit with code 1 where more quality than this is lost; the file is written all the same.
    #[arg(long, value_name = "DB")]
    max_loss: Option<f64>,
}

impl LossArgs {
    /// Refuses a bound that is none, before anything is done.
    pub(super) fn check(&self) -> Result<()> {
        match self.max_loss {
            Some(most) if !(most >= 0.0 && most.is_finite()) => {
                bail!("--max-loss {most}: needs a number of decibels from 0 on, for example 0.5")
            }
            _ => Ok(()),
        }
    }

    /// The exit code for a file that lost so much, and a word about it where that is too much; the result was printed, as JSON perhaps, and
    /// stays the one thing on stdout.
    ///
    /// * `remedy`: what loses less.
    pub(super) fn hold(&self, path: &Path, loss_db: f64, remedy: &str) -> ExitCode {
        // As it is printed, so that nothing is refused for a digit that nobody sees; a loss that is no number is none that was kept.
        let too_much = self.max_loss.filter(|most| !(loss_db <= most + 0.005));
        let Some(most) = too_much else { return ExitCode::SUCCESS };
        say!("error: {} is written and loses {loss_db:.2} dB, --max-loss allows {most}; {remedy}", path.display());
        ExitCode::FAILURE
    }
}

/// What a scene 30 dB from its photographs loses by pictures `psnr_db` from its own, where the errors have nothing to do with each other.
pub(super) fn loss_at_30_db(psnr_db: f64) -> f64 {
    10.0 * (1.0 + 10f64.powf((SCENE_DB - psnr_db) / 10.0)).log10()
}

#[cfg(test)]
mod tests {
    use std::path::Path;
    use std::process::ExitCode;

    use super::{LossArgs, loss_at_30_db};

    #[test]
    fn errors_add_up() {
        assert!((loss_at_30_db(30.0) - 3.0103).abs() < 1e-3 && loss_at_30_db(100.0) < 1e-6);
    }

    #[test]
    fn a_bound_is_held_and_has_to_be_one() {
        let held =
            |max_loss: Option<f64>, loss_db| LossArgs { max_loss }.hold(Path::new("a.spz"), loss_db, "write a .ply");
        for (most, loss_db) in [(None, 9.0), (Some(0.5), 0.504), (Some(0.0), 1e-7)] {
            assert_eq!(held(most, loss_db), ExitCode::SUCCESS, "{loss_db}");
        }
        for loss_db in [0.51, f64::NAN, f64::INFINITY] {
            assert_eq!(held(Some(0.5), loss_db), ExitCode::FAILURE, "{loss_db}");
        }
        for most in [-0.1, f64::NAN, f64::INFINITY] {
            let said = LossArgs { max_loss: Some(most) }.check().expect_err("no bound").to_string();
            assert!(said.contains(&format!("--max-loss {most}")) && said.contains("0.5"), "{said}");
        }
    }
}
