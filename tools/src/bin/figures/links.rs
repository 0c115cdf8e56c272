//! Links between pages, and the pages that sources cite.

use std::collections::{HashMap, HashSet};
use std::fs;
use std::path::{Component, Path, PathBuf};
use std::process::Command;

use anyhow::{Context as _, Result, ensure};
use regex::Regex;

use super::in_repository;

/// Links that lead nowhere.
pub(super) fn faults() -> Result<Vec<String>> {
    let link = Regex::new(r"\]\(([^)\s]+)\)")?;
    let cited = Regex::new(r"\bdocs/[\w./-]+\.(md|csv|svg)(#[\w-]+)?")?;
    let mut faults = Vec::new();
    let mut anchors: HashMap<PathBuf, HashSet<String>> = HashMap::new();
    for file in tracked()? {
        let is_page = file.extension().is_some_and(|extension| extension == "md");
        let Ok(text) = fs::read_to_string(in_repository(&file)) else { continue };
        let is_source =
            ["rs", "sh", "py", "toml", "mjs", "js"].iter().any(|known| file.extension().is_some_and(|e| e == *known));
        let targets: Vec<String> = if is_page {
            let of_page = link.captures_iter(&text).map(|found| found[1].to_owned());
            of_page.filter(|target| !target.contains("://") && !target.starts_with("mailto:")).collect()
        } else if is_source || file.ends_with("Snakefile") {
            cited.find_iter(&text).map(|found| format!("/{}", found.as_str())).collect()
        } else {
            continue;
        };
        for target in targets {
            let (path, anchor) =
                target.split_once('#').map_or((target.as_str(), None), |(path, anchor)| (path, Some(anchor)));
            let base = file.parent().unwrap_or(Path::new(""));
            let to = match path.strip_prefix('/') {
                Some(from_root) => PathBuf::from(from_root),
                None if path.is_empty() => file.clone(),
                None => joined(base, path),
            };
            if !in_repository(&to).exists() {
                faults.push(format!("{}: {target} leads nowhere", file.display()));
                continue;
            }
            let Some(anchor) = anchor.filter(|_| to.extension().is_some_and(|extension| extension == "md")) else {
                continue;
            };
            if !anchors.contains_key(&to) {
                anchors.insert(to.clone(), anchors_of(&fs::read_to_string(in_repository(&to))?)?);
            }
            if !anchors[&to].contains(anchor) {
                faults.push(format!("{}: {} has no heading #{anchor}", file.display(), to.display()));
            }
        }
    }
    Ok(faults)
}

/// Files of the repository.
fn tracked() -> Result<Vec<PathBuf>> {
    let said = Command::new("git")
        .args(["ls-files", "--cached", "--others", "--exclude-standard"])
        .current_dir(in_repository(""))
        .output()
        .context("git is missing")?;
    ensure!(said.status.success(), "git ls-files failed");
    Ok(String::from_utf8(said.stdout)?
        .lines()
        .map(PathBuf::from)
        .filter(|path| in_repository(path).is_file())
        .collect())
}

/// `path` from `base`, without dots.
fn joined(base: &Path, path: &str) -> PathBuf {
    let mut all = PathBuf::new();
    for component in base.join(path).components() {
        match component {
            Component::ParentDir => {
                all.pop();
            }
            Component::CurDir => {}
            other => all.push(other),
        }
    }
    all
}

/// As GitHub makes them of headings.
fn anchors_of(text: &str) -> Result<HashSet<String>> {
    // Of a link its text alone.
    let link = Regex::new(r"\[([^\]]*)\]\([^)]*\)")?;
    let mut found: HashMap<String, usize> = HashMap::new();
    let mut anchors = HashSet::new();
    let mut in_code = false;
    for line in text.lines() {
        in_code ^= line.trim_start().starts_with("```");
        let Some(heading) = line.strip_prefix('#').filter(|_| !in_code) else { continue };
        let heading = heading.trim_start_matches('#').trim();
        let heading = link.replace_all(heading, "$1");
        let slug: String = heading
            .to_lowercase()
            .chars()
            .filter(|c| c.is_alphanumeric() || *c == '-' || *c == '_' || *c == ' ')
            .map(|c| if c == ' ' { '-' } else { c })
            .collect();
        let n = found.entry(slug.clone()).or_default();
        anchors.insert(if *n == 0 { slug } else { format!("{slug}-{n}") });
        *n += 1;
    }
    Ok(anchors)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn headings_become_anchors_as_on_github() {
        let anchors =
            anchors_of("# Rate: what [HAC](x.md) saves, at 800×800\n## Twice\n## Twice\n```\n# no\n```\n").unwrap();
        let expected = ["rate-what-hac-saves-at-800800", "twice", "twice-1"];
        assert_eq!(anchors, expected.iter().map(|&anchor| anchor.to_owned()).collect());
    }

    #[test]
    fn paths_are_relative_to_their_page() {
        assert_eq!(joined(Path::new("a/b"), "../c/./d.csv"), Path::new("a/c/d.csv"));
    }
}
