"""Writes the measured points of this case: synthetic ones, from the values below with noise.

    python3 measure.py PILUM

`PILUM` is the program. Noise of 10 kN in the load and 15 kN in axial forces is normal, from a fixed seed.
"""

import csv
import random
import subprocess
import sys
import tempfile
from pathlib import Path

TRUTH = {
    "laws.skin_clay.parameters.friction_angle": 22.0,
    "laws.skin_sand.parameters.friction_angle": 27.0,
    "laws.skin_sand.parameters.shear_stiffness": 6e4,
}
COLUMNS = {
    "pile_head_load": ("load (kN)", 10.0),
    "gauge_1": ("force at 5 m (kN)", 15.0),
    "gauge_2": ("force at 8 m (kN)", 15.0),
    "gauge_3": ("force at 12 m (kN)", 15.0),
}

here = Path(__file__).parent
noise = random.Random(2001)

with tempfile.TemporaryDirectory() as folder:
    settings = [f"--set={key}={value}" for key, value in TRUTH.items()]
    subprocess.run([sys.argv[1], "run", str(here), "--out", folder, *settings], check=True)
    rows = list(csv.DictReader((Path(folder) / "history.csv").open()))
with (here / "load_test.csv").open("w") as file:
    names = ",".join(label for label, _ in COLUMNS.values())
    file.write(f"# synthetic: measure.py\nsettlement (mm),{names}\n")
    for row in rows:
        if row["phase"] == "load test":
            values = [float(row[name]) + noise.gauss(0.0, deviation) for name, (_, deviation) in COLUMNS.items()]
            settlement = 1e3 * float(row["pile_settlement"])
            file.write(f"{settlement:.2f}," + ",".join(f"{value:.1f}" for value in values) + "\n")
