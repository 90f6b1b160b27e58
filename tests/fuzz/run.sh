#!/bin/sh
# Fuzzes what reads files and libraries of others: every target for so many seconds (5), or one of
# them.
#
#   tests/fuzz/run.sh [SECONDS [TARGET [LIBFUZZER OPTION …]]]
#   tests/fuzz/run.sh 0 case FILE        a finding again
#
# Findings stand in target/fuzz/findings, new inputs in target/fuzz/corpus; the committed corpus is
# read and never changed. Exit code 1 if there are findings.
set -eu
cd "$(dirname "$0")/../.."
seconds=${1:-5}
targets=${2:-case driver incremental lock sidecar capsule description library}
[ $# -gt 2 ] && shift 2 || set --

export RUSTC_WORKSPACE_WRAPPER="$PWD/tests/fuzz/instrument.sh"
cargo build --quiet --release -p fuzz --features libfuzzer
unset RUSTC_WORKSPACE_WRAPPER
laws=target/release/deps
[ -e $laws/libelastic.so ] || cargo build --quiet --release -p elastic -p coulomb_joint -p mepi
# Laws are looked for beside the program: these, and nothing else that lies in a folder of cargo's.
folder=target/fuzz
mkdir -p $folder/bin $folder/findings
cp target/release/fuzz $folder/bin/
for law in elastic coulomb_joint mepi; do cp $laws/lib$law.so $folder/bin/; done

limits="-timeout=10 -rss_limit_mb=2048 -malloc_limit_mb=512"
if [ $# -gt 0 ] && [ -f "$1" ]; then
  PILUM_FUZZ=$targets NO_COLOR=1 exec $folder/bin/fuzz $limits "$@"
fi
bad=0
total=0
for target in $targets; do
  mkdir -p "$folder/corpus/$target"
  log=$folder/$target.log
  status=0
  PILUM_FUZZ=$target NO_COLOR=1 $folder/bin/fuzz $limits -max_total_time="$seconds" -seed=1 \
    -max_len=8192 -artifact_prefix="$folder/findings/$target-" -dict=tests/fuzz/words.dict \
    -print_final_stats=1 "$@" "$folder/corpus/$target" "tests/fuzz/corpus/$target" \
    >"$log" 2>&1 </dev/null || status=$?
  runs=$(sed -n 's/^stat::number_of_executed_units: *//p' "$log")
  peak=$(sed -n 's/^stat::peak_rss_mb: *//p' "$log")
  edges=$(sed -n 's/.* cov: \([0-9]*\).*/\1/p' "$log" | tail -1)
  printf '%-12s %8s executions, %6s edges, %4s inputs, peak %s MB%s\n' "$target" "${runs:-?}" \
    "${edges:-?}" "$(ls "tests/fuzz/corpus/$target" | wc -l)" "${peak:-?}" \
    "$([ $status -eq 0 ] || echo ": FOUND SOMETHING, see $log")"
  total=$((total + ${runs:-0}))
  [ $status -eq 0 ] || bad=$((bad + 1))
done
echo "$total executions, findings in $bad targets"
[ $bad -eq 0 ]
