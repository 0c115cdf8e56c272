//! Loops over arrays that run in parallel: the sum, the scan, the sort, the marked items, and the rows of some.

pub mod compact;
pub mod gather;
pub mod radix_sort;
pub mod scan;
pub mod sum;
