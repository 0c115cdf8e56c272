#!/usr/bin/env bash
# Compares two tables of instructions row by row: counts within 1 %, no row more, none fewer. The clock of a Cortex-M board moves once
# in 40 instructions, so that a stage of a thousand, read a few times, is known to four ticks: frames of the same work differ by three.
#
#   compare.sh KNOWN.csv MEASURED.csv
set -euo pipefail
known=${1:?usage: compare.sh KNOWN MEASURED} measured=${2:?usage: compare.sh KNOWN MEASURED}

awk -F, -v known_file="$known" '
  { key = $0; sub(/,[^,]*$/, "", key) }
  FILENAME == known_file { known[key] = $NF; next }
  FNR == 1 { next }
  !(key in known) { print "compare: not in " known_file ": " $0; bad = 1; next }
  {
    difference = $NF - known[key]
    if (difference < 0) difference = -difference
    if (difference > 160 && 100 * difference > known[key]) { print "compare: " key " took " $NF " instructions, known are " known[key]; bad = 1 }
    delete known[key]
    n++
  }
  END {
    for (key in known) if (key !~ /^board,/) { print "compare: not measured: " key; bad = 1 }
    if (!bad) print "compare: " n " rows within 1 %, or 160 instructions"
    exit bad
  }' "$known" "$measured"
