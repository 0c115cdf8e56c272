//! Tables of the decoder's page: the code of each set of cargo features, and the stack of each call.

use std::fmt::Write as _;

use anyhow::{Context as _, Result};

use super::in_repository;

/// Sets of cargo features that the page has, as `sizes.csv` of the link gate names them, and what they are.
const FEATURES: [(&str, &str); 8] = [
    ("none", "none: static tables, isotropic Gaussians"),
    ("anisotropy", "`anisotropy`: Gaussians of three deviations and a rotation"),
    ("detail", "`detail`: the detail head"),
    ("baked detail", "`detail`, `baked`: what is evaluated once"),
    ("context", "`context`: symbols whose models follow from their place"),
    ("effects", "by default: `anisotropy`, `context` and `detail`"),
    ("context detail", "without `anisotropy`"),
    ("anisotropy context", "without `detail`"),
];
/// Calls whose stack it has: their head, the bundle if it has to be one, and the call as `stack.csv` names it.
const CALLS: [(&str, Option<&str>, &str); 7] = [
    ("`parse`", None, "parse"),
    ("`plan`", None, "plan"),
    ("`bind`", Some("sample-context"), "bind"),
    ("`bind`, baked", Some("sample-matte"), "bind"),
    ("`render`", None, "render"),
    ("`begin`", None, "begin"),
    ("`next_tile`", None, "next_tile"),
];

/// A table of that name, if it is the decoder's.
pub(super) fn table(name: &str) -> Option<Result<String>> {
    match name {
        "code" => Some(code()),
        "stack" => Some(stack()),
        _ => None,
    }
}

fn code() -> Result<String> {
    let records = records("tests/link-gate/sizes.csv")?;
    let mut text = "| cargo features | text, bytes | tables and messages |\n|---|---|---|\n".to_owned();
    for (features, what) in FEATURES {
        let record = records.iter().find(|record| &record[0] == features);
        let record = record.with_context(|| format!("sizes.csv has no row of the features {features}"))?;
        writeln!(text, "| {what} | {} | {} |", in_thousands(record[2].parse()?), in_thousands(record[3].parse()?))?;
    }
    Ok(text)
}

fn stack() -> Result<String> {
    let records = records("docs/results/stack.csv")?;
    let heads: Vec<&str> = CALLS.iter().map(|(head, ..)| *head).collect();
    let mut text = format!("| built with | {} |\n|---|{}\n", heads.join(" | "), "---|".repeat(heads.len()));
    let mut profiles: Vec<&str> = records.iter().map(|record| &record[0]).collect();
    profiles.dedup();
    for profile in profiles {
        let mut line = format!("| {profile} |");
        for (_, bundle, call) in CALLS {
            let of_call = records.iter().filter(|record| {
                &record[0] == profile && bundle.is_none_or(|bundle| &record[1] == bundle) && &record[2] == call
            });
            let bytes = of_call.map(|record| record[3].parse()).collect::<Result<Vec<u64>, _>>()?;
            let most = bytes.into_iter().max().with_context(|| format!("stack.csv has no {call} of {profile}"))?;
            write!(line, " {} |", in_thousands(most))?;
        }
        writeln!(text, "{line}")?;
    }
    Ok(text)
}

fn records(path: &str) -> Result<Vec<csv::StringRecord>> {
    let mut reader = csv::Reader::from_path(in_repository(path)).with_context(|| format!("could not read {path}"))?;
    Ok(reader.records().collect::<Result<_, _>>()?)
}

/// 12,345 for 12345.
fn in_thousands(number: u64) -> String {
    let digits = number.to_string();
    let mut text = String::new();
    for (i, digit) in digits.chars().enumerate() {
        if i > 0 && (digits.len() - i).is_multiple_of(3) {
            text.push(',');
        }
        text.push(digit);
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn thousands_are_set_apart() {
        assert_eq!([0, 999, 1_000, 68_832, 1_234_567].map(in_thousands), ["0", "999", "1,000", "68,832", "1,234,567"]);
    }

    #[test]
    fn every_row_and_call_of_the_page_is_measured() {
        let [code, stack] = ["code", "stack"].map(|name| table(name).expect("the decoder's").expect("measured"));
        assert_eq!(code.lines().count(), 2 + FEATURES.len());
        assert!(stack.lines().all(|line| line.matches('|').count() == 2 + CALLS.len()), "{stack}");
        assert!(table("captures").is_none());
    }
}
