#!/usr/bin/env bash
# The loader of the GNU C library 2.36 and G++ 12.2.0 (g++-12 12.2.0-14+deb12u1 of Debian 12): a library of a law has a function
# `extern "C" double gamma(double depth)`, the unit weight, 18 kN/m3, and `double stress(double depth)`, which integrates it. Neither C nor C++
# reserve this name; -std=c++17 -Wall -Wextra say nothing. A program that uses libm, here Python, opens the library with RTLD_LOCAL.
# A good guess: the library calls its own function, the more so as RTLD_LOCAL keeps libraries apart: -36 kPa at 2 m.
# Seen: -0.83. It calls `gamma` of libm, the logarithm of the gamma function: what a library exports is looked for first in the program and in what
# the program is linked with. `y0`, `y1`, `j0`, `j1`, `significand` and `drem` are such names, too. Asked for its address from outside, the
# library gives its own `gamma`, so that a test of that function passes. -36 with `static`, -fvisibility=hidden, -Wl,-Bsymbolic, RTLD_DEEPBIND.
# Source: dlopen(3) of the Linux manual, RTLD_DEEPBIND; gamma(3).
set -euo pipefail
place=$(mktemp -d) && trap 'rm -rf "$place"' EXIT && cd "$place"
# With what it needs and this system has not.
version=12.2.0-14+deb12u1
packages=$(apt-get install -s -q --no-install-recommends g++-12=$version binutils | awk '/^Inst/ { print $2 }')
# shellcheck disable=SC2086  # several packages
(mkdir packages && cd packages && apt-get download -q g++-12=$version ${packages//g++-12/} >/dev/null 2>&1)
for package in packages/*.deb; do dpkg -x "$package" root; done
LD_LIBRARY_PATH=$(find "$PWD/root" -name '*.so*' -printf '%h\n' | sort -u | paste -sd:)
export LD_LIBRARY_PATH PATH=$PWD/root/usr/bin:$PATH
cat >law.cpp <<'CPP'
extern "C" {
KIND double gamma(double depth) { return depth < 100 ? 18 : 20; }

__attribute__((visibility("default"))) double stress(double depth) {
  double sum = 0;
  for (int slice = 0; slice < 100; slice++)
    sum += gamma((slice + 0.5) * depth / 100) * depth / 100;
  return -sum;
}
}
CPP
cat >call.py <<'PYTHON'
import ctypes
import os
import platform
import sys

with open("/proc/self/maps") as maps:
    if "/libm.so.6" not in maps.read():
        sys.exit("this Python is not linked with libm")
found = {}
for name, flag in (("plain", 0), ("static", 0), ("hidden", 0), ("symbolic", 0), ("deep", os.RTLD_DEEPBIND)):
    library = ctypes.CDLL(f"./{name}.so", mode=os.RTLD_NOW | os.RTLD_LOCAL | flag)
    library.stress.restype, library.stress.argtypes = ctypes.c_double, [ctypes.c_double]
    found[name] = library.stress(2.0)
    print(f"{name}: stress at 2 m {found[name]:.4f} kPa")
plain = ctypes.CDLL("./plain.so").gamma
plain.restype, plain.argtypes = ctypes.c_double, [ctypes.c_double]
print(f"plain: gamma from outside {plain(1.0):g} kN/m3;", *platform.libc_ver())
own = all(abs(found[name] + 36) < 1e-9 for name in ("static", "hidden", "symbolic", "deep"))
sys.exit(not (own and abs(found["plain"] + 0.83) < 0.01 and plain(1.0) == 18))
PYTHON
g++-12 --version | head -1
compile() { # NAME KIND OPTION_OF_GCC OPTION_OF_LD
  g++-12 -std=c++17 -Wall -Wextra -Werror -O2 -fPIC -DKIND="$2" ${3:+"$3"} -c law.cpp -o "$1.o"
  ld -shared ${4:+"$4"} "$1.o" -o "$1.so"
}
compile plain "" "" ""
compile static static "" ""
compile hidden "" -fvisibility=hidden ""
compile symbolic "" "" -Bsymbolic
cp plain.so deep.so
python3 call.py && echo "as written" || { echo "CHANGED"; exit 1; }
