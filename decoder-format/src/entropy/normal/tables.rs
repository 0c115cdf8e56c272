//! The tables, made of `normal_tables.bin` when this is compiled.
#![expect(clippy::indexing_slicing, reason = "a wrong index is an error of compilation")]

use super::super::FREQUENCY_TOTAL;
use super::{EIGHTHS, N_NORMAL_SHORT_CUTS, N_PHASES, N_SCALES, NORMAL_WINDOW, Scale};

/// The bounds as FORMAT.md lists them, two bytes each.
const FILE: &[u8; 19_160] = include_bytes!("../../bundle/normal_tables.bin");

/// Per scale and phase `[2D + 3]` where each entry begins, where the escape begins, and where it ends; padding at the end, since a
/// decoder looks at as many from the start of any table.
pub(super) static BOUNDS: [u16; FILE.len() / 2 + NORMAL_WINDOW] = {
    let mut bounds = [FREQUENCY_TOTAL; FILE.len() / 2 + NORMAL_WINDOW];
    let mut i = 0;
    while i < FILE.len() / 2 {
        bounds[i] = u16::from_le_bytes([FILE[2 * i], FILE[2 * i + 1]]);
        i += 1;
    }
    bounds
};

/// Of each scale where its tables begin in [`BOUNDS`], how far they reach, and short cuts into them.
pub(super) static SCALES: [Scale; N_SCALES] = {
    const NONE: Scale = Scale { first: [0; EIGHTHS as usize], reach: 0, short_cuts: [0; N_NORMAL_SHORT_CUTS] };
    let mut scales = [NONE; N_SCALES];
    let (mut scale, mut at) = (0, 0);
    while scale < N_SCALES {
        // A table ends where the range does.
        let mut len = 1;
        while BOUNDS[at + len - 1] != FREQUENCY_TOTAL {
            len += 1;
        }
        let Scale { first, reach, short_cuts } = &mut scales[scale];
        *reach = (len as u16 - 3) / 2;
        let mut part = 0;
        while part < EIGHTHS as usize {
            first[part] = (at + part.abs_diff(EIGHTHS as usize / 2) * len) as u16;
            part += 1;
        }
        let mut piece = 1;
        while piece < N_NORMAL_SHORT_CUTS {
            let start = piece * FREQUENCY_TOTAL as usize / N_NORMAL_SHORT_CUTS;
            let (mut least, mut phase) = (len, 0);
            while phase < N_PHASES {
                let mut entry = short_cuts[piece - 1] as usize;
                while BOUNDS[at + phase * len + entry + 1] as usize <= start {
                    entry += 1;
                }
                if entry < least {
                    least = entry;
                }
                phase += 1;
            }
            short_cuts[piece] = least as u8;
            piece += 1;
        }
        at += N_PHASES * len;
        scale += 1;
    }
    scales
};
