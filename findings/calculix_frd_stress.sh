#!/usr/bin/env bash
# CalculiX 2.20 (calculix-ccx 2.20-1 of Debian 12): a fixed cube (C3D8) has the uniform initial stress xx -100, yy -200, zz -300, xy 10, xz 20,
# yz 30; it is printed at integration points (*EL PRINT, .dat) and written at nodes (*EL FILE, .frd).
# A good guess: both files have these six numbers, in one order.
# Seen: the columns of .dat are xx yy zz xy xz yz, as in the input, those of .frd xx yy zz xy yz zx. All values in .frd are 4e-5 too small, -99.996
# for -100, although it has six digits: the factors with which they are taken from integration points to nodes are rounded.
# Source: extrapolate.f, whose row 2.549 -.683 .183 -.683 -.683 .183 -.04904 .183 sums up to 0.99996.
set -euo pipefail
place=$(mktemp -d) && trap 'rm -rf "$place"' EXIT && cd "$place"
# With what it needs and this system has not.
packages=$(apt-get install -s -q --no-install-recommends calculix-ccx=2.20-1 | awk '/^Inst/ { print $2 }')
# shellcheck disable=SC2086  # several packages
(mkdir packages && cd packages && apt-get download -q calculix-ccx=2.20-1 ${packages//calculix-ccx/} >/dev/null 2>&1)
for package in packages/*.deb; do dpkg -x "$package" root; done
LD_LIBRARY_PATH=$(find "$PWD/root" -name '*.so*' -printf '%h\n' | sort -u | paste -sd:)
export LD_LIBRARY_PATH
cat >cube.inp <<'INP'
*NODE, NSET=ALL
1, 0., 0., 0.
2, 1., 0., 0.
3, 1., 1., 0.
4, 0., 1., 0.
5, 0., 0., 1.
6, 1., 0., 1.
7, 1., 1., 1.
8, 0., 1., 1.
*ELEMENT, TYPE=C3D8, ELSET=CUBE
1, 1, 2, 3, 4, 5, 6, 7, 8
*MATERIAL, NAME=ELASTIC
*ELASTIC
1E4, 0.3
*SOLID SECTION, ELSET=CUBE, MATERIAL=ELASTIC
*INITIAL CONDITIONS, TYPE=STRESS
INP
for point in 1 2 3 4 5 6 7 8; do echo "1, $point, -100., -200., -300., 10., 20., 30." >>cube.inp; done
cat >>cube.inp <<'INP'
*BOUNDARY
ALL, 1, 3
*STEP
*STATIC
*EL PRINT, ELSET=CUBE
S
*EL FILE
S
*END STEP
INP
root/usr/bin/ccx -v || true # its exit code is 201
root/usr/bin/ccx cube >log.txt
echo "$(grep stresses cube.dat):"
printed=$(awk '/stresses/ { on = 1 } on && NF == 8 && $2 == 1 { print $3 + 0, $4 + 0, $5 + 0, $6 + 0, $7 + 0, $8 + 0 }' cube.dat)
echo "$printed"
names=$(awk '/^ -4/ { on = $2 == "STRESS" } on && /^ -5/ { print $2 }' cube.frd | paste -sd' ')
# Columns of 12 characters.
written=$(awk '/^ -4/ { on = $2 == "STRESS" } on && /^ -1/ { for (i = 0; i < 6; i++) printf "%.4f ", substr($0, 14 + 12 * i, 12); print "" }' cube.frd |
  sort -u | sed 's/ $//')
printf '%s\n' ".frd $names:" "$written"
[ "$printed" = "-100 -200 -300 10 20 30" ] && [ "$names" = "SXX SYY SZZ SXY SYZ SZX" ] &&
  [ "$written" = "-99.9960 -199.9920 -299.9880 9.9996 29.9988 19.9992" ] && echo "as written" || { echo "CHANGED"; exit 1; }
