#!/bin/sh
# Fuzzes what reads files and libraries of others: every target for so many seconds (5), or one.
#
#   tests/fuzz/run.sh [SECONDS [TARGET [LIBFUZZER OPTION …]]]
#   tests/fuzz/run.sh 0 TARGET FILE        one input again
#   SANITIZE=1 tests/fuzz/run.sh …         under AddressSanitizer
#   RUNS=10000 tests/fuzz/run.sh …         so many inputs of each target from a fixed seed instead
#
# What is run before every merge takes a fixed seed: whether a change is green should not depend on luck (hash
# maps still count from where they like). To look for what nobody has seen yet, give it seconds.
# What it finds stands in target/fuzz/findings, inputs that reach new code in target/fuzz/corpus; the
# committed corpus is read and never changed. Exit code 1 if anything was found.
set -eu
cd "$(dirname "$0")/../.."
seconds=${1:-5}
targets=${2:-case driver incremental mesh lock sidecar capsule description library}
if [ $# -gt 2 ]; then shift 2; else set --; fi
folder=target/fuzz
mkdir -p $folder/bin $folder/findings

# Cargo tells builds apart by the wrapper: dependencies are those of `cargo test --release`.
wrapper=instrument.sh
[ -z "${SANITIZE:-}" ] || wrapper=sanitize.sh
RUSTC_WORKSPACE_WRAPPER="$PWD/tests/fuzz/$wrapper" \
  cargo build --quiet --release -p fuzz --features libfuzzer
# Laws are looked for beside the program: these, and nothing else that lies in a folder of cargo's.
laws=target/release/deps
[ -e $laws/libmepi.so ] || cargo build --quiet --release -p pilum-elastic -p pilum-coulomb-joint -p pilum-mepi
cp target/release/fuzz $folder/bin/
for law in elastic coulomb_joint mepi; do cp $laws/lib$law.so $folder/bin/; done

export NO_COLOR=1
# Libraries are never unloaded on purpose, which is no leak.
export ASAN_OPTIONS=detect_leaks=0
limits="-timeout=20 -rss_limit_mb=2048 -malloc_limit_mb=512 -detect_leaks=0"
if [ $# -gt 0 ] && [ -f "$1" ]; then
  PILUM_FUZZ=$targets exec $folder/bin/fuzz $limits "$@"
fi
bad=0
total=0
length="-max_total_time=$seconds"
[ -z "${RUNS:-}" ] || length="-runs=$RUNS -seed=1"
for target in $targets; do
  corpus=$folder/corpus/$target
  [ -z "${RUNS:-}" ] || corpus=$folder/fixed/$target
  rm -rf "$folder/fixed" && mkdir -p "$corpus"
  log=$folder/$target.log
  status=0
  PILUM_FUZZ=$target $folder/bin/fuzz $limits $length -max_len=8192 \
    -artifact_prefix="$folder/findings/$target-" -dict=tests/fuzz/words.dict -print_final_stats=1 \
    "$@" "$corpus" "tests/fuzz/corpus/$target" >"$log" 2>&1 </dev/null || status=$?
  number() { sed -n "s/^stat::$1: *//p" "$log" | tail -n 1; }
  runs=$(number number_of_executed_units)
  edges=$(sed -n 's/.* cov: \([0-9]*\).*/\1/p' "$log" | tail -n 1)
  printf '%-12s %8s executions, %5s edges, corpus %3s, peak %s MB\n' "$target" "${runs:-?}" \
    "${edges:-?}" "$(ls "tests/fuzz/corpus/$target" | wc -l)" "$(number peak_rss_mb)"
  total=$((total + ${runs:-0}))
  if [ $status -ne 0 ]; then
    bad=$((bad + 1))
    echo "$target: FOUND SOMETHING"
    grep -v '^#[0-9]' "$log" | tail -n 40
  fi
done
echo "$total executions, findings in $bad targets"
[ $bad -eq 0 ]
