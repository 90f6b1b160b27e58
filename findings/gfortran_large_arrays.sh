#!/usr/bin/env bash
# GNU Fortran 12.2.0 (gfortran-12 12.2.0-14+deb12u1 of Debian 12): a subroutine, such as a UMAT, has a local array without SAVE, with no initial
# value. Two threads call it, each with its own arguments; each fills the array, waits for the other, and reads the array.
# A good guess: each thread reads what it wrote, since local variables are on the stack.
# Seen: up to 65536 bytes (8192 numbers) they are. One number more, and the array is in static memory: both threads read what one of them wrote,
# and only -Wall warns of it. With -frecursive, which -fopenmp implies, each reads its own.
# Source: the manual of GNU Fortran 12, options for code generation conventions, -fmax-stack-var-size.
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
subroutine law(written, read, meet)
  use iso_c_binding
  implicit none
  real(c_double), intent(in) :: written
  real(c_double), intent(out) :: read
  interface
    subroutine meet() bind(c)
    end subroutine
  end interface
  real(c_double) :: work(SIZE)
  work = written
  call meet()
  read = work(SIZE)
end subroutine
FORTRAN
cat >call.py <<'PYTHON'
import ctypes
import sys
import threading


def run(library):
    both = threading.Barrier(2)
    meet = ctypes.CFUNCTYPE(None)(lambda: both.wait() and None)
    law = ctypes.CDLL(library).law_
    read = [ctypes.c_double(), ctypes.c_double()]

    def call(number):
        law(ctypes.byref(ctypes.c_double(number + 1.0)), ctypes.byref(read[number]), meet)

    threads = [threading.Thread(target=call, args=(number,)) for number in (0, 1)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    return [number.value for number in read]


own = {}
for name in sys.argv[1:]:
    read = run(f"./{name}.so")
    print(f"{name}: the threads wrote 1 and 2, and read {read[0]:g} and {read[1]:g}")
    own[name] = read == [1.0, 2.0]
sys.exit(own != {"size_8192": True, "size_8193": False, "size_8193_recursive": True})
PYTHON
compile() { # NAME SIZE [OPTION]
  gfortran-12 -cpp -O2 -fPIC -DSIZE="$2" ${3:+"$3"} -c law.f90 -o "$1.o"
  ld -shared "$1.o" -o "$1.so"
}
gfortran-12 --version | head -1
compile size_8192 8192
compile size_8193 8193
compile size_8193_recursive 8193 -frecursive
timeout 60 python3 call.py size_8192 size_8193 size_8193_recursive && echo "as written" || { echo "CHANGED"; exit 1; }
