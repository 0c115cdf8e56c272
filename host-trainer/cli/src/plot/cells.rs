//! Numbers in the cells of CSV files.

use anyhow::{Error, Result, anyhow};
use csv::StringRecord;

/// Refuses a row with a number that is not finite in one of these columns: no axis reaches there, and every mean is lost.
///
/// What is empty, or no number at all, is left to whoever reads the row.
pub(crate) fn refuse_infinite(header: &StringRecord, row: &StringRecord, columns: &[&str]) -> Result<()> {
    for (column, value) in header.iter().zip(row.iter()) {
        let is_infinite = value.parse::<f64>().is_ok_and(|number| !number.is_finite());
        if is_infinite && columns.contains(&column) {
            return Err(refused(row, column, value, "a finite number"));
        }
    }
    Ok(())
}

/// Why a cell cannot be used.
///
/// * `needed`: in its place.
pub(crate) fn refused(row: &StringRecord, column: &str, found: &str, needed: &str) -> Error {
    let line = row.position().map_or(0, csv::Position::line);
    anyhow!("line {line}, column {column}: found `{found}`, needed: {needed}; correct it, or take the row out")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_number_without_end_is_refused_by_its_place_and_other_text_is_left_alone() {
        let mut reader =
            csv::Reader::from_reader(&b"name,PSNR,other\ninf,30,inf\nb,,NaN\nc,none,1\nd,-Infinity,1\n"[..]);
        let header = reader.headers().unwrap().clone();
        let rows: Vec<StringRecord> = reader.records().map(Result::unwrap).collect();
        for row in &rows[..3] {
            refuse_infinite(&header, row, &["PSNR"]).unwrap();
        }
        let said = refuse_infinite(&header, &rows[3], &["PSNR"]).unwrap_err().to_string();
        assert!(said.starts_with("line 5, column PSNR: found `-Infinity`, needed: a finite number; "), "{said}");
        assert!(refuse_infinite(&header, &rows[1], &["PSNR", "other"]).is_err(), "what is no number is not finite");
    }
}
