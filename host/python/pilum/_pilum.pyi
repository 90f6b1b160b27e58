"""The part of the package that is written in Rust."""

import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Literal, final, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._run import Step

__version__: str

_Hypothesis = Literal["plane_strain", "axisymmetric", "3d", "interface_2d", "interface_3d"]
_Folders = Sequence[str | os.PathLike[str]]
_Operator = Literal["consistent", "elastic"]

@final
class Law:
    def __new__(
        cls,
        id: str,
        /,
        *,
        hypothesis: _Hypothesis | None = None,
        parameters: Mapping[str, float | str] | None = None,
        law_path: _Folders | None = None,
        isolate: float | None = None,
        **values: Any,
    ) -> Law: ...
    @property
    def id(self) -> str: ...
    @property
    def hypothesis(self) -> str: ...
    @property
    def components(self) -> list[str]: ...
    @property
    def variables(self) -> list[str]: ...
    @property
    def parameters(self) -> dict[str, float | str]: ...
    @property
    def library(self) -> Path: ...
    @property
    def sha256(self) -> str: ...
    @property
    def law_path(self) -> list[Path]: ...
    @property
    def isolate(self) -> float | None: ...
    def initial(
        self,
        points: int | None = None,
        *,
        flux: ArrayLike | None = None,
        gradient: ArrayLike | None = None,
        internal: ArrayLike | None = None,
        time: float = 0.0,
        increment: int = 0,
    ) -> State: ...
    @overload
    def integrate(
        self,
        gradient: ArrayLike,
        state: State | None = None,
        *,
        dt: float = 1.0,
        tangent: _Operator = "consistent",
        out: State | None = None,
        copy: bool = True,
        positions: ArrayLike | None = None,
    ) -> tuple[NDArray[np.float64], NDArray[np.float64], State]: ...
    @overload
    def integrate(
        self,
        gradient: ArrayLike,
        state: State | None = None,
        *,
        dt: float = 1.0,
        tangent: None,
        out: State | None = None,
        copy: bool = True,
        positions: ArrayLike | None = None,
    ) -> tuple[NDArray[np.float64], None, State]: ...
    @overload
    def integrate(
        self,
        gradient: ArrayLike,
        state: State | None = None,
        *,
        dt: float = 1.0,
        tangent: _Operator | None,
        out: State | None = None,
        copy: bool = True,
        positions: ArrayLike | None = None,
    ) -> tuple[NDArray[np.float64], NDArray[np.float64] | None, State]: ...

@final
class State:
    @property
    def gradient(self) -> NDArray[np.float64]: ...
    @property
    def flux(self) -> NDArray[np.float64]: ...
    @property
    def internal(self) -> NDArray[np.float64]: ...
    @property
    def time(self) -> float: ...
    @property
    def increment(self) -> int: ...
    def __getitem__(self, key: str, /) -> NDArray[np.float64]: ...
    def __len__(self) -> int: ...

@final
class SimulationState:
    @property
    def phase(self) -> int: ...
    @property
    def increment(self) -> int: ...
    @property
    def reached(self) -> float: ...

@final
class Simulation:
    def __new__(
        cls,
        source: str | os.PathLike[str] | Mapping[str, Any],
        *,
        name: str = "problem",
        mesh: bytes | None = None,
        set: Mapping[str, Any] | None = None,
        variant: str | None = None,
        isolate: float | None = None,
    ) -> Simulation: ...
    @property
    def time(self) -> float: ...
    @property
    def groups(self) -> list[str]: ...
    @property
    def lines(self) -> list[str]: ...
    @property
    def nodes(self) -> NDArray[np.float64]: ...
    @property
    def mesh_rows(self) -> NDArray[np.int64]: ...
    @property
    def displacements(self) -> NDArray[np.float64]: ...
    @property
    def reactions(self) -> NDArray[np.float64]: ...
    def reaction(self, line: str) -> list[float]: ...
    def displacement(self, line: str) -> list[float]: ...
    def group(self, name: str) -> dict[str, NDArray[Any]]: ...
    def step(self) -> Step | None: ...
    def run(self) -> None: ...
    def state(self) -> SimulationState | None: ...
    def go_to(self, state: SimulationState) -> None: ...
    def copy(self) -> Simulation: ...
    def __copy__(self) -> Simulation: ...
    def __deepcopy__(self, _memo: Any) -> Simulation: ...
    def __iter__(self) -> Iterator[Step]: ...
    def __next__(self) -> Step: ...

@final
class Residuals:
    def __new__(cls, file: str, settings: Mapping[str, Any] | None, variant: str | None, folder: str) -> Residuals: ...
    @property
    def parameters(self) -> list[tuple[str, list[float], float]]: ...
    @property
    def points(self) -> int: ...
    def residuals(self, theta: list[float], folder: str) -> list[float]: ...
    def jacobian(self, theta: list[float], folder: str) -> list[float]: ...
    def log_likelihood(self, theta: list[float], folder: str, scatter: float) -> float: ...

def state_of(
    gradient: NDArray[np.float64],
    flux: NDArray[np.float64],
    internal: NDArray[np.float64],
    time: float,
    increment: int,
    names: Sequence[str],
) -> State: ...
def describe(id: str, /, *, law_path: _Folders | None = None) -> dict[str, Any]: ...
def laws(*, law_path: _Folders | None = None) -> dict[str, Path]: ...
def point(
    source: str | os.PathLike[str] | Mapping[str, Any],
    settings: Mapping[str, Any] | None,
    variant: str | None,
    isolate: float | None,
) -> list[tuple[str | None, str, int, int, int]]: ...
def run(
    source: str | os.PathLike[str] | Mapping[str, Any],
    name: str,
    mesh: bytes | None,
    settings: Mapping[str, Any] | None,
    variant: str | None,
    results: str | os.PathLike[str] | None,
    resume: bool,
    checkpoints: float | None,
    isolate: float | None,
    watch: Callable[..., object] | None,
) -> list[tuple[str | None, Path]]: ...
def stream(columns: Sequence[tuple[str, Any]]) -> object: ...
def stands_for(program: str | os.PathLike[str]) -> None: ...
def goes_on_as_copy() -> None: ...
