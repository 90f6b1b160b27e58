"""Writes the mesh files of these cases: `python3 meshes.py`.

A grid of n × m cells is mapped into the plane; each cell is a quad of 8 nodes or two triangles of 6.
Gmsh format 2.2, text. Nothing but Python is needed.
"""
from math import asin, cos, radians, sin
from pathlib import Path

HERE = Path(__file__).parent


def write(path, n, m, place, group, lines, triangles=False, points=()):
    """`place(i, j)`: where grid point (i, j) of half cells lies; `group(i, j)`: of cell (i, j);
    `lines`: name -> list of pairs of corner points (in half cells, two apart)."""
    numbers, nodes = {}, []

    def node(i, j):
        if (i, j) not in numbers:
            x, y = place(i, j)
            nodes.append((x, y))
            numbers[i, j] = len(nodes)
        return numbers[i, j]

    elements, groups = [], {}
    for b in range(m):
        for a in range(n):
            i, j = 2 * a, 2 * b
            name = group(a, b)
            tag = groups.setdefault(name, len(groups) + 1)
            p = lambda k, l: node(i + k, j + l)
            if triangles:
                # The diagonal is straight, as inner sides of Gmsh's are.
                ends = nodes[p(0, 0) - 1], nodes[p(2, 2) - 1]
                nodes[p(1, 1) - 1] = tuple((u + v) / 2 for u, v in zip(*ends))
                elements.append((9, tag, [p(0, 0), p(2, 0), p(2, 2), p(1, 0), p(2, 1), p(1, 1)]))
                elements.append((9, tag, [p(0, 0), p(2, 2), p(0, 2), p(1, 1), p(1, 2), p(0, 1)]))
            else:
                corners = [p(0, 0), p(2, 0), p(2, 2), p(0, 2)]
                elements.append((16, tag, corners + [p(1, 0), p(2, 1), p(1, 2), p(0, 1)]))
    names = [(2, tag, name) for name, tag in groups.items()]
    tag = len(groups)
    for name, sides in lines.items():
        tag += 1
        names.append((1, tag, name))
        for (i, j), (k, l) in sides:
            elements.append((8, tag, [node(i, j), node(k, l), node((i + k) // 2, (j + l) // 2)]))
    for name, at in points:
        tag += 1
        names.append((0, tag, name))
        elements.append((15, tag, [node(*at)]))
    with open(HERE / path, "w") as out:
        out.write("$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n%d\n" % len(names))
        out.writelines('%d %d "%s"\n' % name for name in names)
        out.write("$EndPhysicalNames\n$Nodes\n%d\n" % len(nodes))
        out.writelines("%d %.17g %.17g 0\n" % (k + 1, x, y) for k, (x, y) in enumerate(nodes))
        out.write("$EndNodes\n$Elements\n%d\n" % len(elements))
        for k, (kind, tag, of) in enumerate(elements):
            out.write("%d %d 2 %d %d %s\n" % (k + 1, kind, tag, tag, " ".join(map(str, of))))
        out.write("$EndElements\n")


def row(n, j):
    """Sides along row j of half cells."""
    return [((2 * a, j), (2 * a + 2, j)) for a in range(n)]


def column(m, i):
    """Sides along column i of half cells."""
    return [((i, 2 * b), (i, 2 * b + 2)) for b in range(m)]


def joint_at_30_degrees():
    c, s = cos(radians(30)), sin(radians(30))
    n = 4
    turned = lambda i, j: (i / (2 * n) * c - j / (2 * n) * s, i / (2 * n) * s + j / (2 * n) * c)
    group = lambda a, b: "lower" if b < n // 2 else "upper"
    lines = {"bottom": row(n, 0), "joint": row(n, n), "top": row(n, 2 * n)}
    for name in ["quads", "triangles"]:
        write(f"joint_at_30_degrees/{name}.msh", n, n, turned, group, lines, name == "triangles")


def oblique_interface():
    n, m = 2, 6

    def place(i, j):
        x, t = i / (2 * n), j / m  # t from 0 to 2, the interface at 1
        middle = 1 + x
        return x, t * middle if t <= 1 else middle + (t - 1) * (3 - middle)

    group = lambda a, b: "lower" if b < m // 2 else "upper"
    lines = {
        "bottom": row(n, 0),
        "joint": row(n, m),
        "top": row(n, 2 * m),
        "left": column(m, 0),
        "right": column(m, 2 * n),
    }
    for name in ["quads", "triangles"]:
        write(f"oblique_interface/{name}.msh", n, m, place, group, lines, name == "triangles", [("corner", (0, 0))])


def thick_cylinder():
    n = 8
    place = lambda i, j: (1 + i / (2 * n), j / (2 * n))
    lines = {"bottom": row(n, 0), "top": row(n, 2), "inner": column(1, 0), "outer": column(1, 2 * n)}
    write("thick_cylinder/triangles.msh", n, 1, place, lambda a, b: "ground", lines, True)


def thick_sphere():
    """A half of a hollow sphere, radii 1 and 2, by the angle from the equator to the pole."""
    for n in [2, 4, 8]:
        m = 2 * n

        def place(i, j):
            radius, angle = 1 + i / (2 * n), radians(90 * j / (2 * m))
            return radius * cos(angle) if j < 2 * m else 0.0, radius * sin(angle)

        lines = {"equator": row(n, 0), "axis": row(n, 2 * m), "inner": column(m, 0), "outer": column(m, 2 * n)}
        points = [("inner_end", (0, 0)), ("outer_end", (2 * n, 0))]
        write(f"thick_sphere/quads_{n}.msh", n, m, place, lambda a, b: "ground", lines, points=points)
        if n > 2:
            write(f"thick_sphere/triangles_{n}.msh", n, m, place, lambda a, b: "ground", lines, True, points)


def ring(path, n, m, triangles):
    """A quarter of a ring, radii 1 and 2, interface halfway."""

    def place(i, j):
        radius, angle = 1 + i / (2 * n), radians(90 * j / (2 * m))
        return (radius * cos(angle), radius * sin(angle)) if j < 2 * m else (0.0, radius)

    group = lambda a, b: "near" if a < n // 2 else "far"
    lines = {
        "along_x": row(n, 0),
        "along_y": row(n, 2 * m),
        "inner": column(m, 0),
        "joint": column(m, n),
        "outer": column(m, 2 * n),
    }
    points = [("inner_end", (0, 0)), ("outer_end", (2 * n, 0))]
    write(path, n, m, place, group, lines, triangles, points)


def curved_interface():
    for n in [2, 4]:
        ring(f"curved_interface/quads_{n}.msh", n, n, False)
        ring(f"curved_interface/triangles_{n}.msh", n, n, True)


def activated_interface():
    """A square whose interface is a wave."""
    n, m = 4, 4

    def place(i, j):
        x, t = i / (2 * n), j / m
        middle = 0.5 + 0.2 * sin(radians(270 * x))
        return x, t * middle if t <= 1 else middle + (t - 1) * (1 - middle)

    group = lambda a, b: "lower" if b < m // 2 else "upper"
    lines = {
        "bottom": row(n, 0),
        "joint": row(n, m),
        "top": row(n, 2 * m),
        "left": column(m, 0),
        "right": column(m, 2 * n),
    }
    write("activated_interface/wave.msh", n, m, place, group, lines, points=[("corner", (0, 0))])

    # A pile: shaft upright to -4 m, then inclined to a corner at (0.4, -6), a round tip below it.
    n, m, across, below, inclined = 7, 10, 3, 4, 2

    def pile(i, j):
        if i > 2 * across and i % 2:
            return tuple((u + v) / 2 for u, v in zip(pile(i - 1, j), pile(i + 1, j)))
        angle = min(i / (2 * across), 1.0) * asin(0.8)
        x, y = (0.5 * sin(angle), -5.7 - 0.5 * cos(angle)) if i < 2 * across else (0.4, -6.0)
        if j <= 2 * below:
            y = -12 + j / (2 * below) * (y + 12)
        elif j <= 2 * (below + inclined):
            t = (j - 2 * below) / (2 * inclined)
            x, y = x * (1 + 0.25 * t), y + t * (-4 - y)
        else:
            x, y = 1.25 * x, -4 + (j - 2 * (below + inclined)) / (m - below - inclined) * 2
        beyond = max(i / (2 * across) - 1, 0) * across / (n - across)
        return x + beyond**2 * (6 - x), y

    group = lambda a, b: "pile" if a < across and b >= below else "ground"
    lines = {
        "axis": column(m, 0),
        "far": column(m, 2 * n),
        "bottom": row(n, 0),
        "head": row(n, 2 * m)[:across],
        "shaft": column(m, 2 * across)[below:],
        "base": row(n, 2 * below)[:across],
    }
    for name in ["quads", "triangles"]:
        write(f"activated_interface/pile_{name}.msh", n, m, pile, group, lines, name == "triangles")


def level_ground():
    """A square of level ground, elements with inclined sides or along a wave."""
    n, m = 4, 4
    for shape, middle in [("straight", lambda x: 0.5 + 0.3 * x), ("wave", lambda x: 0.5 + 0.2 * sin(radians(270 * x)))]:

        def place(i, j):
            x, t = i / (2 * n), j / m
            at = middle(x)
            return x, t * at if t <= 1 else at + (t - 1) * (1 - at)

        lines = {"bottom": row(n, 0), "left": column(m, 0), "right": column(m, 2 * n)}
        for name in ["quads", "triangles"]:
            write(f"level_ground/{shape}_{name}.msh", n, m, place, lambda a, b: "ground", lines, name == "triangles")


def lake():
    """Ground of 20 m with a slope of 1 in 2 from -2 m to -6 m."""
    n, m = 10, 4

    def place(i, j):
        x = 20 * i / (2 * n)
        surface = -2 - min(max(x - 6, 0), 8) / 2
        return x, -10 + (surface + 10) * j / (2 * m)

    lines = {"bottom": row(n, 0), "top": row(n, 2 * m), "left": column(m, 0), "right": column(m, 2 * n)}
    for name in ["quads", "triangles"]:
        write(f"lake/slope_{name}.msh", n, m, place, lambda a, b: "ground", lines, name == "triangles")


if __name__ == "__main__":
    for make in [
        joint_at_30_degrees,
        oblique_interface,
        activated_interface,
        curved_interface,
        lake,
        level_ground,
        thick_cylinder,
        thick_sphere,
    ]:
        folder = HERE / make.__name__
        folder.mkdir(exist_ok=True)
        make()
