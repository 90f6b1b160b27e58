#!/usr/bin/env bash
# meshio 5.3.5 (PyPI) reads a file of Nastran whose points are in a cylindrical system: GRID with 1 in the third field (CP), CORD2C 1, radius 1 and
# 2, angles 0 and 90 degrees, one CQUAD4.
# A good guess: it converts the points, or refuses a system that it does not know: the area is 1.5.
# Seen: radius, angle and height become x, y and z, without a word: the area is 90. The number of the system is kept as point data
# `nastran:ref`, as if it were a label; CORD2C is skipped. Points in the basic system (0), which may be in the same file, are right.
# Source: src/meshio/nastran/_nastran.py, read_buffer (`pref`); the field CP of GRID in any quick reference of Nastran.
set -euo pipefail
place=$(mktemp -d) && trap 'rm -rf "$place"' EXIT && cd "$place"
python3 -m venv python && python/bin/pip -q --disable-pip-version-check install meshio==5.3.5
cat >read.py <<'PYTHON'
import sys

import meshio


def fields(*values):
    return "".join(f"{value:<8}" for value in values).rstrip() + "\n"


with open("ring.bdf", "w") as file:
    file.write("BEGIN BULK\n")
    # Origin, a point of the axis, a point of the half plane of angle 0.
    file.write(fields("CORD2C", 1, 0, *[0.0] * 5, 1.0, "+C") + fields("+C", 1.0, 0.0, 0.0))
    for number, (system, *at) in enumerate(((1, 1.0, 0.0), (1, 2.0, 0.0), (1, 2.0, 90.0), (1, 1.0, 90.0), (0, 3.0, 4.0)), 1):
        file.write(fields("GRID", number, system, *at, 0.0))
    file.write(fields("CQUAD4", 1, 1, 1, 2, 3, 4) + "ENDDATA\n")
print(f"meshio {meshio.__version__}")
mesh = meshio.read("ring.bdf")
print(open("ring.bdf").read(), end="")
at = mesh.points[mesh.cells[0].data[0]]
area = sum(a[0] * b[1] - a[1] * b[0] for a, b in zip(at, [*at[1:], at[0]])) / 2
print(f"points {mesh.points.tolist()}, data {({name: data.tolist() for name, data in mesh.point_data.items()})}, area {area:g}")
right = area == 90 and mesh.points[3:].tolist() == [[1, 90, 0], [3, 4, 0]]
sys.exit(not (right and mesh.point_data["nastran:ref"].tolist() == [1, 1, 1, 1, 0]))
PYTHON
python/bin/python read.py && echo "as written" || { echo "CHANGED"; exit 1; }
