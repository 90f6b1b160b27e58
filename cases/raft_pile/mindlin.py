"""A rigid, smooth raft on a pile in an elastic half-space, by Mindlin's solution (Physics 7, 195, 1936). Needs NumPy.

Raft, shaft and base are rings of constant pressure. Ground below the raft settles by w, ground at the pile by w less
the shortening of the pile. Prints settlement (mm), loads of raft, shaft and base (kN).
"""
import numpy as np

E, NU, R0, LENGTH, R, E_PILE, LOAD = 30e3, 0.495, 0.3, 12.0, 3.0, 30e6, 6000.0
G = E / 2 / (1 + NU)


def settlement(r, z, c):
    """At (r, z) from a unit force at depth c."""
    a, b, k = np.sqrt(r**2 + (z - c) ** 2), np.sqrt(r**2 + (z + c) ** 2), 3 - 4 * NU
    w = k / a + (8 * (1 - NU) ** 2 - k) / b + (z - c) ** 2 / a**3
    w = w + (k * (z + c) ** 2 - 2 * c * z) / b**3 + 6 * c * z * (z + c) ** 2 / b**5
    return w / (16 * np.pi * G * (1 - NU))


def of_circle(r, z, a, c, points):
    angle = (np.arange(points) + 0.5) * np.pi / points
    return settlement(np.sqrt(r**2 + a**2 - 2 * r * a * np.cos(angle)), z, c).mean()


def rings(rafts, shafts, bases):
    edge = lambda a, b, n: a + (b - a) * np.sin(np.linspace(0, np.pi / 2, n + 1))
    pairs = lambda at: list(zip(at, at[1:]))
    return (
        [("raft", a, b) for a, b in pairs(edge(R0, R, rafts))]
        + [("shaft", a, b) for a, b in pairs(np.linspace(0, LENGTH, shafts + 1))]
        + [("base", a, b) for a, b in pairs(edge(0, R0, bases))]
    )


def of_ring(r, z, kind, a, b, near):
    """From a ring of unit load, cut into pieces if it is the point's own."""
    at, weights = np.polynomial.legendre.leggauss(6)
    cuts = np.linspace(a, b, 9 if near else 2)
    total = load = 0.0
    for lower, upper in zip(cuts, cuts[1:]):
        for x, weight in zip((lower + upper) / 2 + (upper - lower) / 2 * at, weights * (upper - lower) / 2):
            share = weight * (1.0 if kind == "shaft" else x)
            radius, depth = (R0, x) if kind == "shaft" else (x, 0.0 if kind == "raft" else LENGTH)
            total += share * of_circle(r, z, radius, depth, 400 if near else 96)
            load += share
    return total / load


def shortening(z, kind, a, b):
    """Of the pile above depth z, from the load that leaves it in this ring."""
    if kind == "raft":
        return 0.0
    a, b = (LENGTH, LENGTH + 1.0) if kind == "base" else (a, b)
    mean = (a + b) / 2 if b <= z else z if a >= z else ((z**2 - a**2) / 2 + (b - z) * z) / (b - a)
    return mean / (E_PILE * np.pi * R0**2)


def main(rafts=20, shafts=40, bases=4):
    parts = rings(rafts, shafts, bases)
    n = len(parts)
    matrix, right = np.zeros((n + 1, n + 1)), np.zeros(n + 1)
    for i, (kind, a, b) in enumerate(parts):
        middle = (a + b) / 2
        r, z = {"raft": (middle, 0.0), "shaft": (R0, middle), "base": (middle, LENGTH)}[kind]
        for j, part in enumerate(parts):
            matrix[i, j] = of_ring(r, z, *part, i == j)
            if kind != "raft":
                matrix[i, j] += shortening(z, *part)
        matrix[i, n], matrix[n, i] = -1.0, 1.0
    right[n] = LOAD
    loads = np.linalg.solve(matrix, right)
    print("settlement", round(1e3 * loads[n], 2))
    for name in ("raft", "shaft", "base"):
        print(name, round(sum(loads[i] for i in range(n) if parts[i][0] == name), 1))


if __name__ == "__main__":
    main()
