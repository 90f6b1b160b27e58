"""Studies by the program, as objects."""

from __future__ import annotations

import json
import os
import tempfile
from collections.abc import Mapping
from functools import cached_property
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._command import carry_out, read_toml, toml_value
from ._errors import Error, InputError
from ._results import Results
from ._table import Table

__all__ = ["Study", "study"]


class Study:
    """Outcome of a study, from its folder."""

    def __init__(self, folder: str | os.PathLike[str]) -> None:
        self.folder = Path(folder)
        """The folder."""
        try:
            text = (self.folder / "study.json").read_text(encoding="utf-8")
        except OSError:
            raise InputError(f"{self.folder} has no `study.json`: it is not the folder of a study") from None
        self.summary: dict[str, Any] = json.loads(text)
        """`study.json`."""

    @cached_property
    def runs(self) -> Table:
        """A row for each run: `index`, `folder`, parameters, outputs (NaN where there is none), `state`, `reason`."""
        table = Table._read(self.folder / "runs.csv", {"folder", "state", "reason"})
        return Table({**table, "index": table["index"].astype(np.int64)})

    @property
    def parameters(self) -> list[str]:
        """Names of the parameters, columns of `runs`."""
        return [parameter["name"] for parameter in self.summary["parameters"]]

    @property
    def outputs(self) -> list[str]:
        """Names of the outputs, columns of `runs`."""
        names = [output["name"] for output in self.summary["outputs"]]
        return [f"{name} (output)" if name not in self.runs else name for name in names]

    @property
    def sample(self) -> NDArray[Any]:
        """Values of the parameters, shape (runs, parameters)."""
        return np.column_stack([self.runs[name] for name in self.parameters])

    @cached_property
    def effects(self) -> Table:
        """For each output and parameter means at the lowest and highest level, `share` of the variance and `total`
        index with 95 % intervals."""
        path = self.folder / "effects.csv"
        if not path.is_file():
            raise InputError(f"the study has written no {path}", hint="a parameter needs two values or more")
        return Table._read(path, {"output", "parameter"})

    @cached_property
    def curves(self) -> Table:
        """`history.csv` of all runs, one after the other, with the column `run` first. `pyarrow.table(curves)` and
        `pandas.DataFrame(curves)` take it."""
        tables = []
        for index, name in zip(self.runs["index"], self.runs["folder"]):
            path = self.folder / str(name) / "history.csv"
            if path.is_file():
                table = Table.read(path)
                tables.append({"run": np.full(len(table), int(index)), **table})
        names = list(dict.fromkeys(name for table in tables for name in table))
        if not tables:
            raise InputError("no run has written a `history.csv`")
        columns = {name: [_column(table, name) for table in tables] for name in names}
        return Table({name: np.concatenate(column) for name, column in columns.items()})

    def results(self, index: int) -> Results:
        """`Results` of a run, by its number from 1."""
        return Results(self.folder / f"{index:05d}")

    @property
    def report(self) -> Path:
        """The report, a page that needs no network."""
        return self.folder / "report.html"

    def to_pandas(self) -> Any:
        """`runs` as a DataFrame with the numbers of the runs as index."""
        pandas: Any = import_module("pandas")
        return pandas.DataFrame(dict(self.runs)).set_index("index")

    def _repr_html_(self) -> str:
        effects = self.effects._repr_html_() if (self.folder / "effects.csv").is_file() else ""
        return self.runs._repr_html_() + effects

    def __repr__(self) -> str:
        done = int(np.sum(self.runs["state"] == "done"))
        return f"<pilum.Study in {self.folder}: {len(self.runs)} runs, {done} done>"


def _column(table: Mapping[str, NDArray[Any]], name: str) -> NDArray[Any]:
    return table[name] if name in table else np.full(len(table["run"]), np.nan)


def study(
    file: str | os.PathLike[str] | Mapping[str, Any],
    *,
    sample: ArrayLike | Mapping[str, ArrayLike] | None = None,
    results: str | os.PathLike[str] | None = None,
    jobs: int | None = None,
    retry: bool = False,
    anew: bool = False,
) -> Study:
    """Carries out the runs of a study: the command `pilum study`.

    `file` is a study file or a dictionary with its keys, whose paths are relative to the working folder. `sample`
    replaces its method: values of shape (runs, parameters), in the order and unit of the file's parameters, or a
    mapping (a DataFrame, say) by their names; those of a `whole` parameter are rounded. Results go into the folder
    `results`, default `results/<study>`; what is done there is not repeated unless `retry` (runs that failed) or
    `anew` say so. `jobs` is the number of runs at a time. A run that fails has a state and no exception. Raises
    InputError or LawError.
    """
    name = "study" if isinstance(file, Mapping) else _stem(Path(file))
    folder = Path("results") / name if results is None else Path(results)
    options = ["--out", os.fspath(folder)]
    options += [] if jobs is None else ["--jobs", str(jobs)]
    options += ["--retry"] * retry + ["--anew"] * anew
    if sample is None and not isinstance(file, Mapping):
        carry_out(["study", os.fspath(file), *options])
        return Study(folder)
    if isinstance(file, Mapping):
        content, place = dict(file), Path()
    else:
        path = Path(file) / "study.toml" if Path(file).is_dir() else Path(file)
        content, place = read_toml(path), path.parent
    if "case" in content:
        content["case"] = (place / content["case"]).absolute()
    if sample is not None:
        content = _with_sample(content, sample)
    with tempfile.TemporaryDirectory() as written:
        text = "".join(f"{key} = {toml_value(value)}\n" for key, value in content.items())
        path = Path(written) / f"{name}.toml"
        path.write_text(text, encoding="utf-8")
        try:
            carry_out(["study", os.fspath(path), *options])
        except Error as error:
            if error.file == os.fspath(path):  # which nobody has written
                error.file = error.line = error.column = None
            raise
    return Study(folder)


def _stem(path: Path) -> str:
    return path.absolute().name if path.is_dir() else path.stem


def _with_sample(content: dict[str, Any], sample: Any) -> dict[str, Any]:
    """The same study with a list of values."""
    parameters = content["parameter"]
    names = [_name(parameter) for parameter in parameters]
    if hasattr(sample, "keys"):
        missing = [name for name in names if name not in sample]
        if missing:
            raise InputError(f"the sample has no `{missing[0]}`", key=missing[0])
        columns = [np.asarray(sample[name]) for name in names]
    else:
        array = np.asarray(sample)
        if array.ndim != 2 or array.shape[1] != len(names):
            raise InputError(f"the sample has shape {array.shape}, expected (runs, {len(names)})")
        columns = list(array.T)
    listed = []
    for parameter, values in zip(parameters, columns):
        own = {key: value for key, value in parameter.items() if key in ("name", "key")}
        if parameter.get("whole"):
            try:
                numbers = np.asarray(values, dtype=np.float64)
            except (TypeError, ValueError):
                numbers = np.array([np.nan])
            if not np.all(np.isfinite(numbers)):
                name = _name(parameter)
                raise InputError(f"the sample of `{name}` has something else than numbers", key=name)
            values = np.rint(numbers).astype(np.int64)
        listed.append({**own, "values": values.tolist()})
    kept = {key: value for key, value in content.items() if key not in ("runs", "seed")}
    return {**kept, "method": "list", "parameter": listed}


def _name(parameter: Mapping[str, Any]) -> str:
    key = parameter["key"]
    return str(parameter.get("name", key if isinstance(key, str) else key[0]))
