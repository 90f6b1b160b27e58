"""Programs: where they are, and the CPU seconds, wall seconds and peak memory of one run.

A child's peak memory counts from the fork, when it still is its parent. So this module is also that
parent: a separate program, smaller than anything it measures.

    programs.py RESULT LOG PROGRAM [ARGUMENT …]
"""

import json
import os
import shutil
import subprocess
import sys
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent.parent


class Missing(Exception):
    """A measurement needs something that is missing."""


class Failed(Exception):
    """A run of ours that did not come to its end."""


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


def target():
    """The workspace's build folder."""
    listing = run(program("cargo"), "metadata", "--no-deps", "--format-version", 1,
                  "--manifest-path", ROOT / "Cargo.toml")
    return Path(json.loads(listing)["target_directory"])


def pilum():
    """Our program, built with its laws."""
    run(program("cargo"), "build", "--release", "--quiet", "--manifest-path", ROOT / "Cargo.toml")
    return target() / "release" / "pilum"


class Done:
    """A run of our program on a case: what it used, and what came out."""

    def __init__(self, usage, folder):
        self.usage = usage
        summary = json.loads((folder / "summary.json").read_text())
        phases = summary["phases"]
        self.phases = phases
        self.unknowns = phases[-1]["equations"]
        self.iterations = sum(phase["iterations"] for phase in phases)
        self.cut_backs = sum(phase["cut_backs"] for phase in phases)
        # The load on the pile's head, N.
        self.head = 1000.0 * phases[-1]["probes"]["q_t"]


def run_case(pilum, text, folder, *arguments, n_threads=1):
    """Runs a case given by its text. Raises `Failed`."""
    case, results = folder / "case.toml", folder / "results"
    case.write_text(text)
    usage = measure([pilum, "run", case, "--out", results, *arguments], folder, n_threads)
    if usage.code != 0:
        raise Failed(f"pilum ended with {usage.code}:\n{usage.output[-2000:]}")
    return Done(usage, results)


class Usage:
    """What a process used: CPU and wall seconds, peak MiB; its exit code and its output."""

    def __init__(self, cpu, wall, memory, code, output):
        self.cpu, self.wall, self.memory, self.code, self.output = cpu, wall, memory, code, output


def threads(n):
    """The environment that holds programs to `n` threads."""
    names = ("RAYON_NUM_THREADS", "OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "OGS_ASM_THREADS")
    return {**os.environ, **dict.fromkeys(names, str(n))}


def measure(command, folder, n_threads=1):
    """Runs a command in a folder; both streams of its output go through a file there."""
    result, log = Path(folder) / "usage.json", Path(folder) / "usage.log"
    subprocess.run([sys.executable, "-ISs", __file__, result, log, *map(str, command)],
                   cwd=folder, env=threads(n_threads), check=True)
    return Usage(**json.loads(result.read_text()), output=log.read_text(errors="replace"))


def _run(result, log, *command):
    started = time.monotonic()
    child = os.fork()
    if child == 0:
        try:
            out = os.open(log, os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
            os.dup2(out, 1)
            os.dup2(out, 2)
            os.execvp(command[0], command)
        except OSError as error:
            os.write(2, f"{command[0]}: {error}\n".encode())
        os._exit(127)
    _, status, used = os.wait4(child, 0)
    with open(result, "w") as file:
        json.dump({"cpu": used.ru_utime + used.ru_stime, "wall": time.monotonic() - started,
                   "memory": used.ru_maxrss / 1024, "code": os.waitstatus_to_exitcode(status)}, file)


if __name__ == "__main__":
    _run(*sys.argv[1:])
