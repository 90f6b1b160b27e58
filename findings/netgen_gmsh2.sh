#!/usr/bin/env bash
# Netgen 6.2.2608 (netgen-mesher, PyPI) writes a plane mesh whose surface and edges have names as "Gmsh2 Format".
# A good guess: the file has the version 2.2, the edges as lines with the numbers of their boundaries, and $PhysicalNames.
# Seen: the version is 2.000000, there are triangles and no lines, no names, and coordinates have six decimals.
set -euo pipefail
place=$(mktemp -d) && trap 'rm -rf "$place"' EXIT && cd "$place"
python3 -m venv python && python/bin/pip -q --disable-pip-version-check install netgen-mesher==6.2.2608
cat >write.py <<'PYTHON'
import re
import sys
from importlib.metadata import version

from netgen.geom2d import SplineGeometry

square = SplineGeometry()
corners = [square.AppendPoint(*at) for at in ((0, 0), (1 / 3, 0), (1 / 3, 1), (0, 1))]
for number, name in enumerate(("bottom", "right", "top", "left")):
    ends = corners[number], corners[(number + 1) % 4]
    square.Append(["line", *ends], bc=name, leftdomain=1, rightdomain=0)
square.SetMaterial(1, "sand")
mesh = square.GenerateMesh(maxh=0.5)
mesh.Export("square.msh", "Gmsh2 Format")
text = open("square.msh").read()
kinds = {line.split()[1] for line in text.split("$Elements\n")[1].splitlines()[1:-1]}
names = [mesh.GetMaterial(1), *(mesh.GetBCName(number) for number in range(4))]
print(f"Netgen {version('netgen-mesher')}: {len(mesh.Elements1D())} edges, {len(mesh.Elements2D())} triangles, names {names}; in the file:")
print(text)
print(f"kinds of elements {kinds} (1 line, 2 triangle)")
is_so = (
    text.startswith("$MeshFormat\n2.000000 0 8\n")
    and kinds == {"2"}
    and "PhysicalNames" not in text
    and not any(name in text for name in names)
    and re.search(r" 0\.333333 ", text) is not None
)
sys.exit(not is_so)
PYTHON
python/bin/python write.py && echo "as written" || { echo "CHANGED"; exit 1; }
