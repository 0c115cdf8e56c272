#!/usr/bin/env bash
# Synthetic-NeRF as published: 800×800, all 200 test views, on black.
#
#   tools/reproduce/synthetic_nerf.sh DATA OUT [SCENE…]
#
# DATA: the folder nerf_synthetic, as its authors publish it
# The field publishes figures on black, as HAC and Scaffold-GS do, or on white, as 3DGS does: BACKGROUND=white.
source "$(dirname "$0")/scenes.sh"
[ $# -ge 2 ] || { sed -n 's/^# \{0,1\}//p' "$0" | sed 1d >&2; exit 2; }
data=$1 out=$2
shift 2
folder() { echo "$data/$1"; }
run_scenes "$out" "${*:-chair drums ficus hotdog lego materials mic ship}" folder --background "${BACKGROUND:-black}"
