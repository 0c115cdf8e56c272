#!/usr/bin/env bash
# Whether scenes fill the memory, or the number of bytes, that they are trained for.
#
#   tools/reproduce/budgets.sh ram|bytes OUT CAPTURE…
#
# Trains every capture for 20 amounts of memory, or for 10 lengths of the bundle and 5 weights of the bits to compare with. Writes
# OUT/budgets_ram.csv or OUT/budgets_bytes.csv and prints it. What is done is not done again. ITERATIONS (1500), SIZE (100, the longest
# side in pixels), SEED (42) and POCKETSPLAT (the program) are read from the environment.
set -euo pipefail
[ $# -ge 3 ] || { sed -n '1d;/^#/!q;s/^# \{0,1\}//p' "$0" >&2 && exit 2; }
what=$1 out=$2
shift 2
program=${POCKETSPLAT:-pocketsplat}
mkdir -p "$out"
ram_kib="48 56 64 72 80 96 112 128 144 160 176 192 208 224 240 256 288 320 384 512"
kilobytes="15 20 25 30 40 50 60 75 90 110"
lambdas="0.0005 0.001 0.002 0.004 0.008"
effects=view-colour,view-geometry,anisotropy

trained() { # CAPTURE NAME OPTIONS…
  local capture=$1 name=$2
  shift 2
  [ ! -f "$out/$name.json" ] || return 0
  if "$program" train "$capture" -o "$out/$name.psb" --run "$out/$name.run" --overwrite --iterations "${ITERATIONS:-1500}" \
    --max-resolution "${SIZE:-100}" --seed "${SEED:-42}" --effects "$effects" --no-report --json "$@" \
    >"$out/$name.part" 2>"$out/$name.log"; then
    mv "$out/$name.part" "$out/$name.json"
  else
    tail -1 "$out/$name.log" >&2
  fi
  rm -rf "$out/$name.run"
}

for capture in "$@"; do
  scene=$(basename "$capture")
  case $what in
    ram) for kib in $ram_kib; do trained "$capture" "ram-$scene-$kib" --ram "${kib}KiB"; done ;;
    bytes)
      for kilo in $kilobytes; do trained "$capture" "bytes-$scene-$kilo" --bytes "${kilo}kB"; done
      for lambda in $lambdas; do trained "$capture" "lambda-$scene-$lambda" --lambda "$lambda"; done
      ;;
    *) echo "ram or bytes, not $what" >&2 && exit 2 ;;
  esac
done

python3 - "$out" "$what" <<'PYTHON'
import csv, json, math, pathlib, sys

out, what = pathlib.Path(sys.argv[1]), sys.argv[2]
found = {path.stem: json.loads(path.read_text()) for path in out.glob("*.json")}


def runs(kind):
    """(scene, number) → result, of the runs of one kind."""
    names = (name.split("-") for name in found if name.startswith(f"{kind}-"))
    return {("-".join(parts[1:-1]), float(parts[-1])): found["-".join(parts)] for parts in names}


def on_curve(scene, n_bytes):
    """PSNR of the runs at fixed λ, on straight lines over the logarithm of their bytes; none beyond their ends."""
    curve = sorted((run["bundle_bytes"], run["psnr_db"]) for (of, _), run in runs("lambda").items() if of == scene)
    for (low, psnr_low), (high, psnr_high) in zip(curve, curve[1:]):
        if low <= n_bytes <= high:
            return psnr_low + (psnr_high - psnr_low) * math.log(n_bytes / low) / math.log(high / low)
    return None


rows = []
for (scene, number), run in sorted(runs(what).items()):
    limit = int(number * (1024 if what == "ram" else 1000))
    used = run["scratch_bytes"] if what == "ram" else run["bundle_bytes"]
    row = {"capture": scene, "limit_bytes": limit, "used_bytes": used, "share": round(used / limit, 4)}
    row |= {"psnr_db": round(run["psnr_db"], 3), "n_valid_anchors": run["n_valid_anchors"], "bundle_bytes": run["bundle_bytes"]}
    if what == "bytes":
        at = on_curve(scene, used)
        row["above_curve_db"] = "" if at is None else round(run["psnr_db"] - at, 3)
    rows.append(row)
with open(out / f"budgets_{what}.csv", "w", newline="") as file:
    table = csv.DictWriter(file, list(rows[0]))
    table.writeheader()
    table.writerows(rows)
shares = sorted(row["share"] for row in rows)
fitting, median = sum(share <= 1.0 for share in shares), shares[len(shares) // 2]
print((out / f"budgets_{what}.csv").read_text(), end="")
print(f"{fitting} of {len(rows)} fit; share used: least {shares[0]:.3f}, median {median:.3f}, most {shares[-1]:.3f}")
PYTHON
