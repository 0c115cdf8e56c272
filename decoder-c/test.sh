#!/usr/bin/env bash
# The C interface: its header is that of the source; a C program draws the golden frames on this machine under the address and the
# undefined-behaviour sanitiser, and on an emulated Cortex-M4; the library builds for RISC-V.
#
#   test.sh TARGET_FOLDER
set -euo pipefail
cd "$(dirname "$0")"
out=${1:?usage: test.sh TARGET_FOLDER}
golden=../tests/golden
mkdir -p "$out"
export CARGO_TARGET_DIR=$out

compare() { # WHAT FOUND BUNDLE…
  local what=$1 found=$2 bundle
  shift 2
  for bundle in "$@"; do
    diff <(grep "^$bundle," "$golden/frames.csv") <(grep "^$bundle," "$found") >&2 ||
      { echo "$what draws other frames of $bundle than tests/golden/frames.csv" >&2 && exit 1; }
  done
  echo "$what: $(grep -c , "$found") frames as in tests/golden/frames.csv"
}

cargo clippy -q --all-targets --locked -- -D warnings
cargo test -q --locked

bundles=(static context matte isotropic)
flags=(-std=c11 -Wall -Wextra -Wpedantic -Werror -O1 -g -Iinclude)
cargo build -q --release --locked
cc "${flags[@]}" -pthread -fsanitize=address,undefined -fno-sanitize-recover=all c/test.c c/draw.c c/pieces.c "$out/release/libpocketsplat.a" -lm -o "$out/test"
arguments=()
for bundle in "${bundles[@]}"; do arguments+=("$bundle=$golden/$bundle.psb"); done
"$out/test" "${arguments[@]}" >"$out/host.csv"
compare "a C program with sanitisers" "$out/host.csv" "${bundles[@]}"

target=thumbv7em-none-eabihf
cargo build -q --release --locked --target $target
: >"$out/board.csv"
for bundle in "${bundles[@]}"; do
  arm-none-eabi-gcc "${flags[@]}" -mcpu=cortex-m4 -mfloat-abi=hard -mfpu=fpv4-sp-d16 -ffreestanding -nostdlib -ffunction-sections \
    -Wl,--gc-sections -Wl,-z,noexecstack "-DNAME=\"$bundle\"" "-DFILE=\"$golden/$bundle.psb\"" -Tc/mps2.ld c/mps2.c c/draw.c c/pieces.c \
    "$out/$target/release/libpocketsplat.a" -lgcc -o "$out/$bundle.elf"
  timeout 120 qemu-system-arm -M mps2-an386 -display none -monitor none -serial none -semihosting-config enable=on,target=native \
    -kernel "$out/$bundle.elf" </dev/null >>"$out/board.csv" 2>&1 || { cat "$out/board.csv" >&2 && exit 1; }
done
compare "a Cortex-M4 programmed in C" "$out/board.csv" "${bundles[@]}"

cargo build -q --release --locked --target riscv32imac-unknown-none-elf
echo "riscv32imac: libpocketsplat.a builds"
