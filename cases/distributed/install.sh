#!/usr/bin/env bash
# Makes an environment of Python for distributed runs (350 MB): install.sh [FOLDER [WHEEL]]. FOLDER, or $PILUM_DOLFINX, or
# target/dolfinx of the repository. WHEEL is Pilum's own, or the newest one in target/wheels, where host/python/wheel.sh
# puts it. $PYTHON names another interpreter. Exit code 1, with a sentence, if something is missing.
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
target=${CARGO_TARGET_DIR:-$here/../../target}
folder=$(realpath -m "${1:-${PILUM_DOLFINX:-$target/dolfinx}}")
fails() { echo "error: $1" >&2 && exit 1; }

[ "$(uname -sm)" = "Linux x86_64" ] || fails "the wheel of DOLFINx is for Linux on x86-64; see README.md for other installations"
for python in ${PYTHON:-python3 python3.14 python3.13 python3.12}; do
  "$python" -c "import ensurepip, sys, venv; sys.exit(sys.version_info < (3, 12))" 2>/dev/null && break
  python=
done
[ -n "$python" ] || fails "Python 3.12 or newer with venv is missing; PYTHON=… names one"
command -v cc >/dev/null || fails "a C compiler is missing (cc): DOLFINx compiles its forms with it"
wheel=${2:-$(find "$target/wheels" -name 'pilum-*.whl' -printf '%T@ %p\n' 2>/dev/null | sort -n | tail -n 1 | cut -d ' ' -f 2- || true)}
[ -f "$wheel" ] || fails "Pilum's wheel is missing: make it (pip install maturin, then host/python/wheel.sh), or name it: install.sh FOLDER WHEEL"

"$folder/bin/python" -c "" 2>/dev/null || { rm -rf "$folder" && "$python" -m venv "$folder"; }
pip() { "$folder/bin/python" -m pip install --quiet --disable-pip-version-check --timeout 60 "$@"; }
pip -r "$here/requirements.txt" || fails "DOLFINx cannot be had: see what pip says above"
pip --force-reinstall --no-deps "$wheel"
"$folder/bin/python" -c "import dolfinx_solver, dolfinx, pilum; print('DOLFINx', dolfinx.__version__, 'and pilum', pilum.__version__)"
echo "installed; now $folder/bin/mpiexec -n 2 $folder/bin/python $here/run.py $here --variant m200"
