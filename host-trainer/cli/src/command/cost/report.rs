//! The results of `pocketsplat cost`: table, figure and page.

use std::path::Path;

use crate::plot::{CostPanel, CostPoint, cost_svg};
use anyhow::Result;
use pocketsplat_files::{Content, Output, Outputs};
use pocketsplat_format::Stage;
use pocketsplat_trainer::cost::{Measured, on_front};

use super::super::output;
use super::super::outputs::{FIGURE, table};
use super::machine::Machine;

/// What was measured.
pub(super) struct Report<'a> {
    pub(super) bundle_name: String,
    pub(super) machines: &'a [Machine],
    /// Of each setting, the exact one first; instructions in the order of those machines that are devices.
    /// What trained the bundle, and what measured it.
    pub(super) program: &'a str,
    pub(super) measured: &'a [Measured],
    pub(super) n_views: usize,
    /// Views whose instructions count.
    pub(super) n_counted: usize,
}

/// How the page begins.
const TITLE: &str = "# What accuracy costs in time";

/// cost.csv, cost.svg and cost.md.
pub(super) struct ReportFiles {
    table: Output,
    figure: Output,
    page: Output,
}

impl ReportFiles {
    /// Those in `folder`, which is made where there is none.
    pub(super) fn checked(folder: &Path, outputs: &mut Outputs) -> Result<Self> {
        Outputs::folder(folder)?;
        Ok(Self {
            table: outputs.file(&folder.join("cost.csv"), table(&["knob,"]))?,
            figure: outputs.file(&folder.join("cost.svg"), FIGURE)?,
            page: outputs.file(&folder.join("cost.md"), Content::Text(&[TITLE], "a table (.md)"))?,
        })
    }
}

/// A machine, the place of its instructions, and which settings nothing beats there.
struct Column {
    machine: Machine,
    place: usize,
    front: Vec<bool>,
}

impl Report<'_> {
    /// Writes them, and prints the page.
    pub(super) fn write(&self, files: &ReportFiles) -> Result<()> {
        let columns = self.columns();
        files.table.write(&self.table(&columns)?)?;
        files.figure.write(self.figure(&columns)?.as_bytes())?;
        let page = self.page(&columns);
        files.page.write(page.as_bytes())?;
        output::print_text(&page)
    }

    fn columns(&self) -> Vec<Column> {
        let mut n_devices = 0;
        let column = |machine: &Machine| {
            let place = n_devices;
            n_devices += usize::from(machine.device().is_some());
            let times: Vec<Option<f64>> = self.measured.iter().map(|m| machine.time(m, place)).collect();
            // What nobody counted is on no front.
            let points = times.iter().zip(self.measured).map(|(time, m)| (time.unwrap_or(f64::INFINITY), m.psnr_db));
            let front = on_front(&points.collect::<Vec<_>>());
            let front = front.into_iter().zip(times).map(|(on_front, time)| on_front && time.is_some()).collect();
            Column { machine: *machine, place, front }
        };
        self.machines.iter().map(column).collect()
    }

    /// A row for each setting; for each device a group of columns that begins with its name.
    fn table(&self, columns: &[Column]) -> Result<Vec<u8>> {
        let mut table = csv::Writer::from_writer(Vec::new());
        let settings = ["knob", "setting", "pruning_rate", "alpha_cut_255ths", "detail"];
        let figures = ["PSNR", "psnr_to_reference_db", "worst_channel", "host_s", "scratch_bytes", "splats_dropped"];
        let mut header: Vec<String> = settings.into_iter().chain(figures).map(str::to_owned).collect();
        for Column { machine, .. } in columns {
            if machine.device().is_some() {
                header.extend(["instructions", "source"].map(|what| format!("{machine} {what}")));
                header.extend(Stage::ALL.map(|stage| format!("{machine} {}", stage.name())));
            }
            header.push(format!("{machine} on_front"));
        }
        header.push("program".to_owned());
        table.write_record(&header)?;
        for (i, m) in self.measured.iter().enumerate() {
            let quality = m.setting.quality;
            let mut row = vec![
                m.setting.parameter.to_owned(),
                m.setting.name.clone(),
                m.setting.pruning_rate.to_string(),
                quality.alpha_cut.to_string(),
                quality.detail.to_string(),
                m.psnr_db.to_string(),
                m.psnr_to_reference_db.to_string(),
                m.worst_channel.to_string(),
                m.host_s.to_string(),
                m.scratch_bytes.to_string(),
                m.splats_dropped.to_string(),
            ];
            for Column { machine, place, front } in columns {
                if machine.device().is_some() {
                    match m.instructions[*place] {
                        None => row.extend(std::iter::repeat_n(String::new(), 2 + Stage::ALL.len())),
                        Some(instructions) => {
                            row.push(format!("{:.0}", instructions.total()));
                            row.push(if instructions.counted { "counted" } else { "predicted" }.to_owned());
                            row.extend(instructions.stages.map(|stage| format!("{stage:.0}")));
                        }
                    }
                }
                row.push(front[i].to_string());
            }
            row.push(self.program.to_owned());
            table.write_record(&row)?;
        }
        Ok(table.into_inner()?)
    }

    fn figure(&self, columns: &[Column]) -> Result<String> {
        let panel = |Column { machine, place, front }: &Column| CostPanel {
            title: format!("Quality over time: {machine}"),
            unit: machine.unit().to_owned(),
            points: self
                .measured
                .iter()
                .zip(front)
                .filter_map(|(m, &on_front)| {
                    let cost = machine.time(m, *place)?;
                    let (parameter, setting) = (m.setting.parameter.to_owned(), m.setting.name.clone());
                    Some(CostPoint { parameter, setting, cost, psnr_db: m.psnr_db, on_front })
                })
                .collect(),
        };
        cost_svg(&columns.iter().map(panel).collect::<Vec<_>>())
    }

    /// The table as a page; of the combinations those that are on a front.
    fn page(&self, columns: &[Column]) -> String {
        let exact = &self.measured[0];
        let mut text = format!(
            "{TITLE}: {}\n\nMeans over {} views; instructions of a frame in millions, means over {} of them, \
             counted on an emulated board or, after ≈, predicted; boards: milliseconds, computed from instructions and clock; \
             host: milliseconds of a frame on this machine, one thread. PSNR to the f64 reference is the worst view's, the \
             largest difference of a channel of all views is in 255ths.\n\n\
             | knob | setting | PSNR, dB | to the reference, dB | worst | scratch |",
            self.bundle_name, self.n_views, self.n_counted,
        );
        for Column { machine, .. } in columns {
            text += &format!(" {machine} | of exact |");
        }
        text += &format!("\n|---|---|---|---|---|---|{}\n", "---|---|".repeat(columns.len()));
        for (i, m) in self.measured.iter().enumerate() {
            if m.setting.parameter == "quality" && columns.iter().all(|column| !column.front[i]) {
                continue;
            }
            text += &format!(
                "| {} | {} | {:.2} | {:.1} | {} | {} |",
                m.setting.parameter,
                m.setting.name,
                m.psnr_db,
                m.psnr_to_reference_db,
                m.worst_channel,
                m.scratch_bytes,
            );
            for Column { machine, place, front } in columns {
                let (time, of) = (machine.time(m, *place), machine.time(exact, *place));
                let counted = m.instructions.get(*place).copied().flatten().is_some_and(|found| found.counted);
                let about = if machine.device().is_none() || counted { "" } else { "≈ " };
                let mark = if front[i] { "**" } else { "" };
                let [time, share] = match (time, of) {
                    (Some(time), Some(of)) => [format!("{mark}{about}{time:.1}{mark}"), format!("{:.2}", time / of)],
                    _ => [String::new(), String::new()],
                };
                text += &format!(" {time} | {share} |");
            }
            text.push('\n');
        }
        text += "\nBold: nothing measured takes less at no less PSNR. Of the combinations only those are listed; cost.csv has all.\n";
        let dropped = self.measured.iter().map(|m| m.splats_dropped).max().unwrap_or(0);
        if dropped > 0 {
            text += &format!(
                "\nThe plan had no place for some splats, in all views of a setting for at most {dropped}: no view that was measured when \
                 the bundle was written has so many.\n"
            );
        }
        text
    }
}
