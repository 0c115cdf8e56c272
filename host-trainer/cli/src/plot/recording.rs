//! What runs recorded, as read from CSV files.

use std::path::Path;

use anyhow::{Context, Result, bail};
use pocketsplat_trainer::cost::on_front;
use serde::Deserialize;
use serde::de::DeserializeOwned;

use super::cost::{CostPanel, CostPoint};
use super::results::{self, ResultRow};
use super::{Named, refuse_infinite};

/// One row of a run's `progress.csv`; other columns are passed over.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
pub(crate) struct LearningRow {
    /// Iterations done.
    pub iteration: u32,
    /// Mean PSNR of the training views since the row before, dB; none where every step was dropped.
    pub psnr_db: Option<f64>,
    /// Anchors now.
    pub anchors: u64,
    /// Seconds spent in iterations.
    #[serde(default)]
    pub seconds: Option<f64>,
    /// Mean bits of an anchor's features since the row before, where the run has a rate.
    #[serde(default)]
    pub feature_bits: Option<f64>,
    /// Of its log-scales, likewise.
    #[serde(default)]
    pub log_scale_bits: Option<f64>,
    /// Of its offsets, likewise.
    #[serde(default)]
    pub offset_bits: Option<f64>,
}

impl LearningRow {
    /// Its columns that have to be finite.
    const NUMBERS: [&str; 5] = ["psnr_db", "seconds", "feature_bits", "log_scale_bits", "offset_bits"];

    /// Mean bits of an anchor's values, where the run has a rate.
    pub(crate) fn bits(&self) -> Option<f64> {
        Some(self.feature_bits? + self.log_scale_bits? + self.offset_bits?)
    }
}

/// One run of a comparison.
#[derive(Deserialize)]
struct RunRow {
    setting: String,
    processor_minutes: f64,
    #[serde(rename = "PSNR")]
    psnr_db: f64,
    #[serde(rename = "Size [Bytes]")]
    size_bytes: f64,
}

impl RunRow {
    /// Its columns that have to be finite.
    const NUMBERS: [&str; 3] = ["processor_minutes", "PSNR", "Size [Bytes]"];
}

/// A CSV file by what it holds.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Recording {
    /// What settings or runs cost.
    Cost(Vec<CostPanel>),
    /// Quality over size, each curve with its seeds.
    Curves(Vec<Named<Vec<ResultRow>>>),
    /// How a run went.
    Learning(Vec<LearningRow>),
}

impl Recording {
    /// Reads a CSV file, told by its header; errors name the path, and the line where it is a line's.
    pub(crate) fn read(path: &Path) -> Result<Self> {
        let bytes = std::fs::read(path).with_context(|| format!("could not read {}", path.display()))?;
        Self::parse(&bytes).with_context(|| format!("{} cannot be plotted", path.display()))
    }

    fn parse(bytes: &[u8]) -> Result<Self> {
        let mut reader = csv::ReaderBuilder::new().trim(csv::Trim::All).from_reader(bytes);
        let header = reader.headers()?.clone();
        let has = |names: &[&str]| names.iter().all(|name| header.iter().any(|column| column == *name));
        if has(&["iteration", "psnr_db", "anchors"]) {
            Ok(Self::Learning(rows(reader, &LearningRow::NUMBERS)?))
        } else if has(&["knob", "setting", "PSNR", "host_s"]) {
            Ok(Self::Cost(settings(reader)?))
        } else if has(&["setting", "processor_minutes", "PSNR", "Size [Bytes]"]) {
            Ok(Self::Cost(runs(&rows(reader, &RunRow::NUMBERS)?)))
        } else if results::is_table(&header) {
            Ok(Self::Curves(results::curves(&mut reader)?))
        } else {
            let found: String = header.iter().collect::<Vec<_>>().join(",").chars().take(80).collect();
            bail!(
                "it begins with `{found}`; needs the columns iteration, psnr_db and anchors (progress.csv of a run), PSNR and \
                 Size [Bytes] (tables of runs), or what cost and compare write (cost.csv, runs.csv)"
            )
        }
    }
}

/// A panel for each machine of cost.csv.
fn settings(mut reader: csv::Reader<&[u8]>) -> Result<Vec<CostPanel>> {
    let header = reader.headers()?.clone();
    let machines: Vec<&str> = header.iter().filter_map(|column| column.strip_suffix(" on_front")).collect();
    let place =
        |name: &str| header.iter().position(|column| column == name).with_context(|| format!("no column {name}"));
    let records = reader.records().collect::<Result<Vec<_>, _>>()?;
    if machines.is_empty() {
        bail!("it has no column of a front; needs one that ends in ` on_front` for each machine");
    }
    if records.is_empty() {
        bail!("it has no row to draw");
    }
    let [parameter, setting, psnr] = [place("knob")?, place("setting")?, place("PSNR")?];
    let panel = |machine: &str| {
        let is_host = place(&format!("{machine} instructions")).is_err();
        let (column, scale) =
            if is_host { (place("host_s")?, 1e3) } else { (place(&format!("{machine} instructions"))?, 1e-6) };
        let front = place(&format!("{machine} on_front"))?;
        let mut points = Vec::new();
        for record in records.iter().filter(|record| !record[column].is_empty()) {
            refuse_infinite(&header, record, &[&header[column], &header[psnr]])?;
            let number = |i: usize| record[i].parse::<f64>().with_context(|| format!("`{}` is no number", &record[i]));
            let (cost, psnr_db) = (scale * number(column)?, number(psnr)?);
            let (parameter, setting) = (record[parameter].to_owned(), record[setting].to_owned());
            points.push(CostPoint { parameter, setting, cost, psnr_db, on_front: &record[front] == "true" });
        }
        let unit = if is_host { "milliseconds" } else { "millions of instructions" };
        Ok(CostPanel { title: format!("Quality over time: {machine}"), unit: unit.to_owned(), points })
    };
    machines.into_iter().map(panel).collect()
}

/// Minutes and bytes of runs.csv.
fn runs(rows: &[RunRow]) -> Vec<CostPanel> {
    let panel = |title: &str, unit: &str, cost: fn(&RunRow) -> f64| {
        let front = on_front(&rows.iter().map(|row| (cost(row), row.psnr_db)).collect::<Vec<_>>());
        let point = |(row, on_front): (&RunRow, bool)| CostPoint {
            parameter: parameter_of(&row.setting),
            setting: row.setting.clone(),
            cost: cost(row),
            psnr_db: row.psnr_db,
            on_front,
        };
        let points = rows.iter().zip(front).map(point).collect();
        CostPanel { title: title.to_owned(), unit: unit.to_owned(), points }
    };
    vec![
        panel("Quality over time", "minutes of a processor core", |row| row.processor_minutes),
        panel("Quality over bytes", "bundle, kB", |row| row.size_bytes / 1e3),
    ]
}

/// The key that a run's setting begins with; the first run has none.
fn parameter_of(setting: &str) -> String {
    match setting.split_once([' ', ',']) {
        Some((key, _)) if key != "as" => key.to_owned(),
        _ => setting.to_owned(),
    }
}

/// * `numbers`: columns that have to be finite where they are given.
fn rows<T: DeserializeOwned>(mut reader: csv::Reader<&[u8]>, numbers: &[&str]) -> Result<Vec<T>> {
    let header = reader.headers()?.clone();
    let mut rows: Vec<T> = Vec::new();
    for record in reader.records() {
        let record = record?;
        refuse_infinite(&header, &record, numbers)?;
        rows.push(record.deserialize(Some(&header))?);
    }
    if rows.is_empty() {
        bail!("it has no row to draw; let the run go further");
    }
    Ok(rows)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: impl AsRef<[u8]>) -> Result<Recording> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("some.csv");
        std::fs::write(&path, text).unwrap();
        Recording::read(&path)
    }

    #[test]
    fn columns_are_told_by_name() {
        let text = "iteration,weather,psnr_db,anchors\n3,7.5,10.5,54381\n6,,,54400\n";
        let row = |iteration, psnr_db, anchors, [feature_bits, log_scale_bits, offset_bits]: [Option<f64>; 3]| {
            LearningRow { iteration, psnr_db, anchors, seconds: None, feature_bits, log_scale_bits, offset_bits }
        };
        let rows = vec![row(3, Some(10.5), 54_381, [None; 3]), row(6, None, 54_400, [None; 3])];
        assert_eq!(read(text).unwrap(), Recording::Learning(rows));
        let text = "offset_bits,iteration,psnr_db,anchors,feature_bits,log_scale_bits\n3.5,3,10.5,7,60.0,9.0\n";
        let with_rate = row(3, Some(10.5), 7, [Some(60.0), Some(9.0), Some(3.5)]);
        assert_eq!(with_rate.bits(), Some(72.5));
        assert_eq!(read(text).unwrap(), Recording::Learning(vec![with_rate]));
    }

    #[test]
    fn what_the_other_commands_write_is_read_too() {
        let found = |text: &str| -> Vec<(String, usize)> {
            let Recording::Curves(curves) = read(text).unwrap() else { panic!("curves") };
            curves.into_iter().map(|curve| (curve.name, curve.what.len())).collect()
        };
        let named = |name: &str, n| (name.to_owned(), n);
        let heads = "Method,Submethod,PSNR,SSIM,LPIPS,Size [Bytes],#Gaussians\n";
        let table = format!("{heads}hac,a,30,,,4e5,\nhac-plus,a,31,,,3e5,\nhac,b,33,,,8e5,\nhac,c,,,,,\n");
        assert_eq!(found(&table), [named("hac", 2), named("hac-plus", 1)], "what was not measured is no point");
        assert_eq!(found(&format!("{heads}hac,a,30,,,4e5,\n")), [named("", 1)], "one curve is the file's");
        let plan = "run,dataset,scene,size,method,rate,seed,psnr_db,bytes\na-1,A,a,,ours,low,1,30,4e5\na-2,A,a,,ours,low,2,31,5e5\n\
            b-1,A,b,,ours,low,1,33,8e5\n";
        assert_eq!(found(plan), [named("a", 2), named("b", 1)], "runs of one method are its seeds");
        let rates = "capture,px,lambda,PSNR,bytes\nlego,200,0.1,30,1\nlego,400,0.1,31,2\n";
        assert_eq!(found(rates), [named("200", 1), named("400", 1)]);
        let costs = "knob,setting,PSNR,host_s,m4 instructions,m4 on_front,host on_front\n\
            level,exact,31.5,0.002,4e7,false,true\ncut,none,31.0,0.001,,false,true\n";
        let Recording::Cost(panels) = read(costs).unwrap() else { panic!("costs") };
        let found: Vec<_> =
            panels.iter().map(|panel| (panel.unit.as_str(), panel.points.len(), panel.points[0].cost)).collect();
        assert_eq!(found, [("millions of instructions", 1, 40.0), ("milliseconds", 2, 2.0)]);
        let runs = "run,setting,processor_minutes,PSNR,Size [Bytes]\na,as the first,3,33,3000\nb,offsets 3,4,32,2000\n";
        let Recording::Cost(panels) = read(runs).unwrap() else { panic!("costs") };
        assert_eq!(panels.len(), 2);
        assert_eq!([0, 1].map(|i| panels[0].points[i].on_front), [true, false]);
        assert_eq!([0, 1].map(|i| panels[1].points[i].on_front), [true, true]);
    }

    #[test]
    fn a_file_that_cannot_be_plotted_says_why() {
        let message = |text| {
            let error = format!("{:#}", read(text).unwrap_err());
            assert!(error.contains("some.csv"), "{error}");
            error
        };
        assert!(message("a,b\n1,2\n").contains("`a,b`"));
        assert!(message("").contains("needs the columns"));
        assert!(message("iteration,psnr_db,anchors\n").contains("no row"));
        let wrong = message("iteration,psnr_db,anchors\n3,1.0,5\n6,good,5\n");
        assert!(wrong.contains("line: 3"), "{wrong}");
    }

    #[test]
    fn a_number_without_end_is_refused_by_line_and_column_in_every_kind_of_file() {
        let costs = "knob,setting,PSNR,host_s,m4 instructions,m4 on_front,host on_front\nlevel,exact,";
        for (text, place) in [
            ("iteration,psnr_db,anchors\n3,,5\n6,inf,5\n".to_owned(), "line 3, column psnr_db: found `inf`"),
            ("iteration,psnr_db,anchors,seconds\n3,1,5,NaN\n".to_owned(), "line 2, column seconds: found `NaN`"),
            (format!("{costs}inf,0.002,4e7,false,true\n"), "line 2, column PSNR: found `inf`"),
            (format!("{costs}30,0.002,inf,false,true\n"), "line 2, column m4 instructions: found `inf`"),
            (format!("{costs}30,-inf,4e7,false,true\n"), "line 2, column host_s: found `-inf`"),
            (
                "run,setting,processor_minutes,PSNR,Size [Bytes]\na,as the first,3,33,infinity\n".to_owned(),
                "line 2, column Size [Bytes]: found `infinity`",
            ),
        ] {
            let error = format!("{:#}", read(&text).unwrap_err());
            let needed = format!("{place}, needed: a finite number; correct it, or take the row out");
            assert!(error.contains("some.csv") && error.contains(&needed), "{error}");
        }
    }
}
