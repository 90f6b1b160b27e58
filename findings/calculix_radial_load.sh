#!/usr/bin/env bash
# CalculiX 2.20 (calculix-ccx 2.20-1 of Debian 12): a disc (CAX8) of radius 1 m, free to move, carries a pressure of 100 kPa at its rim as the
# equivalent nodal forces of the whole turn, which for CAX8 are 1/6, 4/6 and 1/6 of the force. E = 10 000 kPa, nu = 0.
# A good guess: it is compressed evenly, all its rim moves by p r/E = 0.01 m, and nodes that nothing holds have no radial reaction.
# Seen: the rim moves 1e-4 to 2e-4 of that too little, its upper edge most. The element is a sector of 2 degrees: forces act along its middle, nodes
# move on its sides, and cos 1 degree is 1 - 1.5e-4. The radial RF of a free node inside is 1.16 of the sector, 209 kN of the whole turn.
set -euo pipefail
place=$(mktemp -d) && trap 'rm -rf "$place"' EXIT && cd "$place"
# With what it needs and this system has not.
packages=$(apt-get install -s -q --no-install-recommends calculix-ccx=2.20-1 | awk '/^Inst/ { print $2 }')
# shellcheck disable=SC2086  # several packages
(mkdir packages && cd packages && apt-get download -q calculix-ccx=2.20-1 ${packages//calculix-ccx/} >/dev/null 2>&1)
for package in packages/*.deb; do dpkg -x "$package" root; done
LD_LIBRARY_PATH=$(find "$PWD/root" -name '*.so*' -printf '%h\n' | sort -u | paste -sd:)
export LD_LIBRARY_PATH
cat >disc.inp <<'INP'
*NODE, NSET=ALL
1, 0., 0.
2, 1., 0.
3, 1., 1.
4, 0., 1.
5, .5, 0.
6, 1., .5
7, .5, 1.
8, 0., .5
*ELEMENT, TYPE=CAX8, ELSET=DISC
1, 1, 2, 3, 4, 5, 6, 7, 8
*MATERIAL, NAME=ELASTIC
*ELASTIC
1E4, 0.
*SOLID SECTION, ELSET=DISC, MATERIAL=ELASTIC
*NSET, NSET=AXIS
1, 4, 8
*NSET, NSET=BASE
1, 2, 5
*BOUNDARY
AXIS, 1, 1
BASE, 2, 2
*STEP
*STATIC
*CLOAD
2, 1, -104.719755
6, 1, -418.879020
3, 1, -104.719755
*NODE PRINT, NSET=ALL
U, RF
*END STEP
INP
root/usr/bin/ccx -v || true # its exit code is 201
root/usr/bin/ccx disc >log.txt
cat disc.dat
awk '
  /displacements/ { what = "u" } /forces/ { what = "f" }
  what == "u" && $1 == 6 { u = $2 }
  what == "f" && $1 == 5 { force = 180 * $2 }
  END {
    printf "middle of the rim: %.7f, expected -0.01; radial RF of the free node 5, times 180: %.4f, expected 0\n", u, force
    exit !(u > -0.009999 && u < -0.009998 && (force > 1 || force < -1))
  }' disc.dat && echo "as written" || { echo "CHANGED"; exit 1; }
