#!/usr/bin/env python3
"""Compares laws and whole runs with those of a peer, in one run, on one thread, in CPU time, and
prints the ratios.

    peers.py [PART …] [--rounds N] [--ogs FOLDER] [--meshes NAME,…] [--failing]

Each part is a function in PARTS that prints its own table; a part whose peer is missing prints
what is missing and how to get it, and the others still run.

laws    Mohr-Coulomb and elasticity of MFront, from the Python wheel of OpenGeoSys
        (`python3 -m venv FOLDER && FOLDER/bin/pip install ogs==6.5.9`; FOLDER by --ogs or PILUM_OGS).
linked  the peer is the law itself, linked into the calling program instead of opened as a plugin.
generic a law called point by point through MFront's generic interface, as OpenGeoSys and MGIS do; the peer
        is the same library, called by the contract.
elastic the elastic pile in a chamber, against CalculiX (`ccx` on the path, Debian: calculix-ccx).
plastic the pile in Mohr-Coulomb soil, cases/bonded_pile, against OpenGeoSys (as above).
"""

import argparse
import os
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path

import calculix
import opengeosys
from chamber import MESHES, Mesh, bonded_case
from programs import ROOT, Failed, Missing, measure, pilum, program, run, run_case, target

HERE = Path(__file__).resolve().parent


def bench(name):
    """The executable of a bench of the host, built with the laws."""
    cargo = program("cargo")
    run(cargo, "build", "--release", "--quiet", "--manifest-path", ROOT / "Cargo.toml")
    listing = subprocess.run(
        [cargo, "bench", "--package", "pilum", "--bench", name, "--no-run"],
        cwd=ROOT, capture_output=True, text=True)
    for line in listing.stderr.splitlines():
        if "Executable" in line:
            path = Path(line[line.rindex("(") + 1 : line.rindex(")")])
            return path if path.is_absolute() else ROOT / path
    raise Missing(f"bench `{name}` does not build:\n{listing.stderr.strip()[-2000:]}")


def ogs_library(folder):
    """MFront's laws in the wheel of OpenGeoSys."""
    name = "libOgsMFrontBehaviour.so"
    places = [folder, os.environ.get("PILUM_OGS"), sys.prefix]
    for place in filter(None, places):
        for found in sorted(Path(place).rglob(name)):
            return found
    raise Missing(
        f"{name} is in none of --ogs, PILUM_OGS and this Python; it comes with\n"
        "    python3 -m venv FOLDER && FOLDER/bin/pip install ogs==6.5.9")


def table_of(output):
    """{(name, operator): median ns per point}"""
    rows = (line.split("\t") for line in output.splitlines())
    return {(name, operator): float(median) for name, operator, median, _ in rows}


# Ours, MFront's, operator, at most this fraction of MFront's, in axisymmetry.
LAW_PAIRS = [
    ("elastic", "elastic", "consistent", None),
    ("mohr_coulomb/elastic", "mohr_coulomb/elastic", "none", None),
    ("mohr_coulomb/elastic", "mohr_coulomb/elastic", "consistent", 1 / 20),
    ("mohr_coulomb/restart", "mohr_coulomb/restart", "none", None),
    ("mohr_coulomb/restart", "mohr_coulomb/restart", "consistent", 1 / 8),
    ("mohr_coulomb/large", "mohr_coulomb/large", "consistent", None),
    ("mohr_coulomb/edge", "mohr_coulomb/edge", "consistent", None),
    ("mohr_coulomb_3d/elastic", "mohr_coulomb_3d/elastic", "consistent", None),
    ("mohr_coulomb_3d/restart", "mohr_coulomb_3d/restart", "consistent", None),
    ("mepi/plastic", "mohr_coulomb/restart", "consistent", 1 / 10),
]


def laws(options):
    """One law call, ours through the plugin in batches of 512, MFront's point by point."""
    library = ogs_library(options.ogs)
    points = bench("points")
    compiler = program("cc")
    ours_names = sorted({ours for ours, *_ in LAW_PAIRS})
    theirs_names = sorted({theirs for _, theirs, *_ in LAW_PAIRS})
    ours, theirs = [], []
    with tempfile.TemporaryDirectory() as folder:
        mfront = Path(folder) / "mfront"
        run(compiler, "-O2", "-o", mfront, HERE / "peers" / "mfront.c", "-ldl", "-lm")
        for _ in range(options.rounds):
            ours.append(table_of(run(points, "time", 512, *ours_names)))
            theirs.append(table_of(run(mfront, library, *theirs_names)))

    def median(tables, *key):
        return statistics.median(table[key] for table in tables)

    print(f"laws: ns per integration point, CPU time, median of {options.rounds} alternating runs")
    print("| ours | operator | ns | MFront | ns | ratio | goal |")
    print("|---|---|---|---|---|---|---|")
    met = True
    for name, peer, operator, goal in LAW_PAIRS:
        a, b = median(ours, name, operator), median(theirs, peer, operator)
        met = met and (goal is None or a <= goal * b)
        wanted = f"1/{1 / goal:.0f}" if goal else ""
        print(f"| `{name}` | {operator} | {a:.0f} | `{peer}` | {b:.0f} | 1/{b / a:.1f} | {wanted} |")
    copied = [t["elastic", "consistent"] / t["copy elastic", "consistent"] for t in ours]
    factor = statistics.median(copied)
    print(f"`elastic` takes {factor:.2f} times the time of copying its values (goal: 2)")
    return met and factor <= 2


def linked(options):
    """The same law, linked statically and opened as a plugin."""
    cargo, compiler, law = program("cargo"), program("cc"), "mohr_coulomb"
    built = target()
    manifest = ("--manifest-path", ROOT / "models" / law / "Cargo.toml")
    run(cargo, "build", "--release", "--quiet", *manifest)
    # Built aside, since another crate type would replace the shared library.
    aside = built / "linked"
    run(cargo, "rustc", "--release", "--quiet", "--crate-type", "staticlib", "--target-dir", aside, *manifest)
    with tempfile.TemporaryDirectory() as folder:
        both = Path(folder) / "linked"
        run(compiler, "-O2", "-I", ROOT / "abi" / "include", "-o", both, HERE / "peers" / "linked.c",
            aside / "release" / f"lib{law}.a", "-lpthread", "-ldl", "-lm", "-lgcc_s")
        rows = [line.split("\t") for line in
                run(both, built / "release" / f"lib{law}.so", 201).splitlines()]
    print(f"linked: `{law}` with tangent, ns per integration point, CPU time; no allocation in any call")
    print("| batch | linked | plugin | plugin / linked | goal |")
    print("|---|---|---|---|---|")
    met = True
    for batch, a, b, ratio in rows:
        goal = 1.02 if int(batch) >= 64 else None
        met = met and (goal is None or float(ratio) <= goal)
        print(f"| {batch} | {a} | {b} | {ratio} | {goal or ''} |")
    return met


def generic(_):
    """One library by the contract and by MFront's generic interface."""
    cargo, compiler, law = program("cargo"), program("cc"), "mohr_coulomb"
    run(cargo, "build", "--release", "--quiet", "--manifest-path", ROOT / "models" / law / "Cargo.toml")
    with tempfile.TemporaryDirectory() as folder:
        caller = Path(folder) / "generic"
        run(compiler, "-O2", "-I", ROOT / "abi" / "include", "-o", caller, HERE / "peers" / "generic.c", "-ldl", "-lm")
        output = run(caller, target() / "release" / f"lib{law}.so")
    print(f"generic: `{law}`, ns per integration point, CPU time, the least of 25 alternating rounds")
    print("| step | operator | batch of 512 | native, one by one | MFront's interface | / one by one | goal |")
    print("|---|---|---|---|---|---|---|")
    met = True
    for line in output.splitlines():
        step, operator, *times = line.split("\t")
        batch, single, call = map(float, times)
        met = met and call <= single
        print(f"| {step} | {operator} | {batch:.0f} | {single:.0f} | {call:.0f} | {call / single:.2f} | 1 |")
    return met


# Mesh: at most this fraction of CalculiX's CPU seconds and of its memory.
ELASTIC = {"m200": None, "m2k": None, "m5k": None, "m20k": (1 / 8, 1 / 3), "m100k": (1 / 8, 1 / 3)}
# CalculiX prints the head's force with 7 digits.
SAME_FORCE = 3e-7


def chosen(options, meshes):
    """The meshes of a part that are asked for."""
    wanted = options.meshes.split(",") if options.meshes else meshes
    return [mesh for mesh in meshes if mesh in wanted]


def middle(runs, what):
    return statistics.median(what(run) for run in runs)


def judged(value, goal):
    """A cell that says what the goal is and whether it is met."""
    return "" if goal is None else f"1/{1 / goal:.0f}: {'met' if value <= goal else 'missed'}"


def elastic(options):
    """The elastic pile: one increment, one solution."""
    ours_program, ccx, met = pilum(), program("ccx"), True
    print(f"elastic: whole processes on one thread, medians of {options.rounds} alternating runs")
    print("| mesh | unknowns | CPU s | MiB | CalculiX: CPU s | MiB | ratio | goal | memory | goal "
          "| head load, N | differs by |")
    print("|---|---|---|---|---|---|---|---|---|---|---|---|")
    for name in chosen(options, ELASTIC):
        with tempfile.TemporaryDirectory() as folder:
            folder = Path(folder)
            calculix.write(Mesh(*MESHES[name]), folder)
            text, ours, theirs = bonded_case(*MESHES[name], elastic=True), [], []
            for _ in range(options.rounds):
                ours.append(run_case(ours_program, text, folder, "--variant", "bench"))
                theirs.append(measure([ccx, "pile"], folder))
                if theirs[-1].code != 0:
                    raise Missing(f"ccx ended with {theirs[-1].code}:\n{theirs[-1].output[-1000:]}")
            force = calculix.head_force(folder)
        a, b = middle(ours, lambda run: run.usage.cpu), middle(theirs, lambda run: run.cpu)
        m, n = middle(ours, lambda run: run.usage.memory), middle(theirs, lambda run: run.memory)
        goals = ELASTIC[name] or (None, None)
        differs = abs(ours[-1].head - force) / force
        met = met and differs <= SAME_FORCE
        met = met and all(goal is None or x <= goal for x, goal in zip((a / b, m / n), goals))
        print(f"| {name} | {ours[-1].unknowns} | {a:.3f} | {m:.0f} | {b:.3f} | {n:.0f} | 1/{b / a:.1f} | "
              f"{judged(a / b, goals[0])} | 1/{n / m:.1f} | {judged(m / n, goals[1])} | "
              f"{ours[-1].head:.6f} | {differs:.0e} |", flush=True)
    return met


def ogs_program(folder):
    """The program of OpenGeoSys' wheel."""
    return ogs_library(folder).parents[4] / "bin" / "ogs"


# Mesh: whether OpenGeoSys completes it, and at most this fraction of its CPU seconds.
PLASTIC = {"m200": (True, 1 / 10), "m2k": (True, 1 / 10), "m5k": (False, None), "m20k": (False, None)}


def plastic(options):
    """The pile in Mohr-Coulomb soil: ten increments."""
    ours_program, ogs, met = pilum(), ogs_program(options.ogs), True
    with tempfile.TemporaryDirectory() as folder:
        start = statistics.median(
            measure([ogs, "--version"], folder).cpu for _ in range(options.rounds))
    print(f"plastic: whole processes on one thread, medians of {options.rounds} alternating runs; a run that "
          "OpenGeoSys does not\ncomplete counts once")
    print(f"{start:.3f} s of OpenGeoSys' CPU time are the start of its Python wrapper; the second ratio is "
          "without them, and the one that is judged")
    print("| mesh | unknowns | CPU s | MiB | iterations | head load, N | OpenGeoSys: CPU s | MiB | iterations "
          "| head load, N | ratio | less start | goal | iterations |")
    print("|---|---|---|---|---|---|---|---|---|---|---|---|---|---|")
    for name in chosen(options, PLASTIC):
        completes, goal = PLASTIC[name]
        mesh = Mesh(*MESHES[name])
        text, ours, theirs = bonded_case(*MESHES[name], elastic=False), [], []
        with tempfile.TemporaryDirectory() as folder:
            folder = Path(folder)
            opengeosys.write(mesh, folder, elastic=False)
            try:
                for _ in range(options.rounds if completes else 1):
                    ours.append(run_case(ours_program, text, folder, "--variant", "bench"))
                    if completes or options.failing:
                        theirs.append(measure([ogs, "pile.prj"], folder))
            except Failed as failed:
                print(f"| {name} | complete: missed |\n{failed}", flush=True)
                met = False
                continue
            done = bool(theirs) and theirs[-1].code == 0
            force = opengeosys.head_force(folder, mesh, elastic=False) if done else None
        last, a = ours[-1], middle(ours, lambda run: run.usage.cpu)
        cut = f", {last.cut_backs} cut back" if last.cut_backs else ""
        row = (f"| {name} | {last.unknowns} | {a:.3f} | {middle(ours, lambda run: run.usage.memory):.0f} | "
               f"{last.iterations}{cut} | {last.head:.2f} | ")
        if not theirs:
            print(row + "not run | | | | | | complete: met | |", flush=True)
            continue
        b = middle(theirs, lambda run: run.cpu)
        iterations = opengeosys.iterations(theirs[-1].output)
        row += f"{b:.3f} | {middle(theirs, lambda run: run.memory):.0f} | {iterations} | "
        if not done:
            increment = opengeosys.increments_begun(theirs[-1].output)
            print(row + f"fails in increment {increment} | | | complete: met | |", flush=True)
            continue
        less, fewer = a / (b - start), last.iterations <= iterations
        met = met and fewer and (goal is None or less <= goal)
        print(row + f"{force:.2f} | 1/{b / a:.1f} | 1/{1 / less:.1f} | {judged(less, goal)} | "
              f"no more: {'met' if fewer else 'missed'} |", flush=True)
    return met


PARTS = {"laws": laws, "linked": linked, "generic": generic, "elastic": elastic, "plastic": plastic}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("parts", nargs="*", metavar="PART", help=f"of {', '.join(PARTS)}; all if left out")
    parser.add_argument("--rounds", type=int, default=5, help="alternating runs of both programs")
    parser.add_argument("--ogs", help="folder with the wheel of OpenGeoSys")
    parser.add_argument("--meshes", help="of the elastic and the plastic pile, by commas; all if left out")
    parser.add_argument("--failing", action="store_true",
                        help="run OpenGeoSys where it fails, too (minutes)")
    options = parser.parse_args()
    unknown = set(options.parts) - set(PARTS)
    if unknown:
        parser.error(f"unknown part {', '.join(sorted(unknown))}")
    code = 0
    for name in options.parts or PARTS:
        try:
            code = max(code, 0 if PARTS[name](options) else 1)
        except (Missing, Failed) as why:
            print(f"{name}: not measured: {why}")
            code = 2
    return code


if __name__ == "__main__":
    sys.exit(main())
