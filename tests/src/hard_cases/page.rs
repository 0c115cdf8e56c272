//! `docs/numerical-stability.md`: the catalogue as a page.

use std::fmt::Write as _;

use super::{Case, Family, Figures, Outcome, Probe};

const INTRODUCTION: &str = "\
# Numerical stability

## What to rely on

- A frame of the decoder is within 1.5 steps of 8 bits of the exact picture. Exceptions are stacks of hundreds of layers, where a rule
  of the format is a jump (up to 4 steps), and very long lenses (2 steps).
- The same holds for any memory, any number of strips, any machine.
- Training cannot produce a number that is not finite, and neither can a bundle contain one.
- If you change the arithmetic of the decoder or the trainer, run this catalogue: it holds what breaks splat renderers, case by case,
  with a bound that was written down before the error was measured.

Each section says first what you can rely on, then what was measured, then why the bound is what it is. The page is written by the
tests (`POCKETSPLAT_BLESS=1 cargo test -p conformance --test hard_cases`). They fail where the page does not say what they do, or where
an error exceeds its bound.

## How to read the tables

A picture goes through the whole product and is compared with the oracle: the rules of a frame in f64, without tiles, tables or
approximations (`host-trainer/codec/src/render/reference.rs`). Errors of pixels are in steps of 8 bits.

- *decoder, worst*: a channel of `decoder-core`'s frame against the oracle's, which is not rounded to 8 bits, so half a step is
  rounding. Of two bundles the larger figure: one has heads as halves, the other coded heads.
- *decoder, worst tile*: the mean over the 16 × 16 tile where it is largest. Rounding makes a quarter of a step on average and
  half a step at most; more in a whole tile would be seen as one.
- *trainer, worst*: a channel of the trainer's picture in f32 against the oracle's.
- *codec*: a value quantised, encoded and decoded against itself, in quantisation steps: half is rounding.
- *gradient, f32*: the gradient of a training step whose target image is noise: f32 against f64, for the worst parameter. The unit is
  the largest gradient of its kind (features, log-scales, offsets, weights), towards this noise or three others.
- *gradient, f64*: the derivative along a random direction of each kind against central differences, in units of the sum of its
  terms.

`0.52 ≤ 1.5` says that 0.52 was measured and 1.5 is allowed. The measured numbers are of the machine that wrote the page; others
differ in the last digit.
";

const FOUND: &str = "
## What the cases found

Errors before, and as the tables have them now:

- *passing needles*: the decoder kept a splat's shear as a half. Times a thousand rows that is more than a needle's width:
  7.2 steps, now 1. The trainer drew with the conic Σ'⁻¹ in f32: 4.1 steps, now 0.008.
- *needle 1e3*, *screen-long needle*, *passing needles*, *needle, compensated*: for the same reason gradients in f32 were 0.003, 8,
  20,000 and 0.05 times the largest of their kind away from those in f64, now 5·10⁻⁴ at most.
- *huge and far*: the decoder's inverse variances ended where halves end. A splat whose rim crosses the frame came out as another
  one, by 1.2 steps in a whole tile, now 0.26. A property test found it.
- *anchors like needles*: the trainer's prefilter took a determinant that rounding had made negative for a reason to drop an anchor.
- *on the near plane*: the oracle, and gradients in f64, compared with 0.2 where f32 compares with what is nearest to it.
- *beyond f32*: that such a Gaussian is not drawn was a property of the programs, and is a rule of the format now.
- *bits*: the gradient of a probability at its floor was 0·∞, 10³⁰ steps from the mean at a scale of 2⁻⁵⁰.
";

/// The page, with what was measured of each case in order; [`None`] leaves a measured number out.
pub fn render<'o>(families: &[Family], mut outcome: impl FnMut(&Case) -> Option<&'o Outcome>) -> String {
    let n_cases: usize = families.iter().map(|family| family.cases.len()).sum();
    let n_refused = families.iter().flat_map(|family| &family.cases).filter(|case| case.is_refusal()).count();
    let mut page = format!("{INTRODUCTION}\n{n_cases} cases, {n_refused} of them refusals.\n");
    for family in families {
        let _ = write!(page, "\n## {}\n\n{}\n", family.title, family.answer);
        let of_kind = |kind: fn(&Probe) -> bool| family.cases.iter().filter(move |case| kind(&case.probe));
        let pictures = of_kind(|probe| matches!(probe, Probe::Picture { .. }));
        table(
            &mut page,
            &[&["case", "what"], &Figures::COLUMNS[..]].concat(),
            pictures.map(|case| picture_row(case, outcome(case))),
        );
        let errors = of_kind(|probe| matches!(probe, Probe::Error { .. }));
        table(&mut page, &["case", "what", "error", "measured"], errors.map(|case| error_row(case, outcome(case))));
        let refusals = of_kind(|probe| matches!(probe, Probe::Refusal { .. }));
        table(&mut page, &["case", "what", "refused by", "message"], refusals.map(refusal_row));
        let _ = write!(page, "\n**Why these bounds.** {}\n", family.analysis);
    }
    page.push_str(FOUND);
    page
}

/// The page without its measured numbers: what every machine writes alike.
pub fn without_measures(page: &str) -> String {
    let bound_alone = |cell: &str| cell.split_once(" ≤ ").map_or(cell.to_owned(), |(_, bound)| format!(" ≤ {bound}"));
    let line = |line: &str| -> String {
        if line.starts_with('|') {
            line.split('|').map(bound_alone).collect::<Vec<_>>().join("|")
        } else {
            line.to_owned()
        }
    };
    page.lines().map(line).collect::<Vec<_>>().join("\n")
}

impl Case {
    /// Whether it has to be refused.
    pub fn is_refusal(&self) -> bool {
        matches!(self.probe, Probe::Refusal { .. })
    }
}

fn table(page: &mut String, head: &[&str], rows: impl Iterator<Item = Vec<String>>) {
    let mut rows = rows.peekable();
    if rows.peek().is_some() {
        let _ = write!(page, "\n| {} |\n|{}\n", head.join(" | "), " --- |".repeat(head.len()));
        rows.for_each(|row| {
            let _ = writeln!(page, "| {} |", row.join(" | "));
        });
    }
}

fn picture_row(case: &Case, outcome: Option<&Outcome>) -> Vec<String> {
    let Probe::Picture { bounds, .. } = case.probe else { return Vec::new() };
    let found = match outcome {
        Some(Outcome::Drawn(figures)) => figures.columns().map(Some),
        _ => [None; 6],
    };
    let cells = found.into_iter().zip(bounds.columns()).map(|(found, bound)| cell(found, bound));
    [case.name.to_owned(), case.what.to_owned()].into_iter().chain(cells).collect()
}

fn error_row(case: &Case, outcome: Option<&Outcome>) -> Vec<String> {
    let Probe::Error { of, bound, .. } = case.probe else { return Vec::new() };
    let found = if let Some(Outcome::Measured(error)) = outcome { Some(*error) } else { None };
    vec![case.name.to_owned(), case.what.to_owned(), of.to_owned(), cell(found, bound)]
}

fn refusal_row(case: &Case) -> Vec<String> {
    let Probe::Refusal { by, says, .. } = case.probe else { return Vec::new() };
    [case.name, case.what, by, &format!("“… {says} …”")].map(str::to_owned).to_vec()
}

fn cell(found: Option<f64>, bound: f64) -> String {
    // A bound of infinity: nothing to measure, but that it is finite, which the other columns say.
    if bound.is_infinite() {
        return "—".to_owned();
    }
    let bound = if bound >= 1e-3 || bound == 0.0 { bound.to_string() } else { format!("{bound:e}") };
    format!("{} ≤ {bound}", found.map_or("…".to_owned(), short))
}

/// Two digits.
fn short(x: f64) -> String {
    let rounded: f64 = format!("{x:.1e}").parse().unwrap_or(x);
    if rounded == 0.0 || (1e-3..1e4).contains(&rounded) { format!("{rounded}") } else { format!("{rounded:e}") }
}
