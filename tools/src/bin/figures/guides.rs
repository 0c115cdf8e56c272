//! What a guide may not say outside of blocks: figures that nobody writes anew, and history.

use std::fs;

use anyhow::Result;
use regex::Regex;

use super::blocks::{outside, pages};

/// Pages that a program writes whole.
const WRITTEN: [&str; 2] = ["commands.md", "numerical-stability.md"];

/// What is found, and what it is.
const RULES: [(&str, &str); 5] = [
    (r"\d dB\b", "a measured figure"),
    (r"\b\d{1,3}(,\d{3})+ (bytes|B)\b", "a measured figure"),
    (
        r"\d (million|billion) instructions|\d core (minutes|hours)|\d(\.\d+)? % (fewer|more|smaller|larger|less|faster|slower)",
        "a measured figure",
    ),
    (r"\bcommit `?[0-9a-f]{7,40}\b|`[0-9a-f]{7,40}`", "a commit"),
    (
        r"(?i)\b(of|is|are|was|were) before\b|today's program|\bformerly\b|\bformat version [1-3]\b|until version \d",
        "history",
    ),
];

/// Lines of guides that belong into a block, an experiment or the changelog.
pub(super) fn faults() -> Result<Vec<String>> {
    let rules = RULES.iter().map(|(pattern, what)| Ok((Regex::new(pattern)?, *what))).collect::<Result<Vec<_>>>()?;
    let mut faults = Vec::new();
    for page in pages()? {
        let name = page.file_name().unwrap_or_default().to_string_lossy().into_owned();
        if !WRITTEN.contains(&name.as_str()) {
            faults.extend(faults_of(&name, &fs::read_to_string(&page)?, &rules));
        }
    }
    Ok(faults)
}

fn faults_of(name: &str, text: &str, rules: &[(Regex, &str)]) -> Vec<String> {
    let mut faults = Vec::new();
    let mut in_code = false;
    for (i, line) in outside(text).lines().enumerate() {
        if line.trim_start().starts_with("```") {
            in_code = !in_code;
        }
        for (rule, what) in rules.iter().filter(|_| !in_code) {
            if let Some(found) = rule.find(line) {
                faults.push(format!("{name}:{}: {what} outside of a block: `{}`", i + 1, found.as_str()));
            }
        }
    }
    faults
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn figures_and_history_are_found_and_settings_are_not() {
        let rules: Vec<_> = RULES.iter().map(|(pattern, what)| (Regex::new(pattern).unwrap(), *what)).collect();
        let found = |line: &str| faults_of("x.md", line, &rules).len();
        for bad in [
            "it has 31.4 dB there",
            "a bundle of 94,100 bytes",
            "62 million instructions",
            "57 % fewer bytes",
            "of commit e0a9d2d",
            "the row is of before that",
        ] {
            assert_eq!(found(bad), 1, "{bad}");
        }
        for good in [
            "--ram 200KiB keeps 200 KiB",
            "level 3 has 96 KiB",
            "before training",
            "```sh\nabc 3 dB\n```",
            "70 % overlap",
        ] {
            assert_eq!(found(good), 0, "{good}");
        }
    }
}
