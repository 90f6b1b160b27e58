#!/bin/sh
# Builds build/libmy_law.so. CC chooses the compiler.
set -e
cd "$(dirname "$0")"
mkdir -p build
case "$(uname)" in Darwin) suffix=dylib ;; *) suffix=so ;; esac
${CC:-cc} -std=c11 -O2 -Wall -Wextra -fPIC -fvisibility=hidden -I include -shared law.c \
  -o "build/libmy_law.$suffix" -lm
