//! [`pocketsplat_kernels::ops::rate::noise`] for kernels: program text, and the word that a stream is.

/// Functions `branch_of`, `draw_of` and `uniform_of`.
pub(super) const STREAM: &str = include_str!("noise/stream.wgsl");
