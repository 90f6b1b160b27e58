"""Cost of a point from Python, against `points`: the scenario `mepi/plastic` of `scenario.rs`, called by
`pilum.Law.integrate` on arrays. Prints scenario, operator, ns of CPU time per point (median, least), as `points` does.

    python3 host/benches/arrays.py [POINTS]      with the package installed
"""

import statistics
import sys
import time

import numpy as np

import pilum

N_POINTS = int(sys.argv[1]) if len(sys.argv) > 1 else 20_000
RUNS = 15
LEAST_RUN = 0.02
TABLE_4 = dict(
    k_n=0.86e5, k_t=0.37e5, n=0.55, mu_0=0.27, mu_p=0.7, mu_c0=0.46, a=0.008, c_0=40.0, t=2e-3, p_0=100.0
)


def slipping(n):
    """Up to 3 mm of slip, then 20 µm further while the faces move by up to 2 µm."""
    random = np.random.default_rng(1)
    before, step = np.zeros((n, 2)), np.zeros((n, 2))
    before[:, 1] = 3e-3 * random.random(n) + 1e-4
    step[:, 0], step[:, 1] = 4e-6 * (random.random(n) - 0.5), 2e-5
    return before, step


def cpu_seconds(call):
    """Median and least CPU time of the process over one call, s."""

    def timed(times):
        start = time.process_time()
        for _ in range(times):
            call()
        return time.process_time() - start

    timed(1)
    times = max(1, round(LEAST_RUN / max(timed(1), 1e-9)))
    seconds = sorted(timed(times) / times for _ in range(RUNS))
    return statistics.median(seconds), seconds[0]


law = pilum.Law("mepi", **TABLE_4)
before, step = slipping(N_POINTS)
start = law.initial(N_POINTS, flux=[-100.0, 0.0])
_, _, start = law.integrate(before, start)
end = before + step
for name, operator in (("none", None), ("consistent", "consistent")):
    spare = law.integrate(end, start, tangent=operator)[2]

    def call():
        global spare
        spare = law.integrate(end, start, tangent=operator, out=spare, copy=False)[2]

    median, least = (1e9 * seconds / N_POINTS for seconds in cpu_seconds(call))
    print(f"mepi/plastic\t{name}\t{median:.2f}\t{least:.2f}")
