#!/usr/bin/env bash
# Installs the programs that the tests of interoperability call, from PyPI, each in an environment of its own (about
# 900 MB): install.sh [FOLDER]. FOLDER, or $PILUM_INTEROPERABILITY, or target/interoperability. What is there in full,
# in these versions, is left as it is. Exit code 1, with a sentence, if they cannot be had.
set -uo pipefail
programs=("opengeosys ogs==6.5.9" "kratos KratosGeoMechanicsApplication==10.4.4" "salib SALib==1.6.0")
patience=400 # s, for an attempt; 600 MB at 2 MB/s are 300 s

folder=${1:-${PILUM_INTEROPERABILITY:-${0%/*}/../../target/interoperability}}
mkdir -p "$folder" && folder=$(cd "$folder" && pwd) || exit 1

wanted=$(printf '%s\n' "${programs[@]}")
runs() { # NAME: its Python still does, after whatever became of the system's
  "$folder/$1/bin/python" -c "" 2>/dev/null
}
if [ "$(cat "$folder/complete" 2>/dev/null)" = "$wanted" ] && runs opengeosys && runs kratos && runs salib; then
  echo "already in $folder: ${programs[*]}"
  exit 0
fi
rm -f "$folder/complete"

install() { # NAME PACKAGE
  runs "$1" || { rm -rf "${folder:?}/$1" && python3 -m venv "$folder/$1"; } || return
  timeout "$patience" "$folder/$1/bin/python" -m pip install --quiet --no-compile --disable-pip-version-check \
    --timeout 60 "$2"
}
attempt() {
  local processes=() status=0
  for program in "${programs[@]}"; do
    # shellcheck disable=SC2086  # name and package
    install $program &
    processes+=($!)
  done
  for process in "${processes[@]}"; do wait "$process" || status=1; done
  return $status
}
attempt || { echo "not installed; once more" >&2 && attempt; } || {
  echo "OpenGeoSys, Kratos and SALib cannot be had: the tests of interoperability need ${programs[*]} from PyPI in $folder" >&2
  exit 1
}
echo "$wanted" >"$folder/complete"
echo "installed in $folder; now"
echo "PILUM_INTEROPERABILITY=$folder cargo test --release -p tests --test interoperability"
