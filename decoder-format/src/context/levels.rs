//! Levels inside a chunk: what an anchor coded before says about the anchors around it (Wang et al. 2024, ContextGS, section 4;
//! there over the whole scene, and with a hyper-latent an anchor).

use super::grid::GridFrame;

/// Levels of anchors: 2 is the coarsest.
pub const N_LEVELS: usize = 3;
/// Largest edge of a level's cells, as a power of two of the lattice's.
pub const MAX_LEVEL_SHIFT: u8 = 15;
/// Largest edge of what level 2 lies in.
pub const MAX_SPAN_SHIFT: u8 = 25;
/// Inputs that say where an anchor stands.
pub const N_POSITION_INPUTS: usize = 3;

/// Bits of the fraction of a place: [`FEATURE_ONE`](super::FEATURE_ONE).
const PLACE_BITS: u8 = 14;

/// The level of an anchor, and where it stands.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Place {
    /// 2 for the first anchor of its cell of level 2, 1 for the first of its cell of level 1, else 0.
    pub level: usize,
    /// In 2⁻¹⁴: from its parent, the anchor that began its cell of the next level, in edges of that cell; at level 2 from the
    /// frame's lowest corner in edges of 2^shift.
    pub position: [i16; N_POSITION_INPUTS],
}

/// The anchors of a chunk that the next one may follow.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Trail {
    /// The anchors that began the current cells of levels 1 and 2.
    cells: [[i32; 3]; 2],
    /// A chunk begins with an anchor of level 2.
    begun: bool,
}

impl Trail {
    /// The next anchor begins a chunk.
    pub(crate) fn restart(&mut self) {
        self.begun = false;
    }

    /// Goes on to the next anchor of a chunk.
    ///
    /// The cells of a level are cubes of 2^shift lattice cells, aligned to multiples of that.
    pub fn next(&mut self, shifts: [u8; N_LEVELS], frame: &GridFrame, cell: [i32; 3]) -> Place {
        let [in_1, in_2] = &self.cells;
        let [shift_1, shift_2, shift_3] = shifts;
        let (level, from, shift) = if !(self.begun && shares(shift_2, in_2, &cell)) {
            (2, &frame.min, shift_3)
        } else if !shares(shift_1, in_1, &cell) {
            (1, in_2, shift_2)
        } else {
            (0, in_1, shift_1)
        };
        let [down, up] = [shift.saturating_sub(PLACE_BITS), PLACE_BITS.saturating_sub(shift)].map(u32::from);
        let mut position = [0; N_POSITION_INPUTS];
        for ((out, own), from) in position.iter_mut().zip(&cell).zip(from) {
            // What lies beyond the cell, as no writer has it, is cut to 16 bits.
            *out = own.wrapping_sub(*from).wrapping_shr(down).wrapping_shl(up) as i16;
        }
        for begun in self.cells.iter_mut().take(level) {
            *begun = cell;
        }
        self.begun = true;
        Place { level, position }
    }
}

/// Whether two lattice cells lie in the same cell of edge 2^shift.
fn shares(shift: u8, a: &[i32; 3], b: &[i32; 3]) -> bool {
    // Numbers that agree from bit `shift` on differ below it alone.
    a.iter().zip(b).fold(0, |differs, (a, b)| differs | (a ^ b)).cast_unsigned().wrapping_shr(shift.into()) == 0
}

#[cfg(test)]
mod tests {
    use super::*;

    const FRAME: GridFrame = GridFrame { min: [-5; 3], scale: [0; 3] };

    #[test]
    fn anchors_follow_the_first_of_their_cells() {
        let mut trail = Trail::default();
        let mut next = |cell| {
            let Place { level, position } = trail.next([1, 3, 5], &FRAME, cell);
            (level, position)
        };
        assert_eq!(next([1, 1, 1]), (2, [6 << 9; 3]), "the first of a chunk");
        assert_eq!(next([0, 1, 0]), (0, [-1 << 13, 0, -1 << 13]));
        assert_eq!(next([2, 0, 0]), (1, [1 << 11, -1 << 11, -1 << 11]));
        assert_eq!(next([3, 1, 1]), (0, [1 << 13; 3]));
        assert_eq!(next([7, 7, 7]), (1, [6 << 11; 3]), "from the anchor of level 2");
        assert_eq!(next([8, 0, 0]).0, 2);
        assert_eq!(next([-1, 0, 0]).0, 2);
        assert_eq!(next([-2, 0, 0]), (0, [-1 << 13, 0, 0]));
        assert_eq!(next([-8, 0, 0]), (1, [-7 << 11, 0, 0]));
    }

    #[test]
    fn places_are_shares_of_the_cell_however_large() {
        let mut trail = Trail::default();
        let mut next = |cell| trail.next([14, 15, 20], &FRAME, cell).position;
        assert_eq!(next([-5, (1 << 20) - 6, 59]), [0, 16383, 1]);
        assert_eq!(next([0; 3]), [0; 3]);
        assert_eq!(next([16384, 1, 2]), [8192, 0, 1]);
        assert_eq!(next([16385, 0, 2]), [1, -1, 0]);
    }
}
