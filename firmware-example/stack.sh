#!/usr/bin/env bash
# Prints the stack that each call of the decoder takes on an emulated Cortex-M4, built in several ways, as rows of CSV.
#
#   stack.sh BUNDLE…
set -euo pipefail
[ $# -gt 0 ] || { echo "usage: stack.sh BUNDLE…" >&2 && exit 1; }
bundles=$(realpath "$@")
export BOARD=mps2-an386 RAM_KIB=512 STACK_KIB=64
cd "$(dirname "$0")"
target=$(realpath -m "${CARGO_TARGET_DIR:-target}")
processor=thumbv7em-none-eabihf

# Rows of all bundles. Without `--locked` nothing would say that the lock file is old.
rows() { # NAME PROFILE CARGO_ARGUMENTS…
  local name=$1 folder=$2 bundle
  shift 2
  for bundle in $bundles; do
    PSB_BUNDLE=$bundle cargo build -q --bin stack --locked --target $processor --target-dir "$target" "$@" >&2
    ./qemu.sh "$target/$processor/$folder/stack" >"$target/stack.log" || { cat "$target/stack.log" >&2 && exit 1; }
    sed -n "s/.*stack of \(.*\): \([0-9]*\)$/$name,$(basename "$bundle" .psb),\1,\2/p" "$target/stack.log"
  done
}

echo profile,bundle,call,bytes
for level in 3 s z; do
  export CARGO_PROFILE_RELEASE_OPT_LEVEL=$level
  rows "opt-level $level with LTO" release --release
  CARGO_PROFILE_RELEASE_LTO=off CARGO_PROFILE_RELEASE_CODEGEN_UNITS=16 rows "opt-level $level" release --release
done
export CARGO_PROFILE_DEV_OPT_LEVEL=0
rows "dev" debug
rows "dev with dependencies at s" debug --config 'profile.dev.package."*".opt-level="s"'
CARGO_PROFILE_DEV_OPT_LEVEL=1 rows "dev at 1" debug
CARGO_PROFILE_DEV_OPT_LEVEL=s rows "dev at s" debug
