#!/usr/bin/env bash
# Synthetic-NeRF as published: 800×800, all 200 test views, on black.
#
#   tools/reproduce/synthetic_nerf.sh DATA OUT [SCENE…]
#
# DATA: the folder nerf_synthetic, as its authors publish it
# Training starts from random points, as published.
# The field publishes figures on black, as HAC and Scaffold-GS do, or on white, as 3DGS does: BACKGROUND=white.
# shellcheck source=tools/reproduce/scenes.sh
source "$(dirname "$0")/scenes.sh"
reproduce "chair drums ficus hotdog lego materials mic ship" --background "${BACKGROUND:-black}" --points random -- "$@"
