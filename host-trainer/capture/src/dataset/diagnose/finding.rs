//! One thing found out about a capture.

use std::collections::BTreeMap;
use std::fmt;
use std::path::PathBuf;

use serde::Serialize;

use crate::dataset::Severity;
use crate::dataset::error::first_few;
use crate::dataset::listing::Shot;

/// One thing found out about a capture.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Finding {
    /// How much it matters.
    pub severity: Severity,
    /// The kind, such as `missing-image`: stable, for programs.
    pub code: &'static str,
    /// What was found, for people.
    pub message: String,
    /// What to do about it; empty where nothing needs to be done.
    pub remedy: String,
    /// The files it is about, all of them.
    #[serde(serialize_with = "super::all_as_shown")]
    pub files: Vec<PathBuf>,
    /// The numbers behind the message.
    pub numbers: BTreeMap<&'static str, f64>,
}

impl Finding {
    /// The finding in one line.
    pub(in crate::dataset) fn in_line(&self) -> String {
        let text =
            if self.remedy.is_empty() { self.message.clone() } else { format!("{}; {}", self.message, self.remedy) };
        format!("{}: {text}", self.severity)
    }

    pub(in crate::dataset) fn new(severity: Severity, code: &'static str, message: String, remedy: &str) -> Self {
        let remedy = remedy.to_owned();
        Self { severity, code, message, remedy, files: Vec::new(), numbers: BTreeMap::new() }
    }

    /// A finding about views; `None` without any.
    pub(super) fn about(
        views: &[(&str, &Shot)],
        severity: Severity,
        code: &'static str,
        what: &str,
        remedy: &str,
    ) -> Option<Self> {
        let names: Vec<String> = views.iter().map(|(name, _)| (*name).to_owned()).collect();
        let message = format!("{what}: {} ({})", names.len(), first_few(&names, ", "));
        let files = views.iter().map(|(_, shot)| shot.path.clone());
        let finding = Self::new(severity, code, message, remedy).files(files).number("views", names.len() as f64);
        (!views.is_empty()).then_some(finding)
    }

    /// A finding of a message that ends with its remedy behind the last semicolon, as all messages of this module do.
    pub(in crate::dataset) fn told(severity: Severity, code: &'static str, text: &str) -> Self {
        let (message, remedy) = text.rsplit_once("; ").unwrap_or((text, ""));
        Self::new(severity, code, message.to_owned(), remedy)
    }

    pub(in crate::dataset) fn files(mut self, files: impl IntoIterator<Item = PathBuf>) -> Self {
        self.files.extend(files);
        self
    }

    pub(in crate::dataset) fn number(mut self, name: &'static str, value: f64) -> Self {
        self.numbers.insert(name, value);
        self
    }
}

impl fmt::Display for Finding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}[{}]: {}", self.severity, self.code, self.message)?;
        if !self.remedy.is_empty() {
            write!(f, "\n  remedy: {}", self.remedy)?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_remedy_stands_behind_the_last_semicolon() {
        let finding = Finding::told(Severity::Warning, "bad-pose", "has a; b, needed: c; do d");
        assert_eq!((finding.message.as_str(), finding.remedy.as_str()), ("has a; b, needed: c", "do d"));
        assert_eq!(finding.to_string(), "warning[bad-pose]: has a; b, needed: c\n  remedy: do d");
        assert_eq!(finding.in_line(), "warning: has a; b, needed: c; do d");
        let note = Finding::told(Severity::Note, "x", "so it is");
        assert_eq!((note.to_string(), note.in_line()), ("note[x]: so it is".to_owned(), "note: so it is".to_owned()));
    }
}
