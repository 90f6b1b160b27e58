#!/bin/sh
# The program with laws of the repository under valgrind: a driver, a case with three laws, a replayed
# call, an inspection. Any read or write outside what was allocated, or of what was never written and
# decides something, ends it with exit code 9.
set -eu
cd "${0%/*}/.."
if ! command -v valgrind >/dev/null; then
  strict=${PILUM_REQUIRE_ALL-}${CI-}
  [ -n "$strict" ] && { echo "valgrind is missing, and PILUM_REQUIRE_ALL or CI is set" >&2; exit 1; }
  echo "SKIPPED: valgrind is missing" >&2
  exit 0
fi
out=target/memory
# Laws are called in the process that valgrind looks at, not in a child of it.
export PILUM_UNSUPERVISED=1
mkdir -p $out
watched() {
  valgrind -q --error-exitcode=9 target/release/pilum --no-probe "$@" >$out/log 2>&1 || {
    status=$?
    cat $out/log
    echo "valgrind: pilum $* ended with $status"
    exit 1
  }
}
corpus=tests/fuzz/corpus
watched point $corpus/driver/joint
watched run tests/fuzz/base/case.toml --threads 2 --out $out/case
watched replay --in-process $corpus/capsule/elastic
watched inspect target/release/deps/libelastic.so
echo "valgrind: no error"
