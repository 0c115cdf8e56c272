#!/usr/bin/env bash
# Builds the firmware with a bundle, draws on an emulated board, and prints the instructions of each stage as rows of CSV.
#
#   measure.sh BUNDLE BOARD RAM_KIB [WIDTHxHEIGHT] [OUT]
#
# Frames and log stay in OUT, which is target/measured here without it. FRAMES is 4 when it is not set; VIEWS, QUALITY,
# BUDGET and ARITHMETIC are build.rs's.
set -euo pipefail
usage="usage: measure.sh BUNDLE mps2-an385|mps2-an386|mps2-an500|virt|virt-fpu RAM_KIB [WIDTHxHEIGHT] [OUT]"
bundle=$(realpath "${1:?$usage}") ram_kib=${3:?$usage} size=${4:-}
export BOARD=${2:?$usage} RAM_KIB=$ram_kib PSB_BUNDLE=$bundle
[ -z "$size" ] || export SIZE=$size
case $BOARD in
virt) processor=riscv32imac-unknown-none-elf ;;
virt-fpu) processor=riscv32imafc-unknown-none-elf ;;
mps2-an385) processor=thumbv6m-none-eabi ;;
*) processor=thumbv7em-none-eabihf ;;
esac
mkdir -p "${5:-${CARGO_TARGET_DIR:-target}/measured}"
out=$(realpath "${5:-${CARGO_TARGET_DIR:-target}/measured}")

cd "$(dirname "$0")"
target=$(realpath -m "${CARGO_TARGET_DIR:-target}")
cargo build -q --release --locked --bin firmware-example --target "$processor" --target-dir "$target" >&2
runner=$PWD/qemu.sh
rm -f "$out"/frame*.ppm "$out/instructions.csv"
cd "$out"
"$runner" "$target/$processor/release/firmware-example" >log.txt || { cat log.txt >&2 && exit 1; }
scratch=$(sed -n 's/.*scratch: \([0-9]*\) bytes.*/\1/p' log.txt)
size=$(sed -n 2p frame0.ppm)
n_frames=$(ls frame*.ppm | wc -l)
# Everything that a host needs to draw the same frames.
echo board,ram_kib,scratch,width,height,bundle,frames,frame,stage,instructions
sed 1d instructions.csv | sed "s/^/$BOARD,$ram_kib,$scratch,${size/ /,},$(basename "$bundle" .psb),$n_frames,/"
