"""Indices of sensitivity by SALib: salib.py ishigami POINTS prints its numbers of the Ishigami function and its indices;
salib.py given N < numbers prints the indices of numbers of a design of N parameters."""

import json
import sys

import numpy as np
from SALib.analyze import sobol
from SALib.sample import sobol as sample


def problem(n):
    bound = [-np.pi, np.pi]
    return {"num_vars": n, "names": [f"x{i}" for i in range(n)], "bounds": [bound] * n}


def analysed(of, numbers):
    found = sobol.analyze(of, numbers, calc_second_order=False, num_resamples=1000, seed=1)
    return {key: list(map(float, found[key])) for key in ("S1", "S1_conf", "ST", "ST_conf")}


if sys.argv[1] == "ishigami":
    of = problem(3)
    x = sample.sample(of, int(sys.argv[2]), calc_second_order=False, seed=1)
    numbers = np.sin(x[:, 0]) + 7 * np.sin(x[:, 1]) ** 2 + 0.1 * x[:, 2] ** 4 * np.sin(x[:, 0])
else:
    of = problem(int(sys.argv[2]))
    numbers = np.array([float(line) for line in sys.stdin])
print(json.dumps({"numbers": list(map(float, numbers)), **analysed(of, numbers)}))
