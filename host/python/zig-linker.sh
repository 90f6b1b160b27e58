#!/usr/bin/env bash
# Zig as the linker of wheel.sh, against glibc 2.28. It takes no --export-dynamic-symbol, but exports from a program what
# a library on its command line asks for: here one that is made for that, and not needed afterwards.
set -euo pipefail
zig() { python-zig cc -target x86_64-linux-gnu.2.28 "$@"; }
place=$(mktemp -d) && trap 'rm -rf "$place"' EXIT
for argument; do
  shift
  case $argument in
    -Wl,--export-dynamic-symbol=*) printf 'extern char %s[]; char *of_%s = %s;\n' "${argument##*=}"{,,} >>"$place/asked.c" ;;
    *) set -- "$@" "$argument" ;;
  esac
done
if [ -f "$place/asked.c" ]; then
  zig -shared -nostdlib -o "$place/libasked.so" "$place/asked.c"
  set -- "$@" -Wl,--as-needed "$place/libasked.so"
fi
zig "$@"
