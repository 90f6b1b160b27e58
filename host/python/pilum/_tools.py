"""Checks of libraries, tables of runs, reports."""

from __future__ import annotations

import json
import os
from collections.abc import Sequence
from html import escape
from pathlib import Path
from typing import Any, TypeAlias, Union

from ._command import carry_out, settings
from ._table import Table

__all__ = ["Check", "check", "report", "table"]

_Folders: TypeAlias = Union[str, "os.PathLike[str]", Sequence[Union[str, "os.PathLike[str]"]]]


class Check:
    """Outcome of `check`."""

    def __init__(self, outcome: dict[str, Any]) -> None:
        self.library = Path(outcome["library"])
        """The library."""
        self.checks: list[dict[str, Any]] = outcome["checks"]
        """Each check with `id`, `family`, `description`, `outcome` and `details`."""
        self.counts: dict[str, int] = outcome["counts"]
        """Number of checks by outcome."""

    @property
    def passed(self) -> bool:
        """Whether no check failed or crashed."""
        return not any(self.counts.get(outcome) for outcome in ("failed", "crashed"))

    def __repr__(self) -> str:
        counts = ", ".join(f"{number} {outcome}" for outcome, number in self.counts.items())
        return f"<pilum.Check of {self.library.name}: {counts}>"

    def _repr_html_(self) -> str:
        keys = list(dict.fromkeys(key for check in self.checks for key in check))
        head = "".join(f"<th>{escape(key)}</th>" for key in keys)
        rows = (
            "".join(f"<td>{escape(str(check.get(key, '')))}</td>" for key in keys) for check in self.checks
        )
        body = "".join(f"<tr>{row}</tr>" for row in rows)
        return f"<p>{escape(repr(self))}</p><table><tr>{head}</tr>{body}</table>"


def check(
    library: str | os.PathLike[str],
    *,
    only: Sequence[str] = (),
    seed: int = 1,
    set: dict[str, float] | None = None,
    driver: str | os.PathLike[str] | None = None,
    out: str | os.PathLike[str] | None = None,
) -> Check:
    """Checks whether a library of laws keeps the contract.

    `library` is a file, or the id of a law; `only` names checks, `seed` is that of all random numbers, `set`
    fixes parameters by id, `driver` is a file whose path and parameters are used, `out` the folder of failed
    calls. A check that fails is no exception: see `passed`. Raises InputError or LawError.
    """
    arguments = ["check", os.fspath(library), "--json", "--seed", str(seed), *settings(set)]
    for name in only:
        arguments += ["--only", name]
    for option, path in (("--driver", driver), ("--out", out)):
        if path is not None:
            arguments += [option, os.fspath(path)]
    text = carry_out(arguments, allowed=(0, 3))
    return Check(json.loads(text))


def _several(folders: _Folders) -> list[str]:
    if isinstance(folders, (str, os.PathLike)):
        return [os.fspath(folders)]
    return [os.fspath(folder) for folder in folders]


def table(folders: _Folders) -> Table:
    """The `Table` of runs in a folder, or in several: settings that differ, last values of probes.

    A row for each run; folders with results folders below count, too. Raises InputError.
    """
    return Table.of_text(carry_out(["table", *_several(folders)]))


def report(
    folders: _Folders, *, print: bool = False, out: str | os.PathLike[str] | None = None
) -> Path:
    """Writes the report of a run or a study, or the comparison of several runs, and returns its file.

    `print` makes the version for paper. `out` is its file, default `report.html` in the folder, or next to
    the folders. Raises InputError.
    """
    names = _several(folders)
    beside = Path(names[0]) if len(names) == 1 else Path(os.path.commonpath([*map(os.path.abspath, names)]))
    path = beside / "report.html" if out is None else Path(out)
    carry_out(["report", *names, "--out", os.fspath(path), *(["--print"] if print else [])])
    return path
