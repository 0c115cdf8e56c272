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
            let [first, second, third] = self.place.models();
            for folder in [&first, &second, &third, &sparse] {
                remove(folder)?;
            }
            let Some(mut best) = self.mapped(&first, true)? else { return Ok(None) };
            let n = self.place.state.photographs.len();
            // Four numbers of distortion are too many for the few points of a first pair: they take up what the poses should.
            if let Some(doubt) = doubt_about(&best, n) {
                say!("{doubt}; once more, with the distortion of the lens left for the end");
                if !self.improved(&mut best, &second)? {
                    return Ok(None);
                }
            }
            if let Some(doubt) = doubt_about(&best, n).filter(|_| self.may_compare_each()) {
                say!("{doubt}; once more, with each of them compared with each other one");
                match self.matched_each() {
                    Ok(true) if self.improved(&mut best, &third)? => {}
                    Ok(_) => return Ok(None),
                    // What there is already is worth more than nothing.
                    Err(error) if !best.is_empty() => say!("warning: {error:#}"),
                    Err(error) => return Err(error),
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
            for folder in [first, second, third] {
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

    /// Takes the models that the mapper makes with a lens without distortion at first in place of others, if they are better; `false` where
    /// it was stopped.
    fn improved(&mut self, best: &mut Vec<Model>, folder: &Path) -> Result<bool> {
        let Some(others) = self.mapped(folder, false)? else { return Ok(false) };
        if !are_better(&others, best) {
            return Ok(true);
        }
        if !self.adjusted(&others[0])? {
            return Ok(false);
        }
        *best = models_in(folder)?;
        Ok(true)
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

/// Why the largest of some models of `n` photographs is probably wrong.
fn doubt_about(models: &[Model], n: usize) -> Option<String> {
    let largest = models.first();
    let n_posed = n_in(models);
    if (n_posed as f64) < USEFUL_SHARE * n as f64 {
        return Some(format!("{n_posed} of {n} photographs have poses"));
    }
    largest.filter(|model| !model.has_square_pixels()).map(|model| {
        let percent = 100.0 * (model.focal_ratio - 1.0);
        format!("the focal lengths of the lens differ by {percent:.0} %, and those of a camera do not")
    })
}

/// Whether to take some models in place of others: one of a lens that there can be, also where it has somewhat fewer photographs; else the
/// larger one.
fn are_better(models: &[Model], than: &[Model]) -> bool {
    let is_sound = |models: &[Model]| models.first().is_some_and(Model::has_square_pixels);
    let (n, n_of_others) = (n_in(models), n_in(than));
    match (is_sound(models), is_sound(than)) {
        (true, false) => n as f64 >= USEFUL_SHARE * n_of_others as f64,
        (false, true) => false,
        _ => n > n_of_others,
    }
}

/// Photographs in the largest.
fn n_in(models: &[Model]) -> usize {
    models.first().map_or(0, |model| model.names.len())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn models(n: usize, focal_ratio: f64) -> Vec<Model> {
        let names = (0..n).map(|i| format!("{i:02}.jpg")).collect();
        vec![Model { folder: "0".into(), names, n_points: 900, error_px: Some(0.7), focal_ratio }]
    }

    #[test]
    fn few_photographs_and_lenses_that_nobody_makes_are_doubted() {
        assert_eq!(doubt_about(&models(30, 1.01), 40), None);
        assert_eq!(doubt_about(&models(20, 1.01), 40).unwrap(), "20 of 40 photographs have poses");
        assert_eq!(doubt_about(&[], 40).unwrap(), "0 of 40 photographs have poses");
        let said = doubt_about(&models(31, 1.147), 37).unwrap();
        assert!(said.starts_with("the focal lengths of the lens differ by 15 %"), "{said}");
    }

    #[test]
    fn a_lens_that_there_can_be_is_worth_some_photographs() {
        assert!(are_better(&models(21, 1.0), &models(20, 1.0)) && !are_better(&models(20, 1.0), &models(20, 1.0)));
        assert!(are_better(&models(20, 1.0), &models(31, 1.15)) && !are_better(&models(10, 1.0), &models(31, 1.15)));
        assert!(!are_better(&models(40, 1.15), &models(10, 1.0)) && !are_better(&[], &models(10, 1.15)));
    }
}
