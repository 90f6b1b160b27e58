#!/usr/bin/env bash
# Gmsh 4.15.2 (PyPI): a surface of area 1 is in two physical groups, "clay" and "all"; it is written in formats 2.2 and 4.1.
# A good guess: each triangle is in the file once; in format 2.2 with one group of the two, or with both tags.
# Seen: in format 2.2 each triangle is written once for each group, with a new number: twice as many triangles, area 2. A program that assembles
# all of them doubles stiffness and weight. Gmsh itself reads twice as many as it had. In format 4.1 a triangle is there once.
# Source: src/mesh/MElement.cpp and src/geo/GModelIO_MSH2.cpp of Gmsh, writeElementMSH2.
set -euo pipefail
place=$(mktemp -d) && trap 'rm -rf "$place"' EXIT && cd "$place"
python3 -m venv python && python/bin/pip -q --disable-pip-version-check install gmsh==4.15.2
cat >square.geo <<'GEO'
Point(1) = {0, 0, 0, 1}; Point(2) = {1, 0, 0, 1}; Point(3) = {1, 1, 0, 1}; Point(4) = {0, 1, 0, 1};
Line(1) = {1, 2}; Line(2) = {2, 3}; Line(3) = {3, 4}; Line(4) = {4, 1};
Curve Loop(1) = {1, 2, 3, 4}; Plane Surface(1) = {1};
Physical Surface("clay", 1) = {1}; Physical Surface("all", 2) = {1};
GEO
cat >write.py <<'PYTHON'
import sys

import gmsh

TRIANGLE = 2


def in_text(file, version):
    """Triangles in the file, and their area."""
    words = [line.split() for line in open(file)]
    start = {word[0]: number for number, word in enumerate(words) if word}
    if version == 2.2:
        nodes = {w[0]: tuple(map(float, w[1:3])) for w in words[start["$Nodes"] + 2 : start["$EndNodes"]]}
        triangles = [w[-3:] for w in words[start["$Elements"] + 2 : start["$EndElements"]] if int(w[1]) == TRIANGLE]
    else:
        tags = [w[0] for w in words[start["$Nodes"] : start["$EndNodes"]] if len(w) == 1]
        places = [tuple(map(float, w[:2])) for w in words[start["$Nodes"] : start["$EndNodes"]] if len(w) == 3]
        nodes = dict(zip(tags[1:], places))
        triangles = [w[1:] for w in words[start["$Elements"] + 3 : start["$EndElements"]]]
    area = 0.0
    for (ax, ay), (bx, by), (cx, cy) in ([nodes[n] for n in triangle] for triangle in triangles):
        area += abs((bx - ax) * (cy - ay) - (cx - ax) * (by - ay)) / 2
    return len(triangles), area


gmsh.initialize()
gmsh.option.setNumber("General.Terminal", 0)
gmsh.open("square.geo")
gmsh.model.mesh.generate(2)
count = len(gmsh.model.mesh.getElementsByType(TRIANGLE)[0])
print(f"Gmsh {gmsh.__version__}: {count} triangles")
for version in (2.2, 4.1):
    gmsh.option.setNumber("Mesh.MshFileVersion", version)
    gmsh.write(f"square_{version}.msh")
found = {}
for version in (2.2, 4.1):
    written, area = in_text(f"square_{version}.msh", version)
    gmsh.open(f"square_{version}.msh")
    read = len(gmsh.model.mesh.getElementsByType(TRIANGLE)[0])
    print(f"format {version}: {written} triangles in the file, area {area:g}; Gmsh reads {read}")
    found[version] = written / count, read / count, round(area, 9)
print(open("square_2.2.msh").read())
sys.exit(found != {2.2: (2, 2, 2), 4.1: (1, 1, 1)})
PYTHON
python/bin/python write.py && echo "as written" || { echo "CHANGED"; exit 1; }
