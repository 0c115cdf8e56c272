//! Where a run stands: not begun, begun, or finished.

use std::path::Path;

use anyhow::{Context as _, Result, bail};
use pocketsplat_trainer::train::run::{RunError, RunFolder};

use super::in_folder::IN_RUN_AND_ON_COMMAND_LINE;
use crate::config::RunConfig;
use crate::say::say;

/// Where the run that is asked for stands.
pub(crate) enum RunStatus {
    /// Not begun; its folder.
    New(RunFolder),
    /// Begun and not finished; its folder.
    Begun(RunFolder),
    /// Finished, and its bundle is there.
    Finished,
}

impl RunStatus {
    /// Of the run in `path`; takes the folder for this process unless the run is finished.
    ///
    /// # Errors
    /// Another process works in the folder, or the run in it is not the one that is asked for.
    pub(crate) fn of(path: &Path, config: &RunConfig) -> Result<Self> {
        match RunFolder::reopen(path) {
            Ok(folder) => {
                let begun = RunConfig::parse(&folder.config()?)
                    .with_context(|| format!("could not use the config.toml in {}", path.display()))?;
                refuse_other(&begun, config, path)?;
                Ok(Self::Begun(folder))
            }
            Err(RunError::Finished { .. }) if config.output.is_file() => {
                refuse_other(&RunConfig::of_run(path)?, config, path)?;
                Ok(Self::Finished)
            }
            Err(error @ (RunError::NoRun { .. } | RunError::Finished { .. })) => {
                if matches!(error, RunError::Finished { .. }) {
                    say!(
                        "warning: the run in {} is finished, and its bundle {} is not there: it is trained anew",
                        path.display(),
                        config.output.display()
                    );
                }
                Ok(Self::New(RunFolder::start(path, &config.to_toml()?, false)?))
            }
            Err(error) => Err(error.into()),
        }
    }
}

/// Stops where the run in a folder is not the one that is asked for, in its bundle's bytes or its capture.
fn refuse_other(begun: &RunConfig, config: &RunConfig, folder: &Path) -> Result<()> {
    let difference = match begun.difference(config, IN_RUN_AND_ON_COMMAND_LINE)? {
        Some(difference) => difference,
        None if begun.encoding != config.encoding => "its bundle is coded in another way".to_owned(),
        None if begun.dataset != config.dataset => {
            format!("its capture is {}, not {}", begun.dataset.display(), config.dataset.display())
        }
        None => return Ok(()),
    };
    bail!("the run in {} is not the one that is asked for: {difference}; choose another --output", folder.display())
}
