//! Where an anchor lies in the feature grid: fixed-point coordinates, corners and their weights.
//!
//! The grid has the shape of HAC's (Chen et al. 2024, section 4.1; levels as in Müller et al. 2022, Instant-NGP, section 3):
//! volumes and axis-aligned planes of several resolutions, dense while that fits, else hashed. The interpolation is a rule
//! of this crate, in integers: no border is special, and the weights of a level add up to 2²⁴ exactly.

/// Features of a row.
pub const FEATURES_PER_LEVEL: usize = 4;
/// A weight of one, and the sum of the weights of a level.
pub const WEIGHT_ONE: u32 = 1 << 24;

/// Multipliers of the spatial hash (Müller et al. 2022, eq. 4).
const HASH_PRIMES: [u32; 3] = [1, 2_654_435_761, 805_459_861];

/// Maps lattice coordinates to the unit cube of the grid, 16 bits an axis.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct GridFrame {
    /// Lattice coordinates of the cube's lowest corner.
    pub min: [i32; 3],
    /// 2⁻¹⁶ parts of a unit coordinate for each lattice cell.
    pub scale: [u32; 3],
}

impl GridFrame {
    /// The frame whose cube spans the cells from `min` to `max`.
    #[must_use]
    pub fn spanning(min: [i32; 3], max: [i32; 3]) -> Self {
        let [x, y, z] = min;
        let [max_x, max_y, max_z] = max;
        let scale = |low: i32, high: i32| (0xFFFF_u32 << 16).checked_div(high.abs_diff(low)).unwrap_or(0);
        Self { min, scale: [scale(x, max_x), scale(y, max_y), scale(z, max_z)] }
    }

    /// `min(65535, max(0, lattice − min)·scale / 2¹⁶)` on each axis: cells outside the cube count as on its border.
    #[inline]
    #[must_use]
    pub fn unit(&self, lattice: [i32; 3]) -> [u16; 3] {
        let [x, y, z] = lattice;
        let [min_x, min_y, min_z] = self.min;
        let [scale_x, scale_y, scale_z] = self.scale;
        let unit = |cell: i32, min: i32, scale: u32| {
            let above = if cell > min { cell.abs_diff(min) } else { 0 };
            // Below 2³² · 2³².
            let scaled = u64::from(above).wrapping_mul(u64::from(scale)) >> 16;
            u16::try_from(scaled).unwrap_or(u16::MAX)
        };
        [unit(x, min_x, scale_x), unit(y, min_y, scale_y), unit(z, min_z, scale_z)]
    }
}

/// What a level of the grid spans.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LevelKind {
    /// All three axes.
    Volume,
    /// The plane of x and y.
    Xy,
    /// The plane of x and z.
    Xz,
    /// The plane of y and z.
    Yz,
}

impl LevelKind {
    /// Its code in a bundle.
    #[must_use]
    pub const fn code(self) -> u8 {
        match self {
            Self::Volume => 0,
            Self::Xy => 1,
            Self::Xz => 2,
            Self::Yz => 3,
        }
    }

    /// The kind of a code.
    #[must_use]
    pub const fn from_code(code: u8) -> Option<Self> {
        match code {
            0 => Some(Self::Volume),
            1 => Some(Self::Xy),
            2 => Some(Self::Xz),
            3 => Some(Self::Yz),
            _ => None,
        }
    }

    const fn n_axes(self) -> u32 {
        match self {
            Self::Volume => 3,
            Self::Xy | Self::Xz | Self::Yz => 2,
        }
    }
}

/// One resolution of the grid.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct GridLevel {
    /// Its axes.
    pub kind: LevelKind,
    /// Nodes R along each axis, at least 2.
    pub resolution: u16,
    /// Rows of its table: R^d, or a power of two, and then nodes are hashed.
    pub n_rows: u32,
}

/// The nodes around a point and their shares of it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Corners {
    rows: [u32; 8],
    weights: [u32; 8],
    n: usize,
}

impl Corners {
    /// (row of the level's table, weight) of each node; weights add up to [`WEIGHT_ONE`].
    #[inline]
    pub fn iter(&self) -> impl Iterator<Item = (u32, u32)> + '_ {
        self.rows.iter().copied().zip(self.weights.iter().copied()).take(self.n)
    }
}

impl GridLevel {
    /// Nodes of the whole level, R^d; `None` beyond 2³².
    #[must_use]
    pub fn n_nodes(&self) -> Option<u32> {
        u32::from(self.resolution).checked_pow(self.kind.n_axes())
    }

    /// Whether every node has a row of its own.
    #[must_use]
    pub fn is_dense(&self) -> bool {
        let r = u64::from(self.resolution);
        let in_plane = r.wrapping_mul(r);
        // Below 2⁴⁸.
        let n_nodes = if self.kind == LevelKind::Volume { in_plane.wrapping_mul(r) } else { in_plane };
        n_nodes == self.n_rows.into()
    }

    /// The nodes around a point: along each axis `u·(R − 1)` in 16.16 fixed point gives the lower node and, from its upper
    /// eight fraction bits f, the weights 256 − f and f; a node's weight is the product over the axes, scaled to
    /// [`WEIGHT_ONE`]. Its row is `x + R·(y + R·z)` where the level is dense, else
    /// `(x ⊕ y·2654435761 ⊕ z·805459861) mod n_rows`, over the level's axes in the order x, y, z.
    ///
    /// # Budget
    /// Two multiplications an axis, one a corner.
    #[inline]
    #[must_use]
    pub fn corners(&self, [x, y, z]: [u16; 3]) -> Corners {
        // A plane has one more axis, on which every point lies at node 0.
        let (axes, n) = match self.kind {
            LevelKind::Volume => ([x, y, z], 8),
            LevelKind::Xy => ([x, y, 0], 4),
            LevelKind::Xz => ([x, z, 0], 4),
            LevelKind::Yz => ([y, z, 0], 4),
        };
        let r = u32::from(self.resolution);
        let dense = self.is_dense();
        let [first, second, third] = if dense { [1, r, r.wrapping_mul(r)] } else { HASH_PRIMES };
        let [a, b, c] = axes;
        let [a, b, c] = [self.along(a, first), self.along(b, second), self.along(c, third)];
        let mut corners = Corners { n, ..Corners::default() };
        let slots = corners.rows.iter_mut().zip(&mut corners.weights);
        for (bits, (row, weight)) in (0_u32..).zip(slots) {
            let [(part_a, weight_a), (part_b, weight_b), (part_c, weight_c)] =
                [end(a, bits & 1), end(b, bits >> 1 & 1), end(c, bits >> 2)];
            *row = if dense {
                part_a.wrapping_add(part_b).wrapping_add(part_c)
            } else {
                (part_a ^ part_b ^ part_c) & self.n_rows.wrapping_sub(1)
            };
            *weight = weight_a.wrapping_mul(weight_b).wrapping_mul(weight_c);
        }
        corners
    }

    /// Of the lower node of an axis and of the upper one: its number times `multiplier`, and its weight in 256ths.
    #[inline]
    fn along(&self, unit: u16, multiplier: u32) -> [(u32, u32); 2] {
        // Below 2¹⁶ · 2¹⁶. A unit coordinate stays below 1, so the upper node exists.
        let position = u32::from(unit).wrapping_mul(u32::from(self.resolution).wrapping_sub(1));
        let (part, upper) = ((position >> 16).wrapping_mul(multiplier), (position >> 8) & 0xFF);
        [(part, 256_u32.wrapping_sub(upper)), (part.wrapping_add(multiplier), upper)]
    }
}

/// The lower or the upper node of an axis.
#[inline]
fn end([lower, upper]: [(u32, u32); 2], bit: u32) -> (u32, u32) {
    if bit == 0 { lower } else { upper }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::vec::Vec;

    fn levels() -> [GridLevel; 4] {
        [
            GridLevel { kind: LevelKind::Volume, resolution: 8, n_rows: 512 },
            GridLevel { kind: LevelKind::Volume, resolution: 200, n_rows: 1024 },
            GridLevel { kind: LevelKind::Xz, resolution: 33, n_rows: 33 * 33 },
            GridLevel { kind: LevelKind::Yz, resolution: 32768, n_rows: 64 },
        ]
    }

    #[test]
    fn weights_add_up_and_rows_exist() {
        for level in levels() {
            for unit in [[0, 0, 0], [65535, 65535, 65535], [1, 40000, 65534], [12345, 23456, 34567]] {
                let corners = level.corners(unit);
                assert_eq!(corners.iter().map(|(_, weight)| weight).sum::<u32>(), WEIGHT_ONE, "{level:?} at {unit:?}");
                assert!(corners.iter().all(|(row, _)| row < level.n_rows), "{level:?} at {unit:?}");
            }
        }
    }

    #[test]
    fn a_dense_level_interpolates_linearly() {
        let level = GridLevel { kind: LevelKind::Volume, resolution: 8, n_rows: 512 };
        // Rows hold their node's x + 10·y + 100·z, which trilinear interpolation reproduces.
        let value = |row: u32| f64::from(row % 8) + 10.0 * f64::from(row / 8 % 8) + 100.0 * f64::from(row / 64);
        for unit in [[0, 0, 0], [30000, 65535, 123], [54321, 12345, 33333]] {
            let found: f64 =
                level.corners(unit).iter().map(|(row, w)| value(row) * f64::from(w) / f64::from(WEIGHT_ONE)).sum();
            let [x, y, z] = unit.map(|u| f64::from(u) / 65536.0 * 7.0);
            let expected = x + 10.0 * y + 100.0 * z;
            assert!((found - expected).abs() < 111.0 / 256.0, "{found} against {expected}");
        }
    }

    #[test]
    fn the_frame_reaches_from_corner_to_corner() {
        let frame = GridFrame::spanning([-1000, 5, 7], [1329, 5, 9]);
        assert_eq!(frame.unit([-1000, 5, 7]), [0, 0, 0]);
        assert_eq!(frame.unit([1329, 5, 9])[0] >> 4, 65535 >> 4, "the last cell is at the far border");
        assert_eq!(frame.unit([i32::MIN, i32::MIN, i32::MIN]), [0, 0, 0], "outside counts as on the border");
        assert_eq!(frame.unit([i32::MAX, i32::MAX, i32::MAX]), [65535, 0, 65535]);
        let along: Vec<u16> = (-1000..1330).map(|x| frame.unit([x, 5, 7])[0]).collect();
        assert!(along.is_sorted());
    }
}
