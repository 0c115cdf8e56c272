#!/usr/bin/env bash
# Runs a firmware image on the emulated BOARD and prints its decoded log; ends with the firmware's exit code.
# The firmware writes its files into the current folder. Instructions are counted: QEMU takes one nanosecond for each.
set -euo pipefail
elf=${1:?usage: qemu.sh ELF}

case ${BOARD:-} in
virt | virt-fpu) qemu=(qemu-system-riscv32 -M virt -bios none) ;;
# Its first core has neither FPU nor the instructions for 16 bits unless asked for.
mps2-an521) qemu=(qemu-system-arm -M "$BOARD" -global sse-200.CPU0_FPU=on -global sse-200.CPU0_DSP=on) ;;
mps2-*) qemu=(qemu-system-arm -M "$BOARD") ;;
'') case $elf in
  *riscv32*) qemu=(qemu-system-riscv32 -M virt -bios none) ;;
  *) qemu=(qemu-system-arm -M mps2-an386) ;;
  esac ;;
*) echo "qemu.sh: BOARD=$BOARD is none of mps2-an385, mps2-an386, mps2-an500, mps2-an521, virt, virt-fpu" >&2 && exit 2 ;;
esac
read -ra more <<<"${QEMU_ARGS:-}"
# QEMU waits for ever on a firmware that hangs.
timeout "${QEMU_TIMEOUT_S:-300}" "${qemu[@]}" "${more[@]}" -icount shift=0 -display none -monitor none -serial none \
  -semihosting-config enable=on,target=native -kernel "$elf" </dev/null | defmt-print -e "$elf"
