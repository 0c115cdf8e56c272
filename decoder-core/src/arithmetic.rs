//! What a frame is computed with: number formats and functions, one type for each choice.
//!
//! [`ReferenceArithmetic`] is what [`Decoder::bind`](crate::Decoder::bind) uses and what the trainer's reference is compared with.
//! [`Decoder::bind_in`](crate::Decoder::bind_in) takes either:
//!
//! ```
//! # fn main() -> Result<(), pocketsplat_core::DecodeError> {
//! # let bytes = include_bytes!(concat!(env!("CARGO_MANIFEST_DIR"), "/examples/example.psb"));
//! # let mut scratch = [0; 8 * 1024];
//! # struct Sink;
//! # impl pocketsplat_core::TileSink for Sink {
//! #     type Error = core::convert::Infallible;
//! #     fn tile(&mut self, _: pocketsplat_core::Tile<'_>) -> Result<(), Self::Error> { Ok(()) }
//! # }
//! use pocketsplat_core::{Budget, Bundle, Decoder, Plan, WithoutFpu};
//!
//! let bundle = Bundle::parse(bytes)?;
//! let plan = Plan::new(&bundle, &Budget::for_frame(32, 24))?;
//! let mut decoder = Decoder::bind_in::<WithoutFpu>(&bundle, plan, &mut scratch)?;
//! let report = decoder.render(&bundle.header().preview, &mut Sink)?;
//! assert_eq!(report.splats, 5);
//! # Ok(())
//! # }
//! ```
//!
//! A choice is made when the firmware is built, so none costs the other anything, and either gives the same bytes on every target.
//! What each costs and saves was measured: `docs/experiments/2026-11-21-decoder-settings.md` of the repository.

use crate::functions::{Functions, Reference, Table};
use crate::mlp::{F32, HeadFormat, I16};
use crate::raster::{Blending, FloatBlending, IntegerBlending};

/// [`ReferenceArithmetic`] or [`WithoutFpu`].
#[expect(private_bounds, reason = "sealed: what a choice decides is the decoder's own affair")]
pub trait Arithmetic: Choices {}

impl<T: Choices> Arithmetic for T {}

/// What an [`Arithmetic`] decides.
pub(crate) trait Choices: 'static {
    /// The format of the heads.
    type Heads: HeadFormat;
    /// The transcendental functions.
    type Functions: Functions;
    /// How splats become pixels.
    type Blending: Blending;
}

/// As the reference, within the rounding of f32, and of halves for splats in memory.
#[derive(Clone, Copy, Debug)]
pub struct ReferenceArithmetic;

/// For processors without an FPU: heads, functions and pixels in integers.
#[derive(Clone, Copy, Debug)]
pub struct WithoutFpu;

impl Choices for ReferenceArithmetic {
    type Heads = F32;
    type Functions = Reference;
    type Blending = FloatBlending;
}

impl Choices for WithoutFpu {
    type Heads = I16;
    type Functions = Table;
    type Blending = IntegerBlending;
}
