#!/usr/bin/env bash
# Builds the WebAssembly module and writes it to OUT. The same source gives the same bytes, wherever it lies.
#
#   viewer/build.sh OUT.wasm
set -euo pipefail
out=$(realpath -m "$1")
cd "$(dirname "$0")/.."
target=${CARGO_TARGET_DIR:-$PWD/target}/viewer
# Four numbers at a time where the loops allow it: half the time of a frame, and the same sums in the same order. Paths out of messages
# of panics, which name whoever built it.
export RUSTFLAGS="-C target-feature=+simd128 --remap-path-prefix=$PWD=. --remap-path-prefix=${CARGO_HOME:-$HOME/.cargo}=cargo"
unset CARGO_ENCODED_RUSTFLAGS
cargo rustc -q -p pocketsplat-viewer --lib --crate-type cdylib --target wasm32-unknown-unknown --profile viewer --locked \
  --target-dir "$target"
install -m 644 "$target/wasm32-unknown-unknown/viewer/pocketsplat_viewer.wasm" "$out"
