#!/bin/sh
# `RUSTC_WORKSPACE_WRAPPER` of `run.sh`: what fuzzing looks at (no dependency, no build script)
# reports to libFuzzer which edges it takes and what it compares. With SANITIZE=address
# AddressSanitizer watches its memory too; sanitizers are not stable yet, whence RUSTC_BOOTSTRAP.
case " $* " in
*" --crate-name abi "* | *" --crate-name bridges "* | *" --crate-name text "* | *" --crate-name algebra "* | *" --crate-name law "* | *" --crate-name mechanics "* | \
  *" --crate-name point "* | *" --crate-name results "* | *" --crate-name input "* | *" --crate-name workshop "* | *" --crate-name fuzz "*)
  if [ -n "${SANITIZE:-}" ]; then
    export RUSTC_BOOTSTRAP=1
    set -- "$@" -Z sanitizer="$SANITIZE"
  fi
  exec "$@" -C opt-level=0 -C debug-assertions=on -C overflow-checks=on \
    -C passes=sancov-module \
    -C llvm-args=-sanitizer-coverage-level=3 \
    -C llvm-args=-sanitizer-coverage-inline-8bit-counters \
    -C llvm-args=-sanitizer-coverage-pc-table \
    -C llvm-args=-sanitizer-coverage-trace-compares
  ;;
esac
exec "$@"
