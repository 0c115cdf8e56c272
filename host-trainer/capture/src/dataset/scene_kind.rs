//! What a capture shows: an object on nothing, or a place with all that stands around.

use std::fmt;

use serde::{Deserialize, Serialize};

use super::looks::{Looks, is_like, median_colour};

/// From this share of transparent pixels on, something stands on nothing, however it fills the frames.
const TRANSPARENT_SHARE: f64 = 0.25;
/// So many photographs need a border of the same colour.
const BARE_PHOTOGRAPHS: f64 = 0.75;

/// What the photographs of a capture show. It decides where random points lie, how fine their lattice is and what colour lies behind.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum SceneKind {
    /// Something that stands on nothing: behind it is one colour.
    Object,
    /// A place: every pixel shows a part of it.
    Room,
}

impl fmt::Display for SceneKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Object => "object",
            Self::Room => "room",
        })
    }
}

/// What a capture was taken for, and why.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Taken {
    pub(super) kind: SceneKind,
    /// The colour around an object in photographs without transparent pixels.
    pub(super) backdrop: Option<[u8; 3]>,
    /// For people; none where the user has said what it is.
    pub(super) because: Option<String>,
}

/// What these photographs show: an object where a quarter of all pixels is transparent, or where one colour runs along the borders of
/// three quarters of them; else a room. The layout of the files says nothing.
///
/// * `asked`: what the user says it is.
pub(super) fn taken_for(looks: &[Looks], asked: Option<SceneKind>) -> Taken {
    let n = looks.len().max(1) as f64;
    let transparent = looks.iter().map(|looks| 1.0 - looks.shown).sum::<f64>() / n;
    let borders = || looks.iter().filter_map(|looks| looks.border);
    let common = median_colour(borders());
    let is_bare =
        |colour: [u8; 3]| borders().filter(|own| is_like(*own, colour)).count() as f64 >= BARE_PHOTOGRAPHS * n;
    let around = common.filter(|colour| is_bare(*colour));
    let percent = 100.0 * transparent;
    let (kind, because) = match around {
        _ if transparent >= TRANSPARENT_SHARE => {
            (SceneKind::Object, format!("{percent:.0} % of the pixels are transparent"))
        }
        Some([r, g, b]) => {
            (SceneKind::Object, format!("the colour {r},{g},{b} runs along the borders of the photographs"))
        }
        None => (SceneKind::Room, "the photographs show something up to their borders".to_owned()),
    };
    let backdrop = around.filter(|_| transparent == 0.0);
    match asked {
        None => Taken { kind, backdrop, because: Some(because) },
        Some(asked) => Taken { kind: asked, backdrop: backdrop.filter(|_| asked == SceneKind::Object), because: None },
    }
}

#[cfg(test)]
mod tests {
    use super::super::looks::Look;
    use super::*;

    fn looks(shown: f64, border: Option<[u8; 3]>) -> Looks {
        Looks { shown, look: Look::Sound, border, leaves_out: false }
    }

    #[test]
    fn pixels_decide_and_a_few_photographs_may_differ() {
        let kind = |looks: &[Looks]| taken_for(looks, None).kind;
        let (object, room) = (looks(1.0, Some([250; 3])), looks(1.0, None));
        assert_eq!(kind(&[object; 8]), SceneKind::Object);
        assert_eq!(kind(&[room; 8]), SceneKind::Room);
        assert_eq!(kind(&[[object; 6].as_slice(), &[room; 2]].concat()), SceneKind::Object);
        assert_eq!(kind(&[[object; 5].as_slice(), &[room; 3]].concat()), SceneKind::Room);
        // A border of another colour in each, as at dusk.
        let each: Vec<Looks> = (0..8).map(|i| looks(1.0, Some([20 * i; 3]))).collect();
        assert_eq!(kind(&each), SceneKind::Room);
        // Cut by all frames, yet on nothing; and a passer-by who was made transparent.
        assert_eq!(kind(&[looks(0.6, None); 8]), SceneKind::Object);
        assert_eq!(kind(&[looks(0.9, None); 8]), SceneKind::Room);
        assert_eq!(kind(&[]), SceneKind::Room);
    }

    #[test]
    fn a_backdrop_is_what_was_photographed_and_not_what_was_filled_in() {
        assert_eq!(taken_for(&[looks(1.0, Some([250; 3])); 4], None).backdrop, Some([250; 3]));
        assert_eq!(taken_for(&[looks(0.4, Some([0; 3])); 4], None).backdrop, None);
    }

    #[test]
    fn what_the_user_says_goes() {
        let white = [looks(1.0, Some([250; 3])); 4];
        let room = taken_for(&white, Some(SceneKind::Room));
        assert_eq!((room.kind, room.backdrop, room.because), (SceneKind::Room, None, None));
        assert_eq!(taken_for(&white, Some(SceneKind::Object)).backdrop, Some([250; 3]));
        assert_eq!(taken_for(&[looks(1.0, None); 4], Some(SceneKind::Object)).kind, SceneKind::Object);
    }
}
