"""Writes the measured points of this case: synthetic ones, from the values below with noise.

    python3 measure.py PILUM

`PILUM` is the program. The truth is Table I of De Gennaro & Frank for silica sand, A = 0.00006 and
C_0 = 0.05; noise of 2 kPa is normal, from a fixed seed.
"""

import csv
import random
import subprocess
import sys
import tempfile
from pathlib import Path

TRUTH = {"a": 0.00006, "c_0": 0.05}
SLIPS = [0.1 * k for k in range(1, 11)] + [1.0 + 0.2 * k for k in range(1, 21)]  # mm

here = Path(__file__).parent
noise = random.Random(1996)


def between(rows, column, at):
    for before, after in zip(rows, rows[1:]):
        x0, x1 = (1e3 * float(row["jump_t"]) for row in (before, after))
        if x0 <= at <= x1 * (1 + 1e-9):
            y0, y1 = float(before[column]), float(after[column])
            return y0 + (y1 - y0) * (at - x0) / (x1 - x0)
    raise ValueError(at)


for variant in ("400_kPa_per_mm", "800_kPa_per_mm", "constant_stress"):
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "out.csv"
        settings = [f"--set=parameters.{name}={value}" for name, value in TRUTH.items()]
        # Finer increments than the calibration has.
        fine = [f"--set=segment.{part}.increments=4000" for part in (1, 2)]
        command = [sys.argv[1], "point", str(here / "driver.toml"), "--variant", variant, "--csv", str(out), *fine]
        subprocess.run(command + settings, check=True)
        rows = list(csv.DictReader(out.open()))
    with (here / f"{variant}.csv").open("w") as file:
        file.write("# synthetic: measure.py\nslip (mm),normal stress (kPa),shear stress (kPa)\n")
        for slip in SLIPS:
            normal = -between(rows, "traction_n", slip) + noise.gauss(0.0, 2.0)
            shear = between(rows, "traction_t", slip) + noise.gauss(0.0, 2.0)
            file.write(f"{slip:.2f},{normal:.2f},{shear:.2f}\n")
