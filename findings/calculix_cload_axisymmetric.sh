#!/usr/bin/env bash
# CalculiX 2.20 (calculix-ccx 2.20-1 of Debian 12): an axisymmetric element (CAX8) from r = 1 to r = 2 stands on its base and is pressed at its
# top by nodal forces that amount to 360, in the ratio of a uniform pressure.
# A good guess: the reactions at the base (RF) sum up to the loads (*CLOAD), whatever both are taken per.
# Seen: the loads are of the whole turn, since the stress is -360/(pi (2^2 - 1^2)) = -38.197; the reactions are of the sector of 2 degrees to
# which CalculiX expands the element: 2.
set -euo pipefail
place=$(mktemp -d) && trap 'rm -rf "$place"' EXIT && cd "$place"
# With what it needs and this system has not.
packages=$(apt-get install -s -q --no-install-recommends calculix-ccx=2.20-1 | awk '/^Inst/ { print $2 }')
# shellcheck disable=SC2086  # several packages
(mkdir packages && cd packages && apt-get download -q calculix-ccx=2.20-1 ${packages//calculix-ccx/} >/dev/null 2>&1)
for package in packages/*.deb; do dpkg -x "$package" root; done
LD_LIBRARY_PATH=$(find "$PWD/root" -name '*.so*' -printf '%h\n' | sort -u | paste -sd:)
export LD_LIBRARY_PATH
cat >ring.inp <<'INP'
*NODE, NSET=ALL
1, 1., 0.
2, 2., 0.
3, 2., 1.
4, 1., 1.
5, 1.5, 0.
6, 2., .5
7, 1.5, 1.
8, 1., .5
*ELEMENT, TYPE=CAX8, ELSET=RING
1, 1, 2, 3, 4, 5, 6, 7, 8
*NSET, NSET=BASE
1, 2, 5
*MATERIAL, NAME=ELASTIC
*ELASTIC
1E4, 0.
*SOLID SECTION, ELSET=RING, MATERIAL=ELASTIC
*BOUNDARY
BASE, 2, 2
*STEP
*STATIC
*CLOAD
4, 2, -40.
7, 2, -240.
3, 2, -80.
*NODE PRINT, NSET=BASE, TOTALS=ONLY
RF
*EL PRINT, ELSET=RING
S
*END STEP
INP
root/usr/bin/ccx -v || true # its exit code is 201
root/usr/bin/ccx ring >log.txt
cat ring.dat
awk '
  /^ total force/ { getline; getline; force = $2 }
  /^ *1 +[0-9]+ +[-0-9.E+]/ && NF == 8 { n++; stress += $4 }
  END {
    stress /= n
    printf "loads -360, reactions %.6f, mean stress %.4f\n", force, stress
    exit !(force > 1.9999 && force < 2.0001 && stress < -38.19 && stress > -38.20)
  }' ring.dat && echo "as written" || { echo "CHANGED"; exit 1; }
