"""Writes the points that the figures of this case show: `python3 closed_forms.py`.

Drained triaxial compression with the cap out of reach: the hyperbola as long as nothing dilates, and beyond it the
axial strain less half the integral of sin psi_m over gamma_ps, by Simpson's rule. Oedometer: integrals of 1/E_oed on
the line of normal consolidation and, in unloading, of 1/(E_ur (1 - nu)/((1 + nu) (1 - 2 nu))), with the lateral stress
falling by nu/(1 - nu) of the axial one.
"""

import math
from pathlib import Path

E_50, E_OED, E_UR, M, NU, K_0, R_F, P_REF = 37e3, 29.6e3, 90e3, 0.5, 0.2, 0.34, 0.9, 100.0
SIN, SIN_PSI = math.sin(math.radians(41.0)), math.sin(math.radians(14.0))
SIN_CV = (SIN - SIN_PSI) / (1 - SIN * SIN_PSI)


def dilatancy(q, s3):
    x = q / (q + 2 * s3)
    return 0.0 if x < 0.75 * SIN else max(0.0, (x - SIN_CV) / (1 - x * SIN_CV))


def triaxial(q, s3):
    """Axial strain."""
    scale = (s3 / P_REF) ** M
    e_i, e_ur = 2 * E_50 / (2 - R_F) * scale, E_UR * scale
    q_a = s3 * 2 * SIN / (1 - SIN) / R_F
    x = 0.75 * SIN
    onset = max(2 * s3 * x / (1 - x), 2 * s3 * SIN_CV / (1 - SIN_CV))
    held = 0.0
    if q > onset:
        n = 200
        h = (q - onset) / n
        for i in range(n + 1):
            at = onset + i * h
            rate = 2 / e_i / (1 - at / q_a) ** 2 - 2 / e_ur
            weight = 1 if i in (0, n) else 4 if i % 2 else 2
            held += h / 3 * weight * 0.5 * rate * dilatancy(at * (1 + 1e-12), s3)
    return q / e_i / (1 - q / q_a) - held


def primary(s1):
    """Strain of primary loading from 50 kPa."""
    power = lambda s: (s / P_REF) ** (1 - M)
    return P_REF / E_OED * (power(s1) - power(50.0)) / (1 - M)


def unloaded(s1):
    """Strain of unloading from 200 kPa."""
    stiffness = E_UR * (1 - NU) / ((1 + NU) * (1 - 2 * NU))
    ratio = NU / (1 - NU)
    lateral = lambda s: K_0 * 200.0 - ratio * (200.0 - s)
    power = lambda s: (lateral(s) / P_REF) ** (1 - M)
    return primary(200.0) - P_REF / stiffness / ratio * (power(200.0) - power(s1)) / (1 - M)


shear = []
for s3 in (50.0, 100.0, 300.0):
    q_f = s3 * 2 * SIN / (1 - SIN)
    shear += [(triaxial(part * q_f, s3), s3 + part * q_f) for part in (0.2, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9)]
    shear.append((0.08, s3 + q_f))
oedometer = [(primary(s), s) for s in (50.0, 80.0, 110.0, 140.0, 170.0, 200.0, 250.0, 300.0, 350.0, 400.0)]
oedometer += [(unloaded(s), s) for s in (80.0, 110.0, 140.0, 170.0)]

def write(name, rows):
    with (Path(__file__).parent / name).open("w") as file:
        file.write("axial strain,axial stress\n")
        for strain, stress in rows:
            file.write(f"{-strain:.6e},{-stress:.4f}\n")


write("closed_triaxial.csv", shear)
write("closed_oedometer.csv", oedometer)
