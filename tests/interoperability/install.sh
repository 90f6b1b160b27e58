#!/usr/bin/env bash
# Installs the programs that the tests of interoperability call, from PyPI, each in an environment of its own (about
# 500 MB): install.sh [FOLDER]. FOLDER, or $PILUM_INTEROPERABILITY, or target/interoperability.
set -euo pipefail
folder=${1:-${PILUM_INTEROPERABILITY:-$(dirname "$0")/../../target/interoperability}}
mkdir -p "$folder"
folder=$(cd "$folder" && pwd)
for program in "opengeosys ogs==6.5.9" "kratos KratosGeoMechanicsApplication==10.4.4"; do
  read -r name package <<<"$program"
  [ -x "$folder/$name/bin/pip" ] || python3 -m venv "$folder/$name"
  "$folder/$name/bin/pip" install --quiet "$package"
done
echo "installed in $folder; now"
echo "PILUM_INTEROPERABILITY=$folder cargo test --release -p tests --test interoperability -- --include-ignored"
