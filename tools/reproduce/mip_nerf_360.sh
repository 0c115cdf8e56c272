#!/usr/bin/env bash
# Mip-NeRF 360 as published: images at most 1,600 px wide, every 8th view held out.
#
#   tools/reproduce/mip_nerf_360.sh DATA OUT [SCENE…]
#
# DATA: the folder 360_v2, as its authors publish it
# The images of all nine scenes are wider than high, so that the longest side is the width.
source "$(dirname "$0")/scenes.sh"
[ $# -ge 2 ] || { sed -n 's/^# \{0,1\}//p' "$0" | sed 1d >&2; exit 2; }
data=$1 out=$2
shift 2
folder() { echo "$data/$1"; }
run_scenes "$out" "${*:-bicycle bonsai counter flowers garden kitchen room stump treehill}" folder --images images --max-resolution 1600
