//! COLMAP's programs that work on a database: features and matches. A stage that is finished is not done again.

use std::collections::BTreeMap;
use std::process::Command;

use anyhow::{Context, Result, bail};
use pocketsplat_files::shown;

use super::child::{Ended, Work};
use super::colmap::{Colmap, Paths, Shared};
use super::heard::{fault_in, step_in};
use super::place::{LIST, PAIRS, Place, remove};
use super::progress::Progress;
use super::state::{Cameras, Matching, Stage, State};
use super::taking::Taken;
use crate::say::say;

/// More photographs than these are not compared with each other one, unless they are asked to be.
const MOST_EXHAUSTIVE: usize = 200;
/// Photographs in an order that are also compared with each other, however far apart, at most: so a walk that comes back is closed.
const MOST_KEYS: usize = 40;
/// One of so many is such a one, at least.
const KEY_EVERY: usize = 5;

/// Runs one of COLMAP's programs in a place, if it is not done yet.
pub(super) struct Search<'a> {
    pub(super) colmap: &'a Colmap,
    pub(super) place: &'a mut Place,
    pub(super) work: Work<'a>,
    /// Whether COLMAP works on a GPU.
    pub(super) on_gpu: bool,
}

impl Search<'_> {
    /// Finds features; `false` where it was stopped.
    pub(super) fn features(&mut self) -> Result<bool> {
        if self.place.state.is_done(Stage::Features) {
            return Ok(true);
        }
        let groups = self.groups()?;
        if groups.len() > 1 && self.place.state.settings.cameras == Cameras::One {
            let sizes: Vec<String> =
                groups.iter().map(|((w, h), names)| format!("{} of {w}×{h} px", names.len())).collect();
            say!("photographs of {} sizes, and a camera for each: {}", groups.len(), sizes.join(", "));
        }
        let mut progress = Progress::new("features", groups.values().map(Vec::len).sum());
        let mut n_before = 0;
        for (i, names) in groups.into_values().enumerate() {
            let n = names.len();
            let list = self.place.list(LIST, names)?;
            let is_done = self.with_gpu(|search, on_gpu| {
                let begun = search.place.state.cameras.get(i).copied();
                let shared = match search.place.state.settings.cameras {
                    Cameras::One => Shared::One { begun },
                    Cameras::Each => Shared::Each,
                };
                let (database, images) = (search.place.database(), search.place.images());
                let paths = Paths { database: &database, images: &images };
                let command = search.colmap.features(&paths, &list, shared, on_gpu);
                search.run(command, |search, line| {
                    if let Some(step) = step_in(line) {
                        progress.reached(n_before + step.done);
                    }
                    let number = line.split_once("Camera:").and_then(|(_, rest)| number_in(rest));
                    // Without it a search that goes on would begin with another camera.
                    if let (Some(number), true) = (number, search.place.state.cameras.len() == i) {
                        search.place.state.cameras.push(number);
                        search.place.state.write(&search.place.folder)?;
                    }
                    Ok(())
                })
            })?;
            remove(&list)?;
            if !is_done {
                return Ok(false);
            }
            n_before += n;
        }
        drop(progress);
        self.place.finish(Stage::Features)?;
        Ok(true)
    }

    /// Compares photographs; `false` where it was stopped.
    pub(super) fn matches(&mut self) -> Result<bool> {
        if self.place.state.is_done(Stage::Matches) {
            return Ok(true);
        }
        let n = self.place.state.photographs.len();
        let how = self.place.state.settings.matching.unwrap_or_else(|| matching(&self.place.state.photographs));
        say!(
            "{}",
            match how {
                Matching::Exhaustive => format!("comparing each of {n} photographs with each other one"),
                Matching::Sequential =>
                    format!("comparing each of {n} photographs with the next ones, and some with each other"),
            }
        );
        let n_spaced = self.place.state.photographs.iter().filter(|taken| has_space(&taken.name)).count();
        if how == Matching::Sequential && n_spaced > 0 {
            say!(
                "warning: photographs with a space in their name: {n_spaced}; these are compared with the next ones alone, so a round trip \
                 may not close; rename them, or give --matching exhaustive"
            );
        }
        let is_done = match how {
            Matching::Exhaustive => self.matched_each()?,
            Matching::Sequential => {
                self.matched("matches", |colmap, paths, on_gpu| colmap.sequential(paths, on_gpu))?
                    && self.matched_afar()?
            }
        };
        if is_done {
            self.place.finish(Stage::Matches)?;
        }
        Ok(is_done)
    }

    /// Whether photographs were compared in their order because they are of a film, and are few enough to compare each with each other one.
    pub(super) fn may_compare_each(&self) -> bool {
        let State { settings, photographs, .. } = &self.place.state;
        settings.matching.is_none() && is_film(photographs) && photographs.len() <= MOST_EXHAUSTIVE
    }

    /// Compares each photograph with each other one; pairs that are compared already are not compared again.
    pub(super) fn matched_each(&mut self) -> Result<bool> {
        let n = self.place.state.photographs.len();
        self.matched("matches", |colmap, paths, on_gpu| colmap.exhaustive(paths, n, on_gpu))
    }

    /// Compares photographs that are far apart in their order.
    fn matched_afar(&mut self) -> Result<bool> {
        let pairs = key_pairs(&self.place.state.photographs);
        if pairs.is_empty() {
            return Ok(true);
        }
        let list = self.place.list(PAIRS, pairs)?;
        let is_done = self.matched("matches afar", |colmap, paths, on_gpu| colmap.pairs(paths, &list, on_gpu))?;
        remove(&list)?;
        Ok(is_done)
    }

    fn matched(&mut self, what: &'static str, command: impl Fn(&Colmap, &Paths<'_>, bool) -> Command) -> Result<bool> {
        self.with_gpu(|search, on_gpu| {
            let (database, images) = (search.place.database(), search.place.images());
            let command = command(search.colmap, &Paths { database: &database, images: &images }, on_gpu);
            let mut progress = None;
            search.run(command, |_, line| {
                if let Some(step) = step_in(line)
                    && let Some(n) = step.of
                {
                    progress.get_or_insert_with(|| Progress::new(what, n)).reached(step.done);
                }
                Ok(())
            })
        })
    }

    /// The names of photographs by their size, pixels; all together where each has a camera of its own.
    fn groups(&self) -> Result<BTreeMap<(u32, u32), Vec<String>>> {
        let mut groups: BTreeMap<(u32, u32), Vec<String>> = BTreeMap::new();
        for Taken { name, .. } in &self.place.state.photographs {
            let path = self.place.images().join(name);
            let size_px = match self.place.state.settings.cameras {
                Cameras::One => image::ImageReader::open(&path)
                    .and_then(|reader| reader.with_guessed_format())
                    .map_err(anyhow::Error::from)
                    .and_then(|reader| Ok(reader.into_dimensions()?))
                    .with_context(|| format!("`{}` cannot be read as a photograph; leave it out of what you give, and begin anew with --overwrite", shown(&path)))?,
                Cameras::Each => (0, 0),
            };
            groups.entry(size_px).or_default().push(name.clone());
        }
        Ok(groups)
    }

    /// Runs a program on the GPU, and on the CPU where that is not to be; `false` where it was stopped.
    fn with_gpu(&mut self, mut run: impl FnMut(&mut Self, bool) -> Result<Told>) -> Result<bool> {
        loop {
            match run(self, self.on_gpu)? {
                Told::Well => return Ok(true),
                Told::Stopped => return Ok(false),
                Told::Badly { why, by_signal: false } if self.on_gpu => {
                    say!("warning: {why}");
                    say!("once more on the CPU, in case it was the GPU; --cpu begins with that");
                    self.on_gpu = false;
                }
                Told::Badly { why, .. } => bail!("{why}"),
            }
        }
    }

    pub(super) fn run(
        &mut self,
        command: Command,
        mut heard: impl FnMut(&mut Self, &str) -> Result<()>,
    ) -> Result<Told> {
        let program = command.get_args().next().unwrap_or_default().to_string_lossy().into_owned();
        let (mut fault, mut failed) = (None, Ok(()));
        let work = self.work;
        let ended = work.run(command, |line| {
            if let Some(found) = fault_in(line) {
                fault = Some(found.to_owned());
            }
            if failed.is_ok() {
                failed = heard(self, line);
            }
        })?;
        failed?;
        Ok(match ended {
            Ended::Well => Told::Well,
            Ended::Stopped => Told::Stopped,
            Ended::Badly(status) => {
                let fault = fault.map_or(String::new(), |fault| format!(": {fault}"));
                let log = work.log.path().display();
                Told::Badly {
                    why: format!("`colmap {program}` failed ({status}){fault}; its words are in {log}"),
                    by_signal: status.code().is_none(),
                }
            }
        })
    }
}

/// How a program of COLMAP ended.
pub(super) enum Told {
    Well,
    Stopped,
    Badly {
        /// For people.
        why: String,
        /// Whether something else ended it, as a system that runs out of memory.
        by_signal: bool,
    },
}

/// How photographs are compared where nobody says it.
fn matching(photographs: &[Taken]) -> Matching {
    if is_film(photographs) || photographs.len() > MOST_EXHAUSTIVE {
        Matching::Sequential
    } else {
        Matching::Exhaustive
    }
}

fn is_film(photographs: &[Taken]) -> bool {
    photographs.iter().any(|taken| taken.at_s.is_some())
}

/// Pairs of photographs that are spread over an order, as COLMAP reads them: two names and a space between, which a name cannot hold.
fn key_pairs(photographs: &[Taken]) -> Vec<String> {
    let every = KEY_EVERY.max(photographs.len().div_ceil(MOST_KEYS));
    let keys = photographs.iter().map(|taken| taken.name.as_str()).filter(|name| !has_space(name));
    let keys: Vec<&str> = keys.step_by(every).collect();
    let pairs = keys.iter().enumerate().flat_map(|(i, a)| keys[i + 1..].iter().map(move |b| format!("{a} {b}")));
    pairs.collect()
}

/// Whether COLMAP's lists of pairs cannot hold a name.
fn has_space(name: &str) -> bool {
    name.contains(char::is_whitespace)
}

/// `#1 - OPENCV`, a camera's number.
fn number_in(text: &str) -> Option<usize> {
    let digits = text.split_once('#')?.1;
    digits.split(|c: char| !c.is_ascii_digit()).next()?.parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn taken(i: usize) -> Taken {
        Taken { name: format!("{i:03}.jpg"), from: String::new(), at_s: None }
    }

    #[test]
    fn films_and_many_photographs_are_compared_in_their_order() {
        let photographs: Vec<Taken> = (0..201).map(taken).collect();
        let film: Vec<Taken> = (0..2).map(|i| Taken { at_s: Some(0.5 * i as f64), ..taken(i) }).collect();
        assert_eq!(matching(&film), Matching::Sequential);
        assert_eq!(matching(&photographs[..200]), Matching::Exhaustive);
        assert_eq!(matching(&photographs), Matching::Sequential);
    }

    #[test]
    fn keys_close_a_walk_that_comes_back() {
        let few: Vec<Taken> = (0..12).map(taken).collect();
        assert_eq!(key_pairs(&few), ["000.jpg 005.jpg", "000.jpg 010.jpg", "005.jpg 010.jpg"]);
        let many: Vec<Taken> = (0..1000).map(taken).collect();
        assert_eq!(key_pairs(&many).len(), 40 * 39 / 2);
        assert!(key_pairs(&[Taken { name: "a b.jpg".into(), ..taken(0) }]).is_empty());
        assert_eq!(number_in("          #12 - OPENCV"), Some(12));
    }
}
