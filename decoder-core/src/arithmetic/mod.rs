//! What a frame is computed with: number formats and approximations, one type for each choice.
//!
//! [`Exact`] is what [`Decoder::bind`](crate::Decoder::bind) uses and what the trainer's reference is compared with.
//! [`Decoder::bind_in`](crate::Decoder::bind_in) takes any other:
//!
//! ```
//! # fn main() -> Result<(), pocketsplat_core::DecodeError> {
//! # let bytes = include_bytes!(concat!(env!("CARGO_MANIFEST_DIR"), "/src/bundle/example.psb"));
//! # let mut scratch = [0; 8 * 1024];
//! # struct Sink;
//! # impl pocketsplat_core::TileSink for Sink { fn tile(&mut self, _: u16, _: u16, _: u16, _: u16, _: &[[u8; 3]]) {} }
//! use pocketsplat_core::arithmetic::QuickWithoutFpu;
//! use pocketsplat_core::{Budget, Bundle, Decoder};
//!
//! let bundle = Bundle::parse(bytes)?;
//! let plan = bundle.plan(&Budget::for_frame(32, 24))?;
//! let mut decoder = Decoder::bind_in::<QuickWithoutFpu>(&bundle, plan, &mut scratch)?;
//! let report = decoder.render(&bundle.header().preview, &mut Sink)?;
//! assert_eq!(report.splats, 5);
//! # Ok(())
//! # }
//! ```
//!
//! A choice is made when the firmware is built, so none costs the others anything, and whatever is chosen gives the same bytes
//! on every target; [`With`] turns each knob by itself. What each costs and saves is measured in the repository's `docs/accuracy-and-time.md`.

mod colour;
mod functions;
mod roots;

use core::marker::PhantomData;

pub(crate) use colour::Colours;
pub use colour::{Rgb565, Rgb565Dithered, Rgb888};
pub(crate) use functions::Functions;
pub use functions::{Libm, Polynomial, Precise, Table};
pub(crate) use roots::Roots;
pub use roots::{Fast, Ieee};

use crate::mlp::HeadNumbers;
use crate::project::SplatRecord;

/// A choice for everything: [`With`] any of this module's types.
#[expect(private_bounds, reason = "sealed: what a choice decides is the decoder's own affair")]
pub trait Arithmetic: Choices {}

impl<T: Choices> Arithmetic for T {}

/// What an [`Arithmetic`] decides.
pub(crate) trait Choices: 'static {
    type Heads: HeadNumbers;
    type Functions: Functions;
    type Roots: Roots;
    type Splat: SplatRecord;
    type Depth: DepthKey;
    type Colours: Colours;
}

/// The heads' numbers H, the functions F, roots and divisions R, splats in memory S, keys of depth D, colours C.
#[derive(Clone, Copy, Debug)]
pub struct With<H = F32, F = Precise, R = Ieee, S = Mixed, D = Depth32, C = Rgb888>(PhantomData<(H, F, R, S, D, C)>);

/// As the reference, within the rounding of f32, and of halves for splats that wait in memory.
pub type Exact = With;
/// Fewer instructions in every part that floats take, for errors far below a step of 8 bits.
pub type Quick = With<F32, Polynomial, Fast>;
/// The same for processors without an FPU, whose heads take a sixth of the instructions in integers.
pub type QuickWithoutFpu = With<I16, Polynomial, Fast>;

impl<H, F, R, S, D, C> Choices for With<H, F, R, S, D, C>
where
    H: HeadNumbers + 'static,
    F: Functions + 'static,
    R: Roots + 'static,
    S: SplatChoice + 'static,
    D: DepthKey + 'static,
    C: Colours + 'static,
{
    type Heads = H;
    type Functions = F;
    type Roots = R;
    type Splat = S::Record;
    type Depth = D;
    type Colours = C;
}

/// Weights as f32.
#[derive(Clone, Copy, Debug)]
pub struct F32;
/// Weights as halves, which is what the file holds or nearly so; sums in f32.
#[derive(Clone, Copy, Debug)]
pub struct F16;
/// Weights as halves, and each product and each sum rounded to a half: what a processor of halves alone would do.
#[derive(Clone, Copy, Debug)]
pub struct StrictF16;
/// Weights, inputs and hidden units as 16-bit integers, sums of 32 bits; the detail head in f32.
#[derive(Clone, Copy, Debug)]
pub struct I16;
/// As [`I16`] with weights of 8 bits.
#[derive(Clone, Copy, Debug)]
pub struct I8;

/// Splats in 28 bytes: place, depth and shear as f32, the rest with the eleven bits of halves.
#[derive(Clone, Copy, Debug)]
pub struct Mixed;
/// Splats in 40 bytes, all f32; in memory planned for [`Mixed`] there are places for fewer.
#[derive(Clone, Copy, Debug)]
pub struct Wide;

/// Splats in 20 bytes, every number in 16 bits: centres in eighths of a pixel, the order by the upper half of the depth.
#[derive(Clone, Copy, Debug)]
pub struct Narrow;

/// Which record a choice of splats stands for.
pub(crate) trait SplatChoice {
    type Record: SplatRecord;
}

/// Splats in order of all bits of their depths.
#[derive(Clone, Copy, Debug)]
pub struct Depth32;
/// Splats in order of the upper 16 bits of their depths, a 128th of it: nearer differences stay in the order of the file.
#[derive(Clone, Copy, Debug)]
pub struct Depth16;

/// How many bits of a depth decide about the order.
pub(crate) trait DepthKey {
    /// The lowest bit, a multiple of 8.
    const FIRST_BIT: u32;
}

impl DepthKey for Depth32 {
    const FIRST_BIT: u32 = 0;
}

impl DepthKey for Depth16 {
    const FIRST_BIT: u32 = 16;
}
