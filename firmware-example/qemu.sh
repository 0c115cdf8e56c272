#!/usr/bin/env bash
# Runs a firmware image on QEMU's Cortex-M4 and prints its decoded log; ends with the firmware's exit code.
# The firmware writes frame.ppm into the current folder.
set -euo pipefail
elf=${1:?usage: qemu.sh ELF}

# QEMU waits for ever on a firmware that hangs.
timeout "${QEMU_TIMEOUT_S:-300}" qemu-system-arm -M mps2-an386 -display none -monitor none -serial none \
  -semihosting-config enable=on,target=native -kernel "$elf" </dev/null | defmt-print -e "$elf"
