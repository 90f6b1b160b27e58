#!/usr/bin/env bash
# The tests on request, which take minutes: before a release, after `.ci/run`. One of them: tests/release.sh NAME. At
# the end come the rows of the table in CONTRIBUTING.md. Exit code 1 if one fails.
set -uo pipefail
cd "${0%/*}/.."
export PILUM_REQUIRE_ALL=1
chosen=${1-}
commit=$(git rev-parse --short HEAD)
git diff --quiet HEAD || commit+=", changed"
rows=()
status=0

on_request() { # TARGET TEST
  [[ "$2" == *"$chosen"* ]] || return 0
  local start=$SECONDS said outcome=passed
  said=$(cargo test --workspace --release --test "$1" -- --ignored --exact "$2" 2>&1 | tee /dev/stderr)
  # A name that no test has passes too.
  [[ "$said" == *"test result: ok. 1 passed"* ]] || { outcome=FAILED && status=1; }
  rows+=("| \`$2\` | \`$1/\` | $(date +%F) | $commit | $((SECONDS - start)) s | $outcome |")
}

# The job array is tried in Slurm.
[ -x /usr/sbin/slurmctld ] || { apt-get update -q && apt-get install -q -y --no-install-recommends slurm-wlm munge; } || exit 1
# The program and all that its tests need, as `.ci/run` builds them.
cargo test --workspace --release --no-run || exit 1
on_request trade_off the_committed_errors_are_those_that_are_measured
on_request command_line slurm::tasks_whose_time_is_over_are_sent_in_again_and_go_on
on_request command_line trade_off::a_case_is_measured_on_its_mesh_and_against_a_finer_one
printf '%s\n' "${rows[@]}"
exit $status
