#!/bin/sh
# The study by GNU parallel, which knows runs by their numbers only: run.sh [FOLDER FOR THE RESULTS].
# It may be stopped at any time, and goes on with what is not done; --sshlogin spreads it over machines.
set -eu
here=$(dirname "$0")
out=${1:-results/study_parallel}
pilum study "$here" --out "$out" --plan
runs=$(($(wc -l < "$out/runs.csv") - 1))
seq "$runs" | parallel --jobs 2 --halt never pilum study "$here" --out "$out" --run {}
pilum table "$out" --out "$out/table.csv"
pilum report "$out"
