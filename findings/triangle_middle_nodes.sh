#!/usr/bin/env bash
# Triangle (triangle 20250106, PyPI) makes triangles with six nodes (switch o2) of a square of side 1.
# A good guess: after the corners 1, 2, 3 follow the middles of the edges 12, 23 and 31, as in VTK, Gmsh, Abaqus and MED.
# Seen: they are those opposite to the corners: 23, 31, 12. Taken in the usual order, the elements pass any check of numbers and names; their shape
# functions give the area -1 instead of 1.
# Source: the page "Command line switches" of Triangle, -o2; its page ".ele files".
set -euo pipefail
place=$(mktemp -d) && trap 'rm -rf "$place"' EXIT && cd "$place"
python3 -m venv python && python/bin/pip -q --disable-pip-version-check install triangle==20250106
cat >middles.py <<'PYTHON'
import sys
from importlib.metadata import version

import numpy
import triangle

EDGES = [(1, 2), (2, 3), (3, 1)]


def area(nodes):
    """Of an element whose middles follow the edges 12, 23, 31: the Jacobian at three points is integrated exactly."""
    total = 0.0
    for s, t in ((1 / 6, 1 / 6), (2 / 3, 1 / 6), (1 / 6, 2 / 3)):
        r = 1 - s - t
        slopes = [(1 - 4 * r, 1 - 4 * r), (4 * s - 1, 0), (0, 4 * t - 1), (4 * (r - s), -4 * s), (4 * t, 4 * s), (-4 * t, 4 * (r - t))]
        total += numpy.linalg.det(numpy.transpose(slopes) @ nodes) / 6
    return total


mesh = triangle.triangulate({"vertices": [[0, 0], [1, 0], [1, 1], [0, 1]]}, "qo2")
print(f"triangle {version('triangle')}: {len(mesh['triangles'])} triangles")
found, taken, right = set(), 0.0, 0.0
for element in mesh["triangles"]:
    nodes = mesh["vertices"][element]
    middles = [next(edge for edge in EDGES if numpy.allclose((nodes[edge[0] - 1] + nodes[edge[1] - 1]) / 2, at)) for at in nodes[3:]]
    print(f"nodes 4, 5, 6 are in the middle of {middles}")
    found.add(tuple(middles))
    taken += area(nodes)
    right += area(nodes[[0, 1, 2, 5, 3, 4]])
print(f"area as 12 23 31: {taken:.6f}, reordered: {right:.6f}")
sys.exit(not (found == {((2, 3), (3, 1), (1, 2))} and abs(taken + 1) < 1e-12 and abs(right - 1) < 1e-12))
PYTHON
python/bin/python middles.py && echo "as written" || { echo "CHANGED"; exit 1; }
