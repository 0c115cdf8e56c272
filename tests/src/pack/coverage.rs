//! What of the format occurs in a bundle, told from the bytes of its file and from what is drawn of it, not from what it was made for.

mod coding;
mod drawing;
mod layout;
mod streams;

use std::collections::BTreeSet;

use super::expected::FEATURES;
use super::sample::Sample;

/// Names of what occurs.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Found(BTreeSet<String>);

impl Found {
    /// What occurs in a sample and its frames.
    pub fn of(sample: &Sample) -> Self {
        let (mut found, bundle) = (Self::default(), sample.bundle());
        layout::mark(&mut found, &bundle, &sample.bytes);
        coding::mark(&mut found, &bundle, &sample.bytes);
        streams::mark(&mut found, &bundle, &sample.bytes);
        drawing::mark(&mut found, &bundle, sample);
        found
    }

    /// Adds what occurs elsewhere.
    pub fn join(&mut self, other: Self) {
        self.0.extend(other.0);
    }

    /// Of [`required`] what does not occur.
    pub fn missing(&self) -> Vec<String> {
        required().into_iter().filter(|name| !self.0.contains(name)).collect()
    }

    fn mark(&mut self, occurs: bool, name: &str) {
        if occurs {
            self.0.insert(name.to_owned());
        }
    }

    /// Marks which of `ends` a number is.
    fn mark_ends(&mut self, name: &str, number: impl Into<i64>, ends: &[i64]) {
        let number = number.into();
        self.mark(ends.contains(&number), &format!("{name} is {number}"));
    }
}

/// Everything that must occur in the pack.
pub fn required() -> Vec<String> {
    let mut names: Vec<String> = Vec::new();
    for (bit, _) in FEATURES {
        names.extend([format!("feature {bit} set"), format!("feature {bit} clear"), format!("feature {bit} alone")]);
    }
    let all = [layout::ENDS, coding::ENDS, streams::ENDS].concat();
    for (name, ends) in all {
        names.extend(ends.iter().map(|end| format!("{name} is {end}")));
    }
    let others = [layout::OTHERS, coding::OTHERS, streams::OTHERS, drawing::OTHERS].concat();
    names.extend(others.into_iter().map(str::to_owned));
    names
}
