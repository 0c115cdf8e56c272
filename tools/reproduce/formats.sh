#!/usr/bin/env bash
# One capture in several forms: explicit Gaussians as .ply, .spz and .sog, and the bundles of three backbones.
#
#   tools/reproduce/formats.sh CAPTURE OUT [OPTION of train…]
#
# Writes OUT/formats.csv and prints it. What is done is not done again, what was interrupted goes on. ITERATIONS (7000), SIZE (200, the
# longest side in pixels), SEED (42), LPIPS (a file of weights) and POCKETSPLAT (the program) are read from the environment.
set -euo pipefail
[ $# -ge 2 ] || { sed -n '1d;/^#/!q;s/^# \{0,1\}//p' "$0" >&2 && exit 2; }
capture=$1 out=$2
shift 2
program=${POCKETSPLAT:-pocketsplat}
mkdir -p "$out"
lpips=()
[ -z "${LPIPS:-}" ] || lpips=(--lpips-weights "$LPIPS")

# How photographs are prepared; a .ply, .spz or .sog does not say it.
prepared=(--max-resolution "${SIZE:-200}")
for ((i = 1; i <= $#; i++)); do
  case ${!i} in
    --background | --images | --model | --test-every) j=$((i + 1)) && prepared+=("${!i}" "${!j}") ;;
    --background=* | --images=* | --model=* | --test-every=*) prepared+=("${!i}") ;;
  esac
done

# On one background, or rows do not compare.
if [[ " ${prepared[*]}" != *" --background"* ]]; then
  prepared+=(--background black)
  set -- --background black "$@"
fi

trained() { # FILE OPTIONS…
  local file=$1 run=${1%.*}.run
  shift
  [ ! -f "$run/result.json" ] || return 0
  if [ -f "$run/config.toml" ]; then
    "$program" train --resume "$run" >/dev/null
  else
    "$program" train "$capture" -o "$file" --iterations "${ITERATIONS:-7000}" --max-resolution "${SIZE:-200}" --seed "${SEED:-42}" \
      --no-report "$@" >/dev/null
  fi
}

exported() { # FROM TO [CAPTURE]
  [ -f "$2" ] || "$program" export "$1" ${3:+"$3"} -o "$2" >/dev/null
}

trained "$out/3dgs.ply" --backbone 3dgs "$@"
effects=(--effects +view-colour)
trained "$out/scaffold.psb" --backbone scaffold --modules none "${effects[@]}" "$@"
trained "$out/hac.psb" --backbone hac --modules none --lambda 0.002 "${effects[@]}" "$@"
trained "$out/hac-modules.psb" --backbone hac --modules rdo-pruning --lambda 0.002 "${effects[@]}" "$@"
exported "$out/hac-modules.psb" "$out/hac-modules.ply" "$capture"
for name in 3dgs hac-modules; do
  for kind in spz sog; do exported "$out/$name.ply" "$out/$name.$kind"; done
done
for file in 3dgs.ply 3dgs.spz 3dgs.sog scaffold.psb hac.psb hac-modules.psb hac-modules.ply hac-modules.spz hac-modules.sog; do
  [ -f "$out/$file.json" ] || {
    "$program" eval "$out/$file" "$capture" "${prepared[@]}" --json "${lpips[@]}" >"$out/$file.part"
    mv "$out/$file.part" "$out/$file.json"
  }
done

python3 - "$out" <<'PYTHON'
import csv, json, pathlib, sys

out = pathlib.Path(sys.argv[1])
names = ["psnr_db", "ssim", "lpips", "bundle_bytes", "n_gaussians", "decode_s", "render_s_per_view"]
# An explicit Gaussian of degree 3 is 59 numbers of 32 bits in memory.
BYTES_OF_A_GAUSSIAN = 59 * 4
rows = []
for path in out.glob("*.json"):
    found = json.loads(path.read_text())
    ram_bytes = found["scratch_bytes"] or BYTES_OF_A_GAUSSIAN * found["n_gaussians"]
    rows.append({"file": path.stem, **{name: found.get(name, "") for name in names}, "ram_bytes": ram_bytes, "program": found["program"]})
whole = next(row["bundle_bytes"] for row in rows if row["file"] == "3dgs.ply")
for row in rows:
    row["times_smaller"] = round(whole / row["bundle_bytes"], 1)
rows.sort(key=lambda row: -row["bundle_bytes"])
with open(out / "formats.csv", "w", newline="") as file:
    table = csv.DictWriter(file, ["file", *names, "ram_bytes", "times_smaller", "program"])
    table.writeheader()
    table.writerows(rows)
print((out / "formats.csv").read_text(), end="")
PYTHON
