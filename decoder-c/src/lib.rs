//! The C interface of `pocketsplat-core`: `include/pocketsplat.h` and a static library.
//!
//! The order of calls is that of the Rust crate: [`psb_make_plan`] says how many bytes a scene takes, [`psb_bind`] takes them, [`psb_render`]
//! draws frames, or [`psb_begin`] and [`psb_next_tile`] piece by piece; [`psb_bind_two`] and [`psb_render_by_two`] do on two cores what
//! [`psb_bind`] and [`psb_render`] do on one. Nothing is allocated, no panic crosses, and a pointer that is NULL
//! where it must not be is an error.
//!
//! What the caller promises, since no code can check it: pointers that are not NULL point to as many bytes as the call says; bundle and
//! scratch memory stay where they are, unchanged and apart from each other, as long as the decoder is used; one thread at a
//! time uses it, but for the tasks of [`psb_render_by_two`].
#![cfg_attr(not(test), no_std)]
#![deny(unsafe_op_in_unsafe_fn)]

mod by_two;
mod camera;
mod decoder;
mod drawing;
mod plan;
mod status;

pub use by_two::{JoinFn, PAIR_BYTES, Pair, Task, psb_bind_two, psb_pair_bytes, psb_render_by_two};
pub use camera::{Camera, psb_orbit, psb_preview};
pub use decoder::{DECODER_ALIGN, DECODER_BYTES, Decoder, Report, TileFn, psb_bind, psb_decoder_bytes, psb_render};
pub use drawing::{Format, Pixels, Progress, psb_advance, psb_begin, psb_next_tile, psb_next_tile_row};
pub use plan::{Budget, Plan, Quality, psb_budget_for_frame, psb_make_plan};
pub use status::{Message, Status, psb_status_name};

/// The decoder reaches no panic but those that `tests/link-gate` lists; should one come all the same, the device stops here.
#[cfg(not(test))]
#[panic_handler]
fn panic(_: &core::panic::PanicInfo<'_>) -> ! {
    loop {}
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    /// The committed header is what the source says; with `POCKETSPLAT_BLESS=1` it is written.
    #[test]
    fn the_header_is_that_of_the_source() {
        let root = Path::new(env!("CARGO_MANIFEST_DIR"));
        let config = cbindgen::Config::from_file(root.join("cbindgen.toml")).expect("a configuration");
        let mut builder = cbindgen::Builder::new().with_config(config);
        for file in ["status", "plan", "camera", "decoder", "drawing", "by_two"] {
            builder = builder.with_src(root.join(format!("src/{file}.rs")));
        }
        let mut text = Vec::new();
        builder.generate().expect("a header").write(&mut text);
        let header = root.join("include/pocketsplat.h");
        if std::env::var_os("POCKETSPLAT_BLESS").is_some() {
            std::fs::write(&header, &text).expect("written");
        }
        let committed =
            std::fs::read(&header).expect("include/pocketsplat.h; write it with POCKETSPLAT_BLESS=1 cargo test");
        assert!(
            committed == text,
            "include/pocketsplat.h is not what src/ says; run POCKETSPLAT_BLESS=1 cargo test and commit it"
        );
    }
}
