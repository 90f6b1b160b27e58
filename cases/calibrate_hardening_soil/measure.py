"""Writes the measured points of this case: synthetic ones, from the values below with noise.

    python3 measure.py

An explicit integration of the rate equations, `reference.py` of the law's tests, computes them; it shares no code
with the law. Three drained triaxial tests and one oedometer test of a dense sand. Normal noise from a fixed seed: 1 %
of the deviatoric stress, 1e-4 in the lateral strain and in the strain of the oedometer.
"""

import random
import sys
from pathlib import Path

here = Path(__file__).parent
sys.path.insert(0, str(here / "../../models/hardening_soil/src/tests"))
import reference  # noqa: E402

TRUTH = dict(e50=37e3, eoed=29.6e3, eur=90e3, m=0.5, nu=0.2, c=0.0, phi=41.0, psi=14.0, pref=100.0, k0=0.34, rf=0.9)
STEPS = 10_000
noise = random.Random(1999)
soil = reference.Soil(TRUTH)


def points(stress, segments):
    p_p, gamma = soil.start(stress, 1.0)
    return list(reference.run(soil, stress, p_p, gamma, segments, True, STEPS))[1:]


def write(name, header, rows):
    with (here / name).open("w") as file:
        file.write(f"# synthetic: measure.py\n{header}\n")
        for row in rows:
            file.write(",".join(f"{x:.6g}" for x in row) + "\n")


for cell in (50, 100, 300):
    start = [float(cell)] * 3
    rows = []
    # Two segments, for more points where the curve bends.
    strains = [("strain", 0.01), reference.FREE, reference.FREE], [("strain", 0.04), reference.FREE, reference.FREE]
    for s1, s2, s3, e1, e2, e3, *_ in points(start, strains):
        q = (s1 - s3) * (1 + noise.gauss(0.0, 0.01))
        rows.append((1e2 * e1, s3 + q, -1e2 * (e3 + noise.gauss(0.0, 1e-4))))
    write(f"triaxial_{cell}_kPa.csv", "axial strain (%),axial stress (kPa),lateral expansion (%)", rows)

lateral = TRUTH["k0"] * 25.0
segments = [
    [("stress", 375.0), ("strain", 0.0), ("strain", 0.0)],
    [("stress", -300.0), ("strain", 0.0), ("strain", 0.0)],
]
rows = []
for s1, _, _, e1, *_ in points([25.0, lateral, lateral], segments):
    rows.append((s1, 1e2 * (e1 + noise.gauss(0.0, 1e-4))))
write("oedometer_loading.csv", "axial stress (kPa),axial strain (%)", rows[:10])
write("oedometer_unloading.csv", "axial stress (kPa),axial strain (%)", rows[10:])
