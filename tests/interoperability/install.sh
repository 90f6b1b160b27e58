#!/usr/bin/env bash
# Installs the programs that the tests of interoperability call, from PyPI, each in an environment of its own (about
# 650 MB): install.sh [FOLDER]. FOLDER, or $PILUM_INTEROPERABILITY, or target/interoperability.
set -euo pipefail
folder=${1:-${PILUM_INTEROPERABILITY:-$(dirname "$0")/../../target/interoperability}}
mkdir -p "$folder"
folder=$(cd "$folder" && pwd)
install() { # NAME PACKAGE
  [ -x "$folder/$1/bin/pip" ] || python3 -m venv "$folder/$1" || return
  "$folder/$1/bin/pip" install --quiet --no-compile --disable-pip-version-check "$2"
}
install opengeosys "ogs==6.5.9" & opengeosys=$!
install kratos "KratosGeoMechanicsApplication==10.4.4" & kratos=$!
wait $opengeosys
wait $kratos
touch "$folder/complete"
echo "installed in $folder; now"
echo "PILUM_INTEROPERABILITY=$folder cargo test --release -p tests --test interoperability -- --include-ignored"
