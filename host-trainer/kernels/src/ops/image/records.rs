//! The records that the CPU and a GPU share, byte for byte.

use bytemuck::{Pod, Zeroable};

use super::project::{Footprint, Splat};
use crate::ops::heads::neural_gaussians::Gaussian;

/// Records of f32 without gaps, which the size says.
macro_rules! of_floats {
    ($($record:ty: $n:literal),*) => {
        $(
            const _: () = assert!(size_of::<$record>() == 4 * $n);
            #[expect(unsafe_code, reason = "the derives do not take generic records; these are f32 alone, in the order of C, without gaps")]
            unsafe impl Zeroable for $record {}
            #[expect(unsafe_code, reason = "as above")]
            unsafe impl Pod for $record {}
        )*
    };
}

of_floats!(Gaussian<f32>: 14, Splat<f32>: 9, Footprint<f32>: 3);
