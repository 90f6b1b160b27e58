"""Tables: columns of arrays by name, as CSV files of results have them."""

from __future__ import annotations

import csv
import io
from collections.abc import Container, Iterator, Mapping
from html import escape
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from . import _pilum
from ._errors import InputError, NoSuchNameError

__all__ = ["Table"]

_WHOLE = {"increment", "iterations", "element", "point"}
_TEXTS = {"phase", "group"}
_SHOWN = 10


class Table(dict[str, NDArray[Any]]):
    """Columns of arrays by name, all of one length; what is missing is NaN.

    A dictionary of one-dimensional arrays: float64, int64 of counts, texts. Its length is the number of
    rows. pandas, polars, pyarrow and DuckDB take it (by the Arrow C stream interface):
    `pandas.DataFrame(table)`.
    """

    def __init__(self, columns: Mapping[str, Any]) -> None:
        super().__init__({name: np.asarray(values) for name, values in columns.items()})
        for name, values in self.items():
            if values.shape != (len(self),):
                message = f"column `{name}` has shape {values.shape}, expected ({len(self)},)"
                raise InputError(message)

    @classmethod
    def read(cls, path: str | Path) -> Table:
        """Reads a CSV file of results."""
        with open(path, encoding="utf-8", newline="") as file:
            return cls._of_rows(csv.reader(file))

    @classmethod
    def of_text(cls, text: str) -> Table:
        """Takes the text of a CSV file of results."""
        return cls._of_rows(csv.reader(io.StringIO(text)))

    @classmethod
    def _read(cls, path: Path, texts: Container[str]) -> Table:
        """Reads a CSV file some of whose columns are texts, whatever they look like."""
        with open(path, encoding="utf-8", newline="") as file:
            return cls._of_rows(csv.reader(file), texts)

    @classmethod
    def _of_rows(cls, rows: Iterator[list[str]], texts: Container[str] = ()) -> Table:
        names = next(rows, [])
        # The row that a run is writing may not be whole yet.
        columns = list(zip(*(row for row in rows if len(row) == len(names))))
        if not columns:
            columns = [()] * len(names)
        return cls({name: _array(name, values, name in texts) for name, values in zip(names, columns)})

    @property
    def names(self) -> list[str]:
        """Names of the columns, in order."""
        return list(self.keys())

    def __missing__(self, name: str) -> NDArray[Any]:
        raise NoSuchNameError(f"there is no column `{name}`: {', '.join(self.names)}")

    def __len__(self) -> int:
        """Number of rows."""
        for values in self.values():
            return int(values.shape[0])
        return 0

    def where(self, **equal: Any) -> Table:
        """Rows with these values: `profile.where(phase="push", increment=10)`."""
        chosen = np.ones(len(self), dtype=bool)
        for name, value in equal.items():
            chosen &= self[name] == value
        return Table({name: values[chosen] for name, values in self.items()})

    def __arrow_c_stream__(self, requested_schema: object = None) -> object:
        """The columns as a stream of Arrow, copied; float64, int64 and texts."""
        columns: list[tuple[str, Any]] = []
        for name, values in self.items():
            if values.dtype.kind == "f":
                columns.append((name, np.require(values, np.float64, ["C", "A"])))
            elif values.dtype.kind in "iub":
                columns.append((name, np.require(values, np.int64, ["C", "A"])))
            else:
                columns.append((name, [str(value) for value in values]))
        return _pilum.stream(columns)

    def __repr__(self) -> str:
        return f"<pilum.Table: {len(self)} rows of {', '.join(self.names)}>"

    def _repr_html_(self) -> str:
        head = "".join(f"<th>{escape(name)}</th>" for name in self.names)
        if len(self) > 2 * _SHOWN:
            rows = [*range(_SHOWN), -1, *range(len(self) - _SHOWN, len(self))]
        else:
            rows = list(range(len(self)))
        body = "".join(
            "<tr>"
            + "".join(
                "<td>…</td>" if row < 0 else f"<td>{escape(_short(values[row]))}</td>"
                for values in self.values()
            )
            + "</tr>"
            for row in rows
        )
        return (
            f"<table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>"
            f"<p>{len(self)} rows</p>"
        )


def _short(value: Any) -> str:
    return f"{value:.6g}" if isinstance(value, (float, np.floating)) else str(value)


def _array(name: str, values: tuple[str, ...], is_text: bool) -> NDArray[Any]:
    """Numbers where all are numbers or nothing, else texts; names are texts."""
    if is_text or name in _TEXTS:
        return np.array(values, dtype=np.str_)
    try:
        numbers = np.array([value if value else "nan" for value in values], dtype=np.float64)
    except ValueError:
        return np.array(values)
    if name in _WHOLE and np.all(numbers == np.floor(numbers)):
        return numbers.astype(np.int64)
    return numbers
