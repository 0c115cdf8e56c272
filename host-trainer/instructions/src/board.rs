//! Boards and chips that people buy: what each has for a scene.
//!
//! Memory, clock and display follow from data sheets. `docs/firmware.md` shows the table.

use Processor::{CortexM0Plus, CortexM4, CortexM7, Riscv32imac, Riscv32imafc};

use crate::Processor;

/// A board or chip, as a target of training.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Board {
    /// As options have it.
    pub name: &'static str,
    /// The chips, their core and what the table should say of them.
    pub chip: &'static str,
    /// Clock of one core, MHz.
    pub clock_mhz: u32,
    /// Scratch memory to give, bytes: less than the chip has in one piece, for stack and statics.
    pub ram_bytes: u64,
    /// Flash for the bundle, bytes.
    pub flash_bytes: u64,
    /// Width and height of a frame, pixels.
    pub frame_px: [u16; 2],
    /// The processor whose limit its frames keep: its own, or the one that is nearest.
    pub processor: Processor,
}

const KIB: u64 = 1024;
const MIB: u64 = 1024 * KIB;

/// The boards there are, by core and memory.
pub const BOARDS: [Board; 11] = [
    board("rp2350", "Pico 2 (RP2350, M33)", 150, [494 * KIB, MIB], [240, 240], CortexM4),
    board("stm32f411", "STM32F411 (M4)", 100, [117 * KIB, 64 * KIB], [128, 128], CortexM4),
    board(
        "stm32f429",
        "STM32F429 (M4), stack in core-coupled memory",
        180,
        [190 * KIB, 96 * KIB],
        [160, 120],
        CortexM4,
    ),
    board("stm32f767", "STM32F767 (M7)", 216, [490 * KIB, 512 * KIB], [320, 240], CortexM7),
    board("stm32h743", "STM32H743 (M7), stack in DTCM", 480, [510 * KIB, MIB], [320, 240], CortexM7),
    board("stm32h7a3", "STM32H7A3 (M7)", 280, [1013 * KIB, MIB], [320, 240], CortexM7),
    board("stm32n657", "STM32N657 (M55), bundle in external flash", 800, [2 * MIB, 2 * MIB], [480, 320], CortexM7),
    board("esp32-p4", "ESP32-P4 (RISC-V with FPU), scratch in PSRAM", 400, [4 * MIB, MIB], [320, 240], Riscv32imafc),
    board("esp32-s3", "ESP32-S3 (Xtensa), scratch in PSRAM", 240, [2 * MIB, 512 * KIB], [240, 240], CortexM4),
    board("esp32-c6", "ESP32-C6 (RISC-V, no FPU)", 160, [380 * KIB, 256 * KIB], [160, 120], Riscv32imac),
    board("rp2040", "RP2040 (M0+, no FPU)", 133, [245 * KIB, 96 * KIB], [128, 128], CortexM0Plus),
];

const fn board(
    name: &'static str,
    chip: &'static str,
    clock_mhz: u32,
    [ram_bytes, flash_bytes]: [u64; 2],
    frame_px: [u16; 2],
    processor: Processor,
) -> Board {
    Board { name, chip, clock_mhz, ram_bytes, flash_bytes, frame_px, processor }
}

impl Board {
    /// The board of this name, if there is one.
    pub fn named(name: &str) -> Option<&'static Self> {
        BOARDS.iter().find(|board| board.name == name)
    }

    /// Seconds of a frame: instructions × [cycles of one](Processor::cycles_per_instruction) ÷ clock. Nothing was timed on a board.
    pub fn seconds(&self, instructions: f64) -> f64 {
        instructions * self.processor.cycles_per_instruction() / (1e6 * f64::from(self.clock_mhz))
    }
}

#[cfg(test)]
mod tests {
    use super::{BOARDS, Board};

    #[test]
    fn names_are_of_one_board_each_and_frames_take_seconds() {
        for (number, board) in BOARDS.iter().enumerate() {
            assert_eq!(BOARDS.iter().position(|other| other.name == board.name), Some(number));
            assert_eq!(Board::named(board.name), Some(board));
            let most = board.seconds(board.processor.frame_instructions() as f64);
            assert!((0.1..10.0).contains(&most), "{}: {most} s", board.name);
        }
        assert_eq!(Board::named("cortex-m4"), None);
        let pico = Board { clock_mhz: 154, ..BOARDS[0] };
        assert!((pico.seconds(100e6) - 1.0).abs() < 1e-9, "154 million cycles at 154 MHz");
    }
}
