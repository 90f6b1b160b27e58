"""A calibration as plain functions of its parameters, for the libraries of others."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _pilum
from ._calibrate import Calibration, calibrate
from ._errors import InputError, WrongTypeError

__all__ = ["CalibrationProblem"]

_Values = NDArray[np.float64]


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
        summary = calibration.summary
        self._arguments = (os.path.abspath(file), None if set is None else dict(set), variant)
        self._core = self._read()
        names, bounds, start = zip(*self._core.parameters)
        self.names: list[str] = list(names)
        """Names of the parameters."""
        self.bounds: _Values = np.array(bounds)
        """Least and greatest values, shape (parameters, 2); infinite without one."""
        self.start: _Values = np.array(start)
        """Values that the command starts from."""
        self.best: _Values = calibration.values
        """Values that the command found."""
        self.scatter: float = float(np.sqrt(summary["stages"][-1]["variance"]))
        """Standard deviation over the noise of the file: 1 if `variance` is "given", else that of the command."""
        if summary["variance"] == "given":
            self.scatter = 1.0

    def residuals(self, theta: ArrayLike) -> _Values:
        """Residuals of all points, shape (points,): computed less measured values over their noise, times the root
        of the weights. Their squares add up to the command's sum.

        Raises InputError for values outside `bounds`, LawError or NoEquilibriumError where a test has no answer.
        """
        return np.array(self._of(self._core.residuals, theta))

    def jacobian(self, theta: ArrayLike) -> _Values:
        """Derivatives of `residuals` by the parameters, shape (points, parameters). They follow a driver whose law
        gives rates; else they are central differences with the step of the file, one-sided at bounds. Raises as
        `residuals`."""
        return np.reshape(self._of(self._core.jacobian, theta), (len(self.names), -1)).T

    def log_likelihood(self, theta: ArrayLike, scatter: float | None = None) -> float:
        """Logarithm of the probability density of the measured values, normal and independent, with `scatter`
        times the noise of the file as standard deviation (default: `scatter`, the attribute).

        Weights are no information and do not count. It is -inf outside `bounds` and where a test has no answer.
        """
        scatter = self.scatter if scatter is None else scatter
        if not scatter > 0.0:
            raise InputError(f"`scatter` is {scatter}, expected above 0", key="scatter")
        return float(self._of(self._core.log_likelihood, theta, scatter))

    def __repr__(self) -> str:
        return f"<pilum.CalibrationProblem of {', '.join(self.names)}: {self._core.points} points>"

    def __getstate__(self) -> dict[str, Any]:
        return {name: value for name, value in vars(self).items() if name != "_core"}

    def __setstate__(self, state: dict[str, Any]) -> None:
        vars(self).update(state)
        self._core = self._read()

    def _read(self) -> _pilum.Residuals:
        with tempfile.TemporaryDirectory() as folder:
            return _pilum.Residuals(*self._arguments, folder)

    def _of(self, function: Any, theta: ArrayLike, *more: float) -> Any:
        try:
            values = np.asarray(theta, dtype=np.float64)
        except (TypeError, ValueError):
            raise WrongTypeError(f"theta is no array of {len(self.names)} numbers") from None
        if values.shape != self.start.shape:
            raise InputError(f"theta has shape {values.shape}, expected {self.start.shape}")
        with tempfile.TemporaryDirectory() as folder:
            return function(values.tolist(), folder, *more)
