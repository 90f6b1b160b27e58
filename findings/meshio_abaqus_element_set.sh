#!/usr/bin/env bash
# meshio 5.3.5 (PyPI) reads a file of Abaqus in which two blocks *ELEMENT of one set follow each other, ELSET=SOIL: four triangles (CPS3), then one
# quad (CPS4). Gmsh 4.15.2 (PyPI) writes such a file of each surface that it meshes with triangles and quads.
# A good guess: the set has all five elements, as in Abaqus and CalculiX, where a second ELSET of the same name adds to the first.
# Seen: it has one triangle and the quad: the numbers of the last block are taken in each block. The weight of three triangles is gone without a
# word. If the last block is the longer one, the set has numbers of elements that do not exist: of Gmsh's surface with 8 triangles and 17
# quads, 17 triangles. Sets that have an *ELSET of their own, such as Gmsh's physical groups, are right.
# Source: src/meshio/abaqus/_abaqus.py, read_buffer (`cell_sets_element.update`).
set -euo pipefail
place=$(mktemp -d) && trap 'rm -rf "$place"' EXIT && cd "$place"
python3 -m venv python && python/bin/pip -q --disable-pip-version-check install meshio==5.3.5 gmsh==4.15.2
cat >soil.inp <<'INP'
*NODE
1, 0., 0.
2, 1., 0.
3, 2., 0.
4, 0., 1.
5, 1., 1.
6, 2., 1.
7, 3., 0.
8, 3., 1.
*ELEMENT, TYPE=CPS3, ELSET=SOIL
1, 1, 2, 5
2, 1, 5, 4
3, 2, 3, 6
4, 2, 6, 5
*ELEMENT, TYPE=CPS4, ELSET=SOIL
5, 3, 7, 8, 6
INP
cat >read.py <<'PYTHON'
import sys

import gmsh
import meshio


def area(mesh, name):
    total = 0.0
    for block, numbers in zip(mesh.cells, mesh.cell_sets[name]):
        for nodes in block.data[numbers]:
            at = mesh.points[nodes]
            total += sum(a[0] * b[1] - a[1] * b[0] for a, b in zip(at, [*at[1:], at[0]])) / 2
    return total


def show(file):
    mesh = meshio.read(file)
    counts = {block.type: len(block) for block in mesh.cells}
    sets = {name: [len(numbers) for numbers in blocks] for name, blocks in mesh.cell_sets.items()}
    print(f"{file}: {counts}, numbers in sets {sets}")
    return mesh, counts, sets


print(f"meshio {meshio.__version__}, Gmsh {gmsh.__version__}")
mesh, counts, sets = show("soil.inp")
found = area(mesh, "SOIL")
print(f"area of the set {found:g}, of the elements 3")
right = counts == {"triangle": 4, "quad": 1} and sets == {"SOIL": [1, 1]} and found == 1.5

gmsh.initialize()
gmsh.option.setNumber("General.Terminal", 0)
gmsh.option.setNumber("Mesh.RecombinationAlgorithm", 0)
gmsh.model.occ.addRectangle(0, 0, 0, 3, 1)
gmsh.model.occ.synchronize()
for _, curve in gmsh.model.getEntities(1):
    gmsh.model.mesh.setTransfiniteCurve(curve, 6)
gmsh.model.mesh.setRecombine(2, 1)
gmsh.model.addPhysicalGroup(2, [1], name="soil")
gmsh.model.mesh.generate(2)
gmsh.write("surface.inp")
print(*(line for line in open("surface.inp") if line.startswith("*E")), sep="", end="")
_, counts, sets = show("surface.inp")
triangles, quads = counts["triangle"], counts["quad"]
right &= sets == {"soil": [triangles, quads], "Surface1": [quads, quads]} and triangles != quads
sys.exit(not right)
PYTHON
python/bin/python read.py && echo "as written" || { echo "CHANGED"; exit 1; }
