//! Facts and tables of the page.

use std::path::Path;

use anyhow::Result;
use pocketsplat_codec::bundle::SizeReport;
use pocketsplat_core::{Budget, Bundle, Plan};
use pocketsplat_viewer::escaped;

use super::super::effects::PilotLine;
use super::super::fit::frame_budget;
use super::Run;
use super::amounts::size;
use crate::plot::thousands;

/// Parts of a file that get a line of their own; smaller ones are added up.
const LEAST_SHARE: f64 = 0.01;

/// A table; the first column names the row, the others are numbers. It scrolls on its own where it is too wide, by keys too.
///
/// * `name`: what it is of, for those who do not see the heading above.
pub(super) fn table(name: &str, header: &[&str], rows: impl IntoIterator<Item = Vec<String>>) -> String {
    let head: String = header.iter().map(|name| format!("<th scope=\"col\">{}</th>", escaped(name))).collect();
    let row = |cells: Vec<String>| {
        let cell = |(i, text): (usize, &String)| {
            let text = escaped(text);
            if i == 0 { format!("<th scope=\"row\">{text}</th>") } else { format!("<td>{text}</td>") }
        };
        format!("<tr>{}</tr>\n", cells.iter().enumerate().map(cell).collect::<String>())
    };
    let body: String = rows.into_iter().map(row).collect();
    format!(
        "<div class=\"scroll\" tabindex=\"0\" role=\"group\" aria-label=\"{name}\"><table>\n<thead><tr>{head}</tr></thead>\n<tbody>\n{body}</tbody></table></div>"
    )
}

/// The figures that people ask for first.
pub(super) fn facts(run: &Run<'_>, bundle: &Bundle<'_>) -> String {
    let [width_px, height_px] = bundle.header().training_px;
    let mut facts = Vec::new();
    if let Some(photographs) = &run.photographs {
        let evaluation = &photographs.evaluation;
        facts.push((format!("{:.2} dB", evaluation.psnr_db), format!("PSNR, {} held-out views", evaluation.n_views)));
        facts.push((format!("{:.4}", evaluation.ssim), "SSIM".to_owned()));
    }
    facts.push((size(run.file.bytes.len() as f64), "bundle".to_owned()));
    facts.push((thousands(bundle.n_anchors().into()), "anchors".to_owned()));
    let iterations = thousands(run.result.iterations.into());
    facts.push((format!("{width_px}×{height_px}"), format!("pixels, {iterations} iterations")));
    facts.push((
        format!("{:.1} min", run.result.train_s / 60.0),
        format!("training, {:.1} of one core", run.result.train_processor_s / 60.0),
    ));
    if let Some(bytes) = run.result.peak_memory_bytes {
        facts.push((size(bytes as f64), "memory of training".to_owned()));
    }
    facts
        .iter()
        .map(|(value, name)| format!("<div><b>{}</b><span>{}</span></div>\n", escaped(value), escaped(name)))
        .collect()
}

/// A bar and a table: where the bytes of the file are.
pub(super) fn bytes(bundle: &Bundle<'_>) -> Result<String> {
    let size = SizeReport::of(bundle)?;
    let total = size.total as f64;
    let mut parts: Vec<(String, f64)> = size
        .parts()
        .into_iter()
        .filter(|part| part.bytes > 0.0)
        .map(|part| (part.name.to_owned(), part.bytes))
        .collect();
    parts.sort_by(|a, b| b.1.total_cmp(&a.1));
    let n_large = parts.iter().take_while(|(_, bytes)| *bytes >= LEAST_SHARE * total).count();
    let rest: f64 = parts.drain(n_large..).map(|(_, bytes)| bytes).sum();
    if rest > 0.0 {
        parts.push(("everything else".to_owned(), rest));
    }
    let share = |bytes: f64| 100.0 * bytes / total;
    let bar: String = parts
        .iter()
        .map(|(name, bytes)| {
            let name = escaped(name);
            // A name that would not fit is in the table below, beside its colour.
            let text = if share(*bytes) >= 12.0 { &name } else { "" };
            format!("<span style=\"flex-grow:{:.3}\" title=\"{name}\">{text}</span>", share(*bytes))
        })
        .collect();
    let rows = parts.iter().map(|(name, bytes)| {
        let bits = 8.0 * bytes / size.n_anchors.max(1) as f64;
        vec![name.clone(), thousands(*bytes), format!("{:.1}", share(*bytes)), format!("{bits:.2}")]
    });
    Ok(format!(
        "<div class=\"bar\" aria-hidden=\"true\">{bar}</div>\n<div class=\"key\">{}</div>",
        table("Where the bytes are", &["part", "bytes", "%", "bits an anchor"], rows)
    ))
}

/// What smaller devices get.
pub(super) fn tiers(bundle: &Bundle<'_>) -> Result<String> {
    let frame = frame_budget(bundle, None)?;
    let chunks_start = bundle.sections().last().map_or(0, |section| section.offset);
    let mut rows = Vec::new();
    for number in 0..bundle.n_tiers() {
        let (Some(tier), Some(measures)) = (bundle.tier(number), bundle.measures(number)) else { continue };
        let budget = frame.with_tiers(number + 1);
        rows.push(vec![
            format!("{:.0} %", 100.0 * (1.0 - f64::from(tier.n_anchors) / f64::from(bundle.n_anchors().max(1)))),
            thousands(tier.n_anchors.into()),
            size(f64::from(chunks_start + tier.end)),
            measures.psnr_db.map_or_else(|| "–".to_owned(), |psnr_db| format!("{psnr_db:.2}")),
            size(least_bytes(bundle, &budget)? as f64),
            size(Plan::new(bundle, &budget)?.scratch_len() as f64),
        ]);
    }
    let header = ["pruned", "anchors", "file cut here", "PSNR, dB", "least RAM", "RAM for the fastest frame"];
    Ok(table("What smaller devices get", &header, rows))
}

/// Bytes with which the decoder draws all tiers of the budget, and with one fewer does not.
fn least_bytes(bundle: &Bundle<'_>, budget: &Budget) -> Result<usize> {
    let fits =
        |bytes: usize| Plan::new(bundle, &budget.in_bytes(bytes)).is_ok_and(|plan| plan.n_tiers() == budget.tiers);
    let (mut too_few, mut enough) = (0, Plan::new(bundle, budget)?.scratch_len());
    while enough - too_few > 1 {
        let middle = too_few + (enough - too_few) / 2;
        if fits(middle) { enough = middle } else { too_few = middle }
    }
    Ok(enough)
}

/// What each effect was worth, where it was measured.
pub(super) fn effects(folder: &Path) -> Result<String> {
    let Some(lines) = PilotLine::of_run(folder)? else {
        return Ok("<p>Not measured: the run kept the default effects, or its options named them.</p>".to_owned());
    };
    let rows = lines.iter().map(|line| {
        vec![
            format!("{}{}", if line.chosen { "★ " } else { "" }, line.effects),
            format!("{:.2}", line.psnr_db),
            format!("{:+.2}", line.gain_db),
            format!("{:.2}", line.price_db),
            format!("{:.1}", line.instructions as f64 / 1e6),
            thousands(line.bytes as f64),
        ]
    });
    Ok(table(
        "Effects",
        &["effects (★ kept)", "PSNR, dB", "gain, dB", "price, dB", "million instructions", "bytes"],
        rows,
    ))
}

/// Every held-out view.
pub(super) fn views(run: &Run<'_>) -> String {
    let Some(photographs) = &run.photographs else { return String::new() };
    let views = &photographs.evaluation.views;
    let [low, high] = views
        .iter()
        .fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], view| [low.min(view.psnr_db), high.max(view.psnr_db)]);
    let rows = views.iter().map(|view| {
        let cc = view.cc_psnr_db.map_or_else(String::new, |cc| format!("{cc:.2}"));
        vec![view.name.clone(), format!("{:.2}", view.psnr_db), cc, format!("{:.4}", view.ssim)]
    });
    format!(
        "<details><summary>{} views, {low:.2} to {high:.2} dB</summary>\n{}\n</details>",
        views.len(),
        table("View by view", &["view", "PSNR, dB", "colour-corrected", "SSIM"], rows)
    )
}

/// How the photographs were prepared, and everything that the run was asked for.
pub(super) fn protocol(run: &Run<'_>) -> Result<String> {
    let protocol = run.photographs.as_ref().and_then(|photographs| photographs.evaluation.protocol.as_ref());
    let said = protocol.map_or_else(String::new, |protocol| format!("<p>{}.</p>\n", escaped(&protocol.to_string())));
    Ok(format!(
        "{said}<details><summary>The whole configuration</summary>\n<pre tabindex=\"0\" role=\"group\" aria-label=\"configuration\">{}</pre>\n</details>",
        escaped(&run.config.to_toml()?)
    ))
}
