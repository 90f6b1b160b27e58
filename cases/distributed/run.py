"""Runs a case on many ranks: `mpiexec -n 2 python run.py CASE [--variant NAME] [--results FOLDER]`.

Exit codes are those of `pilum run`: 0 done, 1 wrong input, 2 no equilibrium, 3 a law fails, 4 a defect.
"""

from __future__ import annotations

import argparse
import hashlib
import importlib.util
import json
import os
import shutil
import sys
import time
import traceback
import warnings
from pathlib import Path
from typing import NoReturn

# Ranks share the processors; libraries must not start threads on top.
os.environ.setdefault("OMP_NUM_THREADS", "1")
NEEDED = {
    "numpy": "numpy",
    "mpi4py": "an MPI library and mpi4py",
    "petsc4py": "PETSc with petsc4py",
    "dolfinx": "DOLFINx",
    "pilum": "Pilum's wheel",
}
VERSION = (0, 11)  # of DOLFINx


def ended(message: str, code: int) -> NoReturn:
    """Ends a rank before there is MPI: the others meet the same, and one says it."""
    ranks = [os.environ.get(name) for name in ("PMI_RANK", "OMPI_COMM_WORLD_RANK", "SLURM_PROCID")]
    if next((rank for rank in ranks if rank), "0") == "0":
        print(f"error: {message}", file=sys.stderr, flush=True)
    raise SystemExit(code)


class Arguments(argparse.ArgumentParser):
    """Exit code 1 for a wrong argument, as for all that is wrong in the input."""

    def error(self, message: str) -> NoReturn:
        ended(f"{message}\n{self.format_usage()}".rstrip(), 1)


def check_environment() -> None:
    """Says what is missing before anything is imported that would say it worse."""
    if sys.version_info < (3, 11):
        ended("Python 3.11 or newer is needed (of the wheels of DOLFINx 3.12)", 1)
    missing = [what for name, what in NEEDED.items() if importlib.util.find_spec(name) is None]
    if missing:
        ended(f"{', '.join(missing)} cannot be imported by {sys.executable}: see README.md, or run install.sh", 1)
    try:
        if importlib.util.find_spec("dolfinx_solver"):
            import dolfinx_solver  # noqa: F401  # orders what is imported
        from mpi4py import MPI
    except (ImportError, RuntimeError) as error:
        ended(f"MPI cannot be loaded: {error}", 1)
    for variable in ("PMI_SIZE", "OMPI_COMM_WORLD_SIZE", "SLURM_STEP_NUM_TASKS"):
        started = os.environ.get(variable, "1")
        if started.isdigit() and int(started) > 1 and MPI.COMM_WORLD.size == 1:
            ended(
                f"{started} processes were started, and each is alone: mpiexec belongs to another MPI than mpi4py "
                f"({MPI.Get_library_version().splitlines()[0].strip()})",
                1,
            )
    try:
        import dolfinx
        from petsc4py import PETSc
    except (ImportError, RuntimeError) as error:
        ended(f"DOLFINx cannot be loaded: {error}", 1)
    found = tuple(int(part) for part in dolfinx.__version__.split(".")[:2])
    if found < VERSION:
        ended(f"DOLFINx {dolfinx.__version__} is installed, 0.11 is needed", 1)
    if PETSc.ScalarType().dtype.kind == "c":
        ended("this PETSc computes with complex numbers: one for real numbers is needed", 1)
    if not PETSc.Sys.hasExternalPackage("mumps"):
        ended("this PETSc has no MUMPS", 1)


def natural(text: str) -> int:
    """A whole number of at least 1."""
    if not text.isdecimal() or int(text) == 0:
        raise argparse.ArgumentTypeError(f"{text} is no increment")
    return int(text)


def arguments() -> argparse.Namespace:
    parser = Arguments(description="Runs a case of Pilum on many ranks, in DOLFINx.")
    parser.add_argument("case", type=Path, help="a case file, or a folder with case.toml")
    parser.add_argument("--variant", help="one of the file's variants")
    parser.add_argument("--results", type=Path, default=Path("results/distributed"), help="folder of the results")
    parser.add_argument("--resume", action="store_true", help="go on from the state in the folder of the results")
    parser.add_argument("--stop-after", type=natural, metavar="N", help="stop after increment N, to be resumed")
    return parser.parse_args()


def main() -> None:
    asked = arguments()
    check_environment()
    import pilum
    from grid_case import WrongInput, load
    from mpi4py import MPI
    from pilum_dolfinx import Body, LawFailed, NoEquilibrium, together

    comm, began = MPI.COMM_WORLD, time.monotonic()
    first = comm.rank == 0

    def say(text: str) -> None:
        if first:
            print(text, flush=True)

    def warn(message: Warning | str, *_: object) -> None:
        print(f"warning: {message}", file=sys.stderr, flush=True)

    # Warnings of laws as they are opened are the same on all ranks; later on each has its own points.
    warnings.showwarning = warn
    warnings.simplefilter("once" if first else "ignore", pilum.PilumWarning)

    def stop(error: Exception, code: int) -> NoReturn:
        if first:
            print(f"error: {error}", file=sys.stderr, flush=True)
        raise SystemExit(code)

    try:
        case = together(comm, lambda: load(asked.case, asked.variant))
        body = Body(comm, case)
        warnings.simplefilter("once", pilum.PilumWarning)
        unknowns = 2 * body.V.dofmap.index_map.size_global
        cells = comm.gather(body.n_owned)
        say(f"{case.title}: {unknowns} unknowns, {comm.size} ranks with {', '.join(map(str, cells or []))} elements")

        led = [(line, component) for line, component, _ in case.prescribed]
        header = ["increment", "iterations", *(f"{line}_{'xy'[component]}" for line, component in led)]
        history = asked.results / "history.csv"
        mark = mark_of(case, body)
        if asked.resume:
            body.go_on_from(asked.results / "state", mark)
            rows = history.read_text().splitlines()[: body.reached + 1] if first else []
            say(f"goes on after increment {body.reached}")
        else:
            rows = [",".join(header)]
            if first:
                shutil.rmtree(asked.results / "state", ignore_errors=True)
        if first:
            asked.results.mkdir(parents=True, exist_ok=True)
            history.write_text("\n".join(rows) + "\n")
        comm.barrier()

        set_up = time.monotonic() - began
        until = min(case.increments, asked.stop_after or case.increments)
        while body.reached < until:
            iterations = body.advance()
            forces = [body.reaction(line)[component] for line, component in led]
            if first:
                with history.open("a") as file:
                    file.write(
                        ",".join([str(body.reached), str(iterations), *(repr(float(force)) for force in forces)]) + "\n"
                    )
            body.keep(asked.results / "state", mark)
            say(f"increment {body.reached}/{case.increments}, {iterations} iterations")
    except WrongInput as error:
        stop(error, 1)
    except OSError as error:  # of rank 0, which writes the tables
        print(f"error: {error}", file=sys.stderr, flush=True)
        comm.Abort(1)
    except NoEquilibrium as error:
        stop(error, 2)
    except LawFailed as error:
        stop(error, 3)

    processor, parts = comm.gather(time.process_time()), comm.gather(body.spent)
    if first:
        wall = time.monotonic() - began
        summary = {
            "case": str(case.file),
            "variant": asked.variant,
            "unknowns": unknowns,
            "ranks": comm.size,
            "elements": cells,
            "increments": body.reached,
            "wall_s": round(wall, 3),
            "set_up_s": round(set_up, 3),
            "cpu_s": [round(seconds, 3) for seconds in processor],
            **{f"cpu_{part}_s": [round(of_rank[part], 3) for of_rank in parts] for part in parts[0]},
            "laws": {
                name: {"law": law.id, "library": str(law.library), "sha256": law.sha256}
                for name, law in body.laws.items()
            },
        }
        (asked.results / "summary.json").write_text(json.dumps(summary, indent=2) + "\n")
        print(
            f"results in {asked.results}: {wall:.1f} s, of the processors {', '.join(f'{s:.1f}' for s in processor)} s"
        )


def mark_of(case, body) -> str:  # noqa: ANN001
    """A digest that two runs share if the one can go on with the other's state."""
    digest = hashlib.sha256()
    for array in (case.vertices, case.cells):
        digest.update(array.tobytes())
    loads = (case.axisymmetric, case.increments, case.time, case.fixed, case.prescribed, case.pressures)
    laws = {name: (law.id, law.sha256, law.parameters) for name, law in body.laws.items()}
    points = {name: one.points for name, one in case.interfaces.items()}
    stress = {name: one.stress.tolist() for name, one in case.solids.items()}
    digest.update(repr((loads, sorted(laws.items()), points, stress)).encode())
    return digest.hexdigest()


if __name__ == "__main__":
    try:
        main()
    except Exception:  # one rank that ends alone leaves the others waiting
        traceback.print_exc()
        sys.stderr.flush()
        from mpi4py import MPI

        MPI.COMM_WORLD.Abort(4)
