//! The viewer of bundles: decoder-core as a WebAssembly module, and the page and the package around it.
//!
//! This crate is two things, one for each target.
//!
//! * For `wasm32-unknown-unknown` it is the module: a [`Scene`] behind a dozen exported functions (`exports`), which
//!   `web/pocketsplat.js` wraps for JavaScript. An instance of the module holds one bundle.
//! * Elsewhere it holds that module as bytes ([`MODULE`]), and makes of it [one page](page()) that draws bundles without anything
//!   from outside, and [a folder](package()) for web developers.
//!
//! The module is committed (`pocketsplat.wasm`), so that a build needs neither the WebAssembly target nor a network.
//! `tools/ci.sh viewer` builds it anew and compares every byte; `tools/ci.sh bless-viewer` writes it.
//!
//! The exports are written by hand rather than by `wasm-bindgen`: they pass numbers and two buffers alone. So neither this build
//! nor its check needs another program, whose version would have to match.

#[cfg(target_arch = "wasm32")]
mod exports;
mod figures;
mod focus;
#[cfg(not(target_arch = "wasm32"))]
mod package;
#[cfg(not(target_arch = "wasm32"))]
mod page;
mod scene;

pub use figures::Figures;
#[cfg(not(target_arch = "wasm32"))]
pub use package::{MODULE, PackageFile, package};
#[cfg(not(target_arch = "wasm32"))]
pub use page::{SceneFile, base64, escaped, page};
pub use scene::Scene;
