#!/bin/sh
# Builds build/libmy_law.so. FC chooses the compiler.
set -e
cd "$(dirname "$0")"
mkdir -p build
case "$(uname)" in
  Darwin) suffix=dylib hide= ;;
  *) suffix=so hide=-Wl,--version-script=exports.map ;;
esac
fc=${FC:-gfortran}
# -frecursive: no local variable is shared between threads.
flags="-O2 -ffree-line-length-none -Wall -Wno-unused-dummy-argument -frecursive -fPIC -J build"
$fc $flags -c include/pilum_law.f90 -o build/pilum_law.o
$fc $flags -c law.f90 -o build/law.o
$fc -fPIC -I include -c manifest.c -o build/manifest.o
$fc -shared build/law.o build/pilum_law.o build/manifest.o -o "build/libmy_law.$suffix" $hide
