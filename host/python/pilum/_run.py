"""Runs of cases and drivers, from files or dictionaries."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, NamedTuple, TypeAlias, TypedDict, Union, overload

from . import _pilum
from ._errors import InputError
from ._mesh import Mesh
from ._results import Results
from ._table import Table

__all__ = ["Problem", "Progress", "Step", "point", "run"]

Case: TypeAlias = Union[str, "os.PathLike[str]", Mapping[str, Any]]


class Progress(NamedTuple):
    """An increment that has reached equilibrium, as passed to `watch`."""

    phase: str
    """Name of the phase."""
    increment: int
    """Number of the increment in it, from 1."""
    of: int
    """Increments of the phase."""
    iterations: int
    """Iterations of the increment, failed attempts included."""
    cut_backs: int
    """Cut-backs in the phase so far."""


class Step(TypedDict):
    """An increment that has reached equilibrium: the dictionary that `Simulation.step` returns."""

    phase: str
    """Name of the phase."""
    increment: int
    """Number of the increment in it, from 1."""
    of: int
    """Increments of the phase."""
    time: float
    """The time at its end."""
    iterations: int
    """Iterations of the increment, failed attempts included."""
    unreliable: str | None
    """Why a law calls a result inaccurate; None if none does."""


class Problem:
    """A problem to compute: a case, as a file or a dictionary, perhaps on a mesh of arrays.

    `case` is a file, a folder with `case.toml`, or a dictionary; `set` and `isolate` are those of
    `pilum.run`. In a dictionary `laws` may be `pilum.Law`s; their `law_path` is searched, too, and if one
    of them is isolated, all are. `mesh` is a `pilum.Mesh` or a mesh of meshio, instead of the key `mesh`.
    `variant` names one of several. Paths in a dictionary are relative to the working folder.
    """

    def __init__(
        self,
        case: Case,
        mesh: Any = None,
        *,
        name: str = "problem",
        set: Mapping[str, Any] | None = None,
        variant: str | None = None,
        isolate: float | None = None,
    ) -> None:
        self.name = name
        """Its name, and that of its folder of results without a file."""
        self._mesh: bytes | None = None
        if mesh is not None:
            if not isinstance(case, Mapping):
                raise InputError("a mesh of arrays goes with a case that is a dictionary")
            if not isinstance(mesh, Mesh):
                mesh = Mesh.from_meshio(mesh)
            self._mesh = mesh._content()
            case = {**case, "mesh": {"file": "mesh of arrays", **case.get("mesh", {})}}
        if isinstance(case, Mapping):
            laws = case.get("laws")
            own = [
                law
                for law in (laws.values() if isinstance(laws, Mapping) else ())
                if isinstance(law, _pilum.Law)
            ]
            folders = [str(Path(folder).absolute()) for law in own for folder in law.law_path]
            if folders:
                case = {**case, "law_path": [*dict.fromkeys(folders), *case.get("law_path", [])]}
            apart = [law.isolate for law in own if law.isolate is not None]
            if isolate is None and apart:
                isolate = min(apart)
        self._case: Any = dict(case) if isinstance(case, Mapping) else os.fspath(case)
        self._set = None if set is None else dict(set)
        self._variant = variant
        self._isolate = isolate

    def start(self) -> _pilum.Simulation:
        """A checked simulation before its first phase; each one is independent."""
        return _pilum.Simulation(
            self._case,
            name=self.name,
            mesh=self._mesh,
            set=self._set,
            variant=self._variant,
            isolate=self._isolate,
        )

    def run(
        self,
        results: str | os.PathLike[str] | None = None,
        *,
        watch: Callable[[Progress], object] | None = None,
        resume: bool = False,
        checkpoints: float | None = 1.0,
    ) -> Results | Any:
        """As `pilum.run`."""
        done = _pilum.run(
            self._case,
            self.name,
            self._mesh,
            self._set,
            self._variant,
            None if results is None else os.fspath(results),
            resume,
            checkpoints,
            self._isolate,
            watch,
        )
        if [variant for variant, _ in done if variant is not None] and self._variant is None:
            return {variant: Results(folder) for variant, folder in done}
        return Results(done[0][1])

    def __repr__(self) -> str:
        what = "a dictionary" if isinstance(self._case, dict) else self._case
        return f"<pilum.Problem {self.name}: {what}>"


@overload
def run(
    case: Case,
    *,
    set: Mapping[str, Any] | None = None,
    watch: Callable[[Progress], object] | None = None,
    results: str | os.PathLike[str] | None = None,
    variant: str,
    resume: bool = False,
    checkpoints: float | None = 1.0,
    isolate: float | None = None,
) -> Results: ...
@overload
def run(
    case: Case | Problem,
    *,
    set: Mapping[str, Any] | None = None,
    watch: Callable[[Progress], object] | None = None,
    results: str | os.PathLike[str] | None = None,
    variant: None = None,
    resume: bool = False,
    checkpoints: float | None = 1.0,
    isolate: float | None = None,
) -> Results | Any: ...
def run(
    case: Case | Problem,
    *,
    set: Mapping[str, Any] | None = None,
    watch: Callable[[Progress], object] | None = None,
    results: str | os.PathLike[str] | None = None,
    variant: str | None = None,
    resume: bool = False,
    checkpoints: float | None = 1.0,
    isolate: float | None = None,
) -> Results | Any:
    """Runs a case and returns its `Results`, with variants a dictionary of them by name.

    `case` is a file, a folder with `case.toml`, a dictionary with the keys of a case file, or a `Problem`.
    `set` overrides settings: `{"phase.push.increments": 80, "laws.mepi.parameters.k_n": 2e5}`. `watch` is
    called with a `Progress` after every increment, by the calling thread; its exceptions stop the run and
    are raised here. Ctrl-C stops the run; `resume=True` goes on from there.

    Results go into the folder `results`, default `results/<case>`. `checkpoints` is the time between
    checkpoints, s. `isolate` calls laws in separate processes and is the time limit of a call, s: a law
    that crashes raises LawError.

    With variants a type checker needs `typing.cast("dict[str, pilum.Results]", pilum.run(case))`.

    Raises InputError, NoEquilibriumError or LawError. Warnings are PilumWarning.
    """
    if isinstance(case, Problem):
        if set is not None or variant is not None or isolate is not None:
            raise InputError("set, variant and isolate are said to the Problem")
        problem = case
    else:
        problem = Problem(case, set=set, variant=variant, isolate=isolate)
    return problem.run(results, watch=watch, resume=resume, checkpoints=checkpoints)


@overload
def point(
    driver: Case,
    *,
    set: Mapping[str, Any] | None = None,
    variant: str,
    isolate: float | None = None,
) -> Table: ...
@overload
def point(
    driver: Case,
    *,
    set: Mapping[str, Any] | None = None,
    variant: None = None,
    isolate: float | None = None,
) -> Table | Any: ...
def point(
    driver: Case,
    *,
    set: Mapping[str, Any] | None = None,
    variant: str | None = None,
    isolate: float | None = None,
) -> Table | Any:
    """Leads a law along a path and returns the `Table` of its increments.

    `driver` is a driver file, or a dictionary with its keys; with variants the result is a dictionary of
    tables by name. Columns are `increment`, jumps and tractions (or strains and stresses) by component,
    internal variables by id, `iterations`; row 0 is the initial state.
    """
    source = dict(driver) if isinstance(driver, Mapping) else os.fspath(driver)
    led = _pilum.point(source, None if set is None else dict(set), variant, isolate)
    tables = {name: Table.of_text(rows) for name, rows, *_ in led}
    if variant is None and any(name is not None for name in tables):
        return tables
    return next(iter(tables.values()))
