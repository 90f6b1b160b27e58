"""Calibrations of parameters of laws by the program, as objects."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from functools import cached_property
from html import escape
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ._command import carry_out, settings
from ._errors import InputError
from ._table import Table

__all__ = ["Calibration", "calibrate"]

_TEXTS = {"parameter", "stage", "test", "unit", "lower_end", "upper_end", "x_column", "y_column"}


class Calibration:
    """Outcome of a calibration, from its folder."""

    def __init__(self, folder: str | os.PathLike[str]) -> None:
        self.folder = Path(folder)
        """The folder."""
        try:
            text = (self.folder / "calibration.json").read_text(encoding="utf-8")
        except OSError:
            message = f"{self.folder} has no `calibration.json`: it is not the folder of a calibration"
            raise InputError(message) from None
        self.summary: dict[str, Any] = json.loads(text)
        """`calibration.json`."""

    @property
    def names(self) -> list[str]:
        """Names of the parameters found, in the order of all arrays here."""
        return [parameter["name"] for parameter in self.summary["parameters"]]

    @cached_property
    def parameters(self) -> Table:
        """A row for each parameter: `value`, ends of its interval `lower` and `upper` (NaN where there is none),
        and how they were found: `lower_end`, `upper_end` ("limit" is an end of the interval), linear
        intervals, `relative_error`, `unit`."""
        return Table._read(self.folder / "parameters.csv", _TEXTS)

    @property
    def values(self) -> NDArray[np.float64]:
        """Values found, shape (parameters,)."""
        return np.array([parameter["value"] for parameter in self.summary["parameters"]])

    @property
    def intervals(self) -> NDArray[np.float64]:
        """Ends of the intervals, shape (parameters, 2); NaN where there is none."""
        return np.column_stack([self.parameters["lower"], self.parameters["upper"]])

    @cached_property
    def correlations(self) -> NDArray[np.float64]:
        """Correlations of the estimates, shape (parameters, parameters); NaN where they are not determined, or
        of parameters that no stage fits together."""
        names = self.names
        matrix = np.full((len(names), len(names)), np.nan)
        for stage in self.summary["stages"]:
            places = [names.index(name) for name in stage["parameters"]]
            matrix[np.ix_(places, places)] = np.array(stage["correlations"], dtype=np.float64)
        return matrix

    @property
    def errors(self) -> NDArray[np.float64]:
        """Standard errors of the values, shape (parameters,); NaN where they are not determined."""
        return np.asarray(self.parameters["relative_error"] * np.abs(self.values))

    @property
    def covariance(self) -> NDArray[np.float64]:
        """Covariance of the values, linearised at the values found, shape (parameters, parameters)."""
        return np.asarray(self.correlations * np.outer(self.errors, self.errors))

    @property
    def sum_of_squares(self) -> float:
        """Sum of squared residuals of the last stage."""
        return float(self.summary["stages"][-1]["sum_of_squares"])

    @cached_property
    def fit(self) -> Table:
        """A row for each measured point: `test`, `predicted`, `x`, `measured`, `computed`, `noise`,
        `deviation`."""
        return Table._read(self.folder / "fit.csv", _TEXTS)

    @property
    def residuals(self) -> dict[str, NDArray[np.float64]]:
        """Computed less measured values over their noise, without weights, by test: arrays of shape (points,)."""
        fit = self.fit
        residuals = (fit["computed"] - fit["measured"]) / fit["noise"]
        return {test["name"]: residuals[fit["test"] == test["name"]] for test in self.summary["tests"]}

    @cached_property
    def profiles(self) -> dict[str, Table]:
        """Profiles by parameter: `value`, and `sum`, the least sum of squares with it; empty without profiles."""
        rows = Table._read(self.folder / "profiles.csv", _TEXTS)
        stages = {parameter["name"]: parameter["stage"] for parameter in self.summary["parameters"]}
        own = {name: rows.where(parameter=name, stage=stage) for name, stage in stages.items()} if rows else {}
        return {name: profile for name, profile in own.items() if len(profile)}

    @cached_property
    def figures(self) -> dict[str, str]:
        """Figures by name, as the text of SVG files."""
        names = self.summary["figures"]
        return {name: (self.folder / f"{name}.svg").read_text(encoding="utf-8") for name in names}

    @property
    def warnings(self) -> list[str]:
        """Warnings of the calibration, for example of parameters that the tests do not determine."""
        return list(self.summary["warnings"])

    @property
    def notes(self) -> list[str]:
        """Notes, for example of measured points that are omitted."""
        return list(self.summary["notes"])

    @property
    def report(self) -> Path:
        """The report, a page that needs no network."""
        return self.folder / "report.html"

    def to_pandas(self) -> Any:
        """`parameters` as a DataFrame with the names as index."""
        pandas: Any = import_module("pandas")
        return pandas.DataFrame(dict(self.parameters)).set_index("parameter")

    def _repr_html_(self) -> str:
        words = "".join(f"<p>{escape(word)}</p>" for word in (*self.warnings, *self.notes))
        return self.parameters._repr_html_() + words + "".join(self.figures.values())

    def __repr__(self) -> str:
        values = ", ".join(f"{name} = {value:.6g}" for name, value in zip(self.names, self.values))
        return f"<pilum.Calibration in {self.folder}: {values}>"


def calibrate(
    file: str | os.PathLike[str],
    *,
    set: Mapping[str, Any] | None = None,
    variant: str | None = None,
    results: str | os.PathLike[str] | None = None,
    anew: bool = False,
) -> Calibration:
    """Finds parameters of laws from measured curves: the command `pilum calibrate`.

    `file` is a calibration file. `set` overrides settings: `{"starts": 2}`. `variant` names one of several.
    Results go into the folder `results`, default `results/calibrate_<file>`; `anew` forgets what an earlier
    call has computed there. Raises InputError with `file`, `line` and `key`, NoEquilibriumError or LawError.
    """
    path = Path(file)
    folder = Path("results") / f"calibrate_{path.stem}" if results is None else Path(results)
    arguments = ["calibrate", os.fspath(path), "--out", os.fspath(folder), *settings(set)]
    if variant is not None:
        arguments += ["--variant", variant]
    if anew:
        arguments.append("--anew")
    carry_out(arguments)
    return Calibration(folder)
