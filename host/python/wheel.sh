#!/usr/bin/env bash
# The wheel: builds program and laws, lays them out as an archive does inside the package, and packs it all with
# the extension module. `host/python/wheel.sh [--manylinux] [FOLDER]` writes into target/wheels, or into FOLDER. Needs
# maturin (`pip install maturin`), and no Python headers. With --manylinux Zig links everything against glibc 2.28, of
# 2018, on a newer system too (`pip install ziglang`; x86-64, in target/manylinux).
set -euo pipefail
cd "$(dirname "$0")/../.."
target=${CARGO_TARGET_DIR:-$PWD/target}
packing=()
if [ "${1-}" = --manylinux ]; then
  shift
  command -v python-zig >/dev/null || { echo "Zig is missing: pip install ziglang" >&2; exit 1; }
  packing=(--compatibility manylinux_2_28)
  export CARGO_TARGET_DIR=$target/manylinux
  export CARGO_TARGET_X86_64_UNKNOWN_LINUX_GNU_LINKER=$PWD/host/python/zig-linker.sh
fi
out=$(realpath -m "${1:-$target/wheels}")
command -v maturin >/dev/null || { echo "maturin is missing: pip install maturin" >&2; exit 1; }

trap 'rm -rf host/python/pilum/installed' EXIT
rm -rf host/python/pilum/installed
cargo run --release --locked -q -p pilum-dist -- --wheel host/python/pilum/installed
maturin build --release --locked --manifest-path host/python/Cargo.toml --out "$out" "${packing[@]}"
