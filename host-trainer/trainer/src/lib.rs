//! Trains a structured neural Gaussian-splat scene from photographs and writes it as a compact bundle.
//!
//! Modules in the order data flows through them, each importing only from those before it: [`train`] → [`explicit`], explicit Gaussians instead of anchors → [`export`]. [`device`] says what a device
//! holds and [`encode`] makes the bundle of a run that fits it; [`effects`] and [`cost`] ask all of them. The scene and its operations
//! are `pocketsplat-kernels`, on a graphics card `pocketsplat-gpu`; bundles are `pocketsplat-codec`.

pub mod cost;
pub mod device;
pub mod effects;
pub mod encode;
pub mod explicit;
pub mod export;
pub mod train;

/// Revision of training: raised by the commit that changes what a run gives, from its photographs to its bundle, so that figures of two
/// programs are told apart.
pub const REVISION: u32 = 7;

/// Version and revision of training of a program that tables name: `0.1.0 r1` of `0.1.0 r1 1a2b3c4, measured by …`.
pub fn revision_of(program: &str) -> &str {
    let trained = program.split_once(',').map_or(program, |(trained, _)| trained);
    trained.match_indices(' ').nth(1).map_or(trained, |(end, _)| &trained[..end])
}
