"""Writes the measured points of this case: synthetic ones, from the values below with noise.

    python3 measure.py PILUM

`PILUM` is the program. The truth is Table I of De Gennaro & Frank for Fontainebleau sand; noise of
0.5 kPa and 2 µm is normal, from a fixed seed.
"""

import csv
import random
import subprocess
import sys
import tempfile
from pathlib import Path

TRUTH = {"k_t": 0.37e5, "mu_p": 0.78, "mu_c0": 0.67, "a": 0.00045, "c_0": 0.05}
SLIPS = [0.05 * k for k in range(1, 11)] + [0.5 + 0.25 * k for k in range(1, 19)]  # mm

here = Path(__file__).parent
noise = random.Random(2003)


def between(rows, column, at):
    for before, after in zip(rows, rows[1:]):
        x0, x1 = (1e3 * float(row["jump_t"]) for row in (before, after))
        if x0 <= at <= x1 * (1 + 1e-9):
            y0, y1 = float(before[column]), float(after[column])
            return y0 + (y1 - y0) * (at - x0) / (x1 - x0)
    raise ValueError(at)


for stress in (50, 100, 150, 200):
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "out.csv"
        settings = [f"--set=parameters.{name}={value}" for name, value in TRUTH.items()]
        driver = str(here / "driver.toml")
        # Finer increments than the calibration has.
        fine = [f"--set=segment.{part}.increments=2000" for part in (1, 2)]
        command = [sys.argv[1], "point", driver, "--variant", f"{stress}_kPa", "--csv", str(out), *fine]
        subprocess.run(command + settings, check=True)
        rows = list(csv.DictReader(out.open()))
    with (here / f"{stress}_kPa.csv").open("w") as file:
        file.write("# synthetic: measure.py\nslip (mm),shear stress (kPa),opening (mm)\n")
        for slip in SLIPS:
            shear = between(rows, "traction_t", slip) + noise.gauss(0.0, 0.5)
            opening = 1e3 * between(rows, "jump_n", slip) + noise.gauss(0.0, 0.002)
            file.write(f"{slip:.2f},{shear:.2f},{opening:.4f}\n")
