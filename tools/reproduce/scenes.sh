# Sourced by the scripts beside it: trains and measures scenes at several rates, and writes one line for each bundle.
#
# reproduce "SCENES" OPTIONS… -- DATA OUT [SCENE…]
#   OUT/SCENE-LAMBDA.psb, its run folder and its figures as JSON; OUT/results.csv. What is done is not done again, what was
#   interrupted goes on; other settings need another OUT. LAMBDAS ("0.004 0.002 0.001 0.0005"), BACKBONE (hac), MODULES (rdo-pruning), SEED (42), LPIPS (a file of
#   weights) and POCKETSPLAT (the program) are read from the environment.
set -euo pipefail

reproduce() {
  local scenes=$1 options=() data out scene lambda run lpips=() rates=${LAMBDAS:-0.004 0.002 0.001 0.0005} rate settings
  shift
  while [ "$1" != -- ]; do options+=("$1") && shift; done
  shift
  # Without both, the head of the script says how it is called.
  [ $# -ge 2 ] || { sed -n '1d;/^# shellcheck/d;s/^# \{0,1\}//p' "$0" >&2 && exit 2; }
  data=$1 out=$2
  shift 2
  scenes=${*:-$scenes}
  mkdir -p "$out"
  [ "${BACKBONE:-hac}" != scaffold ] || rates=0
  [ -z "${LPIPS:-}" ] || lpips=(--lpips-weights "$LPIPS")
  settings="${BACKBONE:-hac} ${MODULES:-} seed ${SEED:-42} ${options[*]}"
  [ ! -f "$out/settings" ] || [ "$(cat "$out/settings")" = "$settings" ] ||
    { echo "$out holds runs of: $(cat "$out/settings"); asked for: $settings; choose another OUT" >&2 && exit 1; }
  echo "$settings" >"$out/settings"
  # As in the names of files: 0.001, not 1e-3.
  rates=$(python3 -c 'import sys; print(*(f"{float(x):.10f}".rstrip("0").rstrip(".") for x in sys.argv[1:]))' $rates)
  for scene in $scenes; do
    for lambda in $rates; do
      rate=(--modules "${MODULES:-rdo-pruning}" --lambda "$lambda")
      # It has no bits to weigh.
      [ "${BACKBONE:-hac}" != scaffold ] || rate=(--modules "${MODULES:-none}")
      run=$out/${scene//\//_}-$lambda
      if [ ! -f "$run.run/result.json" ]; then
        if [ -f "$run.run/config.toml" ]; then
          "${POCKETSPLAT:-pocketsplat}" train --resume "$run.run" >/dev/null
        else
          "${POCKETSPLAT:-pocketsplat}" train "$data/$scene" -o "$run.psb" --preset full \
            --backbone "${BACKBONE:-hac}" "${rate[@]}" --seed "${SEED:-42}" --effects +view-colour "${options[@]}" >/dev/null
        fi
      fi
      [ -f "$run.json" ] && { [ -z "${LPIPS:-}" ] || grep -q '"lpips"' "$run.json"; } ||
        "${POCKETSPLAT:-pocketsplat}" eval "$run.psb" "$data/$scene" --json "${lpips[@]}" >"$run.json.part"
      [ ! -f "$run.json.part" ] || mv "$run.json.part" "$run.json"
    done
  done
  summarise "$out"
}

# One line for each bundle, and the mean of the scenes at each rate.
summarise() {
  python3 - "$1" <<'PYTHON'
import csv, json, pathlib, sys

out = pathlib.Path(sys.argv[1])
names = ["scene", "lambda", "psnr_db", "ssim", "lpips", "bundle_bytes", "n_views", "width_px", "height_px", "background", "program"]
rows = []
for path in sorted(out.glob("*.json")):
    figures = json.loads(path.read_text())
    scene, rate = path.stem.rsplit("-", 1)
    rows.append({"scene": scene, "lambda": rate, **{name: figures.get(name, "") for name in names[2:]}})
for rate in sorted({row["lambda"] for row in rows}, key=float):
    of_rate = [row for row in rows if row["lambda"] == rate]
    measured = [name for name in ["psnr_db", "ssim", "lpips", "bundle_bytes"] if all(row[name] != "" for row in of_rate)]
    mean = {name: sum(float(row[name]) for row in of_rate) / len(of_rate) for name in measured}
    rows.append({"scene": f"mean of {len(of_rate)}", "lambda": rate, **mean})
with open(out / "results.csv", "w", newline="") as file:
    table = csv.DictWriter(file, names)
    table.writeheader()
    table.writerows(rows)
print(out / "results.csv")
PYTHON
}
