//! Backbones as options.

use clap::builder::{PossibleValuesParser, TypedValueParser};

use crate::config::EXPLICIT;
use crate::config::named::{BACKBONES, named};
use pocketsplat_trainer::train::config::Backbone;

/// What `--backbone` names.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::command) enum BackboneChoice {
    /// Anchors, which make a bundle.
    Anchors(Backbone),
    /// Explicit Gaussians, which make a file of Gaussians.
    Explicit,
}

pub(super) fn backbone_choice() -> impl TypedValueParser<Value = BackboneChoice> {
    backbone_among(BACKBONES)
}

/// The same without explicit Gaussians, for commands that make bundles.
pub(in crate::command) fn backbone_of_anchors() -> impl TypedValueParser<Value = BackboneChoice> {
    backbone_among(&BACKBONES[..BACKBONES.len() - 1])
}

fn backbone_among(names: &'static [&'static str]) -> impl TypedValueParser<Value = BackboneChoice> {
    let choice = |name: String| -> Result<BackboneChoice, serde::de::value::Error> {
        if name == EXPLICIT { Ok(BackboneChoice::Explicit) } else { named(&name).map(BackboneChoice::Anchors) }
    };
    PossibleValuesParser::new(names).try_map(choice)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_backbone_that_help_shows_is_parsed() {
        for name in BACKBONES {
            let parsed = backbone_choice().parse_ref(&clap::Command::new("test"), None, name.as_ref());
            assert_eq!(parsed.expect(name) == BackboneChoice::Explicit, *name == EXPLICIT);
        }
    }
}
