"""Fields over the mesh at the times that a run has written."""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, overload

import numpy as np
from numpy.typing import NDArray

from ._errors import InputError, NoSuchItemError, NoSuchNameError
from ._table import Table

__all__ = ["Field", "Fields"]


class Field(Mapping[str, NDArray[np.float64]]):
    """Fields at one time: arrays by name.

    `displacement` has a row a node, (n, 2), m. All others have a value a cell, the mean over its
    integration points: `stress_11` … (kPa), `jump_n`, `traction_t` …, internal variables by id, `group` and
    `active`.
    """

    def __init__(self, path: Path, time: float) -> None:
        self.path = path
        """The file, for PyVista: `pyvista.read(field.path)`."""
        self.time = time
        """The time of the run."""
        piece = ElementTree.parse(path).getroot().find("UnstructuredGrid/Piece")
        if piece is None:
            raise InputError(f"{path}: no unstructured grid")
        points = _numbers(piece.find("Points/DataArray"), np.float64)
        self.nodes: NDArray[np.float64] = points.reshape(-1, 3)[:, :2].copy()
        """Coordinates of the nodes, m, shape (n, 2)."""
        cells = {array.get("Name"): array for array in piece.iterfind("Cells/DataArray")}
        connectivity = _numbers(cells["connectivity"], np.int64)
        self._ends = _numbers(cells["offsets"], np.int64)
        self._connectivity = connectivity
        self._values: dict[str, NDArray[np.float64]] = {}
        for array in piece.iterfind("PointData/DataArray"):
            values = _numbers(array, np.float64).reshape(len(self.nodes), -1)
            self._values[str(array.get("Name"))] = values[:, :2].copy()
        for array in piece.iterfind("CellData/DataArray"):
            self._values[str(array.get("Name"))] = _numbers(array, np.float64)

    @property
    def cells(self) -> list[NDArray[np.int64]]:
        """Nodes of cells: 8 or 9 of a quad, 6 of a triangle (corners, then mid-sides), 3 of an interface."""
        return np.split(self._connectivity, self._ends[:-1]) if len(self._ends) else []

    @property
    def table(self) -> Table:
        """Values of cells, with the coordinates of their middles."""
        starts = np.concatenate([[0], self._ends[:-1]])
        n = self._ends - starts
        middle = np.add.reduceat(self.nodes[self._connectivity], starts) / n[:, None]
        columns: dict[str, Any] = {"x": middle[:, 0], "y": middle[:, 1]}
        columns.update((k, v) for k, v in self._values.items() if v.shape == (len(n),))
        return Table(columns)

    def __getitem__(self, name: str) -> NDArray[np.float64]:
        try:
            return self._values[name]
        except KeyError:
            message = f"there is no field `{name}`: {', '.join(self)}"
            raise NoSuchNameError(message) from None

    def __iter__(self) -> Iterator[str]:
        return iter(self._values)

    def __len__(self) -> int:
        return len(self._values)

    def to_pyvista(self) -> Any:
        """A grid of PyVista, which has to be installed."""
        import pyvista

        return pyvista.read(self.path)

    def __repr__(self) -> str:
        return f"<pilum.Field at time {self.time}: {', '.join(self)}>"


class Fields(Sequence[Field]):
    """Fields by time. `fields[-1]` are the last, `fields["stress_22"]` an array at the last time."""

    def __init__(self, path: Path) -> None:
        self.path = path
        """The list of all, for PyVista and ParaView: `pyvista.get_reader(fields.path)`."""
        self._files: list[tuple[float, Path]] = []
        if path.is_file():
            for entry in ElementTree.parse(path).getroot().iter("DataSet"):
                file = path.parent / str(entry.get("file"))
                self._files.append((float(entry.get("timestep", "nan")), file))

    @property
    def times(self) -> NDArray[np.float64]:
        """The times, in order."""
        return np.array([time for time, _ in self._files])

    @overload
    def __getitem__(self, key: int) -> Field: ...
    @overload
    def __getitem__(self, key: slice) -> list[Field]: ...
    @overload
    def __getitem__(self, key: str) -> NDArray[np.float64]: ...
    def __getitem__(self, key: int | slice | str) -> Any:
        if isinstance(key, str):
            return self[-1][key]
        if isinstance(key, slice):
            return [Field(path, time) for time, path in self._files[key]]
        if not self._files:
            raise NoSuchItemError(
                'the run has written no fields: set={"output.fields": "phases"} or "increments"'
            )
        time, path = self._files[key]
        return Field(path, time)

    def __len__(self) -> int:
        return len(self._files)

    def __repr__(self) -> str:
        return f"<pilum.Fields at {len(self)} times>"


def _numbers(array: ElementTree.Element | None, kind: Any) -> NDArray[Any]:
    text = "" if array is None else array.text or ""
    return np.array(text.split(), dtype=kind)
