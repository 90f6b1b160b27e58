#!/usr/bin/env python3
"""Measures the laws beside those of a peer, in one run, on one thread, in CPU time, and prints the
ratios.

    peers.py [laws] [--rounds N] [--ogs FOLDER]

Each part is a function in PARTS that prints its own table; a part whose peer is not there says what
is missing and how to get it, and the others still run.

laws    Mohr-Coulomb and elasticity of MFront, from the Python wheel of OpenGeoSys
        (`python3 -m venv FOLDER && FOLDER/bin/pip install ogs==6.5.9`; FOLDER by --ogs or PILUM_OGS)
linked  the peer is the law itself, linked into the calling program instead of opened as a plugin
"""

import argparse
import json
import os
import shutil
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path

HERE = Path(__file__).resolve().parent
ROOT = HERE.parent.parent


class Missing(Exception):
    """What a part needs and does not find."""


def program(name):
    """A program on the path."""
    found = shutil.which(name)
    if not found:
        raise Missing(f"`{name}` is not on the path")
    return found


def run(*command):
    """Output of a command."""
    done = subprocess.run([str(c) for c in command], capture_output=True, text=True)
    if done.returncode != 0:
        raise Missing(f"{' '.join(map(str, command))} failed:\n{done.stderr.strip()[-2000:]}")
    return done.stdout


def bench(name):
    """The executable of a bench of the host, built with the laws."""
    cargo = program("cargo")
    run(cargo, "build", "--release", "--quiet", "--manifest-path", ROOT / "Cargo.toml")
    listing = subprocess.run(
        [cargo, "bench", "--package", "host", "--bench", name, "--no-run"],
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
    target = Path(json.loads(run(cargo, "metadata", "--no-deps", "--format-version", 1,
                                 "--manifest-path", ROOT / "Cargo.toml"))["target_directory"])
    manifest = ("--manifest-path", ROOT / "models" / law / "Cargo.toml")
    run(cargo, "build", "--release", "--quiet", *manifest)
    # Built aside, since a crate type of its own would replace the shared library.
    aside = target / "linked"
    run(cargo, "rustc", "--release", "--quiet", "--crate-type", "staticlib", "--target-dir", aside, *manifest)
    with tempfile.TemporaryDirectory() as folder:
        both = Path(folder) / "linked"
        run(compiler, "-O2", "-I", ROOT / "abi" / "include", "-o", both, HERE / "peers" / "linked.c",
            aside / "release" / f"lib{law}.a", "-lpthread", "-ldl", "-lm", "-lgcc_s")
        rows = [line.split("\t") for line in
                run(both, target / "release" / f"lib{law}.so", 201).splitlines()]
    print(f"linked: `{law}` with tangent, ns per integration point, CPU time; no allocation in any call")
    print("| batch | linked | plugin | plugin / linked | goal |")
    print("|---|---|---|---|---|")
    met = True
    for batch, a, b, ratio in rows:
        goal = 1.02 if int(batch) >= 64 else None
        met = met and (goal is None or float(ratio) <= goal)
        print(f"| {batch} | {a} | {b} | {ratio} | {goal or ''} |")
    return met


PARTS = {"laws": laws, "linked": linked}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("parts", nargs="*", metavar="PART", help=f"of {', '.join(PARTS)}; all if left out")
    parser.add_argument("--rounds", type=int, default=5, help="alternating runs of both programs")
    parser.add_argument("--ogs", help="folder with the wheel of OpenGeoSys")
    options = parser.parse_args()
    unknown = set(options.parts) - set(PARTS)
    if unknown:
        parser.error(f"unknown part {', '.join(sorted(unknown))}")
    code = 0
    for name in options.parts or PARTS:
        try:
            code = max(code, 0 if PARTS[name](options) else 1)
        except Missing as missing:
            print(f"{name}: not measured: {missing}")
            code = 2
    return code


if __name__ == "__main__":
    sys.exit(main())
