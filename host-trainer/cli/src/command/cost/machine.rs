//! Machines whose time can be compared.

use std::fmt;

use clap::ValueEnum;
use pocketsplat_instructions::Processor;
use pocketsplat_trainer::cost::Measured;

/// Where frames are drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Machine {
    /// This machine, one thread: milliseconds.
    Host,
    /// A Cortex-M4 with FPU: instructions.
    CortexM4,
    /// A Cortex-M7 with FPU: instructions.
    CortexM7,
    /// RISC-V without an FPU (RV32IMAC): instructions.
    Riscv32imac,
}

impl fmt::Display for Machine {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.to_possible_value().as_ref().map_or("", |value| value.get_name()))
    }
}

impl Machine {
    /// The device that it is.
    pub(crate) fn device(self) -> Option<Processor> {
        match self {
            Self::Host => None,
            Self::CortexM4 => Some(Processor::CortexM4),
            Self::CortexM7 => Some(Processor::CortexM7),
            Self::Riscv32imac => Some(Processor::Riscv32imac),
        }
    }

    /// What the time of a frame is measured in.
    pub(crate) fn unit(self) -> &'static str {
        match self {
            Self::Host => "milliseconds of a frame, one thread",
            _ => "instructions of a frame, millions",
        }
    }

    /// The time of a frame in that unit, if it is known; `column`: the place of this device's [`Measured::instructions`].
    pub(crate) fn time(self, measured: &Measured, column: usize) -> Option<f64> {
        match self {
            Self::Host => Some(1e3 * measured.host_s),
            _ => measured.instructions.get(column)?.as_ref().map(|instructions| instructions.total() / 1e6),
        }
    }
}
