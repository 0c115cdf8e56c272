//! How many instructions a device takes for a frame: what the frame consists of, times what each part costs on a target.
//!
//! The costs are fitted to counts of emulated boards by `cargo run -p tools --bin fit_instructions`; they are instructions, not
//! cycles.

pub mod board;
mod context;
pub mod level;
mod processor;

use pocketsplat_core::{Bundle, FrameReport, Plan, Stage};

use context::ContextShape;
pub use processor::Processor;

use Stage::{Blend, Context, Decode, Heads, Output, Project, Sort};

/// A family of processors that run the same code.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum InstructionSet {
    /// Cortex-M4 and M7 with an FPU of single precision: `thumbv7em-none-eabihf`.
    CortexM,
    /// Cortex-M0+, drawing with `WithoutFpu`: `thumbv6m-none-eabi`.
    CortexM0Plus,
    /// RISC-V without an FPU, drawing with `WithoutFpu`: `riscv32imac-unknown-none-elf`.
    RiscV32,
    /// RISC-V with an FPU of single precision: `riscv32imafc-unknown-none-elf`.
    RiscV32Fpu,
}

impl InstructionSet {
    /// All, in the order of the columns of `costs.csv`.
    pub const ALL: [Self; 4] = [Self::CortexM, Self::CortexM0Plus, Self::RiscV32, Self::RiscV32Fpu];

    /// The column of `costs.csv`.
    pub fn name(self) -> &'static str {
        match self {
            Self::CortexM => "cortex-m",
            Self::CortexM0Plus => "cortex-m0plus",
            Self::RiscV32 => "riscv32",
            Self::RiscV32Fpu => "riscv32-fpu",
        }
    }

    /// The target of a board of `firmware-example`.
    pub fn of_board(board: &str) -> Option<Self> {
        match board {
            "mps2-an385" => Some(Self::CortexM0Plus),
            "mps2-an386" | "mps2-an500" => Some(Self::CortexM),
            "virt" => Some(Self::RiscV32),
            "virt-fpu" => Some(Self::RiscV32Fpu),
            _ => None,
        }
    }
}

/// Parts of a frame that have a cost, in the order of `costs.csv`.
pub const N_TERMS: usize = 20;

/// One part of a frame, and how much of it there is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Term {
    /// What is counted.
    pub name: &'static str,
    /// Where it is spent.
    pub stage: Stage,
    /// How much there is of it.
    pub count: f64,
}

/// What a frame consists of.
///
/// * `report`: of the frame, drawn by any machine by `plan`. * `size_px`: its width and height.
pub fn terms(bundle: &Bundle<'_>, plan: &Plan, report: &FrameReport, size_px: [u16; 2]) -> [Term; N_TERMS] {
    let header = bundle.header();
    let decoded = f64::from(report.anchors_decoded);
    let from_memory = f64::from(report.anchors_read - report.anchors_decoded);
    let (anchors, symbols) = (u64::from(report.anchors_decoded), report.symbols_decoded);
    let (table_symbols, [context_symbols, corners, units, macs]) = match ContextShape::of(bundle.coder()) {
        None => (symbols, [0; 4]),
        Some(context) => {
            let work = [anchors * context.corners, context.units(anchors, symbols), context.macs(anchors, symbols)];
            let [corners, units, macs] = work;
            (0, [symbols, corners, units, macs])
        }
    };
    let [context_symbols, corners, units, macs] = [context_symbols, corners, units, macs].map(|n| n as f64);
    let count = |n: u32| f64::from(n);
    let evaluated = if plan.is_baked() { 0.0 } else { count(report.gaussians) };
    let [width, height] = size_px.map(f64::from);
    // Strips that fit in memory together are drawn in one pass.
    let n_passes = report.slabs.clamp(1, plan.n_strips().max(1).into());
    let rows_of_pass = f64::from(u32::from(size_px[1].div_ceil(16)).div_ceil(n_passes));
    let term = |stage, name, count| Term { name, stage, count };
    [
        term(Decode, "anchor decoded", decoded),
        term(Decode, "symbol of a table", table_symbols as f64),
        term(Decode, "symbol of a context", context_symbols),
        term(Decode, "anchor from memory", from_memory),
        term(Decode, "channel from memory", from_memory * header.n_channels() as f64),
        term(Context, "corner of the grid", corners),
        term(Context, "unit of the context", units),
        term(Context, "multiply-add of the context", macs),
        term(Heads, "multiply-add of the heads", report.head_macs as f64),
        term(Heads, "Gaussian", evaluated),
        term(Project, "anchor", count(report.anchors_read)),
        term(Project, "Gaussian", evaluated),
        term(Project, "Gaussian from memory", count(report.gaussians) - evaluated),
        term(Sort, "splat and strip", count(report.strip_splats)),
        term(Sort, "splat and row of tiles", count(report.strip_splats) * rows_of_pass),
        // Each slab of a strip looks at the strip's pixels again.
        term(Blend, "pixel", width * height * count(report.slabs) / f64::from(n_passes)),
        term(Blend, "splat and tile", count(report.tile_splats)),
        term(Blend, "splat and row of pixels", count(report.row_splats)),
        term(Blend, "splat and pixel", count(report.pixel_splats)),
        term(Output, "pixel", width * height),
    ]
}

/// Instructions of each term on each target.
#[derive(Clone, Debug, PartialEq)]
pub struct Costs([[f64; N_TERMS]; InstructionSet::ALL.len()]);

impl Costs {
    /// Those that were measured.
    ///
    /// # Panics
    /// Never: a test reads the table.
    pub fn measured() -> Self {
        Self::parse(include_str!("costs.csv")).expect("the table in the source is sound")
    }

    /// All zero.
    pub fn none() -> Self {
        Self([[0.0; N_TERMS]; InstructionSet::ALL.len()])
    }

    /// Reads a table, whose rows are the terms in their order; `None` when it is another's.
    pub fn parse(csv: &str) -> Option<Self> {
        let mut costs = Self::none();
        let mut rows = csv.lines().skip(1);
        for term in 0..N_TERMS {
            let mut fields = rows.next()?.split(',').skip(2);
            for target in &mut costs.0 {
                target[term] = decimal(fields.next()?)?;
            }
        }
        rows.next().is_none().then_some(costs)
    }

    /// The table of `terms`.
    pub fn to_csv(&self, terms: &[Term; N_TERMS]) -> String {
        let mut csv = format!("stage,term,{}\n", InstructionSet::ALL.map(InstructionSet::name).join(","));
        for (i, term) in terms.iter().enumerate() {
            let costs = self.0.map(|of_set| format!("{:.2}", of_set[i]));
            csv += &format!("{},{},{}\n", term.stage.name(), term.name, costs.join(","));
        }
        csv
    }

    /// The costs on a target, in the order of the terms.
    pub fn of(&mut self, target: InstructionSet) -> &mut [f64; N_TERMS] {
        &mut self.0[target as usize]
    }

    /// Predicted instructions of each stage, as [`Stage::ALL`] orders them.
    pub fn predict(&self, target: InstructionSet, terms: &[Term; N_TERMS]) -> [f64; Stage::ALL.len()] {
        let mut stages = [0.0; Stage::ALL.len()];
        for (term, cost) in terms.iter().zip(&self.0[target as usize]) {
            stages[term.stage as usize] += term.count * cost;
        }
        stages
    }
}

/// Reads a number of two decimals, the nearest f64: both its hundredths and 100 are exact. The standard library's reader of floats
/// would be a tenth of the viewer's WebAssembly module.
fn decimal(text: &str) -> Option<f64> {
    let (whole, hundredths) = text.split_once('.').filter(|(_, hundredths)| hundredths.len() == 2)?;
    let [whole, hundredths] = [whole, hundredths].map(|digits| digits.parse::<u32>().ok().map(f64::from));
    Some((100.0 * whole? + hundredths?) / 100.0)
}

/// Predicted instructions of each stage of a frame, as [`Stage::ALL`] orders them; their sum is within 10 % of what the boards
/// of `firmware-example` took for the bundles that were measured.
///
/// * `report`: of the frame, drawn by any machine by `plan`. * `size_px`: its width and height.
pub fn predict(
    target: InstructionSet,
    bundle: &Bundle<'_>,
    plan: &Plan,
    report: &FrameReport,
    size_px: [u16; 2],
) -> [f64; Stage::ALL.len()] {
    Costs::measured().predict(target, &terms(bundle, plan, report, size_px))
}

#[cfg(test)]
mod tests {
    use super::{Costs, InstructionSet, decimal};

    #[test]
    fn decimals_are_those_of_the_standard_library() {
        for text in ["0.00", "0.27", "3.26", "2669.25", "22223.72", "4294967295.99"] {
            assert_eq!(decimal(text), text.parse().ok(), "{text}");
        }
        for text in ["", "1", "1.2", "1.234", ".25", "-1.00", "1e3.00"] {
            assert_eq!(decimal(text), None, "{text}");
        }
    }

    #[test]
    fn the_table_is_sound_and_comes_back() {
        let mut costs = Costs::measured();
        assert!(costs.of(InstructionSet::CortexM).iter().all(|cost| *cost >= 0.0), "no part saves instructions");
        // Projection of a Gaussian.
        let mut of_gaussian = |set| costs.of(set)[11];
        assert!(of_gaussian(InstructionSet::RiscV32) > 10.0 * of_gaussian(InstructionSet::CortexM), "without an FPU");
        assert!(of_gaussian(InstructionSet::RiscV32) > 10.0 * of_gaussian(InstructionSet::RiscV32Fpu), "with one");
        let table = include_str!("costs.csv");
        let names = InstructionSet::ALL.map(InstructionSet::name).join(",");
        assert!(table.starts_with(&format!("stage,term,{names}\n")), "columns in the order of the sets");
        let (head, _) = table.split_once('\n').unwrap();
        assert_eq!(Costs::parse(head), None, "rows are missing");
    }
}
