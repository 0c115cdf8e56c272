#!/usr/bin/env bash
# A plan of 12 runs gives the same tables, byte for byte, whenever everything is killed on the way, and trains nothing twice.
#
#   tests/many-runs/test.sh PROGRAM OUT [KILLS]
#
# PROGRAM is pocketsplat, OUT a folder for everything, KILLS how many times everything is killed under each executor (1).
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
[ $# -ge 2 ] || { sed -n '1d;/^#/!q;s/^# \{0,1\}//p' "$0" >&2 && exit 2; }
program=$(realpath "$1") out=$2 kills=${3:-1}
mkdir -p "$out"
out=$(realpath "$out")

fail() {
  echo "many-runs: $*" >&2
  exit 1
}

venv=$out/venv
[ -x "$venv/bin/snakemake" ] || {
  python3 -m venv "$venv"
  "$venv/bin/pip" install -q --disable-pip-version-check -r "$here/requirements.txt"
}
snakemake() { # FOLDER OPTIONS…
  (cd "$1" && exec "$venv/bin/snakemake" "${@:2}")
}
local_executor=(--cores 2)
queue=(--executor cluster-generic --cluster-generic-submit-cmd "$here/submit.sh" --jobs 2 --latency-wait 20 --seconds-between-status-checks 1)

[ -d "$out/capture" ] || "$program" synth "$out/capture" --size 32 --train-views 6 --test-views 3
cat >"$out/plan.toml" <<'TOML'
[captures.Synthetic]
lamp = "capture"

[options]
iterations = 120
feature-dim = 8
offsets = 3
checkpoint-every = 20

[vary]
backbone = ["hac", "hac-plus"]
lambda = [0.002, 0.001, 0.0005]
seed = [1, 2]
TOML

plan() { # FOLDER
  rm -rf "$1"
  "$program" --threads 1 plan-runs "$out/plan.toml" -o "$1" >/dev/null 2>"$out/plan.log" || fail "$(cat "$out/plan.log")"
}

plan "$out/whole"
started=$SECONDS
snakemake "$out/whole" "${local_executor[@]}" >"$out/whole.log" 2>&1 || fail "a plan that nobody disturbs fails: $(tail -30 "$out/whole.log")"
whole_s=$((SECONDS - started))
[ "$(wc -l <"$out/whole/tables/runs.csv")" -eq 13 ] || fail "runs.csv has $(wc -l <"$out/whole/tables/runs.csv") lines, needs 13"
[ "$(find "$out/whole/lamp" -name '*.html' | wc -l)" -eq 12 ] || fail "not every run has its page"
# Byte for byte what one command after another makes, without the engine.
bundle=$out/alone.psb
"$program" train "$out/capture" -o "$bundle" --overwrite --iterations 120 --feature-dim 8 --offsets 3 --backbone hac-plus --lambda 0.0005 \
  --seed 2 --no-report >"$out/alone.log" 2>&1 || fail "$(cat "$out/alone.log")"
cmp "$bundle" "$out/whole/lamp/hac-plus-lambda-0.0005-seed-2.psb" || fail "a run of the plan is not the run that train makes"

# The finished runs of a folder, each with the time of its bundle.
finished() { # FOLDER
  find "$1" -name result.json -printf '%h\n' | sort | while read -r run; do
    [ ! -f "${run%.run}.psb" ] || stat -c '%n %y' "${run%.run}.psb"
  done
}

# Kills a session. A process may start another one while pkill looks at them: again, until none is alive. Returns how the first ended.
kill_session() { # PID
  local status=0
  # Bash would say that it was killed.
  { while pkill -KILL -s "$1" --runstates D,R,S,T; do sleep 0.05; done; wait "$1" || status=$?; } 2>/dev/null
  return $status
}

# The rest of this test shows nothing where the kill does nothing.
(exec setsid sleep 60) &
sleeper=$! status=0
sleep 0.5
kill_session "$sleeper" || status=$?
[ "$status" -eq 137 ] || fail "a killed session ended with status $status, needs 137: does pkill know --runstates?"

killed() { # NAME OPTIONS…
  local name=$1 folder=$out/killed pid after status=0
  shift
  plan "$folder"
  after=$((RANDOM % (whole_s + 1))).$((RANDOM % 10))
  # A session of its own, so that everything in it can be killed at once.
  (cd "$folder" && exec setsid "$venv/bin/snakemake" "$@" >"$out/killed.log" 2>&1) &
  pid=$!
  sleep "$after"
  kill_session "$pid" || status=$?
  # It may have ended before.
  [ "$status" -eq 137 ] || [ "$status" -eq 0 ] || fail "$name ended with status $status: $(tail -n 30 "$out/killed.log")"
  finished "$folder" >"$out/finished"
  snakemake "$folder" "$@" >"$out/again.log" 2>&1 || fail "$name, killed after $after s, does not go on: $(tail -n 30 "$out/again.log" "$folder"/lamp/*.log)"
  finished "$folder" >"$out/finished-again"
  while read -r line; do
    grep -qxF "$line" "$out/finished-again" || fail "$name, killed after $after s, trained a finished run again: $line"
  done <"$out/finished"
  diff -r "$out/whole/tables" "$folder/tables" || fail "$name, killed after $after s, ends in other tables"
  echo "$name: killed after $after s with $(wc -l <"$out/finished") of 12 runs finished; the same tables, nothing trained twice"
}

for ((i = 0; i < kills; i++)); do
  killed "this machine" "${local_executor[@]}"
  killed "a queue" "${queue[@]}"
done

# One command without the engine ends in the same tables.
rm -rf "$out/here"
"$program" --threads 1 plan-runs "$out/plan.toml" -o "$out/here" --run >"$out/here.log" 2>&1 || fail "$(tail -30 "$out/here.log")"
diff -r "$out/whole/tables" "$out/here/tables" || fail "plan-runs --run and the workflow differ"
echo "plan-runs --run: the same tables as the workflow's"
