//! Options that take one of a library type's names, as a configuration spells them.

use clap::builder::{PossibleValuesParser, TypedValueParser};
use pocketsplat_instructions::level::LEVELS;
use serde::de::DeserializeOwned;
use serde::de::IntoDeserializer as _;
use serde::de::value::{Error, StrDeserializer};

/// The name of explicit Gaussians as a backbone.
pub(crate) const EXPLICIT: &str = "3dgs";

// Names of the choices, in the order in which help shows them.
pub(crate) const SURFACES: &[&str] = &["matte", "mixed", "glossy"];
pub(crate) const CODERS: &[&str] = &["auto", "static", "context"];
pub(crate) const BACKBONES: &[&str] = &["scaffold", "hac", "hac-plus", "contextgs", EXPLICIT];
pub(crate) const SPLITS: &[&str] = &["test", "train"];
pub(crate) const BACKGROUNDS: &[&str] = &["black", "white", "learned"];
/// Of those, what splats can be drawn on.
pub(crate) const DRAWN_BACKGROUNDS: &[&str] = &["black", "white"];
pub(crate) const POINTS: &[&str] = &["matched", "random"];
pub(crate) const SCENES: &[&str] = &["object", "room"];
pub(crate) const LPIPS_RANGES: &[&str] = &["zero-to-one", "minus-one-to-one"];

/// Parses one of `names`, which are serde's for the variants of `T`.
pub(crate) fn one_of<T>(names: &'static [&'static str]) -> impl TypedValueParser<Value = T>
where
    T: DeserializeOwned + Clone + Send + Sync + 'static,
{
    PossibleValuesParser::new(names).try_map(|name| named(&name))
}

/// What serde calls so.
pub(crate) fn named<T: DeserializeOwned>(name: &str) -> Result<T, Error> {
    let name: StrDeserializer<'_, Error> = name.into_deserializer();
    T::deserialize(name)
}

/// Parses the number of a level that there is.
pub(crate) fn level_number() -> impl TypedValueParser<Value = u8> {
    clap::value_parser!(u8).range(1..=LEVELS.len() as i64)
}

#[cfg(test)]
mod tests {
    use pocketsplat_capture::dataset::{Background, PointsChoice, SceneKind, Split};
    use pocketsplat_capture::synth::SurfaceFinish;
    use pocketsplat_instructions::Processor;
    use pocketsplat_metrics::InputRange;
    use pocketsplat_trainer::encode::CoderChoice;

    use super::*;

    /// Every name that help shows is one that serde knows.
    fn all_parse<T: DeserializeOwned + Clone + Send + Sync + 'static>(names: &'static [&'static str]) {
        let parser = one_of::<T>(names);
        for name in names {
            parser.parse_ref(&clap::Command::new("test"), None, name.as_ref()).expect(name);
        }
    }

    #[test]
    fn every_name_shown_is_parsed() {
        all_parse::<SurfaceFinish>(SURFACES);
        all_parse::<CoderChoice>(CODERS);
        all_parse::<Split>(SPLITS);
        all_parse::<Background>(BACKGROUNDS);
        all_parse::<SceneKind>(SCENES);
        all_parse::<PointsChoice>(POINTS);
        all_parse::<InputRange>(LPIPS_RANGES);
        for processor in Processor::ALL {
            assert_eq!(named::<Processor>(processor.name()), Ok(processor));
        }
    }
}
