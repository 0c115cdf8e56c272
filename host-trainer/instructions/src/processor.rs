//! Kinds of processors: how long a frame may be, and what its instructions are worth in cycles.

use crate::InstructionSet;

/// A kind of processor, with the frame that it is meant for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "kebab-case"))]
pub enum Processor {
    /// A Cortex-M0+, drawing with `WithoutFpu`: frames of 250 million instructions.
    #[cfg_attr(feature = "serde", serde(rename = "cortex-m0plus"))]
    CortexM0Plus,
    /// A Cortex-M4 with FPU: frames of 80 million instructions.
    CortexM4,
    /// A Cortex-M7: frames of 250 million instructions.
    CortexM7,
    /// RISC-V without an FPU (RV32IMAC), drawing with `WithoutFpu`: frames of 250 million instructions.
    Riscv32imac,
    /// RISC-V with an FPU (RV32IMAFC): frames of 250 million instructions.
    Riscv32imafc,
}

impl Processor {
    /// All.
    pub const ALL: [Self; 5] =
        [Self::CortexM0Plus, Self::CortexM4, Self::CortexM7, Self::Riscv32imac, Self::Riscv32imafc];

    /// As options and configurations have it.
    pub fn name(self) -> &'static str {
        match self {
            Self::CortexM0Plus => "cortex-m0plus",
            Self::CortexM4 => "cortex-m4",
            Self::CortexM7 => "cortex-m7",
            Self::Riscv32imac => "riscv32imac",
            Self::Riscv32imafc => "riscv32imafc",
        }
    }

    /// What help says of it.
    pub fn description(self) -> &'static str {
        match self {
            Self::CortexM0Plus => "Cortex-M0+",
            Self::CortexM4 => "Cortex-M4 with FPU",
            Self::CortexM7 => "Cortex-M7 with FPU",
            Self::Riscv32imac => "RISC-V without FPU (RV32IMAC)",
            Self::Riscv32imafc => "RISC-V with FPU (RV32IMAFC)",
        }
    }

    /// The one of this name, if there is one.
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|processor| processor.name() == name)
    }

    /// Instructions of a frame at most.
    pub fn frame_instructions(self) -> u64 {
        match self {
            Self::CortexM4 => 80_000_000,
            Self::CortexM0Plus | Self::CortexM7 | Self::Riscv32imac | Self::Riscv32imafc => 250_000_000,
        }
    }

    /// Whether it computes with floats by itself; the others draw with `WithoutFpu`.
    pub fn has_fpu(self) -> bool {
        match self {
            Self::CortexM4 | Self::CortexM7 | Self::Riscv32imafc => true,
            Self::CortexM0Plus | Self::Riscv32imac => false,
        }
    }

    /// Instructions whose costs it has.
    pub fn instruction_set(self) -> InstructionSet {
        match self {
            Self::CortexM0Plus => InstructionSet::CortexM0Plus,
            Self::CortexM4 | Self::CortexM7 => InstructionSet::CortexM,
            Self::Riscv32imac => InstructionSet::RiscV32,
            Self::Riscv32imafc => InstructionSet::RiscV32Fpu,
        }
    }

    /// Cycles of an instruction, the mean over a frame.
    ///
    /// Of a Cortex-M4 by ARM's table with zero wait states: `cycles.csv` holds what `firmware-example/cycles.sh` counted. Of the others
    /// nothing was counted, so it is one.
    pub fn cycles_per_instruction(self) -> f64 {
        match self {
            Self::CortexM4 => 1.54,
            Self::CortexM0Plus | Self::CortexM7 | Self::Riscv32imac | Self::Riscv32imafc => 1.0,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::Processor;

    #[test]
    fn every_frame_that_was_counted_takes_its_cycles_within_5_percent() {
        let mut n_frames = 0;
        for row in include_str!("cycles.csv").lines().skip(1) {
            let counts: Vec<f64> = row.split(',').skip(2).filter_map(|count| count.parse().ok()).collect();
            let [instructions, cycles] = counts[..] else { panic!("{row}") };
            let error = instructions * Processor::CortexM4.cycles_per_instruction() / cycles - 1.0;
            assert!(error.abs() < 0.05, "{row}: {error}");
            n_frames += 1;
        }
        assert_eq!(n_frames, 28);
    }
}
