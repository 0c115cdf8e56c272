//! How much of its limits a bundle takes.

/// Shares of the limits that a bundle takes: above 1 it does not fit; 0 where there is no limit.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LimitShares {
    /// Scratch memory of a decoder that draws the whole scene.
    pub ram: f64,
    /// Instructions of the slowest frame that was tried, or another bound of a level that leaves less room.
    pub instructions: f64,
    /// Bytes of the bundle.
    pub bytes: f64,
}

impl LimitShares {
    /// The larger share of what a decoder needs, whatever the bundle's length.
    pub fn drawing(&self) -> f64 {
        self.ram.max(self.instructions)
    }
}
