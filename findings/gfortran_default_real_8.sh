#!/usr/bin/env bash
# GNU Fortran 12.2.0 (gfortran-12 12.2.0-14+deb12u1 of Debian 12): a routine with arguments of `double precision` is compiled with
# -fdefault-real-8, as sources are that rely on 8 bytes for `real`. Its caller passes three numbers of 8 bytes, as for a UMAT.
# A good guess: `double precision` remains what it is, 8 bytes.
# Seen: it has 16 bytes then. The routine reads two of the caller's numbers as one, and writes twice as far. `real*8` remains 8 bytes, as does
# `double precision` with -fdefault-double-8 as well, or with -freal-4-real-8 alone.
# Source: the manual of GNU Fortran 12, options controlling Fortran dialect, -fdefault-real-8.
set -euo pipefail
place=$(mktemp -d) && trap 'rm -rf "$place"' EXIT && cd "$place"
# With what it needs and this system has not.
version=12.2.0-14+deb12u1
packages=$(apt-get install -s -q --no-install-recommends gfortran-12=$version binutils | awk '/^Inst/ { print $2 }')
# shellcheck disable=SC2086  # several packages
(mkdir packages && cd packages && apt-get download -q gfortran-12=$version ${packages//gfortran-12/} >/dev/null 2>&1)
for package in packages/*.deb; do dpkg -x "$package" root; done
LD_LIBRARY_PATH=$(find "$PWD/root" -name '*.so*' -printf '%h\n' | sort -u | paste -sd:)
export LD_LIBRARY_PATH PATH=$PWD/root/usr/bin:$PATH
cat >law.f90 <<'FORTRAN'
subroutine law(stress, bytes_double, bytes_star)
  implicit none
  double precision, intent(inout) :: stress(3)
  integer, intent(out) :: bytes_double, bytes_star
  real*8 :: star
  bytes_double = storage_size(stress) / 8
  bytes_star = storage_size(star) / 8
  stress(2) = 1
end subroutine
FORTRAN
cat >call.py <<'PYTHON'
import ctypes
import sys

found = []
for name in sys.argv[1:]:
    # Room for what the routine writes too far.
    numbers = (ctypes.c_double * 6)(-10, -20, -30, -40, -50, -60)
    double, star = ctypes.c_int(), ctypes.c_int()
    ctypes.CDLL(f"./law{name}.so").law_(numbers, ctypes.byref(double), ctypes.byref(star))
    print(f"{name or 'no option'}: double precision {double.value} bytes, real*8 {star.value}; after stress(2) = 1: {list(numbers)}")
    found.append((double.value, star.value, list(numbers)))
right = (8, 8, [-10, 1, -30, -40, -50, -60])
wide = found[1]
sys.exit(not (found[0] == found[2] == found[3] == right and wide[:2] == (16, 8) and wide[2][:2] == [-10, -20] and wide[2][2:4] != [-30, -40]))
PYTHON
gfortran-12 --version | head -1
names=("" -fdefault-real-8 "-fdefault-real-8 -fdefault-double-8" -freal-4-real-8)
for name in "${names[@]}"; do
  # shellcheck disable=SC2086  # several options
  gfortran-12 $name -O2 -fPIC -c law.f90 -o law.o
  ld -shared law.o -o "law$name.so"
done
python3 call.py "${names[@]}" && echo "as written" || { echo "CHANGED"; exit 1; }
