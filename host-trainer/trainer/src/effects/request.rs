//! What `--effects` asks for.

use std::str::FromStr;

use super::Effect;

/// Effects as the command line asks for them: `auto`, or `none`, `all`, `+name`, `-name` in a list.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Request {
    /// Measure, and keep what pays.
    Auto,
    /// Give these to the run (true) or take them (false); what is not named stays as it is.
    Forced(Vec<(Effect, bool)>),
}

/// Malformed `--effects` list.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[expect(missing_docs, reason = "each message names its fields")]
pub enum ParseEffectsError {
    /// No effect has that name.
    #[error("there is no effect `{name}`; needs auto, or a list of none, all, and +NAME or -NAME with NAME of {known}")]
    Unknown { name: String, known: String },
    /// An effect is named twice.
    #[error("`{0}` is named twice; name each effect once")]
    Twice(&'static str),
    /// `auto`, `none` or `all` among names that leave it nothing to say.
    #[error("`{0}` has to stand {where_}", where_ = if *.0 == "auto" { "alone" } else { "first" })]
    Misplaced(&'static str),
}

impl FromStr for Request {
    type Err = ParseEffectsError;

    fn from_str(text: &str) -> Result<Self, ParseEffectsError> {
        let items: Vec<&str> = text.split(',').map(str::trim).collect();
        if items == ["auto"] {
            return Ok(Self::Auto);
        }
        let (all, named) = match items.split_first() {
            Some((&"none", rest)) => (Some(false), rest),
            Some((&"all", rest)) => (Some(true), rest),
            _ => (None, items.as_slice()),
        };
        let mut said: Vec<(Effect, bool)> = Vec::new();
        for item in named {
            if let Some(word) = ["auto", "none", "all"].into_iter().find(|word| word == item) {
                return Err(ParseEffectsError::Misplaced(word));
            }
            let (name, on) = match item.strip_prefix('-') {
                Some(name) => (name, false),
                None => (item.strip_prefix('+').unwrap_or(item), true),
            };
            let effect = Effect::ALL.into_iter().find(|effect| effect.name() == name).ok_or_else(|| {
                let known = Effect::ALL.map(Effect::name).join(", ");
                ParseEffectsError::Unknown { name: (*item).to_owned(), known }
            })?;
            if said.iter().any(|(other, _)| *other == effect) {
                return Err(ParseEffectsError::Twice(effect.name()));
            }
            said.push((effect, on));
        }
        if let Some(on) = all {
            // Exposures are no part of a scene: without a word the run finds out.
            let meant = |effect: &Effect| !on || *effect != Effect::Exposure;
            let unnamed = Effect::ALL.into_iter().filter(meant);
            let unnamed = unnamed.filter(|effect| said.iter().all(|(other, _)| other != effect));
            let unnamed: Vec<_> = unnamed.map(|effect| (effect, on)).collect();
            said.extend(unnamed);
        }
        Ok(Self::Forced(said))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use Effect::{Detail, DilationCompensation, ViewColour, ViewDistance};

    #[test]
    fn a_list_forces_what_it_names_and_nothing_else() {
        let forced = |text: &str| match text.parse() {
            Ok(Request::Forced(list)) => list,
            other => panic!("{text}: {other:?}"),
        };
        assert_eq!(forced("+detail,-view-distance"), [(Detail, true), (ViewDistance, false)]);
        assert_eq!(forced("detail"), [(Detail, true)]);
        assert_eq!(forced("none").len(), Effect::ALL.len());
        assert_eq!(forced("all").len(), Effect::ALL.len() - 1, "exposures are found out");
        assert!(forced("all,+exposure").contains(&(Effect::Exposure, true)));
        assert!(forced("none").iter().all(|(_, on)| !on) && forced("all").iter().all(|(_, on)| *on));
        let all_but = forced("all, -dilation-compensation");
        assert!(all_but.contains(&(DilationCompensation, false)) && all_but.contains(&(ViewColour, true)));
        assert_eq!("auto".parse(), Ok(Request::Auto));
    }

    #[test]
    fn what_cannot_be_meant_is_refused_by_name() {
        for (text, part) in [
            (
                "+fog",
                "no effect `+fog`; needs auto, or a list of none, all, and +NAME or -NAME with NAME of view-colour",
            ),
            ("", "no effect ``"),
            ("detail,-detail", "`detail` is named twice"),
            ("detail,none", "`none` has to stand first"),
            ("auto,detail", "`auto` has to stand alone"),
        ] {
            let error = text.parse::<Request>().expect_err(text).to_string();
            assert!(error.contains(part), "{text}: {error}");
        }
    }
}
