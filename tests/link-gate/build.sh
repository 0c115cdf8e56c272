#!/usr/bin/env bash
# Links the decoder for each row of sizes.csv, and holds what the linker kept against the list of panics and against the
# limits of the row, bytes.
#
#   build.sh LLVM_TOOLS_FOLDER TARGET_FOLDER
set -euo pipefail
cd "$(dirname "$0")"
tools=${1:?usage: build.sh LLVM_TOOLS_FOLDER TARGET_FOLDER} target=${2:?usage: build.sh LLVM_TOOLS_FOLDER TARGET_FOLDER}
elf=$target/thumbv7em-none-eabihf/release/link-gate

bytes_of() { # SECTION
  "$tools/llvm-size" -A "$elf" | awk -v section="$1" '$1 == section { print $2 }'
}

status=0
while IFS=, read -r features opt_level most_text most_tables; do
  CARGO_PROFILE_RELEASE_OPT_LEVEL=$opt_level \
    cargo build -q --release --locked --target-dir "$target" --features "${features/none/}" </dev/null
  text=$(bytes_of .text) tables=$(bytes_of .rodata)
  echo "features $features, opt-level $opt_level: $text bytes of text, $tables of tables and messages"
  if [ "$text" -gt "$most_text" ] || [ "$tables" -gt "$most_tables" ]; then
    echo "link-gate: sizes.csv allows $most_text and $most_tables" >&2
    status=1
  fi
  ./panics.sh "$tools/llvm-nm" "$elf" || status=1
done < <(sed 1d sizes.csv)
exit $status
