"""A calibration as plain functions of its parameters, for the libraries of others."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _pilum
from ._calibrate import Calibration, calibrate
from ._errors import Error, InputError, LawError, NoEquilibriumError
from ._merge import merged, variants
from ._run import point, run

__all__ = ["CalibrationProblem"]

_READINGS = ("offset_x", "scale_x", "offset_y", "scale_y")
_Values = NDArray[np.float64]


class _Curve(NamedTuple):
    """A measured curve. `readings` are places of parameters, None where nothing is fitted."""

    x: str
    y: str
    stretch: Any
    at: _Values
    measured: _Values
    noise: _Values
    weight: float
    readings: list[int | None]


class _Test(NamedTuple):
    """A test. `targets` are keys of its file with the places of their parameters."""

    name: str
    path: Path
    is_case: bool
    variant: str | None
    fixed: dict[str, Any]
    targets: list[tuple[str, int]]
    increments: list[int]
    variants: int
    step: float
    curves: list[_Curve]

    def settings(self, values: _Values) -> dict[str, Any]:
        """Settings of its file with these values of all parameters."""
        return {**self.fixed, **{key: float(values[place]) for key, place in self.targets}}

    def places(self) -> set[int | None]:
        """Places of the parameters that move it."""
        read = [place for curve in self.curves for place in curve.readings]
        return {place for _, place in self.targets} | set(read)

    def points(self) -> int:
        """Number of measured points."""
        return sum(len(curve.at) for curve in self.curves)


class CalibrationProblem:
    """Residuals, their derivatives and the likelihood of a calibration, for other optimisers and samplers.

    `file`, `set` and `variant` are those of `pilum.calibrate`. `calibration` is the outcome of that call with the same
    arguments; without it the command is called with one start and without profiles. Predicted tests are no part
    of it. A driver is computed in this process, a case is a run. Arrays `theta` have shape (parameters,), in the
    order of `names` and in the unit of each law.
    """

    def __init__(
        self,
        file: str | os.PathLike[str],
        *,
        set: Mapping[str, Any] | None = None,
        variant: str | None = None,
        calibration: Calibration | None = None,
    ) -> None:
        if calibration is None:
            with tempfile.TemporaryDirectory() as folder:
                quick = {**(set or {}), "starts": 1, "profiles": False}
                calibration = calibrate(file, set=quick, variant=variant, results=folder)
                calibration.fit, calibration.parameters  # read before the folder goes
        summary = calibration.summary
        found = summary["parameters"]
        self.names: list[str] = [parameter["name"] for parameter in found]
        """Names of the parameters."""
        self.bounds: _Values = np.array([parameter["bounds"] for parameter in found], dtype=np.float64)
        """Least and greatest values, shape (parameters, 2); infinite without one."""
        self.bounds = np.where(np.isnan(self.bounds), [-np.inf, np.inf], self.bounds)
        self.start: _Values = np.array([parameter["start"] for parameter in found])
        """Values that the command starts from."""
        self.best: _Values = calibration.values
        """Values that the command found."""
        self.scatter: float = float(np.sqrt(summary["stages"][-1]["variance"]))
        """Standard deviation over the noise of the file: 1 if `variance` is "given", else that of the command."""
        if summary["variance"] == "given":
            self.scatter = 1.0
        self._is_log = np.array([parameter["scale"] == "log" for parameter in found])
        self._width = np.array([np.subtract(*parameter["range"][::-1]) for parameter in found])
        content = merged(file, variant, set)
        self._tests = [
            self._test(test, content, Path(file).parent, calibration)
            for test in content["test"]
            if not test.get("predict", False)
        ]
        self._step = float(content.get("difference", max(test.step for test in self._tests)))

    def residuals(self, theta: ArrayLike) -> _Values:
        """Residuals of all points, shape (points,): computed less measured values over their noise, times the root
        of the weights. Their squares add up to the command's sum.

        Raises InputError for values outside `bounds`, LawError or NoEquilibriumError where a test has no answer.
        """
        values = self._checked(theta)
        return np.concatenate(self._residuals(self._tests, values))

    def jacobian(self, theta: ArrayLike) -> _Values:
        """Derivatives of `residuals` by the parameters, shape (points, parameters): central differences with the
        step of the file, one-sided at bounds. Raises as `residuals`."""
        values = self._checked(theta)
        columns = [self._derivative(values, place) for place in range(len(values))]
        return np.column_stack(columns)

    def log_likelihood(self, theta: ArrayLike, scatter: float | None = None) -> float:
        """Logarithm of the probability density of the measured values, normal and independent, with `scatter`
        times the noise of the file as standard deviation (default: `scatter`, the attribute).

        Weights are no information and do not count. It is -inf outside `bounds` and where a test has no answer.
        """
        scatter = self.scatter if scatter is None else scatter
        if np.shape(theta) != self.start.shape:
            raise InputError(f"theta has shape {np.shape(theta)}, expected {self.start.shape}")
        try:
            residuals = self.residuals(theta)
        except (InputError, LawError, NoEquilibriumError):
            return -np.inf
        curves = [curve for test in self._tests for curve in test.curves]
        noise = np.concatenate([curve.noise for curve in curves]) * scatter
        roots = np.concatenate([np.full(len(curve.at), np.sqrt(curve.weight)) for curve in curves])
        squares = np.sum((residuals / roots / scatter) ** 2)
        return float(-0.5 * squares - np.sum(np.log(noise)) - 0.5 * len(noise) * np.log(2 * np.pi))

    def __repr__(self) -> str:
        points = sum(test.points() for test in self._tests)
        return f"<pilum.CalibrationProblem of {', '.join(self.names)}: {points} points>"

    def _checked(self, theta: ArrayLike) -> _Values:
        values = np.asarray(theta, dtype=np.float64)
        if values.shape != self.start.shape:
            raise InputError(f"theta has shape {values.shape}, expected {self.start.shape}")
        for name, value, (low, high) in zip(self.names, values, self.bounds):
            if not low <= value <= high:
                raise InputError(f"`{name}` is {value}, outside [{low}, {high}]", key=name)
        return values

    def _derivative(self, values: _Values, place: int) -> _Values:
        sides = []
        for sign in (1.0, -1.0):
            there = values.copy()
            if self._is_log[place]:
                there[place] *= np.exp(sign * self._step)
            else:
                there[place] += sign * self._step * self._width[place]
            if self.bounds[place, 0] <= there[place] <= self.bounds[place, 1]:
                sides.append((there[place], there))
        if len(sides) < 2:
            sides.append((values[place], values))
        above, below = sides[0], sides[-1]
        moved = [test for test in self._tests if place in test.places()]
        pairs = zip(self._residuals(moved, above[1]), self._residuals(moved, below[1]))
        changes = iter([(a - b) / (above[0] - below[0]) for a, b in pairs])
        return np.concatenate(
            [next(changes) if place in test.places() else np.zeros(test.points()) for test in self._tests]
        )

    def _residuals(self, tests: list[_Test], values: _Values) -> list[_Values]:
        """Those of each test. Variants of a driver with the same settings are computed in one call, which is quicker."""
        shared: dict[str, Any] = {}
        found = []
        for test in tests:
            settings = test.settings(values)
            key = f"{test.path} {settings}"
            if test.variants and key not in shared:
                number = sum(other.path == test.path for other in tests)
                try:
                    shared[key] = point(test.path, set=settings) if 2 * number > test.variants else {}
                except Error:
                    shared[key] = {}
            table = shared.get(key, {}).get(test.variant) or _table(test, settings)
            found.append(np.concatenate([_of_curve(test, curve, table, values) for curve in test.curves]))
        return found

    def _test(
        self, test: dict[str, Any], content: dict[str, Any], folder: Path, calibration: Calibration
    ) -> _Test:
        is_case = "case" in test
        path = folder / test["case" if is_case else "driver"]
        own = merged(path / "case.toml" if path.is_dir() else path, test.get("variant"))
        fixed, targets = self._targets(test, content, own)
        return _Test(
            name=test["name"],
            path=path,
            is_case=is_case,
            variant=test.get("variant"),
            fixed=fixed,
            targets=targets,
            increments=[segment["increments"] for segment in own.get("segment", [])],
            variants=0 if is_case or "variant" not in test else variants(path),
            step=_step(own) if is_case else 1e-4,
            curves=self._curves(test, own, calibration),
        )

    def _curves(self, test: dict[str, Any], own: dict[str, Any], calibration: Calibration) -> list[_Curve]:
        """Measured curves, their points and noise as the command has them."""
        fit = calibration.fit.where(test=test["name"], predicted="false")
        (known,) = (other["curves"] for other in calibration.summary["tests"] if other["name"] == test["name"])
        curves, first = [], 0
        for number, written in enumerate(test["curve"]):
            part = slice(first, first + known[number]["points"])
            first = part.stop
            alone = sum(other["y"] == written["y"] for other in test["curve"]) == 1
            which = "" if alone else f", curve {number + 1}"
            names = [f"{key} of {test['name']}, {written['y']}{which}" for key in _READINGS]
            last = own["phase"][-1]["name"] if "case" in test else None
            curves.append(
                _Curve(
                    x=written["x"],
                    y=written["y"],
                    stretch=written.get("phase", written.get("segment", last)),
                    at=fit["x"][part],
                    measured=fit["measured"][part],
                    noise=fit["noise"][part],
                    weight=written.get("weight", 1.0) * test.get("weight", 1.0),
                    readings=[self.names.index(name) if name in self.names else None for name in names],
                )
            )
        return curves

    def _targets(
        self, test: dict[str, Any], content: dict[str, Any], own: dict[str, Any]
    ) -> tuple[dict[str, Any], list[tuple[str, int]]]:
        """Keys of the test's file that the names stand for. In a driver names without `laws` go before others."""
        fixed: dict[str, Any] = {}
        targets: dict[str, int] = {}
        names = [*content.get("fixed", {}).items(), *content["free"].items()]
        for name, given in sorted(names, key=lambda item: not item[1].get("laws")):
            id, laws = given.get("parameter", name), given.get("laws", [])
            if "case" in test:
                keys = [f"laws.{table}.parameters.{id}" for table in laws if table in own.get("laws", {})]
            else:
                is_another = laws and test.get("stands_for", laws[0]) not in laws
                keys = [f"parameters.{id}"] if id in _ids(own) and not is_another else []
            for key in keys:
                if key in fixed or key in targets:
                    continue
                if "value" in given:
                    fixed[key] = given["value"]
                else:
                    targets[key] = self.names.index(name)
        return fixed, list(targets.items())


def _table(test: _Test, settings: dict[str, Any]) -> dict[str, _Values]:
    """Computed columns of a test: of a driver, or of the history of a case."""
    if not test.is_case:
        return dict(point(test.path, set=settings, variant=test.variant))
    with tempfile.TemporaryDirectory() as folder:
        done = run(test.path, set=settings, variant=test.variant, results=folder, checkpoints=None)
        return dict(done.history)


def _step(case: dict[str, Any]) -> float:
    """Step of differences of a case: what its tolerance of equilibrium leaves to see."""
    tolerance = case.get("solver", {}).get("force_tolerance", 1e-9)
    return float(np.clip(np.sqrt(tolerance), 1e-3, 0.03))


def _ids(driver: dict[str, Any]) -> set[str]:
    """Ids of the parameters of a driver's law; of a law of others those that the file gives."""
    given = set(driver.get("parameters", {}))
    if "adapter" in driver:
        return given
    try:
        folders = driver.get("law_path")
        return given | {p["id"] for p in _pilum.describe(driver["law"], law_path=folders)["parameters"]}
    except Error:
        return given


def _derived(table: Mapping[str, _Values]) -> dict[str, _Values]:
    """What figures of a driver of an interface show beside its table: friction, normal stress, jumps in mm."""
    if "jump_n" not in table:
        return {}
    normal = -table["traction_n"]
    shear = np.hypot(table["traction_t"], table["traction_s"]) if "jump_s" in table else table["traction_t"]
    with np.errstate(divide="ignore", invalid="ignore"):
        mu = np.where(normal > 0.0, shear / normal, np.nan)
    jumps = {f"u_{c}": 1e3 * table[f"jump_{c}"] for c in "nts" if f"jump_{c}" in table}
    return {"mu": mu, "sigma_n": normal, **jumps}


def _of_curve(test: _Test, curve: _Curve, table: Mapping[str, _Values], values: _Values) -> _Values:
    """Residuals of a curve. The computed one is linear between its rows."""
    table = table if test.is_case else {**table, **_derived(table)}
    if test.is_case:
        chosen: Any = table["phase"] == curve.stretch
    elif curve.stretch is None:
        chosen = slice(None)
    else:
        first = sum(test.increments[: curve.stretch - 1])
        chosen = slice(first, first + test.increments[curve.stretch - 1] + 1)
    none = (0.0, 1.0, 0.0, 1.0)
    read = [n if place is None else values[place] for place, n in zip(curve.readings, none)]
    x, y = read[0] + read[1] * table[curve.x][chosen], read[2] + read[3] * table[curve.y][chosen]
    sign = 1.0 if x[-1] > x[0] else -1.0
    x, at = sign * x, sign * curve.at
    slack = 1e-9 * (x[-1] - x[0])
    starts = curve.readings[0] is not None or at.min() >= x[0] - slack
    if not (starts and at.max() <= x[-1] + slack) or np.any(np.diff(x) <= 0.0):
        raise LawError(f"{test.name}, {curve.y}: the computed curve ends before its last measured point, or turns")
    residuals: _Values = np.sqrt(curve.weight) * (np.interp(at, x, y) - curve.measured) / curve.noise
    return residuals
