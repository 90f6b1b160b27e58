#!/usr/bin/env bash
# GNU Fortran 12.2.0 (gfortran-12 12.2.0-14+deb12u1 of Debian 12): a law, such as a UMAT, is compiled with -ffpe-trap=invalid,zero,overflow, to find
# where it divides by zero. A program that is not in Fortran opens the library and calls it.
# A good guess: 0/0, 1/0 or an overflow ends the program (SIGFPE), as the option does in a program in Fortran.
# Seen: nothing ends; NaN and infinity are returned. The compiler turns traps on at the start of a main program in Fortran, and nowhere else: a
# library's assembler is the same with and without the option, and no warning says so. The law has to ask for traps itself
# (ieee_set_halting_mode), or the program has to.
# Source: gcc/fortran/trans-decl.cc, create_main_function (set_fpe). The manual, options for debugging, -ffpe-trap, names no limit.
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
real(c_double) function ratio(above, below) bind(c)
  use iso_c_binding
  implicit none
  real(c_double), value :: above, below
  ratio = above / below
end function
FORTRAN
cat >main.f90 <<'FORTRAN'
end
FORTRAN
cat >call.py <<'PYTHON'
import ctypes
import math
import sys

DOUBLE = ctypes.c_double
libm = ctypes.CDLL("libm.so.6")
traps = [libm.fegetexcept()]
law = ctypes.CDLL("./law.so")
law.ratio.restype, law.ratio.argtypes = DOUBLE, [DOUBLE] * 2
values = law.ratio(0.0, 0.0), law.ratio(1.0, 0.0), law.ratio(1e308, 1e-308)
traps.append(libm.fegetexcept())
print("0/0, 1/0, 1e308/1e-308:", *values)
print("traps before and after opening and calling:", *traps)
sys.exit(not (math.isnan(values[0]) and values[1] == values[2] == math.inf and traps == [0, 0]))
PYTHON
gfortran-12 --version | head -1
option=-ffpe-trap=invalid,zero,overflow
gfortran-12 -O2 -fPIC $option -c law.f90 -o law.o
ld -shared law.o -o law.so
for source in law main; do
  gfortran-12 -O2 -fPIC -S $source.f90 -o without.s
  gfortran-12 -O2 -fPIC $option -S $source.f90 -o with.s
  # A main program passes the traps to libgfortran.
  differing=$(diff without.s with.s | grep -c '^[<>]' || true)
  echo "$source.f90: lines of assembler that differ with -ffpe-trap: $differing, calls of set_fpe: $(grep -c set_fpe with.s || true)"
  [ $source = main ] || [ "$differing" = 0 ] || { echo "CHANGED"; exit 1; }
done
grep -q set_fpe with.s && python3 call.py && echo "as written" || { echo "CHANGED"; exit 1; }
