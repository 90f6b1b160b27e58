"""The heated pile in an elastic half-space, by the integral equation of ../raft_pile/mindlin.py. Needs NumPy.

Ground at the pile moves with it: free expansion of the pile less the shortening by its axial force, from the head on.
Prints the rise of the head (mm), the axial force at the head, the largest one and its depth (kN, m).
"""
import pathlib
import sys

import numpy as np

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent / "raft_pile"))
import mindlin

mindlin.E, mindlin.LENGTH = 59.8e3, 15.0
mindlin.G = mindlin.E / 2 / (1 + mindlin.NU)
STRAIN = 2e-4


def heated(held):
    parts = [part for part in mindlin.rings(1, 40, 4) if part[0] != "raft"]
    n = len(parts)
    matrix, right = np.zeros((n + 1, n + 1)), np.zeros(n + 1)
    depths = [mindlin.LENGTH if kind == "base" else (a + b) / 2 for kind, a, b in parts]
    for i, (kind, a, b) in enumerate(parts):
        r = (a + b) / 2 if kind == "base" else mindlin.R0
        for j, part in enumerate(parts):
            matrix[i, j] = mindlin.of_ring(r, depths[i], *part, i == j) + mindlin.shortening(depths[i], *part)
        matrix[i, n], right[i] = -1.0, STRAIN * depths[i]
    # The head stays where it is, or carries nothing.
    matrix[n] = [0.0] * n + [1.0] if held else [1.0] * n + [0.0]
    loads = np.linalg.solve(matrix, right)
    forces = [loads[i:n].sum() for i in range(n)]
    largest = int(np.argmax(forces))
    print("held" if held else "free", round(-1e3 * loads[n], 3), round(forces[0], 1), round(forces[largest], 1), depths[largest])


heated(False)
heated(True)
