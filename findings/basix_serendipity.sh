#!/usr/bin/env bash
# Basix 0.11.0, the elements of FEniCSx (fenics-basix, PyPI): "serendipity" of degree 2 on a quadrilateral.
# A good guess: it is the element with 8 nodes of other programs: a coefficient is the value at a corner or in the middle of an edge. What such a
# program writes for its nodes can be taken over, in another order.
# Seen: it has 8 coefficients of the same functions, but four of them are means over edges. Of x^2 the edge from (0, 0) to (1, 0) has 1/3, not 1/4.
# The values of x^2 at the nodes, taken as coefficients, give 1/8 in the middle of that edge. Constants and linear functions show nothing.
# Source: python/basix/finite_element.py, LagrangeVariant and DPCVariant; DefElement, serendipity: integral moments on edges.
set -euo pipefail
place=$(mktemp -d) && trap 'rm -rf "$place"' EXIT && cd "$place"
python3 -m venv python && python/bin/pip -q --disable-pip-version-check install fenics-basix==0.11.0
cat >take.py <<'PYTHON'
import sys

import basix
import numpy

family, square = basix.ElementFamily.serendipity, basix.CellType.quadrilateral
element = basix.create_element(family, square, 2, basix.LagrangeVariant.legendre, basix.DPCVariant.legendre)
corners = [(0, 0), (1, 0), (0, 1), (1, 1)]
# In the order of edges of Basix.
middles = [(0.5, 0), (0, 0.5), (1, 0.5), (0.5, 1)]
nodes = numpy.array(corners + middles, dtype=float)
values = element.tabulate(0, nodes)[0, :, :, 0]
print(f"Basix {basix.__version__}, {element.dim} coefficients, edges {basix.topology(square)[1]}")
right = True
for name, function, middle in (("1", lambda x: 0 * x + 1, 1), ("x", lambda x: x, 0.5), ("x^2", lambda x: x**2, 0.125)):
    own = element.interpolation_matrix @ function(element.points[:, 0])
    at_nodes = function(nodes[:, 0])
    taken = values @ at_nodes
    print(f"{name}: coefficients {own.round(6)}, at the nodes {at_nodes}, the latter as coefficients give there {taken.round(6)}")
    # The space is that of the element with 8 nodes: it has the function exactly.
    right &= numpy.allclose(values @ own, at_nodes, atol=1e-12) and abs(taken[4] - middle) < 1e-12
    right &= name != "x^2" or abs(own[4] - 1 / 3) < 1e-12
sys.exit(not (right and element.dim == 8))
PYTHON
python/bin/python take.py && echo "as written" || { echo "CHANGED"; exit 1; }
