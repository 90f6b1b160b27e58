#!/usr/bin/env bash
# meshio 5.3.5 (PyPI) writes a square and one of its sides as XDMF and reads the file: first with quads of 4 nodes and lines of 2, then with quads
# of 8 and lines of 3.
# A good guess: it reads both, as it reads files with quads of 8 nodes alone.
# Seen: of the second pair it raises `KeyError: 37`, the number of `Quadrilateral_8`. The same for any cell of the second order beside another kind:
# its table of nodes by number has the kinds of the first order. Each kind in a file of its own can be read.
# Source: meshio/xdmf/common.py, xdmf_idx_to_num_nodes; a request on its site, 1321, from 2022, mends it.
set -euo pipefail
place=$(mktemp -d) && trap 'rm -rf "$place"' EXIT && cd "$place"
python3 -m venv python && python/bin/pip -q --disable-pip-version-check install meshio==5.3.5 h5py
cat >read.py <<'PYTHON'
import sys

import meshio

POINTS = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0.5, 0, 0), (1, 0.5, 0), (0.5, 1, 0), (0, 0.5, 0)]


def again(cells):
    meshio.Mesh(POINTS, cells).write("square.xdmf")
    try:
        return [(block.type, block.data.tolist()) for block in meshio.read("square.xdmf").cells]
    except KeyError as error:
        return f"KeyError {int(error.args[0])}"


first = [("quad", [[0, 1, 2, 3]]), ("line", [[0, 1]])]
second = [("quad8", [list(range(8))]), ("line3", [[0, 1, 4]])]
found = {}
for name, cells in (("first order", first), ("second order", second), ("quads of the second order alone", second[:1])):
    found[name] = "the same" if again(cells) == cells else again(cells)
    print(f"meshio {meshio.__version__}, {name}: {found[name]}")
sys.exit(list(found.values()) != ["the same", "KeyError 37", "the same"])
PYTHON
python/bin/python read.py && echo "as written" || { echo "CHANGED"; exit 1; }
