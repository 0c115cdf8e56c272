//! [`pocketsplat_kernels::ops::rate::hash_grid`] over the anchors of a view.

use bytemuck::{Pod, Zeroable};
use pocketsplat_format::context::{FEATURES_PER_LEVEL, GridLevel};

use crate::{Buffer, Commands, GROUP_THREADS, GROUPS, Gpu, GpuError, Kernel};

/// Rows of the grid that a workgroup of the way back has, as `hash_grid/backward.wgsl` says.
const ROWS_PER_GROUP: usize = GROUP_THREADS / 32;

/// Its kernels.
#[derive(Clone, Debug)]
pub struct HashGrid {
    forward: Kernel,
    backward: Kernel,
}

/// Which places of a scene touch which rows of a grid: until anchors are added or dropped.
#[derive(Debug)]
pub struct GridPlaces {
    n_levels: usize,
    n_rows: usize,
    /// `[levels, 5]`: kind, nodes along an axis, rows, rows before, whether every node has a row of its own.
    levels: Buffer<u32>,
    /// `[n_anchors, 2]`: x and y, 16 bits each, and z.
    units: Buffer<u32>,
    /// `[n_rows + 1]`: the entries of row r are `starts[r]..starts[r + 1]`.
    starts: Buffer<u32>,
    /// Anchor × 8 + corner, ascending in each row; those of weight 0 are left out.
    entries: Buffer<u32>,
}

#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Parameters {
    n_items: u32,
    n_levels: u32,
}

impl GridPlaces {
    /// Sorts the corners around all anchors by their rows.
    ///
    /// * `units`: `[n_anchors]` places in the unit cube, fewer than 2²⁹. Cost: the corners of each anchor, twice.
    ///
    /// # Errors
    /// As [`Buffer::zeros`].
    pub fn new(gpu: &Gpu, levels: &[GridLevel], units: &[[u16; 3]]) -> Result<Self, GpuError> {
        let mut table = Vec::with_capacity(5 * levels.len());
        let mut n_rows = 0;
        for level in levels {
            let kind = u32::from(level.kind.code());
            table.extend([kind, level.resolution.into(), level.n_rows, n_rows, level.is_dense().into()]);
            n_rows += level.n_rows;
        }
        // (row of all levels, anchor × 8 + corner) in the order in which the CPU comes to them.
        let each = |f: &mut dyn FnMut(usize, u32)| {
            for (level, of_level) in levels.iter().zip(table.chunks_exact(5)) {
                for (anchor, unit) in (0u32..).zip(units) {
                    for (corner, (row, weight)) in (0u32..).zip(level.corners(*unit).iter()) {
                        if weight > 0 {
                            f((of_level[3] + row) as usize, 8 * anchor + corner);
                        }
                    }
                }
            }
        };
        let mut starts = vec![0u32; n_rows as usize + 1];
        each(&mut |row, _| starts[row + 1] += 1);
        for row in 0..n_rows as usize {
            starts[row + 1] += starts[row];
        }
        let mut next = starts.clone();
        let mut entries = vec![0u32; starts[n_rows as usize] as usize];
        each(&mut |row, entry| {
            entries[next[row] as usize] = entry;
            next[row] += 1;
        });
        let packed: Vec<u32> =
            units.iter().flat_map(|[x, y, z]| [u32::from(*x) | u32::from(*y) << 16, u32::from(*z)]).collect();
        Ok(Self {
            n_levels: levels.len(),
            n_rows: n_rows as usize,
            levels: Buffer::upload(gpu, "levels of the grid", &table)?,
            units: Buffer::upload(gpu, "places in the grid", &packed)?,
            starts: Buffer::upload(gpu, "first places of the grid's rows", &starts)?,
            entries: Buffer::upload(gpu, "places of the grid's rows", &entries)?,
        })
    }

    /// Inputs that the grid gives an anchor.
    pub fn n_features(&self) -> usize {
        FEATURES_PER_LEVEL * self.n_levels
    }
}

impl HashGrid {
    /// Compiles the kernels.
    pub fn new(gpu: &Gpu) -> Self {
        let with = |source| [GROUPS, include_str!("hash_grid/corner.wgsl"), source];
        Self {
            forward: Kernel::new(gpu, "hash grid", &with(include_str!("hash_grid/forward.wgsl"))),
            backward: Kernel::new(gpu, "hash grid backward", &with(include_str!("hash_grid/backward.wgsl"))),
        }
    }

    /// Writes `Σ weight·sign(row)` over the corners of every level.
    ///
    /// * `rows`: `[n_rows, 4]`. * `anchors`: `[n]` of the view. * `features`: `[n, 4·levels]`.
    pub fn forward(
        &self,
        commands: &mut Commands<'_>,
        places: &GridPlaces,
        rows: &Buffer<f32>,
        anchors: &Buffer<u32>,
        features: &Buffer<f32>,
    ) {
        let n_items = anchors.len() * places.n_levels;
        let parameters = Parameters { n_items: n_items as u32, n_levels: places.n_levels as u32 };
        let buffers = [&places.levels as _, &places.units as _, rows as _, anchors as _, features as _];
        commands.run_items(&self.forward, &parameters, &buffers, n_items);
    }

    /// Gradients through the signs: `Σ weight·dL/d(feature)` where |row| ≤ 1, else 0. A row's anchors are added up in 32
    /// parts, each in their order, and these in a tree.
    ///
    /// * `row_of_anchor`: `[n_anchors]`. * `d_features`: `[n, 4·levels]`. * `d_rows`: as `rows`, overwritten.
    pub fn backward(
        &self,
        commands: &mut Commands<'_>,
        places: &GridPlaces,
        rows: &Buffer<f32>,
        row_of_anchor: &Buffer<u32>,
        d_features: &Buffer<f32>,
        d_rows: &Buffer<f32>,
    ) {
        let parameters = Parameters { n_items: places.n_rows as u32, n_levels: places.n_levels as u32 };
        let buffers = [
            &places.levels as _,
            &places.units as _,
            rows as _,
            &places.starts as _,
            &places.entries as _,
            row_of_anchor as _,
            d_features as _,
            d_rows as _,
        ];
        commands.run(&self.backward, &parameters, &buffers, places.n_rows.div_ceil(ROWS_PER_GROUP));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ops::primitives::compact::NO_ROW;
    use crate::parity::{Bound, SIZES, assert_close, gpu, largest};
    use pocketsplat_format::context::LevelKind;
    use pocketsplat_kernels::finite_difference::random;
    use pocketsplat_kernels::ops::rate::hash_grid as cpu;

    fn levels() -> Vec<GridLevel> {
        [
            (LevelKind::Volume, 5, 125),
            (LevelKind::Volume, 900, 256),
            (LevelKind::Xy, 9, 81),
            (LevelKind::Xz, 170, 32),
            (LevelKind::Yz, 65535, 64),
        ]
        .map(|(kind, resolution, n_rows)| GridLevel { kind, resolution, n_rows })
        .to_vec()
    }

    /// Bounds: features are whole numbers of 2⁻²⁴, the same on both. A gradient adds the same products in another order, which an
    /// adapter may fuse: 1e-6 of the largest.
    #[test]
    fn the_hash_grid_agrees_with_the_cpu() {
        let Some(gpu) = gpu() else { return };
        let (kernels, levels) = (HashGrid::new(gpu), levels());
        let n_rows: usize = levels.iter().map(|level| level.n_rows as usize).sum();
        for n in SIZES {
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "within 0..=65535")]
            let mut units: Vec<[u16; 3]> = random(3, 3 * n)
                .chunks_exact(3)
                .map(|v| std::array::from_fn(|i| (32767.5 * (v[i] + 1.0)) as u16))
                .collect();
            for (unit, hard) in units.iter_mut().zip([[0; 3], [65535; 3], [0, 65535, 1], [32768; 3]]) {
                *unit = hard;
            }
            let mut rows: Vec<f32> = random(4, 4 * n_rows).iter().map(|v| (1.2 * v) as f32).collect();
            rows[..5].copy_from_slice(&[0.0, -0.0, 1.0, -1.0, 1.000_000_1]);
            let anchors: Vec<u32> = (0..n as u32).filter(|a| a % 4 != 2).collect();
            let mut row_of_anchor = vec![NO_ROW; n];
            for (row, anchor) in (0..).zip(&anchors) {
                row_of_anchor[*anchor as usize] = row;
            }
            let visible: Vec<[u16; 3]> = anchors.iter().map(|a| units[*a as usize]).collect();
            let places = GridPlaces::new(gpu, &levels, &units).expect("room");
            let mut expected = vec![0.0; anchors.len() * places.n_features()];
            cpu::forward(&levels, &rows, &visible, &mut expected);
            let d_features: Vec<f32> = random(5, expected.len()).iter().map(|v| *v as f32).collect();
            let mut d_expected = vec![9.0; rows.len()];
            let part = cpu::Part { units: &visible, d_features: &d_features };
            cpu::backward(&levels, &rows, &[part], &mut d_expected);

            let upload = |values: &[f32]| Buffer::upload(gpu, "test", values).expect("room");
            let (grid, features) = (upload(&rows), upload(&vec![9.0; expected.len()]));
            let d_rows = upload(&vec![9.0; rows.len()]);
            let anchors = Buffer::upload(gpu, "anchors", &anchors).expect("room");
            let row_of_anchor = Buffer::upload(gpu, "rows", &row_of_anchor).expect("room");
            let mut commands = Commands::new(gpu);
            kernels.forward(&mut commands, &places, &grid, &anchors, &features);
            kernels.backward(&mut commands, &places, &grid, &row_of_anchor, &upload(&d_features), &d_rows);
            commands.submit().expect("runs");
            assert!(features.read(gpu).expect("runs") == expected, "features of {n} anchors");
            let bound = Bound { relative: 0.0, absolute: 1e-6 * largest(&d_expected) };
            assert_close("gradient", &d_rows.read(gpu).expect("runs"), &d_expected, bound);
        }
    }
}
