# Sourced by the scripts beside it: trains and measures scenes at several rates, and writes one line for each bundle.
#
# run_scenes OUT "SCENES" FOLDER_OF_SCENE OPTIONS…
#   OUT/SCENE-LAMBDA.psb, its run folder and its figures as JSON; OUT/results.csv. What is done is not done again, what was
#   interrupted goes on. LAMBDAS ("0.004 0.002 0.001 0.0005"), BACKBONE (hac), MODULES (rdo-pruning), SEED (42), LPIPS (a file of
#   weights) and POCKETSPLAT (the program) are read from the environment.
set -euo pipefail

run_scenes() {
  local out=$1 scenes=$2 folder_of=$3 scene lambda bundle lpips=() rates=${LAMBDAS:-0.004 0.002 0.001 0.0005} rate
  shift 3
  mkdir -p "$out"
  [ "${BACKBONE:-hac}" != scaffold ] || rates=0
  [ -z "${LPIPS:-}" ] || lpips=(--lpips-weights "$LPIPS")
  for scene in $scenes; do
    for lambda in $rates; do
      rate=(--modules "${MODULES:-rdo-pruning}" --lambda "$lambda")
      # It has no bits to weigh.
      [ "${BACKBONE:-hac}" != scaffold ] || rate=(--modules "${MODULES:-none}")
      bundle=$out/${scene//\//_}-$lambda.psb
      if [ ! -f "$out/${scene//\//_}-$lambda.run/result.json" ]; then
        if [ -f "$out/${scene//\//_}-$lambda.run/config.toml" ]; then
          "${POCKETSPLAT:-pocketsplat}" train --resume "$out/${scene//\//_}-$lambda.run" >/dev/null
        else
          "${POCKETSPLAT:-pocketsplat}" train "$("$folder_of" "$scene")" -o "$bundle" --preset full \
            --backbone "${BACKBONE:-hac}" "${rate[@]}" --seed "${SEED:-42}" --effects +view-colour "$@" >/dev/null
        fi
      fi
      [ -f "$out/${scene//\//_}-$lambda.json" ] ||
        "${POCKETSPLAT:-pocketsplat}" eval "$bundle" "$("$folder_of" "$scene")" --json "${lpips[@]}" >"$out/${scene//\//_}-$lambda.json.part"
      [ ! -f "$out/${scene//\//_}-$lambda.json.part" ] || mv "$out/${scene//\//_}-$lambda.json.part" "$out/${scene//\//_}-$lambda.json"
    done
  done
  summarise "$out"
}

# One line for each bundle, and the mean of the scenes at each rate.
summarise() {
  python3 - "$1" <<'PYTHON'
import csv, json, pathlib, sys

out = pathlib.Path(sys.argv[1])
names = ["scene", "lambda", "psnr_db", "ssim", "lpips", "bundle_bytes", "n_views", "width_px", "height_px", "background"]
rows = []
for path in sorted(out.glob("*.json")):
    figures = json.loads(path.read_text())
    scene, rate = path.stem.rsplit("-", 1)
    rows.append({"scene": scene, "lambda": rate, **{name: figures.get(name, "") for name in names[2:]}})
for rate in sorted({row["lambda"] for row in rows}, key=float):
    of_rate = [row for row in rows if row["lambda"] == rate]
    mean = {name: sum(float(row[name]) for row in of_rate) / len(of_rate) for name in ["psnr_db", "ssim", "bundle_bytes"]}
    rows.append({"scene": f"mean of {len(of_rate)}", "lambda": rate, **mean})
with open(out / "results.csv", "w", newline="") as file:
    table = csv.DictWriter(file, names)
    table.writeheader()
    table.writerows(rows)
print(out / "results.csv")
PYTHON
}
