//! What a frame is computed with: number formats and functions, one type for each choice.
//!
//! [`ReferenceArithmetic`] is what [`Decoder::bind`](crate::Decoder::bind) uses and what the trainer's reference is compared with.
//! [`Decoder::bind_in`](crate::Decoder::bind_in) takes any other:
//!
//! ```
//! # fn main() -> Result<(), pocketsplat_core::DecodeError> {
//! # let bytes = include_bytes!(concat!(env!("CARGO_MANIFEST_DIR"), "/src/bundle/example.psb"));
//! # let mut scratch = [0; 8 * 1024];
//! # struct Sink;
//! # impl pocketsplat_core::TileSink for Sink {
//! #     type Error = core::convert::Infallible;
//! #     fn tile(&mut self, _: u16, _: u16, _: u16, _: u16, _: &[[u8; 3]]) -> Result<(), Self::Error> { Ok(()) }
//! # }
//! use pocketsplat_core::arithmetic::WithoutFpu;
//! use pocketsplat_core::{Budget, Bundle, Decoder};
//!
//! let bundle = Bundle::parse(bytes)?;
//! let plan = bundle.plan(&Budget::for_frame(32, 24))?;
//! let mut decoder = Decoder::bind_in::<WithoutFpu>(&bundle, plan, &mut scratch)?;
//! let report = decoder.render(&bundle.header().preview, &mut Sink)?;
//! assert_eq!(report.splats, 5);
//! # Ok(())
//! # }
//! ```
//!
//! A choice is made when the firmware is built, so none costs the others anything, and whatever is chosen gives the same bytes
//! on every target. What each costs and saves was measured: `docs/experiments/2026-11-21-decoder-settings.md` of the repository.

use core::marker::PhantomData;

pub use crate::math::functions::{Reference, Table};
pub use crate::mlp::{F16, F32, I16};
pub use crate::project::{Packed28, Wide};

use crate::math::functions::Functions;
use crate::mlp::HeadFormat;
use crate::project::SplatRecord;

/// A choice for everything: [`With`] any of this module's types.
#[expect(private_bounds, reason = "sealed: what a choice decides is the decoder's own affair")]
pub trait Arithmetic: Choices {}

impl<T: Choices> Arithmetic for T {}

/// What an [`Arithmetic`] decides.
pub(crate) trait Choices: 'static {
    type Heads: HeadFormat;
    type Functions: Functions;
    type Splat: SplatRecord;
}

/// The format of the heads H, the functions F, splats in memory S.
#[derive(Clone, Copy, Debug)]
pub struct With<H = F32, F = Reference, S = Packed28>(PhantomData<(H, F, S)>);

/// As the reference, within the rounding of f32, and of halves for splats in memory.
pub type ReferenceArithmetic = With;
/// For processors without an FPU: heads in integers and functions from a table take half the instructions or less of the
/// stages that they are in.
pub type WithoutFpu = With<I16, Table>;

impl<H, F, S> Choices for With<H, F, S>
where
    H: HeadFormat + 'static,
    F: Functions + 'static,
    S: SplatRecord,
{
    type Heads = H;
    type Functions = F;
    type Splat = S;
}
