//! Writing results: files whole or not at all, tables for people, JSON for machines.

use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};

/// Version of what commands print as JSON and of `result.json`: rises when a field goes or changes its meaning.
pub(crate) const SCHEMA_VERSION: u32 = 1;

/// Fails now if `path` could not be written later, and makes its folder.
pub(crate) fn check_writable(path: &Path) -> Result<()> {
    if path.is_dir() {
        bail!("{} is a folder, and needs to be a file; give a name in it with --output", path.display());
    }
    let (folder, probe) = beside(path);
    fs::create_dir_all(&folder).with_context(|| format!("could not make the folder {}", folder.display()))?;
    fs::write(&probe, [])
        .and_then(|()| fs::remove_file(&probe))
        .with_context(|| format!("could not write to the folder {}; choose another --output", folder.display()))
}

/// Writes `bytes` to `path` by way of a file beside it, so that a full disk leaves an older file as it was.
pub(crate) fn write_whole(path: &Path, bytes: &[u8]) -> Result<()> {
    let (_, partial) = beside(path);
    let write = || -> std::io::Result<()> {
        let mut file = fs::File::create(&partial)?;
        file.write_all(bytes)?;
        file.sync_all()?;
        fs::rename(&partial, path)
    };
    write()
        .inspect_err(|_| {
            // Best effort: the error that matters is the one above.
            let _ = fs::remove_file(&partial);
        })
        .with_context(|| format!("could not write {} ({} bytes)", path.display(), bytes.len()))
}

/// The folder of `path` and the name of a partial file in it.
fn beside(path: &Path) -> (PathBuf, PathBuf) {
    let folder = match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent.to_owned(),
        _ => PathBuf::from("."),
    };
    let mut name = path.file_name().unwrap_or_default().to_owned();
    name.push(format!(".{}.partial", std::process::id()));
    let partial = folder.join(name);
    (folder, partial)
}

/// A table as CSV, one line each, with the names of the fields above.
pub(crate) fn csv(lines: impl IntoIterator<Item = impl serde::Serialize>) -> Result<Vec<u8>> {
    let mut table = csv::Writer::from_writer(Vec::new());
    lines.into_iter().try_for_each(|line| table.serialize(line))?;
    Ok(table.into_inner()?)
}

/// A report with the version of what its fields mean.
#[derive(serde::Serialize)]
struct Versioned<'a, T> {
    schema_version: u32,
    #[serde(flatten)]
    report: &'a T,
}

/// `report`, a set of named values, as JSON with a `schema_version`.
pub(crate) fn json<T: serde::Serialize>(report: &T) -> Result<String> {
    Ok(serde_json::to_string_pretty(&Versioned { schema_version: SCHEMA_VERSION, report })? + "\n")
}

/// Prints `report` to stdout: as JSON, or as aligned `name value` lines.
pub(crate) fn print<T: serde::Serialize>(report: &T, as_json: bool) -> Result<()> {
    let text = if as_json {
        json(report)?
    } else {
        let serde_json::Value::Object(fields) = serde_json::to_value(report)? else {
            anyhow::bail!("a report is a set of named values");
        };
        let width = fields.keys().map(String::len).max().unwrap_or(0);
        fields.iter().map(|(name, value)| format!("{name:width$}  {}\n", plain(value))).collect()
    };
    print_text(&text)
}

/// Prints `report` to stdout: as JSON, or in the words that it has for people.
pub(crate) fn print_or<T: serde::Serialize>(report: &T, as_json: bool, words: impl std::fmt::Display) -> Result<()> {
    print_text(&if as_json { json(report)? } else { words.to_string() })
}

/// Prints `text` to stdout.
pub(crate) fn print_text(text: &str) -> Result<()> {
    match std::io::stdout().write_all(text.as_bytes()) {
        // The reader has seen enough, as `head` does.
        Err(error) if error.kind() == std::io::ErrorKind::BrokenPipe => Ok(()),
        written => written.context("could not write to stdout"),
    }
}

fn plain(value: &serde_json::Value) -> String {
    match value {
        serde_json::Value::String(text) => text.clone(),
        serde_json::Value::Number(number) if number.is_f64() => {
            let value = number.as_f64().unwrap_or(f64::NAN);
            let digits = if value.abs() < 0.1 { 7 } else { 4 };
            format!("{value:.digits$}")
        }
        serde_json::Value::Array(items) => items.iter().map(plain).collect::<Vec<_>>().join(" "),
        other => other.to_string(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_report_as_json_says_its_version() {
        #[derive(serde::Serialize)]
        struct Report {
            share: f32,
        }
        let text = json(&Report { share: 0.1 }).unwrap();
        assert_eq!(text, "{\n  \"schema_version\": 1,\n  \"share\": 0.1\n}\n");
        let of_values = json(&serde_json::json!({ "bytes": 3 })).unwrap();
        assert!(of_values.contains("\"schema_version\": 1") && of_values.contains("\"bytes\": 3"), "{of_values}");
    }
}
