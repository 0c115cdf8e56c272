//! What `--target` names: a board, or a kind of processor.

use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use pocketsplat_instructions::Processor;
use pocketsplat_instructions::board::{BOARDS, Board};

/// What a frame is drawn on.
#[derive(Clone, Copy, Debug)]
pub(crate) enum BoardOrCore {
    Board(&'static Board),
    Core(Processor),
}

impl BoardOrCore {
    pub(crate) fn board(self) -> Option<&'static Board> {
        match self {
            Self::Board(board) => Some(board),
            Self::Core(_) => None,
        }
    }

    /// The one whose instructions count.
    pub(crate) fn processor(self) -> Processor {
        match self {
            Self::Board(board) => board.processor,
            Self::Core(processor) => processor,
        }
    }
}

/// Parses the name of a board or of a kind of processor.
pub(crate) fn board_or_core() -> impl TypedValueParser<Value = BoardOrCore> {
    PossibleValuesParser::new(boards_and_cores()).try_map(|name| board_or_core_named(&name).ok_or("no such board"))
}

/// The names of all, with help.
pub(crate) fn boards_and_cores() -> impl Iterator<Item = PossibleValue> {
    let boards = BOARDS.iter().map(|board| PossibleValue::new(board.name).help(board.chip));
    boards.chain(Processor::ALL.map(|core| PossibleValue::new(core.name()).help(core.description())))
}

/// The board, or else the kind of processor, of this name.
pub(crate) fn board_or_core_named(name: &str) -> Option<BoardOrCore> {
    let board = Board::named(name).map(BoardOrCore::Board);
    board.or_else(|| Processor::named(name).map(BoardOrCore::Core))
}

#[cfg(test)]
mod tests {
    use std::fmt::Write as _;

    use bytesize::ByteSize;

    use super::*;

    const PAGE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/firmware.md");
    const MARK: &str = "<!-- boards, written by the test `the_table_of_boards_is_that_of_the_program` -->\n";
    const END: &str = "<!-- end of boards -->";

    /// As docs/firmware.md has it; `POCKETSPLAT_BLESS=1` writes it.
    #[test]
    fn the_table_of_boards_is_that_of_the_program() {
        let mut table = String::from(
            "\n| `--target` | board or chip | MHz | `--ram` | `--flash` | `--resolution` | million instructions a frame, aimed at | seconds of these |\n|---|---|---|---|---|---|---|---|\n",
        );
        for board in &BOARDS {
            let Board { name, chip, clock_mhz, ram_bytes, flash_bytes, frame_px: [width, height], processor } = board;
            let [ram, flash] = [ram_bytes, flash_bytes].map(|bytes| ByteSize(*bytes).to_string().replace(".0", ""));
            let instructions = processor.frame_instructions() as f64;
            let (millions, seconds) = (instructions / 1e6, board.seconds(instructions));
            let _ = writeln!(
                table,
                "| `{name}` | {chip} | {clock_mhz} | {ram} | {flash} | {width}x{height} | {millions} | {seconds:.1} |"
            );
        }
        let _ = writeln!(
            table,
            "\nCycles of an instruction: {} on a Cortex-M4, by ARM's table and the count of an emulated one. For the RP2350 and the ESP32-S3 the \
             same is assumed; for all others one, since none are counted.\n",
            Processor::CortexM4.cycles_per_instruction()
        );
        let page = std::fs::read_to_string(PAGE).expect("the page");
        let (before, rest) = page.split_once(MARK).expect("the mark");
        let (found, after) = rest.split_once(END).expect("the end");
        if std::env::var_os("POCKETSPLAT_BLESS").is_some() {
            std::fs::write(PAGE, format!("{before}{MARK}{table}{END}{after}")).expect("written");
        } else {
            assert!(
                found == table,
                "docs/firmware.md lacks {table}; write it: POCKETSPLAT_BLESS=1 cargo test -p pocketsplat table_of_boards"
            );
        }
    }

    #[test]
    fn boards_and_processors_are_parsed_and_others_are_not() {
        let parse = |name: &str| board_or_core().parse_ref(&clap::Command::new("test"), None, name.as_ref());
        let pico = parse("rp2350").expect("a board");
        assert_eq!((pico.board().map(|board| board.clock_mhz), pico.processor()), (Some(150), Processor::CortexM4));
        let core = parse("cortex-m7").expect("a processor");
        assert!(core.board().is_none() && core.processor() == Processor::CortexM7);
        assert!(parse("mps2-an386").is_err());
    }
}
