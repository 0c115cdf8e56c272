#!/usr/bin/env bash
# Compares the panic paths that the linker kept in a binary with the committed list, which may only shrink.
#
#   panics.sh LLVM_NM ELF
set -euo pipefail
nm=${1:?usage: panics.sh LLVM_NM ELF} elf=${2:?usage: panics.sh LLVM_NM ELF}
list=$(dirname "$0")/panic-symbols.txt

# The functions of `core` that end a program: panics, failed unwraps, slices and arithmetic out of bounds. The entry
# point must be there, else the binary was stripped and its silence proves nothing.
symbols=$("$nm" --demangle --defined-only --format=just-symbols "$elf")
grep -qx _start <<<"$symbols" || { echo "panics: $elf has no symbol _start: is it stripped?" >&2; exit 1; }
found=$(grep -E 'panic|unwrap_failed|expect_failed|_fail($|[^a-z])|rust_begin_unwind|alloc::' <<<"$symbols" |
  sed -E 's/::h[0-9a-f]{16}$//' | LC_ALL=C sort -u || true)
known=$(grep -vE '^(#|$)' "$list" | LC_ALL=C sort -u || true)

echo "panic paths linked into the decoder: $(grep -c . <<<"$found" || true)"
new=$(LC_ALL=C comm -23 <(echo "$found") <(echo "$known"))
gone=$(LC_ALL=C comm -13 <(echo "$found") <(echo "$known"))
if [ -n "$new" ]; then
  printf 'panics: not in %s:\n%s\n' "$list" "$new" >&2
  echo "panics: find the index, unwrap or arithmetic that reaches them, and make it an error" >&2
  exit 1
fi
if [ -n "$gone" ]; then
  printf 'panics: no longer reached, delete from %s:\n%s\n' "$list" "$gone" >&2
  exit 1
fi
