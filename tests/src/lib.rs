//! What the conformance suites share: scenes, cameras, a sink that counts, and the measure of a difference.
//!
//! The suites see public interfaces alone. Each of them asks one question:
//!
//! * `parity`: does the decoder draw what the f64 oracle draws?
//! * `delivery`: does a sink get every pixel once, whatever the scratch memory held and wherever it lay?
//! * `budget`: do the planned bytes suffice, and does one byte less fail and say how many are needed?
//! * `malformed`: does a damaged bundle fail, and never draw another picture?
//! * `captures`: do captures load with the conventions that the renderers use?
//! * `determinism`: does the same seed give the same bundle for any number of threads?

pub mod captures;
pub mod difference;
pub mod frame;
pub mod scenes;
pub mod seal;
