#!/usr/bin/env bash
# Tanks & Temples and Deep Blending as 3DGS publishes them: every 8th view held out.
#
#   tools/reproduce/tanks_and_temples.sh DATA OUT [SCENE…]
#
# DATA: the folders of tandt_db, as the authors of 3DGS publish them (tandt/train, tandt/truck, db/drjohnson, db/playroom)
# Images are smaller than 1,600 px.
# shellcheck source=tools/reproduce/scenes.sh
source "$(dirname "$0")/scenes.sh"
reproduce "tandt/train tandt/truck db/drjohnson db/playroom" --images images --max-resolution 1600 -- "$@"
