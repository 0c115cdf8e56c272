//! The context model: how it starts, its integers, and what coding does to values in each phase.

pub(super) mod integers;
pub(super) mod phases;
pub mod start;
