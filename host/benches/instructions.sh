#!/usr/bin/env bash
# Instructions and heap allocations of a law call, by valgrind: the same on a noisy machine as on a
# quiet one. Per point, in batches of 1024, host and law together; allocations must be none.
#
#     instructions.sh [NAME…]      of `points names`; all if left out
#
# What a run costs beside the calls cancels: the difference of two runs of different length.
set -euo pipefail
cd "$(dirname "$0")/../.."

for tool in valgrind cargo; do
  command -v "$tool" >/dev/null || { echo "instructions.sh: \`$tool\` is not on the path"; exit 2; }
done
cargo build --release --quiet
points=$(cargo bench --package pilum --bench points --no-run 2>&1 | sed -n 's/.*Executable.*(\(.*\))$/\1/p')
[ -x "$points" ] || { echo "instructions.sh: the bench \`points\` does not build"; exit 2; }

# Instructions of a run with so many calls.
instructions() {
  valgrind --tool=callgrind --callgrind-out-file=/dev/null "$points" call "$1" "$2" "$3" 2>&1 |
    sed -n 's/.*Collected : *\([0-9]*\).*/\1/p'
}

# Allocations of a run with so many calls.
allocations() {
  valgrind --tool=memcheck "$points" call "$1" "$2" "$3" 2>&1 |
    sed -n 's/.*total heap usage: *\([0-9,]*\) allocs.*/\1/p' | tr -d ,
}

names=("$@")
[ ${#names[@]} -gt 0 ] || mapfile -t names < <("$points" names)
failed=0
echo "| scenario | flux | with tangent | allocations |"
echo "|---|---|---|---|"
for name in "${names[@]}"; do
  row="| \`$name\` |"
  for operator in none consistent; do
    row+=" $((($(instructions "$name" "$operator" 5) - $(instructions "$name" "$operator" 1)) / 4096)) |"
  done
  heap=$(($(allocations "$name" consistent 5) - $(allocations "$name" consistent 1)))
  [ "$heap" -eq 0 ] || failed=1
  echo "$row $heap |"
done
exit $failed
