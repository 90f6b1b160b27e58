"""Explicit integration of the rate equations of hardening soil, apart from the law's own code.

For developers. `python3 reference.py > reference.csv` writes the points that `reference.rs` compares the law
with. Standard library only. Principal axes are fixed, compression is positive, stresses are in kPa. Rates follow
from a linear system of stress rates, strain rates and multipliers for each set of surfaces that may be active;
the set whose multipliers are positive, and whose other surfaces are not left, is taken. Heun's method with small
equal steps.
"""

import itertools
import math

DENSE = dict(e50=30e3, eoed=30e3, eur=90e3, m=0.55, nu=0.25, c=0.0, phi=42.0, psi=16.0, pref=100.0, k0=0.4, rf=0.9)
CLAY = dict(e50=6e3, eoed=4e3, eur=20e3, m=0.9, nu=0.2, c=5.0, phi=25.0, psi=0.0, pref=100.0, k0=0.6, rf=0.9)


def solve(matrix, right):
    """Gaussian elimination with row exchange; None if singular."""
    n = len(right)
    rows = [list(row) + [x] for row, x in zip(matrix, right)]
    for i in range(n):
        pivot = max(range(i, n), key=lambda k: abs(rows[k][i]))
        if abs(rows[pivot][i]) < 1e-300:
            return None
        rows[i], rows[pivot] = rows[pivot], rows[i]
        for k in range(i + 1, n):
            factor = rows[k][i] / rows[i][i]
            if factor:
                rows[k] = [x - factor * y for x, y in zip(rows[k], rows[i])]
    x = [0.0] * n
    for i in reversed(range(n)):
        x[i] = (rows[i][n] - sum(rows[i][j] * x[j] for j in range(i + 1, n))) / rows[i][i]
    return x


class Soil:
    def __init__(self, p):
        self.p = p
        phi, psi = math.radians(p["phi"]), math.radians(p["psi"])
        self.sin, self.sin_psi = math.sin(phi), math.sin(psi)
        self.cv = (self.sin - self.sin_psi) / (1 - self.sin * self.sin_psi)
        self.apex = p["c"] / math.tan(phi)
        self.delta = (3 + self.sin) / (3 - self.sin)
        self.ei = 2 * p["e50"] / (2 - p["rf"])
        self.cap()

    def scale(self, x):
        return ((x + self.apex) / (self.p["pref"] + self.apex)) ** self.p["m"]

    def qf(self, s3):
        return (s3 + self.apex) * 2 * self.sin / (1 - self.sin)

    def shear(self, q, s3):
        """What γ_ps is on the surface through q and σ₃."""
        qa = self.qf(s3) / self.p["rf"]
        s = self.scale(s3)
        return 2 / (self.ei * s) * q / (1 - q / qa) - 2 * q / (self.p["eur"] * s)

    def slopes(self, q, s3):
        """Derivatives of `shear`, by differences."""
        h, k = 1e-5 * max(q, 1e-3 * s3), 1e-5 * (s3 + self.apex)
        return (
            (self.shear(q + h, s3) - self.shear(q - h, s3)) / (2 * h),
            (self.shear(q, s3 + k) - self.shear(q, s3 - k)) / (2 * k),
        )

    def dilatancy(self, s1, s3):
        x = (s1 - s3) / (s1 + s3 + 2 * self.apex)
        if x < 0.75 * self.sin:
            return 0.0
        return max(0.0, (min(x, self.sin) - self.cv) / (1 - min(x, self.sin) * self.cv))

    def cap(self):
        """M and H: the oedometer's axial and lateral strain rates without those of elasticity and shear are the
        cap's; their ratio gives M, their size H."""
        p = self.p
        k = p["k0"]
        s1, s3 = p["pref"], k * p["pref"]
        q, mean = s1 - s3, (s1 + 2 * s3) / 3
        by_q, by_s3 = self.slopes(q, s3)
        gamma = max(by_q * (1 - k) + by_s3 * k, 0.0)
        u = self.dilatancy(s1, s3)
        e, nu = p["eur"] * self.scale(s3), p["nu"]
        axial = 1 / p["eoed"] - (1 - 2 * nu * k) / e - gamma * (1 - u) / 2
        radial = -(k - nu - nu * k) / e + gamma * (1 + u) / 4
        volume, distortion = axial + 2 * radial, 2 / 3 * (axial - radial)
        self.M = math.sqrt(q / mean * volume / distortion)
        pp = math.sqrt(q * q / self.M**2 + mean * mean)
        self.H = pp / p["pref"] / (volume * self.scale(pp))

    def pp(self, s):
        q = s[0] + (self.delta - 1) * s[1] - self.delta * s[2]
        return math.sqrt((q / self.M) ** 2 + (sum(s) / 3) ** 2)

    def start(self, s, ocr):
        """p_p and γ_ps at the start."""
        s = sorted(s, reverse=True)
        past = [ocr * s[0], self.p["k0"] * ocr * s[0], self.p["k0"] * ocr * s[0]]
        return max(self.pp(past), self.pp(s)), self.shear(s[0] - s[2], s[2])


def unit(i):
    return [1.0 if j == i else 0.0 for j in range(3)]


def mix(*terms):
    """Sum of factor times vector."""
    return [sum(factor * vector[i] for factor, vector in terms) for i in range(3)]


def surfaces(soil, s, pp, gamma, symmetric):
    """Surfaces that the stress is on: name, gradient by stress, flow, hardening and what the multiplier hardens by. On
    an edge each order of the equal stresses has its own; in a symmetric test one surface with their mean."""
    order = sorted(range(3), key=lambda i: -s[i])
    s1, s2, s3 = (s[n] for n in order)
    near = lambda x, y: abs(x - y) < 1e-4 * abs(s1)
    orders = [[unit(i) for i in order]]
    if near(s2, s3) or near(s1, s2):
        i, j, k = order
        orders.append([unit(n) for n in ((i, k, j) if near(s2, s3) else (j, i, k))])
    if symmetric and len(orders) == 2:
        orders = [[mix((0.5, x), (0.5, y)) for x, y in zip(*orders)]]
    found = []
    q = s1 - s3
    u = soil.dilatancy(s1, s3)
    for major, middle, minor in orders:
        flow = mix(((1 - u) / 2, major), (-(1 + u) / 2, minor))
        # γ_ps is ε₁ − ε₂ − ε₃ in the order of the stresses; equal ones take either place, or both by halves.
        rate = flow[order[0]] - flow[order[1]] - flow[order[2]]
        if symmetric and near(s1, s2) and not near(s2, s3):
            rate = (1 + u) / 2
        if q > soil.qf(s3) * (1 - 1e-9):
            slope = 2 * soil.sin / (1 - soil.sin)
            found.append(("limit", mix((1, major), (-1 - slope, minor)), flow, 0.0, 0.0))
        elif q > 0 and soil.shear(q, s3) > gamma - 1e-9:
            by_q, by_s3 = soil.slopes(q, s3)
            gradient = mix((by_q, major), (by_s3 - by_q, minor))
            found.append(("shear", gradient, flow, -1.0, rate))
        if soil.pp([s1, s2, s3]) > pp * (1 - 1e-9):
            p, qt = sum(s) / 3, s1 + (soil.delta - 1) * s2 - soil.delta * s3
            direction = mix((1, major), (soil.delta - 1, middle), (-soil.delta, minor))
            gradient = [2 * p / 3 + 2 * qt / soil.M**2 * d for d in direction]
            found.append(("cap", gradient, gradient, -2 * pp, soil.H * soil.scale(pp) * 2 * p))
    return found


def rates(soil, s, pp, gamma, control, symmetric):
    """Rates of stress, strain, p_p, γ_ps. `control` is for each axis ("stress" or "strain", rate)."""
    e, nu = soil.p["eur"] * soil.scale(min(s)), soil.p["nu"]
    on = surfaces(soil, s, pp, gamma, symmetric)
    for n in range(len(on), -1, -1):
        for active in itertools.combinations(on, n):
            size = 6 + n
            matrix, right = [], []
            for i in range(3):
                # Strain rate less elastic and plastic strain rates.
                row = [0.0] * size
                for j in range(3):
                    row[j] = -(1.0 if i == j else -nu) / e
                row[3 + i] = 1.0
                for k, surface in enumerate(active):
                    row[6 + k] = -surface[2][i]
                matrix.append(row)
                right.append(0.0)
            for i, (kind, rate) in enumerate(control):
                row = [0.0] * size
                row[i if kind == "stress" else 3 + i] = 1.0
                matrix.append(row)
                right.append(rate)
            for name, gradient, _, hardening, _ in active:
                row = [0.0] * size
                row[:3] = gradient
                # All multipliers of a kind harden it.
                for k, other in enumerate(active):
                    if other[0] == name:
                        row[6 + k] = hardening * other[4]
                matrix.append(row)
                right.append(0.0)
            # Stresses weigh 1/e.
            matrix = [[x * (e if c < 3 else 1) for c, x in enumerate(row)] for row in matrix]
            x = solve(matrix, right)
            if x is None:
                continue
            ds = [e * y for y in x[:3]]
            grown = lambda kind: sum(y * a[4] for a, y in zip(active, x[6:]) if a[0] == kind)
            others = [surface for surface in on if surface not in active]
            left = all(
                sum(g * d for g, d in zip(o[1], ds)) + o[3] * grown(o[0]) <= 1e-9 * e for o in others
            )
            if all(y >= 0 for y in x[6:]) and left:
                return ds, x[3:6], grown("cap"), grown("shear")
    raise ArithmeticError(f"no active set at {s}")


def run(soil, s, pp, gamma, segments, symmetric, steps=20_000):
    """Points at the ends of ten parts of each segment."""
    s, e = list(s), [0.0] * 3
    yield [*s, *e, pp, gamma]
    for control in segments:
        for i in range(steps):
            add = lambda a, b, h: [x + h * y for x, y in zip(a, b)]
            h = 1 / steps
            a = rates(soil, s, pp, gamma, control, symmetric)
            b = rates(soil, add(s, a[0], h), pp + h * a[2], gamma + h * a[3], control, symmetric)
            s = add(add(s, a[0], h / 2), b[0], h / 2)
            e = add(add(e, a[1], h / 2), b[1], h / 2)
            pp += h / 2 * (a[2] + b[2])
            gamma += h / 2 * (a[3] + b[3])
            # Back to the surfaces: what the integration drifts is added to hardening.
            order = sorted(s, reverse=True)
            pp = max(pp, soil.pp(order))
            q = min(order[0] - order[2], soil.qf(order[2]))
            gamma = max(gamma, soil.shear(q, order[2]))
            if (i + 1) % (steps // 10) == 0:
                yield [*s, *e, pp, gamma]


STRAIN, STRESS = "strain", "stress"
FREE = (STRESS, 0.0)


def held(rate):
    return [(STRAIN, rate), (STRAIN, 0.0), (STRAIN, 0.0)]


PATHS = {
    "drained_overconsolidated": (DENSE, [100, 100, 100], 20.0, [[(STRAIN, 0.03), FREE, FREE]]),
    "drained": (DENSE, [100, 100, 100], 1.0, [[(STRAIN, 0.03), FREE, FREE]]),
    "drained_clay": (CLAY, [100, 100, 100], 1.0, [[(STRAIN, 0.05), FREE, FREE]]),
    "oedometer": (DENSE, [50, 20, 20], 1.0, [held(0.008), held(-0.001), held(0.002)]),
    "oedometer_clay": (CLAY, [50, 30, 30], 1.0, [held(0.03), held(-0.005), held(0.01)]),
    "undrained": (DENSE, [100, 100, 100], 1.0, [[(STRAIN, 0.01), (STRAIN, -0.005), (STRAIN, -0.005)]]),
    "undrained_clay": (CLAY, [100, 60, 60], 1.5, [[(STRAIN, 0.03), (STRAIN, -0.015), (STRAIN, -0.015)]]),
    "extension": (DENSE, [100, 100, 100], 1.5, [[(STRAIN, -0.01), FREE, FREE]]),
    "lateral": (CLAY, [100, 80, 60], 1.0, [[(STRAIN, 0.03), FREE, (STRAIN, -0.01)]]),
    "plane": (DENSE, [100, 70, 60], 1.0, [[(STRAIN, 0.02), (STRAIN, 0.0), FREE]]),
}


def main():
    print("path,segment,point,s1,s2,s3,e1,e2,e3,p_p,gamma_ps")
    for name, (parameters, s, ocr, segments) in PATHS.items():
        soil = Soil(parameters)
        pp, gamma = soil.start(s, ocr)
        symmetric = all(control[1] == control[2] for control in segments) and s[1] == s[2]
        for i, row in enumerate(run(soil, s, pp, gamma, segments, symmetric)):
            segment = max(i - 1, 0) // 10
            print(f"{name},{segment},{i},{','.join(f'{x:.9e}' for x in row)}", flush=True)


if __name__ == "__main__":
    main()
