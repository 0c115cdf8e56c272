#!/usr/bin/env bash
# Tanks & Temples and Deep Blending as 3DGS publishes them: every 8th view held out.
#
#   tools/reproduce/tanks_and_temples.sh DATA OUT [SCENE…]
#
# DATA: the folders of tandt_db, as the authors of 3DGS publish them (tandt/train, tandt/truck, db/drjohnson, db/playroom)
# Images are smaller than 1,600 px.
source "$(dirname "$0")/scenes.sh"
[ $# -ge 2 ] || { sed -n 's/^# \{0,1\}//p' "$0" | sed 1d >&2; exit 2; }
data=$1 out=$2
shift 2
folder() { echo "$data/$1"; }
run_scenes "$out" "${*:-tandt/train tandt/truck db/drjohnson db/playroom}" folder --images images --max-resolution 1600
