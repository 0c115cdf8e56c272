#!/usr/bin/env bash
# Instructions and cycles of the frames of an orbit on a Cortex-M4, as rows of CSV. The cycles are those of ARM's table, see cycles/src/thumb.rs.
#
#   cycles.sh BUNDLE RAM_KIB [WIDTHxHEIGHT]
set -euo pipefail
bundle=$(realpath "${1:?usage: cycles.sh BUNDLE RAM_KIB [WIDTHxHEIGHT]}")
export PSB_BUNDLE=$bundle RAM_KIB=${2:?usage: cycles.sh BUNDLE RAM_KIB [WIDTHxHEIGHT]} BOARD=mps2-an386
[ -z "${3:-}" ] || export SIZE=$3
# The plugin is a program of this machine, and the configuration of this folder names another.
cd "$(dirname "$0")/.."
target=$(realpath -m "${CARGO_TARGET_DIR:-firmware-example/target}")
cargo build -q --release --locked --manifest-path firmware-example/cycles/Cargo.toml --target-dir "$target/cycles" >&2
cd firmware-example
cargo build -q --release --locked --bin steps --target-dir "$target" >&2
echo bundle,frame,instructions,cycles
timeout "${QEMU_TIMEOUT_S:-300}" qemu-system-arm -M "$BOARD" -icount shift=0 -display none -monitor none -serial none \
  -semihosting-config enable=on,target=native -d plugin -D /dev/stderr -plugin "$target/cycles/release/libcycles.so" \
  -kernel "$target/thumbv7em-none-eabihf/release/steps" 2>&1 >/dev/null </dev/null | sed -n "s/^cycles,0,/$(basename "$bundle" .psb),/p"
