//! What the conformance suites share: scenes, cameras, a sink that counts, and the measure of a difference.
//!
//! The suites see public interfaces alone. Each of them asks one question:
//!
//! * `parity`: does the decoder draw what the f64 oracle draws?
//! * `golden`: does it draw what it drew before?
//! * `arithmetic`, `quality`: do other number formats and lower qualities stay near the exact frames?
//! * `memory`: do the planned bytes suffice, does one byte less fail and say how many are needed, and do all plan variants draw
//!   the same pixels?
//! * `delivery`: does a sink get every pixel once, whatever the scratch memory held and wherever it lay?
//! * `misuse`: is a frame, a bundle or a camera that a decoder was not planned for refused?
//! * `malformed`: does a damaged bundle fail and name the place, or report the damaged chunk, and never draw another
//!   picture in silence?
//! * `passes`: does a frame go over its scene as seldom as it can, in no more memory than it says, and does damage leave nothing behind?
//! * `two_painters`: do two decoders that share a scene draw together what one draws, in memory that the plan tells exactly?
//! * `tiers`: is each tier's scene part of the next one's, and is a file cut at its end that scene?
//! * `sizes`: does a frame that is larger or smaller than those of training show the same picture?
//! * `digests`: do symbols not depend on the number of threads?
//! * `orbit`: is the decoder's orbit the one that the manifest was measured over?
//! * `stopwatch`: is a stopwatch told of every stage, in order, without a change of the frame?
//! * `fuzzing`: do the bodies of the fuzz targets hold on a seeded walk?
//! * `captures`: do captures load with the conventions that the renderers use?
//! * `hard_cases`, `hard_neighbourhoods`: do named hard cases, and what lies near them, keep the bounds that
//!   `docs/numerical-stability.md` states?
//! * `pack`: is the committed conformance pack what its command writes, does it have every feature, kind, bit and limit of the format, and
//!   are its files to be refused refused for their reasons?
//! * `rooms`: do imports go down only, and never in circles, and has decoder-core few names?
//! * `hand_made`: do bundles made by hand, with every feature and without, draw alike in whatever way?
//! * `determinism`: does the same seed give the same bundle for any number of threads?

pub mod bundles;
pub mod captures;
pub mod difference;
#[path = "../digest/src/digest.rs"]
pub mod digest;
pub mod frame;
#[path = "../../fuzz/src/lib.rs"]
pub mod fuzz;
pub mod hard_cases;
pub mod pack;
pub mod scenes;

pub use fuzz::seal;
