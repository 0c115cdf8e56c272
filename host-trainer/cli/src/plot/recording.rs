//! What runs and sweeps recorded, as read from CSV files.

use std::path::Path;

use anyhow::{Context, Result, bail};
use pocketsplat_metrics::RatePoint;
use pocketsplat_trainer::cost::on_front;
use serde::Deserialize;
use serde::de::DeserializeOwned;

use super::cost::{CostPanel, CostPoint};
use super::{Named, gathered};

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
    /// Mean bits of an anchor's values, where the run has a rate.
    pub(crate) fn bits(&self) -> Option<f64> {
        Some(self.feature_bits? + self.log_scale_bits? + self.offset_bits?)
    }
}

/// One row of results: a method at one rate, with means over views or scenes.
///
/// The columns are those of the 3DGS compression survey (Bagdasarian et al. 2024, "3DGS.zip"), so that its tables and ours
/// can be laid over each other.
#[derive(Clone, Debug, PartialEq, Deserialize)]
pub(crate) struct ResultRow {
    /// Name of the rate.
    #[serde(rename = "Submethod")]
    pub submethod: String,
    /// dB.
    #[serde(rename = "PSNR")]
    pub psnr_db: f64,
    /// Structural similarity.
    #[serde(rename = "SSIM")]
    pub ssim: Option<f64>,
    /// Perceptual distance; none where it was not measured.
    #[serde(rename = "LPIPS")]
    pub lpips: Option<f64>,
    /// Everything that is needed to draw.
    #[serde(rename = "Size [Bytes]")]
    pub size_bytes: f64,
    /// Gaussians that can be drawn.
    #[serde(rename = "#Gaussians")]
    pub n_gaussians: Option<f64>,
    /// What trained and measured it; none for what is published.
    pub program: Option<String>,
}

impl ResultRow {
    /// Where the row lies in the plane of rate and distortion.
    pub(crate) fn rate_point(&self) -> RatePoint {
        RatePoint { size_bytes: self.size_bytes, psnr_db: self.psnr_db }
    }

    /// A row without what no curve shows.
    #[cfg(test)]
    pub(crate) fn of(submethod: &str, size_bytes: f64, psnr_db: f64) -> Self {
        let submethod = submethod.to_owned();
        Self { submethod, psnr_db, ssim: None, lpips: None, size_bytes, n_gaussians: None, program: None }
    }
}

/// Results as the CSV that [`Recording::read`] takes back.
pub(crate) fn results_csv(rows: &[ResultRow]) -> Result<Vec<u8>> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    writer.write_record(["Submethod", "PSNR", "SSIM", "LPIPS", "Size [Bytes]", "#Gaussians", "program"])?;
    let decimals = |value: f64| format!("{value:.6}");
    for row in rows {
        writer.write_record([
            row.submethod.clone(),
            decimals(row.psnr_db),
            row.ssim.map(decimals).unwrap_or_default(),
            row.lpips.map(decimals).unwrap_or_default(),
            row.size_bytes.to_string(),
            row.n_gaussians.map(|n| n.to_string()).unwrap_or_default(),
            row.program.clone().unwrap_or_default(),
        ])?;
    }
    Ok(writer.into_inner()?)
}

/// One run of an ablation.
#[derive(Deserialize)]
struct AblationRow {
    row: String,
    lambda: f64,
    #[serde(rename = "PSNR")]
    psnr_db: f64,
    #[serde(rename = "Size [Bytes]")]
    size_bytes: f64,
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

/// Whose a row of results is, in tables of several methods: two may have rates of one name.
#[derive(Deserialize)]
struct MethodColumn {
    #[serde(rename = "Method")]
    method: String,
}

/// A CSV file by what it holds.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Recording {
    /// What settings or runs cost.
    Cost(Vec<CostPanel>),
    /// Curves of an ablation or of several methods, each with its seeds.
    Curves(Vec<Named<Vec<ResultRow>>>),
    /// How a run went.
    Learning(Vec<LearningRow>),
    /// What came out over rates.
    Results(Vec<ResultRow>),
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
            Ok(Self::Learning(rows(reader)?))
        } else if has(&["knob", "setting", "PSNR", "host_s"]) {
            Ok(Self::Cost(settings(reader)?))
        } else if has(&["setting", "processor_minutes", "PSNR", "Size [Bytes]"]) {
            Ok(Self::Cost(runs(&rows(reader)?)))
        } else if has(&["row", "lambda", "seed", "PSNR", "Size [Bytes]"]) {
            Ok(Self::Curves(ablation(rows(reader)?)))
        } else if has(&["Method", "PSNR", "Size [Bytes]"]) {
            let methods: Vec<MethodColumn> = rows(csv::ReaderBuilder::new().trim(csv::Trim::All).from_reader(bytes))?;
            let named = methods.into_iter().map(|row| row.method).zip(rows(reader)?);
            Ok(match <[_; 1]>::try_from(gathered(named)) {
                Ok([Named { what, .. }]) => Self::Results(what),
                Err(several) => Self::Curves(several),
            })
        } else if has(&["PSNR", "Size [Bytes]"]) {
            Ok(Self::Results(rows(reader)?))
        } else {
            let found: String = header.iter().collect::<Vec<_>>().join(",").chars().take(80).collect();
            bail!(
                "it begins with `{found}`; needs the columns iteration, psnr_db and anchors (progress.csv of a run), PSNR and \
                 Size [Bytes] (results of a sweep), or what ablate, cost and compare write (ablation.csv, cost.csv, runs.csv)"
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

/// The rows of an ablation as curves; rows of one rate are seeds. A row of one rate alone is no curve.
fn ablation(rows: Vec<AblationRow>) -> Vec<Named<Vec<ResultRow>>> {
    let point = |AblationRow { row, lambda, psnr_db, size_bytes }| {
        let submethod = format!("lambda={lambda}");
        (row, ResultRow { submethod, psnr_db, ssim: None, lpips: None, size_bytes, n_gaussians: None, program: None })
    };
    let mut curves = gathered(rows.into_iter().map(point));
    curves.retain(|curve| curve.what.iter().any(|point| point.submethod != curve.what[0].submethod));
    curves
}

fn rows<T: DeserializeOwned>(mut reader: csv::Reader<&[u8]>) -> Result<Vec<T>> {
    let rows = reader.deserialize().collect::<Result<Vec<T>, _>>()?;
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
    fn results_are_read_back_as_they_were_written() {
        let row = |submethod: &str, lpips| ResultRow {
            submethod: submethod.to_owned(),
            psnr_db: 31.25,
            ssim: Some(0.9375),
            lpips,
            size_bytes: 1_234_567.0,
            n_gaussians: Some(98_765.0),
            program: Some("0.1.0 r1".to_owned()),
        };
        let rows = vec![row("λ=0.004", None), row("λ=0.001", Some(0.125))];
        let text = String::from_utf8(results_csv(&rows).unwrap()).unwrap();
        assert!(text.contains("\nλ=0.004,31.250000,0.937500,,1234567,98765,0.1.0 r1\n"), "{text}");
        assert_eq!(read(&text).unwrap(), Recording::Results(rows));
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
        let ablation = "row,lambda,seed,PSNR,Size [Bytes]\nnone,0.004,42,33.5,400\nnone,0.004,43,33.7,420\n\
            none,0.002,42,34.0,500\nalone,0.004,42,1.0,2\n";
        let Recording::Curves(curves) = read(ablation).unwrap() else { panic!("an ablation") };
        assert_eq!((curves.len(), curves[0].name.as_str(), curves[0].what.len()), (1, "none", 3));
        let heads = "Method,Submethod,PSNR,SSIM,LPIPS,Size [Bytes],#Gaussians\n";
        let table = format!("{heads}hac,a,30,,,4e5,\nhac-plus,a,31,,,3e5,\nhac,b,33,,,8e5,\n");
        let Recording::Curves(curves) = read(&table).unwrap() else { panic!("two methods") };
        let found: Vec<_> = curves.iter().map(|curve| (curve.name.as_str(), curve.what.len())).collect();
        assert_eq!(found, [("hac", 2), ("hac-plus", 1)]);
        let Recording::Results(rows) = read(format!("{heads}hac,a,30,,,4e5,\n")).unwrap() else { panic!("one method") };
        assert_eq!(rows.len(), 1);
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
}
