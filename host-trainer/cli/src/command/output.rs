//! Results on stdout, and as text: tables for people, JSON for machines.

use std::io::Write;

use anyhow::{Context, Result};

/// Version of what commands print as JSON and of `result.json`: rises when a field goes or changes its meaning.
pub(crate) const SCHEMA_VERSION: u32 = 1;

/// A table as CSV, one line each, with the names of the fields above.
pub(crate) fn csv(lines: impl IntoIterator<Item = impl serde::Serialize>) -> Result<Vec<u8>> {
    let mut table = csv::Writer::from_writer(Vec::new());
    lines.into_iter().try_for_each(|line| table.serialize(line))?;
    Ok(table.into_inner()?)
}

/// The same with a last column `program` that is alike in all lines: what trained and measured them.
pub(crate) fn csv_of(program: &str, lines: impl IntoIterator<Item = impl serde::Serialize>) -> Result<Vec<u8>> {
    let plain = csv(lines)?;
    let mut table = csv::Writer::from_writer(Vec::new());
    let rows = csv::ReaderBuilder::new().has_headers(false).from_reader(plain.as_slice()).into_records();
    for (i, row) in rows.enumerate() {
        let mut row = row?;
        row.push_field(if i == 0 { "program" } else { program });
        table.write_record(&row)?;
    }
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
        // The reader has seen enough, as `head` does, or the terminal is gone.
        Err(error) if error.kind() == std::io::ErrorKind::BrokenPipe || is_hung_up(&error) => Ok(()),
        written => written.context("could not write to stdout"),
    }
}

/// Whether stdout is a terminal that is gone, which does not say any more that it is one.
#[cfg(unix)]
fn is_hung_up(error: &std::io::Error) -> bool {
    use std::os::fd::AsFd as _;
    use std::os::unix::fs::FileTypeExt as _;
    let stdout = std::io::stdout().as_fd().try_clone_to_owned().map(std::fs::File::from);
    let is_device = stdout.and_then(|file| file.metadata()).is_ok_and(|found| found.file_type().is_char_device());
    is_device && error.raw_os_error() == Some(libc::EIO)
}

#[cfg(not(unix))]
fn is_hung_up(_: &std::io::Error) -> bool {
    false
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
    fn the_program_is_the_last_column() {
        #[derive(serde::Serialize)]
        struct Line {
            name: &'static str,
        }
        let table = csv_of("0.1.0 r1", [Line { name: "a, b" }, Line { name: "c" }]).unwrap();
        assert_eq!(String::from_utf8(table).unwrap(), "name,program\n\"a, b\",0.1.0 r1\nc,0.1.0 r1\n");
    }

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
