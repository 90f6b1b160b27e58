"""Results of a run, from their folder."""

from __future__ import annotations

import json
import os
from functools import cached_property
from html import escape
from pathlib import Path
from typing import Any

from ._errors import InputError
from ._fields import Fields
from ._table import Table

__all__ = ["Results"]


class Results:
    """Results of a run in a folder. Tables are read on demand; InputError if another run has written there
    since: give each run its own folder with `results`.
    """

    def __init__(self, folder: str | os.PathLike[str]) -> None:
        self.folder = Path(folder)
        """The folder."""
        if not (self.folder / "history.csv").is_file():
            raise InputError(f"{self.folder} has no `history.csv`: it is not the folder of a run")
        self._written = self._mark()

    @cached_property
    def history(self) -> Table:
        """A row for every increment: `phase`, `increment`, `time`, probes, `iterations`."""
        self._check()
        return Table.read(self.folder / "history.csv")

    @cached_property
    def profile(self) -> Table:
        """Integration points of interfaces and thin layers."""
        return self._table("profile.csv", '"output.profile": "phases"')

    @cached_property
    def points(self) -> Table:
        """Integration points of all other groups."""
        return self._table("points.csv", '"output.points": "phases"')

    @cached_property
    def pile(self) -> Table:
        """A row for every station of a `[pile]` and increment."""
        return self._table("pile.csv", None)

    @cached_property
    def path(self) -> Table:
        """Under arc-length control: a row for every step on the path."""
        return self._table("path.csv", '"solver.control": "arc_length"')

    @cached_property
    def fields(self) -> Fields:
        """Fields over the mesh."""
        self._check()
        return Fields(self.folder / "fields.pvd")

    @cached_property
    def summary(self) -> dict[str, Any]:
        """`summary.json`: `status`, `warnings`, `laws` and more."""
        self._check()
        with open(self.folder / "summary.json", encoding="utf-8") as file:
            summary: dict[str, Any] = json.load(file)
        return summary

    @property
    def status(self) -> str:
        """`done`, or how else the run ended."""
        return str(self.summary["status"])

    @property
    def warnings(self) -> list[str]:
        """Warnings of the run."""
        return list(self.summary["warnings"])

    @property
    def report(self) -> Path:
        """The report, a page that needs no network."""
        return self.folder / "report.html"

    def _mark(self) -> tuple[int, int] | None:
        """Tells the summary of a run that has ended from that of another one."""
        path = self.folder / "summary.json"
        try:
            with open(path, encoding="utf-8") as file:
                is_running = json.load(file).get("status") == "running"
            found = path.stat()
        except (OSError, ValueError, AttributeError):
            return None
        return None if is_running else (found.st_ino, found.st_mtime_ns)

    def _check(self) -> None:
        if self._written is not None and self._mark() != self._written:
            raise InputError(
                f"another run has written into {self.folder} since",
                hint="give each run its own folder: results=…",
            )

    def _table(self, name: str, setting: str | None) -> Table:
        self._check()
        path = self.folder / name
        if not path.is_file():
            hint = f"set={{{setting}}} asks for it" if setting else "the case has no `[pile]`"
            raise InputError(f"the run has written no `{name}`", hint=hint)
        return Table.read(path)

    def _repr_html_(self) -> str:
        """The report, in a notebook."""
        if not self.report.is_file():
            return f"<pre>{escape(repr(self))}</pre>"
        page = escape(self.report.read_text(encoding="utf-8"), quote=True)
        return (
            f'<iframe srcdoc="{page}" style="width:100%;height:40em;border:1px solid #ccc" '
            f'title="{escape(str(self.folder), quote=True)}"></iframe>'
        )

    def __repr__(self) -> str:
        try:
            status = self.status
        except (OSError, KeyError, ValueError):
            status = "unknown"
        return f"<pilum.Results in {self.folder}: {status}, {len(self.history)} increments>"
