#!/usr/bin/env bash
# Links the decoder for each row of sizes.csv, and holds what the linker kept against the list of panics and against the
# sizes of the row, bytes: at most 1 % above, as the path of a working tree alone moves them by a few bytes.
#
#   build.sh LLVM_TOOLS_FOLDER TARGET_FOLDER [bless]    bless: writes the sizes instead
set -euo pipefail
cd "$(dirname "$0")"
usage="usage: build.sh LLVM_TOOLS_FOLDER TARGET_FOLDER [bless]"
tools=${1:?$usage} target=${2:?$usage} bless=${3:-}
elf=$target/thumbv7em-none-eabihf/release/link-gate

bytes_of() { # SECTION
  "$tools/llvm-size" -A "$elf" | awk -v section="$1" '$1 == section { print $2 }'
}

holds() { # NAME FOUND EXPECTED
  [ -n "$bless" ] || [ $((100 * $2)) -le $((101 * $3)) ] || {
    echo "link-gate: $2 bytes of $1, over 1 % more than the $3 of sizes.csv; if that is meant, run" \
      "\`tools/ci.sh bless-link-gate\` and commit its table" >&2
    status=1
  }
}

status=0
measured=$(head -1 sizes.csv)
while IFS=, read -r features opt_level expected_text expected_tables; do
  CARGO_PROFILE_RELEASE_OPT_LEVEL=$opt_level \
    cargo build -q --release --locked --target-dir "$target" --features "${features/none/}" </dev/null
  text=$(bytes_of .text) tables=$(bytes_of .rodata)
  echo "features $features, opt-level $opt_level: $text bytes of text, $tables of tables and messages"
  holds text "$text" "$expected_text"
  holds "tables and messages" "$tables" "$expected_tables"
  ./panics.sh "$tools/llvm-nm" "$elf" || status=1
  measured+=$'\n'$features,$opt_level,$text,$tables
done < <(sed 1d sizes.csv)
[ -z "$bless" ] || echo "$measured" >sizes.csv
exit $status
