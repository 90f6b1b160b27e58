#!/usr/bin/env bash
# meshio 5.3.5 (PyPI) reads a cube of Gmsh 4.15.2 (PyPI), once from its own format and once from MED, the format of Salome and Code_Aster.
# A good guess: both have the same elements, and the volume of each is positive.
# Seen: tetrahedra, hexahedra and wedges from MED are inside out: their Jacobians are negative. MED lists the nodes of a volume in the opposite
# direction, and meshio passes them on as they are, also into a VTU file. Gmsh reads the MED file back as it was.
# Source: src/meshio/med/_med.py of meshio, which renumbers nothing; src/geo/GModelIO_MED.cpp of Gmsh, med2mshNodeIndex.
set -euo pipefail
place=$(mktemp -d) && trap 'rm -rf "$place"' EXIT && cd "$place"
python3 -m venv python && python/bin/pip -q --disable-pip-version-check install meshio==5.3.5 h5py==3.16.0 gmsh==4.15.2
cat >read.py <<'PYTHON'
import sys

import gmsh
import meshio
import numpy

EDGES = {"tetra": (1, 2, 3), "hexahedron": (1, 3, 4), "wedge": (1, 2, 3)}  # corners next to the first one, right-handed


def jacobians(file, kind):
    mesh = meshio.read(file)
    corners = mesh.points[mesh.get_cells_type(kind)]
    return numpy.linalg.det(corners[:, EDGES[kind]] - corners[:, :1])


def cube(kind):
    gmsh.clear()
    bottom = gmsh.model.occ.addRectangle(0, 0, 0, 1, 1)
    layers = {"tetra": []}.get(kind, [1])
    gmsh.model.occ.extrude([(2, bottom)], 0, 0, 1, layers, recombine=bool(layers))
    gmsh.model.occ.synchronize()
    for _, curve in gmsh.model.getEntities(1):
        gmsh.model.mesh.setTransfiniteCurve(curve, 2)
    for _, surface in gmsh.model.getEntities(2):
        gmsh.model.mesh.setTransfiniteSurface(surface)
        if kind == "hexahedron":
            gmsh.model.mesh.setRecombine(2, surface)
    gmsh.model.addPhysicalGroup(3, [1], name="soil")  # meshio reads no MED file of Gmsh without
    gmsh.model.mesh.generate(3)


gmsh.initialize()
gmsh.option.setNumber("General.Terminal", 0)
found = {}
print(f"meshio {meshio.__version__}, Gmsh {gmsh.__version__}")
for kind in EDGES:
    cube(kind)
    for file in ("cube.msh", "cube.med"):
        gmsh.write(file)
    meshio.write("cube.vtu", meshio.read("cube.med"))
    gmsh.open("cube.med")
    gmsh.write("again.msh")
    signs = {file: sorted(set(numpy.sign(jacobians(file, kind)))) for file in ("cube.msh", "cube.med", "cube.vtu", "again.msh")}
    print(f"{kind}: signs of the Jacobians {({file: [int(sign) for sign in some] for file, some in signs.items()})}")
    found[kind] = list(signs.values())
sys.exit(any(signs != [[1], [-1], [-1], [1]] for signs in found.values()))
PYTHON
python/bin/python read.py && echo "as written" || { echo "CHANGED"; exit 1; }
