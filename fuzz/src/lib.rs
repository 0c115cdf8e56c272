//! The bodies of the fuzz targets, as plain functions: any bytes go in, and a law that does not hold panics.
//!
//! The targets drive them with libFuzzer. The conformance crate has this file as a module, and its suite `fuzzing` drives them with a
//! seeded walk.

mod blame;
mod draw;
pub mod frame;
mod normal;
mod parse;
pub mod seal;
mod setting;
mod symbols;

pub use draw::draw;
pub use normal::normal;
pub use parse::parse;
pub use setting::LEN as SETTING_LEN;
pub use symbols::symbols;

/// Scenes of more anchors are not decoded: what is looked for does not depend on it, the time does.
const MOST_ANCHORS: u32 = 2048;
