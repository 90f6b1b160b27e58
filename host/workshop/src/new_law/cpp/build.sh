#!/bin/sh
# Builds build/libmy_law.so. CXX chooses the compiler.
set -e
cd "$(dirname "$0")"
mkdir -p build
case "$(uname)" in
  Darwin) suffix=dylib hide= ;;
  *) suffix=so hide=-Wl,--version-script=exports.map ;;
esac
${CXX:-c++} -std=c++17 -O2 -Wall -Wextra -fPIC -fvisibility=hidden -I include -shared law.cpp \
  -o "build/libmy_law.$suffix" $hide
