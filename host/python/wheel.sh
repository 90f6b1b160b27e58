#!/usr/bin/env bash
# The wheel: builds program and laws, lays them out as an archive does inside the package, and packs it all with
# the extension module. `host/python/wheel.sh [FOLDER]` writes into target/wheels, or into FOLDER. Needs maturin
# (`pip install maturin`), and no Python headers.
set -euo pipefail
cd "$(dirname "$0")/../.."
target=${CARGO_TARGET_DIR:-$PWD/target}
out=$(realpath -m "${1:-$target/wheels}")
command -v maturin >/dev/null || { echo "maturin is missing: pip install maturin" >&2; exit 1; }

trap 'rm -rf host/python/pilum/installed' EXIT
rm -rf host/python/pilum/installed
cargo run --release --locked -q -p pilum-dist -- --wheel host/python/pilum/installed
maturin build --release --locked --manifest-path host/python/Cargo.toml --out "$out"
