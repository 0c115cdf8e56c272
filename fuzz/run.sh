#!/usr/bin/env bash
# Runs a fuzz target from the bundles of the conformance pack and earlier finds, or again on one file that it found.
#
#   run.sh TARGET SECONDS
#   run.sh TARGET FILE
set -euo pipefail
fuzz=$(cd "$(dirname "$0")" && pwd)
target=${1:?usage: run.sh TARGET SECONDS|FILE} what=${2:?usage: run.sh TARGET SECONDS|FILE}
[ ! -f "$what" ] || what=$(realpath "$what")
out=${CARGO_TARGET_DIR:-$fuzz/../target}/fuzz
mkdir -p "$out/corpus/$target"
out=$(cd "$out" && pwd)
# Comparisons and counters of edges for libFuzzer, as cargo-fuzz asks for them.
flags=(-Zsanitizer=address -Cpasses=sancov-module --cfg fuzzing)
for flag in level=4 inline-8bit-counters pc-table trace-compares; do flags+=("-Cllvm-args=-sanitizer-coverage-$flag"); done
# With a target of its own, so that build scripts and macros get none of it.
host=$(rustc +nightly --print host-tuple)
cd "$fuzz"
RUSTFLAGS="${flags[*]}" cargo +nightly build -q --release --locked --bin "$target" --target "$host" --target-dir "$out"
program=$out/$host/release/$target
# A Gaussian's words are short, and no seed is some.
case $target in normal) options=(-max_len=128) seeds=() ;; *) options=(-max_len=8192) seeds=(../tests/pack/bundles ../tests/pack/refused finds) ;; esac
if [ -f "$what" ]; then
  exec "$program" "$what"
fi
"$program" "${options[@]}" -max_total_time="$what" -timeout=20 -print_final_stats=1 -artifact_prefix="$out/$target-" "$out/corpus/$target" "${seeds[@]}" \
  >"$out/$target.log" 2>&1 || {
  grep -A2 "panicked at\|ERROR:" "$out/$target.log" >&2 || tail -3 "$out/$target.log" >&2
  file=$(ls -t "$out/$target"-{crash,timeout,oom,leak}-* 2>/dev/null | head -1) || true
  echo "$target: a law does not hold for ${file:-(no file: $out/$target.log)}; again: fuzz/run.sh $target ${file:-FILE}" >&2
  exit 1
}
echo "$target: $(sed -n 's/^stat::number_of_executed_units: //p' "$out/$target.log") executions in $what s, no finding"
