#!/usr/bin/env python3
"""CPU seconds and peak memory against the number of unknowns, and what a second thread gains.

    growth.py PART … [--sizes N,…] [--increments N] [--rounds N]

mepi     elastic sand and the interface law MEPI: cases/chamber_mesh1, every element divided by the
         sizes in both directions (the interface along its length only), 10 increments instead of 50.
plastic  cases/bonded_pile on as many columns as the sizes say and twice as many rows, its first 4 of
         10 increments.
threads  wall seconds on one and two threads: `mepi` and `plastic`, one size each.

Exponents are slopes of straight lines through the last three sizes, both axes logarithmic.
"""

import argparse
import statistics
import sys
import tempfile
from math import log
from pathlib import Path

from chamber import bonded_case, mepi_case
from programs import Failed, Missing, pilum, run_case

MEPI, PLASTIC = [1, 2, 4, 8, 16, 31], [10, 20, 40, 80, 100]
MEPI_INCREMENTS, PLASTIC_INCREMENTS = 10, 4


def mepi_run(program, size, increments, n_threads=1):
    with tempfile.TemporaryDirectory() as folder:
        return run_case(program, mepi_case(size, increments), Path(folder), n_threads=n_threads)


def plastic_run(program, size, increments, n_threads=1):
    text = bonded_case(size, 2 * size, elastic=False, increments=increments)
    with tempfile.TemporaryDirectory() as folder:
        return run_case(program, text, Path(folder), "--variant", "bench", n_threads=n_threads)


def slope(x, y):
    """Slope of log y against log x, least squares over the last three."""
    x, y = ([log(value) for value in values[-3:]] for values in (x, y))
    a, b = statistics.mean(x), statistics.mean(y)
    return sum((u - a) * (v - b) for u, v in zip(x, y)) / sum((u - a) ** 2 for u in x)


def table(title, run, sizes, increments, rounds):
    print(f"{title}: {increments} increments, one thread, medians of {rounds} runs")
    print("| size | unknowns | iterations | CPU s | CPU s per iteration | MiB | laws and forces, s | assembly | "
          "equations |")
    print("|---|---|---|---|---|---|---|---|---|")
    unknowns, seconds, each, memory = [], [], [], []
    program = pilum()
    for size in sizes:
        try:
            runs = [run(program, size, increments) for _ in range(rounds)]
        except Failed as failed:
            print(f"| {size} | fails |\n{failed}", flush=True)
            break
        last = runs[-1]
        unknowns.append(last.unknowns)
        seconds.append(statistics.median(run.usage.cpu for run in runs))
        each.append(seconds[-1] / last.iterations)
        memory.append(statistics.median(run.usage.memory for run in runs))
        parts = " | ".join(f"{sum(phase['seconds'][part] for phase in last.phases):.2f}"
                           for part in ("laws_and_forces", "assembly", "equations"))
        print(f"| {size} | {last.unknowns} | {last.iterations} | {seconds[-1]:.2f} | {each[-1]:.4f} | "
              f"{memory[-1]:.0f} | {parts} |", flush=True)
    if len(unknowns) >= 3:
        print("with n unknowns as " + ", ".join(
            f"n^{slope(unknowns, values):.2f} ({name})" for name, values in
            (("CPU s", seconds), ("CPU s per iteration", each), ("MiB", memory))))


def mepi(options):
    """Elastic sand, plastic interface."""
    table("mepi", mepi_run, options.sizes or MEPI, options.increments or MEPI_INCREMENTS, options.rounds)


def plastic(options):
    """Plastic sand."""
    table("plastic", plastic_run, options.sizes or PLASTIC, options.increments or PLASTIC_INCREMENTS,
          options.rounds)


# Part, its run, size, increments.
THREADS = [("mepi", mepi_run, 8, 10), ("mepi", mepi_run, 16, 10), ("plastic", plastic_run, 50, 4)]


def threads(options):
    """One thread and two, in turns."""
    program = pilum()
    print(f"threads: wall seconds, medians of {options.rounds} alternating runs")
    print("| part | size | unknowns | 1 thread: wall s | CPU s | 2 threads: wall s | CPU s | faster by |")
    print("|---|---|---|---|---|---|---|---|")
    for name, run, size, increments in THREADS:
        runs = {1: [], 2: []}
        for _ in range(options.rounds):
            for n, done in runs.items():
                done.append(run(program, size, increments, n_threads=n))
        wall = {n: statistics.median(run.usage.wall for run in done) for n, done in runs.items()}
        cpu = {n: statistics.median(run.usage.cpu for run in done) for n, done in runs.items()}
        print(f"| {name} | {size} | {runs[1][0].unknowns} | {wall[1]:.2f} | {cpu[1]:.2f} | {wall[2]:.2f} | "
              f"{cpu[2]:.2f} | {wall[1] / wall[2]:.2f} |", flush=True)
        same = len({run.head for done in runs.values() for run in done}) == 1
        if not same:
            raise Failed(f"{name}, size {size}: the head load depends on the number of threads")


PARTS = {"mepi": mepi, "plastic": plastic, "threads": threads}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("parts", nargs="+", metavar="PART", choices=PARTS)
    parser.add_argument("--sizes", type=lambda text: [int(size) for size in text.split(",")])
    parser.add_argument("--increments", type=int)
    parser.add_argument("--rounds", type=int, default=1)
    options = parser.parse_args()
    try:
        for part in options.parts:
            PARTS[part](options)
    except (Missing, Failed) as why:
        print(f"not measured: {why}")
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())
