#!/usr/bin/env bash
# meshio 5.3.5 (PyPI) reads a file of Gmsh 4.15.2 (PyPI), format 4.1, in which a physical group has a curve with the opposite
# direction: Physical Curve("left", 12) = {-4}.
# A good guess: the lines of curve 4 have the physical tag 12, as `field_data` names it, and `cell_sets` has them as "left".
# Seen: their tag is -12, which `field_data` does not have, and the set "left" is empty. Gmsh writes the direction as a sign of the
# tag in `$Entities`; in format 2.2 the tag is 12.
set -euo pipefail
place=$(mktemp -d) && trap 'rm -rf "$place"' EXIT && cd "$place"
python3 -m venv python && python/bin/pip -q --disable-pip-version-check install meshio==5.3.5 gmsh==4.15.2
cat >square.geo <<'GEO'
Point(1) = {0, 0, 0}; Point(2) = {1, 0, 0}; Point(3) = {1, 1, 0}; Point(4) = {0, 1, 0};
Line(1) = {1, 2}; Line(2) = {2, 3}; Line(3) = {3, 4}; Line(4) = {1, 4};
Curve Loop(1) = {1, 2, 3, -4}; Plane Surface(1) = {1};
Physical Curve("bottom", 11) = {1}; Physical Curve("left", 12) = {-4}; Physical Surface("sand", 21) = {1};
GEO
cat >read.py <<'PYTHON'
import sys

import gmsh
import meshio

gmsh.initialize()
gmsh.option.setNumber("General.Terminal", 0)
gmsh.open("square.geo")
gmsh.model.mesh.generate(2)
found = {}
for version in (4.1, 2.2):
    gmsh.option.setNumber("Mesh.MshFileVersion", version)
    gmsh.write("square.msh")
    mesh = meshio.read("square.msh")
    blocks = zip(mesh.cells, mesh.cell_data["gmsh:physical"])
    tags = sorted({int(tag) for block, physical in blocks if block.type == "line" for tag in physical})
    named = {name: len(cells.get("line", ())) for name, cells in mesh.cell_sets_dict.items() if name in ("bottom", "left")}
    names = {name: int(tag) for name, (tag, _) in mesh.field_data.items()}
    print(f"meshio {meshio.__version__}, format {version}: names {names}, tags of lines {tags}, lines in sets {named}")
    found[version] = tags, named.get("left")
sys.exit(found != {4.1: ([-12, 11], 0), 2.2: ([11, 12], None)})
PYTHON
python/bin/python read.py && echo "as written" || { echo "CHANGED"; exit 1; }
