//! [`pocketsplat_kernels::ops::image::tiles`] over slots: splats by depth, then (tile, splat) pairs by tile; both sorts are stable.

use bytemuck::{Pod, Zeroable};

use crate::ops::primitives::radix_sort::{Pairs, RadixSort};
use crate::ops::primitives::scan::Scan;
use crate::{Buffer, Commands, GROUPS, Gpu, GpuError, Kernel, RECORDS};
use pocketsplat_kernels::ops::image::project::{Footprint, Splat};
use pocketsplat_kernels::ops::image::tiles::TILE_PX;

/// Its kernels, and the lists of the last view.
#[derive(Debug)]
pub struct Tiles {
    measure: Kernel,
    gather: Kernel,
    pair: Kernel,
    range: Kernel,
    sort: RadixSort,
    scan: Scan,
    by_depth: Pairs,
    by_tile: Pairs,
    /// `[n_slots]` tiles that a slot's splat touches.
    pub n_tiles: Buffer<u32>,
    /// `[n_slots]` where a slot's pairs start, in the order in which they were made: by depth of the splat, then by tile.
    pub first_pair: Buffer<u32>,
    /// `[n_pairs]` slots, in that order.
    pub slot_of_pair: Buffer<u32>,
    /// `[n_tiles + 1]`: the entries of tile t are `starts[t]..starts[t + 1]`.
    pub starts: Buffer<u32>,
    offsets: Buffer<u32>,
    total: Buffer<u32>,
}

#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Parameters {
    size_px: [u32; 2],
    grid: [u32; 2],
    n_items: u32,
}

impl Parameters {
    fn new(size_px: [usize; 2], n_items: usize) -> Self {
        Self {
            size_px: size_px.map(|s| s as u32),
            grid: size_px.map(|s| s.div_ceil(TILE_PX) as u32),
            n_items: n_items as u32,
        }
    }
}

impl Tiles {
    /// Compiles the kernels.
    ///
    /// # Errors
    /// As [`Buffer::zeros`].
    pub fn new(gpu: &Gpu) -> Result<Self, GpuError> {
        const SHARED: &str = include_str!("tiles/rectangle.wgsl");
        let kernel = |name, source| Kernel::new(gpu, name, &[GROUPS, RECORDS, SHARED, source]);
        Ok(Self {
            measure: kernel("tiles: measure", include_str!("tiles/measure.wgsl")),
            gather: kernel("tiles: gather", include_str!("tiles/gather.wgsl")),
            pair: kernel("tiles: pair", include_str!("tiles/pair.wgsl")),
            range: kernel("tiles: range", include_str!("tiles/range.wgsl")),
            sort: RadixSort::new(gpu)?,
            scan: Scan::new(gpu)?,
            by_depth: Pairs::zeros(gpu, 1)?,
            by_tile: Pairs::zeros(gpu, 1)?,
            n_tiles: Buffer::zeros(gpu, "tiles of splats", 1)?,
            first_pair: Buffer::zeros(gpu, "first pairs of splats", 1)?,
            slot_of_pair: Buffer::zeros(gpu, "slots of pairs", 1)?,
            starts: Buffer::zeros(gpu, "starts of tiles", 1)?,
            offsets: Buffer::zeros(gpu, "pairs before a splat", 1)?,
            total: Buffer::zeros(gpu, "number of pairs", 1)?,
        })
    }

    /// `[n_pairs]`: the pairs of all tiles, one tile after the other, nearest first; places in [`Self::slot_of_pair`].
    pub fn entries(&self) -> &Buffer<u32> {
        &self.by_tile.values
    }

    /// Lists the splats of each tile: depth ascending, ties by slot. Returns the number of pairs.
    ///
    /// Waits once, for the number of pairs. Cost: a sort of all slots by 32 bits, one of all pairs by those of a tile's number.
    ///
    /// # Errors
    /// [`GpuError`].
    pub fn build(
        &mut self,
        gpu: &Gpu,
        mut commands: Commands<'_>,
        splats: &Buffer<Splat<f32>>,
        footprints: &Buffer<Footprint<f32>>,
        size_px: [usize; 2],
    ) -> Result<usize, GpuError> {
        let n_slots = splats.len();
        self.by_depth.fit(gpu, n_slots)?;
        for buffer in [&mut self.n_tiles, &mut self.first_pair, &mut self.offsets] {
            buffer.fit(gpu, n_slots)?;
        }
        let of_slots = Parameters::new(size_px, n_slots);
        let by_depth = &self.by_depth;
        let buffers = [splats as _, footprints as _, &by_depth.keys as _, &by_depth.values as _, &self.n_tiles as _];
        commands.run_items(&self.measure, &of_slots, &buffers, n_slots);
        self.sort.run(gpu, &mut commands, &mut self.by_depth, 32)?;
        let order = &self.by_depth.values;
        commands.run_items(&self.gather, &of_slots, &[order, &self.n_tiles, &self.offsets], n_slots);
        self.scan.run(gpu, &mut commands, &self.offsets, &self.total)?;
        commands.submit()?;
        let n_pairs = self.total.read(gpu)?[0] as usize;

        self.by_tile.fit(gpu, n_pairs)?;
        self.slot_of_pair.fit(gpu, n_pairs)?;
        let n_tiles = of_slots.grid.map(|g| g as usize).iter().product::<usize>();
        self.starts.fit(gpu, n_tiles + 1)?;
        let mut commands = Commands::new(gpu);
        let (by_tile, slots) = (&self.by_tile, &self.slot_of_pair);
        let lists = [&by_tile.keys as _, &by_tile.values as _, slots as _, &self.first_pair as _];
        let buffers = [&[splats as _, footprints as _, order as _, &self.offsets as _][..], &lists].concat();
        commands.run_items(&self.pair, &of_slots, &buffers, n_slots);
        self.sort.run(gpu, &mut commands, &mut self.by_tile, usize::BITS - (n_tiles - 1).leading_zeros())?;
        // One more item than pairs, after the last.
        let of_pairs = Parameters::new(size_px, n_pairs);
        commands.run_items(&self.range, &of_pairs, &[&self.by_tile.keys, &self.starts], n_pairs + 1);
        commands.submit()?;
        Ok(n_pairs)
    }
}

#[cfg(test)]
mod tests;
