//! The last of COLMAP's stages: cameras and points are placed, and the largest model is kept.

use std::path::Path;

use anyhow::{Context, Result, bail};

use super::colmap::{Paths, adjuster, mapper};
use super::heard::step_in;
use super::model::{Model, keep, models_in};
use super::place::remove;
use super::progress::Progress;
use super::report::USEFUL_SHARE;
use super::search::{Search, Told};
use super::state::Stage;
use crate::say::say;

impl Search<'_> {
    /// Places cameras and points; the models, the largest first, or `None` where it was stopped.
    pub(super) fn models(&mut self) -> Result<Option<Vec<Model>>> {
        let sparse = self.place.sparse();
        if !self.place.state.is_done(Stage::Model) {
            let [first, second] = self.place.models();
            for folder in [&first, &second, &sparse] {
                remove(folder)?;
            }
            let Some(mut best) = self.mapped(&first, true)? else { return Ok(None) };
            let n = self.place.state.photographs.len();
            let n_in = |models: &[Model]| models.first().map_or(0, |model| model.names.len());
            if (n_in(&best) as f64) < USEFUL_SHARE * n as f64 {
                // Four numbers of distortion are too many for the few points of a first pair: they take up what the poses should.
                say!(
                    "{} of {n} photographs have poses; once more, with the distortion of the lens left for the end",
                    n_in(&best)
                );
                let Some(others) = self.mapped(&second, false)? else { return Ok(None) };
                if n_in(&others) > n_in(&best) {
                    best = others;
                    if !self.adjusted(&best[0])? {
                        return Ok(None);
                    }
                }
            }
            if best.is_empty() {
                bail!(
                    "COLMAP places none of the {n} photographs: too few points are seen in several of them; take photographs that \
                     overlap by 70 %, from different places, of things with texture (its words are in {})",
                    self.place.log.path().display()
                );
            }
            keep(&best, &sparse)?;
            for folder in [first, second] {
                remove(&folder)?;
            }
            self.place.finish(Stage::Model)?;
        }
        models_in(&sparse).map(Some)
    }

    /// The models that the mapper leaves in a folder, none where it finds none; `None` where it was stopped.
    fn mapped(&mut self, models: &Path, with_distortion: bool) -> Result<Option<Vec<Model>>> {
        std::fs::create_dir_all(models).with_context(|| format!("could not make {}", models.display()))?;
        let (database, images) = (self.place.database(), self.place.images());
        let command = mapper(&Paths { database: &database, images: &images }, models, with_distortion);
        let mut progress = Progress::new("poses", self.place.state.photographs.len());
        let ended = self.run(command, |_, line| {
            if let Some(step) = step_in(line) {
                progress.reached(step.done);
            }
            Ok(())
        })?;
        drop(progress);
        match ended {
            Told::Stopped => return Ok(None),
            Told::Badly { why, by_signal: true } => bail!("{why}"),
            // It ends badly where it finds nothing, in some versions.
            Told::Badly { why, .. } => say!("{why}"),
            Told::Well => {}
        }
        models_in(models).map(Some)
    }

    /// Fits all of a model together, the distortion of its lens too; `false` where it was stopped.
    fn adjusted(&mut self, model: &Model) -> Result<bool> {
        match self.run(adjuster(&model.folder), |_, _| Ok(()))? {
            Told::Well => Ok(true),
            Told::Stopped => Ok(false),
            // The model is usable without.
            Told::Badly { why, .. } => {
                say!("warning: the lens stays without distortion: {why}");
                Ok(true)
            }
        }
    }
}
