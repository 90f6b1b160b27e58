"""Writes pile.msh: the section of pile.geo in triangles of six nodes, without Gmsh.

A graded grid whose inner nodes are moved about, each cell cut along its shorter diagonal.
"""
import math


def graded(start, parts):
    at = [start]
    for n, to, ratio in parts:
        first = at[-1]
        total = sum(ratio**i for i in range(n))
        for i in range(1, n + 1):
            at.append(first + (to - first) * sum(ratio**j for j in range(i)) / total)
    return at


R = graded(0.0, [(2, 0.5, 0.7), (5, 1.5, 1.4), (9, 25.0, 1.4)])
Z = graded(-30.0, [(7, -17.0, 0.75), (7, -15.0, 0.8), (18, -5.0, 1.05), (8, 0.0, 1.0)])
KEPT_R, KEPT_Z = {0.0, 0.5, 25.0}, {-30.0, -15.0, -5.0, 0.0}


def kept(values, value):
    return any(abs(value - other) < 1e-9 for other in values)


def place(i, j):
    """A node of the grid, moved by up to an eighth of the cell unless a line holds it."""
    r, z = R[i], Z[j]
    wave = math.sin(12.9898 * i + 78.233 * j)
    if not kept(KEPT_R, r):
        r += 0.125 * wave * min(R[i + 1] - R[i], R[i] - R[i - 1])
    if not kept(KEPT_Z, z):
        z += 0.125 * math.cos(3.0 * wave) * min(Z[j + 1] - Z[j], Z[j] - Z[j - 1])
    return r, z


nodes, number = [], {}


def node(key, at):
    if key not in number:
        nodes.append(at)
        number[key] = len(nodes)
    return number[key]


def corner(i, j):
    return node((i, j), place(i, j))


def middle(a, b):
    at = [nodes[k - 1] for k in (a, b)]
    return node((min(a, b), max(a, b), "m"), tuple((p + q) / 2 for p, q in zip(*at)))


def group(a, b, c):
    r, z = (sum(nodes[k - 1][x] for k in (a, b, c)) / 3 for x in (0, 1))
    if r < 0.5 and z > -15:
        return 3
    return 2 if z > -5 else 1


NAMES = {1: "sand", 2: "clay", 3: "pile"}
LINES = {
    11: ("axis", lambda r, z: abs(r) < 1e-9),
    12: ("far", lambda r, z: abs(r - 25) < 1e-9),
    13: ("bottom", lambda r, z: abs(z + 30) < 1e-9),
    14: ("surface", lambda r, z: abs(z) < 1e-9 and r > 0.5 - 1e-9),
    15: ("head", lambda r, z: abs(z) < 1e-9 and r < 0.5 + 1e-9),
    16: ("shaft_clay", lambda r, z: abs(r - 0.5) < 1e-9 and z > -5 - 1e-9),
    17: ("shaft_sand", lambda r, z: abs(r - 0.5) < 1e-9 and -15 - 1e-9 < z < -5 + 1e-9),
    18: ("base", lambda r, z: abs(z + 15) < 1e-9 and r < 0.5 + 1e-9),
}
elements, edges = [], set()
for i in range(len(R) - 1):
    for j in range(len(Z) - 1):
        a, b, c, d = corner(i, j), corner(i + 1, j), corner(i + 1, j + 1), corner(i, j + 1)
        length = lambda p, q: math.dist(nodes[p - 1], nodes[q - 1])
        halves = [(a, b, c), (a, c, d)] if length(a, c) < length(b, d) else [(a, b, d), (b, c, d)]
        for corners in halves:
            sides = [(corners[k], corners[(k + 1) % 3]) for k in range(3)]
            middles = [middle(p, q) for p, q in sides]
            elements.append((9, group(*corners), list(corners) + middles))
            edges.update((min(p, q), max(p, q)) for p, q in sides)
curves = []
for a, b in sorted(edges):
    for tag, (_, is_on) in LINES.items():
        if is_on(*nodes[a - 1]) and is_on(*nodes[b - 1]):
            curves.append((8, tag, [a, b, middle(a, b)]))
with open("pile.msh", "w") as file:
    print("$MeshFormat\n2.2 0 8\n$EndMeshFormat", file=file)
    names = [(1, tag, name) for tag, (name, _) in LINES.items()]
    names += [(2, tag, name) for tag, name in NAMES.items()]
    print("$PhysicalNames", len(names), sep="\n", file=file)
    for dimension, tag, name in names:
        print(dimension, tag, f'"{name}"', file=file)
    print("$EndPhysicalNames\n$Nodes", len(nodes), sep="\n", file=file)
    for k, (r, z) in enumerate(nodes, 1):
        print(k, f"{r:.9g}", f"{z:.9g}", 0, file=file)
    everything = curves + elements
    print("$EndNodes\n$Elements", len(everything), sep="\n", file=file)
    for k, (kind, tag, own) in enumerate(everything, 1):
        print(k, kind, 2, tag, tag, *own, file=file)
    print("$EndElements", file=file)
