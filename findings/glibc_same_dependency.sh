#!/usr/bin/env bash
# The loader of the GNU C library 2.36 and G++ 12.2.0 (g++-12 12.2.0-14+deb12u1 of Debian 12): two laws, sand/liblaw.so and clay/liblaw.so,
# each linked with its own libtable.so in its own folder (-rpath '$ORIGIN'), which has its stiffness, 1000 and 2000.
# A good guess: each uses the table beside it: that is what $ORIGIN is for, and `ldd` shows that file. RTLD_LOCAL, or at least RTLD_DEEPBIND,
# keeps the libraries apart.
# Seen: the law that is opened second has the table of the first one, without a word, whatever the flags. A library that is needed is looked for by
# its name among those that are loaded, before any folder is searched. If one opens the two tables by their paths first, the same happens. Apart are
# only tables with different names (-soname), and libraries opened with `dlmopen` in a namespace of their own.
# Source: elf/dl-load.c of the GNU C library, _dl_map_object.
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
cat >table.cpp <<'CPP'
extern "C" double stiffness() { return STIFFNESS; }
CPP
cat >law.cpp <<'CPP'
extern "C" double stiffness();
extern "C" double law(double strain) { return stiffness() * strain; }
CPP
cat >call.py <<'PYTHON'
import ctypes
import os
import platform
import sys

LM_ID_NEWLM = -1
names, how = sys.argv[1:3], sys.argv[3]
found = []
for name in names:
    path = f"./{name}/liblaw.so"
    if how == "tables_first":
        for table in names:
            ctypes.CDLL(f"./{table}/libtable.so", mode=os.RTLD_NOW | os.RTLD_LOCAL)
    if how == "dlmopen":
        dlmopen = ctypes.CDLL(None).dlmopen
        dlmopen.restype, dlmopen.argtypes = ctypes.c_void_p, [ctypes.c_long, ctypes.c_char_p, ctypes.c_int]
        library = ctypes.CDLL(path, handle=dlmopen(LM_ID_NEWLM, path.encode(), os.RTLD_NOW))
    else:
        library = ctypes.CDLL(path, mode=os.RTLD_NOW | os.RTLD_LOCAL | (os.RTLD_DEEPBIND if how == "deep" else 0))
    library.law.restype, library.law.argtypes = ctypes.c_double, [ctypes.c_double]
    found.append(library.law(1.0))
print(*platform.libc_ver(), how, {name: f"{value:g}" for name, value in zip(names, found)})
own = [{"sand": 1000.0, "clay": 2000.0}[name.removeprefix("named_")] for name in names]
sys.exit(found != (own if how == "dlmopen" or names[0].startswith("named_") else [own[0], own[0]]))
PYTHON
g++-12 --version | head -1
build() { # FOLDER STIFFNESS NAME_OF_TABLE
  mkdir "$1"
  g++-12 -O2 -fPIC -DSTIFFNESS="$2" -c table.cpp -o "$1/table.o"
  ld -shared -soname "$3" "$1/table.o" -o "$1/$3"
  g++-12 -O2 -fPIC -c law.cpp -o "$1/law.o"
  # shellcheck disable=SC2016  # the loader's variable
  ld -shared "$1/law.o" "$1/$3" -rpath '$ORIGIN' -o "$1/liblaw.so"
}
build sand 1000 libtable.so
build clay 2000 libtable.so
build named_sand 1000 libtable_sand.so
build named_clay 2000 libtable_clay.so
for folder in sand clay; do ldd "$folder/liblaw.so" | grep -o "libtable.*/$folder/libtable.so"; done
(python3 call.py sand clay plain && python3 call.py clay sand plain && python3 call.py sand clay deep && python3 call.py sand clay tables_first &&
  python3 call.py named_sand named_clay plain && python3 call.py sand clay dlmopen) && echo "as written" || { echo "CHANGED"; exit 1; }
