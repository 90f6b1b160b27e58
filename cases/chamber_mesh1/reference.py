#!/usr/bin/env python3
"""Independent reference solution of the case `chamber_mesh1` (pile in a calibration chamber).

Problem   De Gennaro & Frank, "Modelisation de l'interaction sol-pieu par la methode des elements finis":
          mesh 1, elastic sand, thin layer (t = 2 mm) with the interface law MEPI without softening on the shaft.
          Axisymmetric, small strains, units kN, m, kPa; finite-element stresses tension positive; forces are
          for the whole turn (2 pi).  Phase 1: confinement, one increment, everything elastic (layer = sand).
          Phase 2: MEPI in the layer with the stress carried over (xi = 0), head free, 5 increments.  At its
          initial strain MEPI returns its initial stress; the force that this leaves out of balance is taken off in
          proportion to the phase's course.  Phase 3: head pushed 5 mm in 50 increments; displacements from its start.
Source    MEPI: equations (6)-(10), (12)-(17); thin layer: (18)-(19); parameters: Tables III and IV, p_0 = 100 kPa.
Method    8-node quads, 3x3 Gauss points (--points 2: 2x2), full Newton with the consistent tangent, backtracking
          line search.  It starts from the last increment, else from the tangent, and iterates to a relative residual of
          1e-10 over the free equations, then once more.  The increment is halved when both starts fail (counted).
          MEPI backward Euler: scan for the first sign change of the scalar equation in d(lambda), then brentq.
          Layer as an isotropic elastic quad (M = K_n t, G = K_t t) with plastic strain in n and nm only.
Options   --points 2, --p0 1, --increments 50, --no-in-plane (jump = t eps_n, t gamma; in-plane stress frozen),
          --selftest (law against quadrature, tangent against differences), --out FILE, --quiet
Needs     Python 3, numpy, scipy.
"""
import argparse
import numpy as np
import scipy.sparse as sp
from scipy.integrate import solve_ivp
from scipy.optimize import brentq
from scipy.sparse.linalg import splu

TAU2 = 2.0 * np.pi
STEEL, SAND = (210e6, 0.28), (34e3, 0.30)                    # E [kPa], nu
TOL, MAXIT, PRESSURE, SWAP = 1e-10, 25, 100.0, 5


# ---------------------------------------------------------------- MEPI (compression and contraction positive)
class Mepi:
    exhausted = 0                                                          # how often that branch was met

    def __init__(self, p0=100.0, t=0.002, sni=100.0):
        self.t = t
        self.kn, self.kt = 0.86e5 * sni**0.55, 0.37e5 * sni**0.55          # (6), (7)
        self.mu0, self.mup, self.muc0 = 0.27, 0.70, 0.46
        self.a, self.c = 0.008 * sni / p0 * t, 40.0 * sni / p0 / t

    def functions(self, xi):
        """mu, dmu/dxi, g = mu_c - mu (contraction per unit d lambda), dg/dxi"""
        mu = self.mu0 + (self.mup - self.mu0) * xi / (self.a + xi)          # (10)
        dmu = (self.mup - self.mu0) * self.a / (self.a + xi) ** 2
        x = np.minimum(self.c * xi, 700.0)
        sech = np.where(mu < self.muc0, 1.0, 1.0 / np.cosh(x))              # 1 - D, (16)-(17)
        dsech = np.where(mu < self.muc0, 0.0, -self.c * np.tanh(x) * sech)
        return mu, dmu, (self.muc0 - mu) * sech, -dmu * sech + (self.muc0 - mu) * dsech

    def update(self, sn0, tau0, xi0, dun, dut):
        """-> sn (negative: open, virtual stress that measures the gap), tau, xi, tangent 2x2 d(contact sn, tau)/d(jump)"""
        st, tt = sn0 + self.kn * dun, tau0 + self.kt * dut
        if st <= 0.0:
            return st, 0.0, xi0, np.zeros((2, 2))                           # separation
        dst, dtt = np.array([self.kn, 0.0]), np.array([0.0, self.kt])
        if sn0 < 0.0:            # contact re-forms: only the part of the (straight) increment after that acts
            part = st / (st - sn0)
            tt = self.kt * dut * part
            dtt = np.array([-self.kt * dut * self.kn * sn0 / (st - sn0) ** 2, self.kt * part])
        s, at = np.sign(tt), abs(tt)

        def f(dl):
            mu, _, g, _ = self.functions(xi0 + dl)
            return at - self.kt * dl - mu * (st - self.kn * dl * g)
        if f(0.0) <= 0.0:
            return st, tt, xi0, np.array([dst, dtt])
        grid = np.linspace(0.0, at / self.kt, 129)                          # |tau| >= 0 bounds d lambda
        neg = np.nonzero(f(grid) <= 0.0)[0]
        if neg.size == 0:        # contraction uses up sn before slip ends: separation reached during the increment
            press = lambda dl: st - self.kn * dl * self.functions(xi0 + dl)[2]
            k = np.nonzero(press(grid) <= 0.0)[0][0]
            Mepi.exhausted += 1
            return 0.0, 0.0, xi0 + brentq(press, grid[k - 1], grid[k], xtol=1e-22), np.zeros((2, 2))
        dl = brentq(f, grid[neg[0] - 1], grid[neg[0]], xtol=1e-22, rtol=4 * np.finfo(float).eps, maxiter=300)
        mu, dmu, g, dg = (float(v) for v in self.functions(xi0 + dl))
        sn, tau = st - self.kn * dl * g, s * (at - self.kt * dl)
        slope = -self.kt - dmu * sn + mu * self.kn * (g + dl * dg)          # dF/d(d lambda)
        ddl = (mu * dst - s * dtt) / slope                                  # d(d lambda)/d(un, ut)
        tangent = np.array([dst - self.kn * (g + dl * dg) * ddl, dtt - s * self.kt * ddl])
        return sn, tau, xi0 + dl, tangent


def layer_point(law, in_plane, sig0, vn0, xi0, de):
    """Thin layer, n = r, m = z.  sig, de: (rr, zz, theta, rz), tension positive.  -> sig, vn, xi, D (4x4).
    vn: virtual normal stress carried between increments (equals -sig_rr in contact, negative when open)."""
    m = law.kn * law.t
    ratio = 1.0 - 2.0 * law.kt / law.kn if in_plane else 0.0                # lambda / M
    lam = ratio * m
    jump = law.t * np.array([[-1.0, -ratio, -ratio, 0.0], [0.0, 0.0, 0.0, 1.0]])   # contraction, slip from strain
    vn, tau, xi, k2 = law.update(vn0, sig0[3], xi0, *(jump @ de))
    sig, d = sig0.copy(), np.zeros((4, 4))
    sig[0], sig[3] = -max(vn, 0.0), tau
    d[[0, 3]] = np.diag([-1.0, 1.0]) @ k2 @ jump
    if in_plane:
        part = np.array([[0, m - ratio * lam, lam - ratio * lam, 0], [0, lam - ratio * lam, m - ratio * lam, 0]])
        sig[1:3] += ratio * (sig[0] - sig0[0]) + part @ de
        d[1:3] = ratio * d[0] + part
    return sig, vn, xi, d


# ---------------------------------------------------------------- mesh and elements
def geometric(start, end, n, ratio):
    w = ratio ** np.arange(n)
    return start + (end - start) * np.cumsum(w) / w.sum()


def shape(x, y):
    cx, cy = np.array([-1, 1, 1, -1, 0, 1, 0, -1.0]), np.array([-1, -1, 1, 1, -1, 0, 1, 0.0])
    n, dx, dy = np.zeros(8), np.zeros(8), np.zeros(8)
    for i, (a, b) in enumerate(zip(cx, cy)):
        if i < 4:
            n[i] = (1 + a * x) * (1 + b * y) * (a * x + b * y - 1) / 4
            dx[i], dy[i] = a * (1 + b * y) * (2 * a * x + b * y) / 4, b * (1 + a * x) * (a * x + 2 * b * y) / 4
        elif a == 0:
            n[i], dx[i], dy[i] = (1 - x * x) * (1 + b * y) / 2, -x * (1 + b * y), (1 - x * x) * b / 2
        else:
            n[i], dx[i], dy[i] = (1 + a * x) * (1 - y * y) / 2, a * (1 - y * y) / 2, -(1 + a * x) * y
    return n, dx, dy


def hooke(e, nu):
    d = np.zeros((4, 4))
    d[:3, :3] = e * nu / ((1 + nu) * (1 - 2 * nu))
    d[[0, 1, 2], [0, 1, 2]] += e / (1 + nu)
    d[3, 3] = e / (2 * (1 + nu))
    return d


class Chamber:
    def __init__(self, points):
        rs = np.concatenate([[0, 5, 10, 12], geometric(12, 262, 7, 1.6)]) / 1000
        zs = np.concatenate([[-30, 0], geometric(0, 180, 8, 1 / 1.25), 180 + 50.0 * np.arange(1, 11)]) / 1000
        self.nr, self.nz = rs.size - 1, zs.size - 1
        half = lambda a: np.sort(np.concatenate([a, (a[1:] + a[:-1]) / 2]))
        r2, z2 = half(rs), half(zs)
        ids, xy = {}, []
        for j in range(z2.size):
            for i in range(r2.size):
                if not (i % 2 and j % 2):
                    ids[i, j] = len(xy)
                    xy.append((r2[i], z2[j]))
        self.xy = np.array(xy)
        self.ndof = 2 * len(xy)
        conn, group = [], []
        for j in range(self.nz):
            for i in range(self.nr):
                a, b = 2 * i, 2 * j
                conn.append([ids[q] for q in ((a, b), (a + 2, b), (a + 2, b + 2), (a, b + 2),
                                              (a + 1, b), (a + 2, b + 1), (a + 1, b + 2), (a, b + 1))])
                above = zs[j] > 0.180 - 1e-9
                group.append("plate" if j == 0 else "pile" if above and i < 2 else "layer" if above and i == 2 else "sand")
        self.conn, self.group = np.array(conn), np.array(group)
        self.dofs = np.stack([2 * self.conn, 2 * self.conn + 1], axis=2).reshape(-1, 16)
        g, w = np.polynomial.legendre.leggauss(points)
        ne, ng = len(conn), points**2
        self.B, self.w, self.gp = np.zeros((ne, ng, 4, 16)), np.zeros((ne, ng)), np.zeros((ne, ng, 2))
        for e in range(ne):
            x = self.xy[self.conn[e]]
            for q in range(ng):
                n, dx, dy = shape(g[q % points], g[q // points])
                jac = np.array([dx, dy]) @ x
                dr, dz = np.linalg.solve(jac, np.array([dx, dy]))
                self.gp[e, q] = n @ x
                b = self.B[e, q]
                b[0, 0::2], b[1, 1::2], b[2, 0::2], b[3, 0::2], b[3, 1::2] = dr, dz, n / self.gp[e, q, 0], dz, dr
                self.w[e, q] = w[q % points] * w[q // points] * np.linalg.det(jac) * TAU2 * self.gp[e, q, 0]
        self.is_layer = self.group == "layer"
        self.D = np.array([hooke(*(STEEL if k in ("plate", "pile") else SAND)) for k in self.group])
        # boundary sets
        r, z = self.xy.T
        at = lambda v, x: np.abs(v - x) < 1e-9
        self.axis = 2 * np.nonzero(at(r, 0))[0]
        self.top = 2 * np.nonzero(at(z, 0.680) & (r > 0.012 - 1e-9))[0] + 1
        self.head = 2 * np.nonzero(at(z, 0.680) & (r < 0.010 + 1e-9))[0] + 1
        toe_nodes = at(z, 0.180) & (r < 0.010 + 1e-9)
        self.pile = np.nonzero(self.group == "pile")[0]
        self.at_toe = toe_nodes[self.conn[self.pile]]                      # (pile elements, 8)
        # loads: pressure on the underside of the plate (up) and on the side for z >= 0 (inward)
        self.load = np.zeros(self.ndof)
        gx, gw = np.polynomial.legendre.leggauss(3)
        edge = lambda s: np.array([s * (s - 1) / 2, 1 - s * s, s * (s + 1) / 2])
        for i in range(self.nr):
            nodes = [ids[2 * i + k, 0] for k in range(3)]
            for s, ws in zip(gx, gw):
                n = edge(s)
                self.load[2 * np.array(nodes) + 1] += PRESSURE * n * ws * (rs[i + 1] - rs[i]) / 2 * TAU2 * (n @ r[nodes])
        for j in range(1, self.nz):
            nodes = [ids[2 * self.nr, 2 * j + k] for k in range(3)]
            for s, ws in zip(gx, gw):
                self.load[2 * np.array(nodes)] -= PRESSURE * edge(s) * ws * (zs[j + 1] - zs[j]) / 2 * TAU2 * rs[-1]
        self.rows, self.cols = np.repeat(self.dofs, 16, axis=1).ravel(), np.tile(self.dofs, (1, 16)).ravel()
        # probe points: of the layer, |z - 330 mm| < 30 mm
        self.probe = np.abs(self.gp[self.is_layer][:, :, 1] - 0.330) < 0.030

    def evaluate(self, u, u0, state, law, in_plane):
        """internal force, tangent, element forces, layer state; the layer is sand while law is None"""
        eps = np.einsum("egij,ej->egi", self.B, u[self.dofs])
        sig = np.einsum("eij,egj->egi", self.D, eps)
        D = np.broadcast_to(self.D[:, None], sig.shape + (4,)).copy()
        new = None
        if law is not None:
            lay = np.nonzero(self.is_layer)[0]
            de = np.einsum("egij,ej->egi", self.B[lay], (u - u0)[self.dofs[lay]])
            s0, v0, x0 = state
            s1, v1, x1 = s0.copy(), v0.copy(), x0.copy()
            for a, e in enumerate(lay):
                for q in range(self.w.shape[1]):
                    s1[a, q], v1[a, q], x1[a, q], D[e, q] = layer_point(law, in_plane, s0[a, q], v0[a, q], x0[a, q], de[a, q])
            sig[lay], new = s1, (s1, v1, x1)
        fe = np.einsum("egij,egi,eg->ej", self.B, sig, self.w)
        ke = np.einsum("egki,egkl,eglj,eg->eij", self.B, D, self.B, self.w, optimize=True)
        f = np.zeros(self.ndof)
        np.add.at(f, self.dofs, fe)
        K = sp.csc_matrix((ke.ravel(), (self.rows, self.cols)), shape=(self.ndof,) * 2)
        return f, K, fe, new, sig

    def take_over(self, u, state, law, in_plane):
        """what the law makes of the stresses it finds, at the same strain, and the force this leaves out of balance"""
        _, _, _, state, _ = self.evaluate(u, u, state, law, in_plane)
        return state, self.evaluate(u, u, state, law, in_plane)[0] - self.load

    def newton(self, u0, state, law, in_plane, fixed, dfixed, load, guess=None):
        """one (sub)increment -> u, state, results, log.  guess: displacement increment to start from (None: tangent)"""
        free = np.setdiff1d(np.arange(self.ndof), fixed)
        u = u0 if guess is None else u0 + guess
        step = u0[fixed] + dfixed - u[fixed]                               # imposed by the first iteration
        size = lambda out: np.linalg.norm((load - out[0])[free]) / np.linalg.norm(out[0])
        out, log = self.evaluate(u, u0, state, law, in_plane), []
        while len(log) < MAXIT:
            K, du = out[1].tocsr()[free], np.zeros(self.ndof)
            du[fixed] = step
            du[free] = splu(K[:, free].tocsc()).solve((load - out[0])[free] - K[:, fixed] @ step)
            trials = []
            for a in 0.5 ** np.arange(6 if log and log[-1] > 1e-8 else 1):  # backtracking line search
                trials.append((size(o := self.evaluate(u + a * du, u0, state, law, in_plane)), a, o))
                if not log or trials[-1][0] < (1 - 0.1 * a) * log[-1]:
                    break
            else:
                trials.sort(key=lambda x: x[0])
                trials.append(trials[0])
            now, a, out = trials[-1]
            u, step = u + a * du, np.zeros(fixed.size)
            log.append(now)
            if len(log) > 1 and log[-2] < TOL and now < TOL:                # converged, and one iteration more
                return u, out[3], (out[0], out[2], out[4]), log
            if not now < 1e6:
                break
        raise FloatingPointError("Newton: no convergence, residuals " + " ".join(f"{x:.0e}" for x in log))


def run(args):
    ch, law = Chamber(args.points), Mepi(args.p0)
    total = [0, 0, 0]                                                      # iterations, cut-backs, failed starts
    rows = []

    def record(phase, inc, f, fe, sig, w, logs):
        s = sig[ch.is_layer][ch.probe]
        wt = ch.w[ch.is_layer][ch.probe]
        tau, sn = s[:, 3].mean(), -s[:, 0].mean()
        qt = -(f - ch.load)[ch.head].sum()
        qp = fe[ch.pile][:, 1::2][ch.at_toe].sum()
        rows.append([phase, inc, tau, sn, qt, qp, qt - qp, w, sn / 100.0])
        if not args.quiet:
            bal = f[1::2].sum() / np.abs(ch.load).sum()                    # sum of all vertical nodal forces: 0
            tops = (f - ch.load)[ch.top].sum()
            lay, first = ch.is_layer, np.abs(ch.gp[ch.is_layer][:, :, 0] - ch.gp[ch.is_layer][:, :, 0].min()) < 1e-9
            shaft = (sig[lay][:, :, 3] * ch.w[lay])[first].sum() / ch.w[lay][first].sum()
            print(f"{phase[:5]} {inc:3d} tau {tau:9.4f} sn {sn:9.4f} qt {qt:9.5f} qp {qp:8.5f} qs {qt - qp:9.5f} kl {sn / 100:7.4f}"
                  f" | balance {bal:8.1e} applied+top-head {(ch.load[1::2].sum() + tops - qt) / ch.load[1::2].sum():8.1e}"
                  f" inner-column tau {shaft:8.3f} (q_s/area {(qt - qp) / (TAU2 * .01 * .5):8.3f}) min sn {-sig[lay][:, :, 0].max():7.2f}"
                  f" vol.mean {(s[:, 3] * wt).sum() / wt.sum():8.4f} {-(s[:, 0] * wt).sum() / wt.sum():8.4f} | "
                  + " / ".join(" ".join(f"{x:.0e}" for x in l) for l in logs), flush=True)

    # phase 1, confinement
    fixed = np.concatenate([ch.axis, ch.top])
    u, _, (f, fe, sig), log = ch.newton(np.zeros(ch.ndof), None, None, True, fixed, np.zeros(fixed.size), ch.load)
    record("confinement", 1, f, fe, sig, -u[ch.head].mean() * 1000, [log])
    print("confinement: head u_z [mm], per node:", u[ch.head] * 1000, "layer: max |tau|/sn",
          np.max(np.abs(sig[ch.is_layer][..., 3]) / -sig[ch.is_layer][..., 0]))
    # phase 2, the interface: nothing moves but what the law sets free
    s0 = sig[ch.is_layer]
    state = (s0, -s0[:, :, 0], np.zeros(s0.shape[:2]))
    state, rest = ch.take_over(u, state, law, not args.no_in_plane)
    rest[fixed] = 0.0
    head = ch.head

    last = [None, 1.0]                                                     # last increment of u, and of the phase's course

    def advance(u, state, start, part, depth, logs):
        """from `start` by `part` of the phase; `push`: displacement in the whole phase, of the degrees of freedom `fixed`"""
        err = None
        for guess in ([] if last[0] is None else [last[0] * (part / last[1])]) + [None]:
            try:
                u1, st1, out, log = ch.newton(u, state, law, not args.no_in_plane, fixed, push * part,
                                              ch.load + (1.0 - (start + part)) * rest, guess)
                logs.append(log)
                total[0] += len(log)
                last[:] = u1 - u, part
                return u1, st1, out
            except (FloatingPointError, RuntimeError) as e:
                err = e
                total[2] += 1
        total[1] += 1
        print("  cut-back:", err)
        if depth == 12:
            raise SystemExit(f"gave up after {len(rows) - 1} increments: {err}")
        u, state, _ = advance(u, state, start, part / 2, depth + 1, logs)
        return advance(u, state, start + part / 2, part / 2, depth + 1, logs)

    worst = 0
    try:
        push = np.zeros(fixed.size)
        for inc in range(1, SWAP + 1):
            logs = []
            u, state, out = advance(u, state, (inc - 1) / SWAP, 1 / SWAP, 0, logs)
            record("interface", inc, *out, -u[head].mean() * 1000, logs)
        print(f"interface: {total[0]} iterations, {total[1]} cut-backs")
        # phase 3, loading
        fixed = np.concatenate([fixed, head])
        push = np.where(np.isin(fixed, head), -0.005, 0.0)
        rest[:], last[0], total[0] = 0.0, None, 0
        for inc in range(1, args.increments + 1):
            logs = []
            u, state, out = advance(u, state, (inc - 1) / args.increments, 1 / args.increments, 0, logs)
            worst = max(worst, max(len(l) for l in logs))
            record("loading", inc, *out, 5.0 * inc / args.increments, logs)
    finally:
        print(f"loading: {total[0]} iterations, at most {worst} in one (sub)increment, {total[1]} cut-backs, {total[2]} failed starts; "
              f"max xi {state[2].max() * 1000:.3f} mm, open points {(state[1] <= 0).sum()}, exhausted {Mepi.exhausted}")
        if args.out:
            with open(args.out, "w") as o:
                o.write("phase,increment,tau_shaft,sigma_n_shaft,q_t,q_p,q_s,w_t,k_l\n")
                for x in rows:
                    o.write(f"{x[0]},{x[1]}," + ",".join(f"{v:.12g}" for v in x[2:]) + "\n")


def selftest():
    rng, worst = np.random.default_rng(1), 0.0
    for p0 in (100.0, 1.0):
        law = Mepi(p0)
        for _ in range(200):                                               # tangent against central differences
            sn0 = rng.uniform(20, 200)
            arg = (sn0, sn0 * rng.uniform(-.27, .27), rng.choice([0, 1e-5, 1e-4, 1e-3]))
            d = np.array([rng.normal() * 1e-5, rng.normal() * 2e-4])
            k = law.update(*arg, *d)[3]
            h = 1e-10
            num = np.array([(np.array(law.update(*arg, *(d + h * e))[:2]) - np.array(law.update(*arg, *(d - h * e))[:2]))
                            / (2 * h) for e in np.eye(2)]).T
            worst = max(worst, np.abs(k - num).max() / law.kn)
        for stiffness in (0.0, 1e5):                                       # dsn = -k dun: exact rate equations
            def rate(_, y):                                                # y = sn, tau, xi, slip
                mu, dmu, g, _ = law.functions(y[2])
                # sn' = -k (sn'/kn + xi' g); tau' = sn' mu + sn mu' xi'; slip' = tau'/kt + xi' = 1
                a = -stiffness * g / (1 + stiffness / law.kn)
                b = a * mu + y[0] * dmu
                dxi = 1 / (b / law.kt + 1)
                return [a * dxi, b * dxi, dxi, 1.0]
            start = 27.0 / law.kt
            ref = solve_ivp(rate, [start, 2e-3], [100.0, 27.0, 0.0, start], rtol=1e-11, atol=1e-13, method="LSODA").y[:, -1]
            err = []
            for n in (500, 1000):
                sn, tau, xi, un, dut = 100.0, 27.0, 0.0, 0.0, (2e-3 - start) / n
                for _ in range(n):
                    dun = 0.0
                    for _ in range(50):                                    # control: sn + k un = 100
                        a = law.update(sn, tau, xi, dun, dut)
                        r = a[0] + stiffness * (un + dun) - 100.0
                        if abs(r) < 1e-10:
                            break
                        dun -= r / (a[3][0, 0] + stiffness)
                    un += dun
                    sn, tau, xi = a[:3]
                err.append(abs(np.array([sn, tau, xi * 1e4]) - ref[:3] * [1, 1, 1e4]).max())
            print(f"p0 {p0:g} k {stiffness:g}: sn {ref[0]:.6f} tau {ref[1]:.6f} xi {ref[2] * 1e3:.6f} mm; error with 500, 1000 steps {err}")
    print("tangent, largest difference / K_n:", worst)


if __name__ == "__main__":
    ap = argparse.ArgumentParser()
    ap.add_argument("--points", type=int, default=3)
    ap.add_argument("--p0", type=float, default=100.0)
    ap.add_argument("--increments", type=int, default=50)
    ap.add_argument("--no-in-plane", action="store_true")
    ap.add_argument("--selftest", action="store_true")
    ap.add_argument("--quiet", action="store_true")
    ap.add_argument("--out")
    options = ap.parse_args()
    selftest() if options.selftest else run(options)
