#!/usr/bin/env bash
# Mip-NeRF 360 as published: images at most 1,600 px wide, every 8th view held out.
#
#   tools/reproduce/mip_nerf_360.sh DATA OUT [SCENE…]
#
# DATA: the folder 360_v2, as its authors publish it
# The images of all nine scenes are wider than high, so that the longest side is the width.
# shellcheck source=tools/reproduce/scenes.sh
source "$(dirname "$0")/scenes.sh"
reproduce "bicycle bonsai counter flowers garden kitchen room stump treehill" --images images --max-resolution 1600 -- "$@"
