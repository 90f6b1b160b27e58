#!/usr/bin/env bash
# scikit-fem 12.0.2 and meshio 5.3.5 (PyPI) read a mesh of Gmsh 4.15.2 (PyPI): a square whose surface and whose left side have names.
# A good guess: `Mesh.load` has the side among its `boundaries` for triangles of the first and of the second order: the sides that a
# boundary consists of are the same.
# Seen: of the second order it has no boundary, in formats 2.2 and 4.1, and a general warning. The subdomain is there. meshio has the three-node
# lines of the side; scikit-fem looks for two-node lines, and nodes of meshes of the first order.
# Source: skfem/io/meshio.py, from_meshio (`bnd_type`).
set -euo pipefail
place=$(mktemp -d) && trap 'rm -rf "$place"' EXIT && cd "$place"
python3 -m venv python && python/bin/pip -q --disable-pip-version-check install scikit-fem==12.0.2 meshio==5.3.5 gmsh==4.15.2
cat >read.py <<'PYTHON'
import sys

import gmsh
import meshio
import skfem

gmsh.initialize()
gmsh.option.setNumber("General.Terminal", 0)
square = gmsh.model.occ.addRectangle(0, 0, 0, 1, 1)
gmsh.model.occ.synchronize()
left = gmsh.model.getEntitiesInBoundingBox(-0.1, -0.1, -0.1, 0.1, 1.1, 0.1, 1)
gmsh.model.addPhysicalGroup(1, [tag for _, tag in left], 11, "left")
gmsh.model.addPhysicalGroup(2, [square], 21, "sand")
gmsh.option.setNumber("Mesh.MeshSizeMax", 0.25)
gmsh.model.mesh.generate(2)
print(f"scikit-fem {skfem.__version__}, meshio {meshio.__version__}")
found = {}
for order in (1, 2):
    gmsh.model.mesh.setOrder(order)
    for version in (2.2, 4.1):
        gmsh.option.setNumber("Mesh.MshFileVersion", version)
        gmsh.write("square.msh")
        lines = sum(len(block.data) for block in meshio.read("square.msh").cells if block.type in ("line", "line3"))
        mesh = skfem.Mesh.load("square.msh")
        boundaries = {name: len(facets) for name, facets in (mesh.boundaries or {}).items()}
        has_sand = len(mesh.subdomains["sand"]) == mesh.t.shape[1]
        print(f"order {order}, format {version}: {type(mesh).__name__}, lines {lines}, boundaries {boundaries}, sand {has_sand}")
        found[order, version] = lines, boundaries, has_sand
as_written = {(order, version): (8, {"left": 8} if order == 1 else {}, True) for order in (1, 2) for version in (2.2, 4.1)}
sys.exit(found != as_written)
PYTHON
python/bin/python read.py && echo "as written" || { echo "CHANGED"; exit 1; }
