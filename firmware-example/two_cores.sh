#!/usr/bin/env bash
# Draws the frames of an orbit by one Cortex-M33 and by two of them, and prints instructions as rows of CSV: those of one core, of the first of
# two, of the second, those that a frame of two takes, and how many times as many one core takes. Fails when a pixel differs.
#
#   two_cores.sh BUNDLE RAM_KIB [WIDTHxHEIGHT] [OUT]
#
# What one core drew and the log stay in OUT, which is target/two_cores here without it. FRAMES, BUDGET and ARITHMETIC are build.rs's.
set -euo pipefail
usage="usage: two_cores.sh BUNDLE RAM_KIB [WIDTHxHEIGHT] [OUT]"
bundle=$(realpath "${1:?$usage}")
export PSB_BUNDLE=$bundle RAM_KIB=${2:?$usage} BOARD=mps2-an521
[ -z "${3:-}" ] || export SIZE=$3
mkdir -p "${4:-${CARGO_TARGET_DIR:-target}/two_cores}"
out=$(realpath "${4:-${CARGO_TARGET_DIR:-target}/two_cores}")
# Relative to where it is called from, as OUT is.
target=$(realpath -m "${CARGO_TARGET_DIR:-$(dirname "$0")/target}")
# The plugin is a program of this machine, and the configuration of this folder names another.
cd "$(dirname "$0")/.."
cargo build -q --release --locked --manifest-path firmware-example/cycles/Cargo.toml --target-dir "$target/cycles" >&2
cd firmware-example
processor=thumbv8m.main-none-eabihf
cargo build -q --release --locked --bin two_cores --features two-cores --target $processor --target-dir "$target" >&2
runner=$PWD/qemu.sh
rm -f "$out"/frame*.ppm
cd "$out"
QEMU_ARGS="-d plugin -D $out/counts.txt -plugin $target/cycles/release/libcycles.so" \
  "$runner" "$target/$processor/release/two_cores" >log.txt || { cat log.txt >&2 && exit 1; }
echo bundle,frame,one,first,second,two,ratio
# Of each frame the first core counts six stretches: the frame by itself; then its part of both phases, and what it does alone before, between
# and after them; the second one its part of both phases. Between the phases each waits for the other, so that of each phase the longer part counts.
awk -F, -v bundle="$(basename "$bundle" .psb)" '
  function longer(a, b) { return a > b ? a : b }
  $1 != "cycles" { next }
  { spent[$2, $3] = $4 }
  $2 == 0 && $3 % 6 == 5 { n++ }
  END {
    for (frame = 0; frame < n; frame++) {
      one = spent[0, 6 * frame]
      alone = spent[0, 6 * frame + 1] + spent[0, 6 * frame + 3] + spent[0, 6 * frame + 5]
      gather = spent[0, 6 * frame + 2]; gather_second = spent[1, 2 * frame]
      blend = spent[0, 6 * frame + 4]; blend_second = spent[1, 2 * frame + 1]
      two = longer(gather, gather_second) + longer(blend, blend_second) + alone
      printf "%s,%d,%d,%d,%d,%d,%.3f\n", bundle, frame, one, gather + blend + alone, gather_second + blend_second, two, one / two
    }
  }' counts.txt
