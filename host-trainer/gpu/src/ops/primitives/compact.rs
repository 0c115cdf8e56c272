//! The marked ones of many items, in order.

use super::scan::Scan;
use crate::{Buffer, Commands, GROUPS, Gpu, GpuError, Kernel};

/// The row of an item that is not marked.
pub const NO_ROW: u32 = u32::MAX;

/// Its kernels, and the items marked last.
#[derive(Debug)]
pub struct Compact {
    compact: Kernel,
    scan: Scan,
    /// `[n_marked]` items, ascending.
    pub items: Buffer<u32>,
    /// `[n]` where each item stands in [`Self::items`], or [`NO_ROW`].
    pub row_of_item: Buffer<u32>,
    /// `[n]`: 1 where an item is marked, 0 elsewhere; for the kernel before [`Self::run`] to write.
    pub marks: Buffer<u32>,
    total: Buffer<u32>,
}

impl Compact {
    /// Compiles the kernels.
    ///
    /// # Errors
    /// As [`Buffer::zeros`].
    pub fn new(gpu: &Gpu) -> Result<Self, GpuError> {
        Ok(Self {
            compact: Kernel::new(gpu, "compact", &[GROUPS, include_str!("compact/compact.wgsl")]),
            scan: Scan::new(gpu)?,
            items: Buffer::zeros(gpu, "marked items", 1)?,
            row_of_item: Buffer::zeros(gpu, "rows of items", 1)?,
            marks: Buffer::zeros(gpu, "marks", 1)?,
            total: Buffer::zeros(gpu, "number of marked items", 1)?,
        })
    }

    /// Makes room for `n` items.
    ///
    /// # Errors
    /// As [`Buffer::zeros`].
    pub fn fit(&mut self, gpu: &Gpu, n: usize) -> Result<(), GpuError> {
        for buffer in [&mut self.marks, &mut self.row_of_item, &mut self.items] {
            buffer.fit(gpu, n)?;
        }
        Ok(())
    }

    /// Lists the marked items; overwrites the marks. Returns their number.
    ///
    /// Waits once, for that number.
    ///
    /// # Errors
    /// [`GpuError`].
    pub fn run(&mut self, gpu: &Gpu, mut commands: Commands<'_>) -> Result<usize, GpuError> {
        let n = self.marks.len();
        self.scan.run(gpu, &mut commands, &self.marks, &self.total)?;
        let buffers = [&self.marks as _, &self.total as _, &self.items as _, &self.row_of_item as _];
        commands.run_items(&self.compact, &(n as u32), &buffers, n);
        commands.submit()?;
        let n_marked = self.total.read(gpu)?[0] as usize;
        self.items.fit(gpu, n_marked)?;
        Ok(n_marked)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::parity::{SIZES, gpu};

    #[test]
    fn marked_items_stay_in_order() {
        let Some(gpu) = gpu() else { return };
        let mut compact = Compact::new(gpu).expect("room");
        for (n, is_marked) in SIZES.into_iter().zip([|_| true, |_| true, |_| false, |i| i % 7 < 3, |i| i % 2 == 0]) {
            let marks: Vec<u32> = (0..n as u32).map(|i| u32::from(is_marked(i))).collect();
            let expected: Vec<u32> = (0..n as u32).filter(|i| is_marked(*i)).collect();
            compact.fit(gpu, n).expect("room");
            compact.marks.write(gpu, &marks).expect("room");
            assert_eq!(compact.run(gpu, Commands::new(gpu)).expect("runs"), expected.len());
            assert_eq!(compact.items.read(gpu).expect("runs"), expected);
            let mut rows = vec![NO_ROW; n];
            for (row, item) in (0..).zip(&expected) {
                rows[*item as usize] = row;
            }
            assert_eq!(compact.row_of_item.read(gpu).expect("runs"), rows);
        }
    }
}
