//! The order of anchors in a bundle: along the Morton curve, so that neighbours in the file are neighbours in space.

use super::quantise::Rows;

/// Sorts anchors by the interleaved bits of their lattice coordinates; anchors of one cell keep their order.
pub(super) fn in_morton_order(rows: Rows) -> Rows {
    let lowest: [i32; 3] =
        core::array::from_fn(|axis| rows.lattice.iter().map(|cell| cell[axis]).min().unwrap_or_default());
    let mut order: Vec<usize> = (0..rows.lattice.len()).collect();
    order.sort_by_cached_key(|&anchor| {
        morton(core::array::from_fn(|axis| rows.lattice[anchor][axis].abs_diff(lowest[axis])))
    });
    let n_channels = rows.n_channels;
    Rows {
        lattice: order.iter().map(|&anchor| rows.lattice[anchor]).collect(),
        symbols: order
            .iter()
            .flat_map(|&anchor| &rows.symbols[anchor * n_channels..(anchor + 1) * n_channels])
            .copied()
            .collect(),
        ..rows
    }
}

/// Bits of x, y and z in turn, x lowest.
fn morton(cell: [u32; 3]) -> u128 {
    (0..32).fold(0, |code, bit| {
        (0..3).fold(code, |code, axis| code | (u128::from((cell[axis] >> bit) & 1) << (3 * bit + axis)))
    })
}

#[cfg(test)]
mod tests {
    use super::morton;

    #[test]
    fn morton_interleaves_x_lowest() {
        assert_eq!(morton([1, 0, 0]), 0b001, "x");
        assert_eq!(morton([0, 1, 0]), 0b010, "y");
        assert_eq!(morton([0, 0, 1]), 0b100, "z");
        assert_eq!(morton([3, 0, 2]), 0b101_001, "two bits an axis");
    }
}
