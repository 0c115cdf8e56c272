//! Machines whose time can be compared.

use std::fmt;

use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use pocketsplat_instructions::Processor;
use pocketsplat_trainer::cost::Measured;

use crate::config::target::{BoardOrCore, board_or_core_named, boards_and_cores};

/// As the option has it.
const HOST: &str = "host";

/// Where frames are drawn.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Machine {
    /// This machine, one thread.
    Host,
    /// A board or a kind of processor.
    Device(BoardOrCore),
}

/// Parses the name of a machine.
pub(crate) fn machine() -> impl TypedValueParser<Value = Machine> {
    let host = PossibleValue::new(HOST).help("This machine, one thread");
    PossibleValuesParser::new(std::iter::once(host).chain(boards_and_cores())).try_map(|name| match name.as_str() {
        HOST => Ok(Machine::Host),
        name => board_or_core_named(name).map(Machine::Device).ok_or("no such machine"),
    })
}

impl fmt::Display for Machine {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Host => HOST,
            Self::Device(BoardOrCore::Board(board)) => board.name,
            Self::Device(BoardOrCore::Core(processor)) => processor.name(),
        })
    }
}

impl Machine {
    /// The processor whose instructions count.
    pub(crate) fn device(self) -> Option<Processor> {
        match self {
            Self::Host => None,
            Self::Device(device) => Some(device.processor()),
        }
    }

    /// What the time of a frame is measured in.
    pub(crate) fn unit(self) -> &'static str {
        match self {
            Self::Host => "milliseconds of a frame, one thread",
            Self::Device(BoardOrCore::Board(_)) => "milliseconds of a frame, computed from instructions",
            Self::Device(BoardOrCore::Core(_)) => "instructions of a frame, millions",
        }
    }

    /// The time of a frame in that unit, if it is known; `column`: the place of this device's [`Measured::instructions`].
    pub(crate) fn time(self, measured: &Measured, column: usize) -> Option<f64> {
        let device = match self {
            Self::Host => return Some(1e3 * measured.host_s),
            Self::Device(device) => device,
        };
        let instructions = measured.instructions.get(column)?.as_ref()?.total();
        Some(device.board().map_or(instructions / 1e6, |board| 1e3 * board.seconds(instructions)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_machine_is_parsed_by_the_name_it_shows() {
        let parse = |name: &str| machine().parse_ref(&clap::Command::new("test"), None, name.as_ref());
        let names = std::iter::once(HOST.to_owned()).chain(boards_and_cores().map(|value| value.get_name().to_owned()));
        for name in names {
            assert_eq!(parse(&name).expect("a machine").to_string(), name);
        }
        assert!(parse("mps2-an386").is_err());
    }
}
