#!/usr/bin/env bash
# G++ 12.2.0 (g++-12 12.2.0-14+deb12u1 of Debian 12) and the GNU C library: a library keeps the parameters of a law in a static variable of an
# inline function. Two copies of its file, each a file of its own, are opened with RTLD_LOCAL, as for two materials; then one is closed and opened.
# A good guess: each copy has its own variable, and one that is opened again begins anew.
# Seen: there is one variable for both copies: the parameter of the second material is that of the first. Closing does not unload the copy.
# The compiler marks the symbol as unique in the process. With -fno-gnu-unique, or in a function that is not inline, both are as guessed.
# Source: the manual of GCC 12, options for code generation conventions, -fno-gnu-unique.
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
KIND double &cohesion() {
  static double value = 0;
  return value;
}
extern "C" void set(double value) { cohesion() = value; }
extern "C" double get() { return cohesion(); }
CPP
cat >call.py <<'PYTHON'
import _ctypes
import ctypes
import os
import platform
import shutil
import sys


def opened(path):
    library = ctypes.CDLL(path, mode=os.RTLD_NOW | os.RTLD_LOCAL)
    library.set.argtypes, library.get.restype = [ctypes.c_double], ctypes.c_double
    return library


found = {}
for name in sys.argv[1:]:
    paths = [f"./{name}_{number}.so" for number in (1, 2)]
    for path in paths:
        shutil.copy(f"{name}.so", path)
    first, second = map(opened, paths)
    first.set(10.0)
    second.set(20.0)
    values = [first.get(), second.get()]
    _ctypes.dlclose(second._handle)
    values.append(opened(paths[1]).get())
    print(f"{name}: set 10 and 20, got {values[0]:g} and {values[1]:g}, after closing and opening {values[2]:g}")
    found[name] = values
print(*platform.libc_ver())
own = [10.0, 20.0, 0.0]
sys.exit(found != {"inline": [20.0, 20.0, 20.0], "inline_not_unique": own, "not_inline": own})
PYTHON
compile() { # NAME KIND [OPTION]
  g++-12 -O2 -fPIC -DKIND="$2" ${3:+"$3"} -c law.cpp -o "$1.o"
  ld -shared "$1.o" -o "$1.so"
}
g++-12 --version | head -1
compile inline inline
compile inline_not_unique inline -fno-gnu-unique
compile not_inline ""
python3 call.py inline inline_not_unique not_inline && echo "as written" || { echo "CHANGED"; exit 1; }
