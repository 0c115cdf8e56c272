//! Named hard cases: what breaks other renderers and trainers, each with a bound that stood before it was measured.
//!
//! A case is a [picture](Probe::Picture) that goes through the whole product, a single [error](Probe::Error) of one
//! operation, or a [refusal](Probe::Refusal) that has to say what is wrong. `docs/numerical-stability.md` is written from
//! this catalogue by [`page`]; the suite `hard_cases` keeps the two alike.

pub mod blobs;
pub mod gradient;
pub mod page;
pub mod picture;

mod arithmetic;
mod cameras;
mod captures;
mod codec;
mod gathered;
mod layers;
mod qualities;
mod refusals;
mod roundings;
mod scales;
mod scenes;
mod splats;
mod training;

pub use gathered::gathered;
pub use picture::{Figures, Picture};

/// One hard case.
#[derive(Clone, Copy)]
pub struct Case {
    /// Unique.
    pub name: &'static str,
    /// What is hard about it, for the page.
    pub what: &'static str,
    /// How it is tried.
    pub probe: Probe,
}

/// How a case is tried, and what it must not exceed.
#[derive(Clone, Copy)]
pub enum Probe {
    /// A scene and a camera, through decoder, trainer and codec.
    Picture {
        /// Makes them.
        picture: fn() -> Picture,
        /// Whether anything but background is in the picture.
        seen: bool,
        /// Largest errors allowed.
        bounds: Figures,
    },
    /// One number that has to stay small.
    Error {
        /// What it is, with its unit.
        of: &'static str,
        /// The largest allowed.
        bound: f64,
        /// Measures it.
        measure: fn() -> f64,
    },
    /// Something that has to be refused.
    Refusal {
        /// Which part refuses.
        by: &'static str,
        /// What its message has to contain.
        says: &'static str,
        /// Tries it and returns the message; "accepted" when nothing was refused.
        attempt: fn() -> String,
    },
}

/// What came of a case.
#[derive(Clone, Debug, PartialEq)]
pub enum Outcome {
    /// Of a [picture](Probe::Picture).
    Drawn(Figures),
    /// Of an [error](Probe::Error).
    Measured(f64),
    /// Of a [refusal](Probe::Refusal): the message.
    Refused(String),
}

impl Case {
    /// Tries it.
    ///
    /// # Errors
    /// What exceeds its bound, or is not as it has to be.
    ///
    /// # Panics
    /// Where a picture cannot be drawn at all.
    pub fn run(&self) -> Result<Outcome, String> {
        match self.probe {
            Probe::Picture { picture, seen: expected, bounds } => {
                let (figures, seen) = picture().measure();
                if seen != expected {
                    return Err(format!("the oracle sees {}", if seen { "something" } else { "background alone" }));
                }
                let exceeded = figures.exceeding(&bounds);
                if exceeded.is_empty() { Ok(Outcome::Drawn(figures)) } else { Err(exceeded.join(", ")) }
            }
            Probe::Error { of, bound, measure } => {
                let error = measure();
                // Not `>`: NaN has to be found.
                if error <= bound { Ok(Outcome::Measured(error)) } else { Err(format!("{of}: {error:e} of {bound:e}")) }
            }
            Probe::Refusal { by, says, attempt } => {
                let message = attempt();
                let refused = message.contains(says);
                if refused {
                    Ok(Outcome::Refused(message))
                } else {
                    Err(format!("{by} said `{message}`, not `{says}`"))
                }
            }
        }
    }
}

/// Cases that share an analysis of their errors.
pub struct Family {
    /// Heading of the page.
    pub title: &'static str,
    /// What a reader can rely on.
    pub answer: &'static str,
    /// Why the bounds are what they are.
    pub analysis: &'static str,
    /// The cases.
    pub cases: Vec<Case>,
}

/// All families, in the order of the page.
pub fn families() -> Vec<Family> {
    vec![
        splats::family(),
        cameras::family(),
        layers::family(),
        scales::family(),
        scenes::family(),
        codec::family(),
        arithmetic::family(),
        roundings::family(),
        qualities::family(),
        captures::family(),
        training::family(),
        refusals::family(),
    ]
}

/// The pictures of all families.
fn pictures() -> impl Iterator<Item = Case> {
    let families = [splats::family, cameras::family, layers::family, scales::family, scenes::family, codec::family];
    let cases = families.into_iter().chain([arithmetic::family as fn() -> Family]).flat_map(|family| family().cases);
    cases.filter(|case| matches!(case.probe, Probe::Picture { .. }))
}

/// A picture with something in it and the usual bounds.
const fn picture(name: &'static str, what: &'static str, picture: fn() -> Picture) -> Case {
    bounded(name, what, Figures::USUAL, picture)
}

/// A picture with bounds of its own, which its family's analysis explains.
const fn bounded(name: &'static str, what: &'static str, bounds: Figures, picture: fn() -> Picture) -> Case {
    Case { name, what, probe: Probe::Picture { picture, seen: true, bounds } }
}

/// A picture that has to be background alone.
const fn unseen(name: &'static str, what: &'static str, picture: fn() -> Picture) -> Case {
    Case { name, what, probe: Probe::Picture { picture, seen: false, bounds: Figures::USUAL } }
}

const fn error(name: &'static str, what: &'static str, of: &'static str, bound: f64, measure: fn() -> f64) -> Case {
    Case { name, what, probe: Probe::Error { of, bound, measure } }
}

const fn refusal(
    name: &'static str,
    what: &'static str,
    by: &'static str,
    says: &'static str,
    attempt: fn() -> String,
) -> Case {
    Case { name, what, probe: Probe::Refusal { by, says, attempt } }
}

/// Numbers that are not finite.
fn n_not_finite(values: impl IntoIterator<Item = f32>) -> f64 {
    values.into_iter().filter(|value| !value.is_finite()).count() as f64
}

/// Every trained number of a scene.
fn parameters(scene: &pocketsplat_kernels::scene::Scene<f32>) -> impl Iterator<Item = f32> {
    let anchors = &scene.anchors;
    let arrays = [&anchors.features, &anchors.log_scales, &anchors.offsets, &anchors.mask_logits];
    let heads = scene.heads.each().flat_map(|head| head.groups()).flatten();
    arrays.into_iter().flatten().chain(heads).copied()
}
