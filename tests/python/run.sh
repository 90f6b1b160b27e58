#!/usr/bin/env bash
# Builds the wheel, installs it in a clean environment that knows no Rust, and runs the tests there:
# tests/python/run.sh [ARGUMENTS OF PYTEST]. Needs Python 3.10 or later with venv, and PyPI; what is there of an
# earlier time is taken again. The environments are in $PILUM_PYTHON, or target/python.
set -euo pipefail
cd "$(dirname "$0")/../.."
target=${CARGO_TARGET_DIR:-$PWD/target}
folder=${PILUM_PYTHON:-$target/python}
python=${PYTHON:-python3}
if ! "$python" -c "import venv, ensurepip, sys; sys.exit(sys.version_info < (3, 10))" 2>/dev/null; then
  [ -n "${PILUM_REQUIRE_ALL-}${CI-}" ] && { echo "Python 3.10 with venv is missing, and PILUM_REQUIRE_ALL or CI is set" >&2; exit 1; }
  echo "SKIPPED: Python 3.10 with venv is missing" >&2
  exit 0
fi
mkdir -p "$folder"

environment() { # NAME FILE-OF-REQUIREMENTS: an environment with what the file lists
  local place=$folder/$1
  if ! cmp -s "$2" "$place/complete" || ! "$place/bin/python" -c "" 2>/dev/null; then
    rm -rf "$place"
    "$python" -m venv "$place"
    "$place/bin/python" -m pip install --quiet --disable-pip-version-check --timeout 60 -r "$2"
    cp "$2" "$place/complete"
  fi
}

environment tests tests/python/requirements.txt & # while the compiler works
requirements=$!
printf 'maturin>=1.7,<2\n' >"$folder/maturin.txt"
environment build "$folder/maturin.txt"
rm -rf "$folder/wheels"
PATH="$folder/build/bin:$PATH" host/python/wheel.sh "$folder/wheels"

wait "$requirements"
# Nothing of the toolchain, and of the sources the tests alone.
without_rust() {
  local path="" part
  while IFS= read -r -d : part; do
    [ -x "$part/cargo" ] || [ -x "$part/rustc" ] || [ -x "$part/maturin" ] || path+=$part:
  done <<<"$PATH:"
  env -u CARGO_HOME -u RUSTUP_HOME -u PYTHONPATH -u PILUM_LAW_PATH PATH="${path%:}" "$@"
}
inside=$folder/tests/bin/python
"$inside" -m pip uninstall --quiet --disable-pip-version-check -y pilum 2>/dev/null
"$inside" -m pip install --quiet --disable-pip-version-check "$folder"/wheels/pilum-*.whl
without_rust sh -c '! command -v cargo rustc' >/dev/null || { echo "there is a toolchain where there should be none" >&2; exit 1; }
without_rust "$inside" -m pytest -q -p no:cacheprovider tests/python "$@"
