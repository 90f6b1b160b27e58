"""Meshes from arrays, and from meshio."""

from __future__ import annotations

import importlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._errors import InputError

__all__ = ["Mesh"]

# Nodes of a cell, and Gmsh's number of its kind.
_SOLIDS = {8: 16, 6: 9, 4: 3, 3: 2, 9: 10}
_LINES = {3: 8, 2: 1, 1: 15}
# Ends of the edges of a cell, by its number of corners; the middles follow the corners in the same order.
_ENDS = {
    4: np.array([[0, 1], [1, 2], [2, 3], [3, 0]]),
    3: np.array([[0, 1], [1, 2], [2, 0]]),
}
# Nodes and dimension of meshio's cells.
_MESHIO = {
    "quad8": (8, 2),
    "triangle6": (6, 2),
    "quad": (4, 2),
    "triangle": (3, 2),
    "quad9": (9, 2),
    "line3": (3, 1),
    "line": (2, 1),
    "vertex": (1, 0),
}
# Kinds that meshio reads side by side in XDMF.
_MIXED = {"quad", "triangle", "line"}


class Mesh:
    """A mesh in the plane: nodes, groups of cells, named lines and points.

    `nodes` has coordinates, shape (n, 2), m. `groups` gives by name the nodes of cells, from 0: shape (m,
    8) of quads or (m, 6) of triangles, corners in order, then the mid-sides that follow them; or a list of
    both. `lines` gives by name edges, shape (m, 3): two ends and the middle; or points, shape (m, 1). Cells
    and edges of first order, (m, 4), (m, 3) and (m, 2), get mid-side nodes, after all others. Quads of 9
    nodes, (m, 9), have the one in the middle last. Interfaces without thickness are inserted along lines, not meshed.
    """

    def __init__(
        self,
        nodes: ArrayLike,
        groups: Mapping[str, Any],
        lines: Mapping[str, Any] | None = None,
    ) -> None:
        self.nodes: NDArray[np.float64] = _numbers("nodes", nodes)
        if self.nodes.ndim != 2 or self.nodes.shape[1] not in (2, 3):
            raise InputError(f"nodes: found shape {self.nodes.shape}, expected (n, 2)")
        self.groups = {name: self._cells(name, cells, _SOLIDS) for name, cells in groups.items()}
        self.lines = {name: self._cells(name, cells, _LINES) for name, cells in (lines or {}).items()}

    def _cells(self, name: str, cells: Any, kinds: Mapping[int, int]) -> list[NDArray[np.int64]]:
        if '"' in name or "\n" in name:
            raise InputError(f"`{name}`: a name has neither quotes nor ends of lines")
        parts = list(cells) if isinstance(cells, (list, tuple)) else [cells]
        if parts and np.ndim(parts[0]) < 2:
            parts = [cells]
        found = []
        for part in parts:
            array = _array(f"`{name}`", part)
            if array.ndim == 1 and 1 in kinds:
                array = array.reshape(-1, 1)
            if array.ndim != 2 or array.shape[1] not in kinds or array.dtype.kind not in "iu":
                wanted = " or ".join(f"(m, {n})" for n in kinds)
                raise InputError(
                    f"`{name}`: found {array.dtype} of shape {array.shape}, expected whole numbers of "
                    f"shape {wanted}"
                )
            if array.size and not (0 <= array.min() and array.max() < len(self.nodes)):
                node = array.min() if array.min() < 0 else array.max()
                raise InputError(f"`{name}`: node {node} is none of 0 to {len(self.nodes) - 1}")
            found.append(array.astype(np.int64))
        return found

    @classmethod
    def grid(
        cls,
        x: ArrayLike,
        y: ArrayLike,
        group: str | Callable[[Any, Any], Any] = "ground",
    ) -> Mesh:
        """8-node quads between the lines of a grid at `x` and `y`, which rise, m.

        `group` is the name of all cells, or a function of the coordinates of a cell's middle.
        """
        across, up = _numbers("x", x), _numbers("y", y)
        for values in (across, up):
            rises = values.ndim == 1 and len(values) > 1 and np.all(np.diff(values) > 0)
            if not (rises and np.all(np.isfinite(values))):
                raise InputError("a grid needs two values that rise in x, and two in y")
        fine = [np.insert(v, range(1, len(v)), (v[1:] + v[:-1]) / 2) for v in (across, up)]
        n, m = len(fine[0]), len(fine[1])
        number = -np.ones((m, n), dtype=np.int64)
        kept = np.add.outer(np.arange(m) % 2, np.arange(n) % 2) < 2
        number[kept] = np.arange(kept.sum())
        nodes = np.stack(np.meshgrid(*fine), axis=-1)[kept]
        at = [(0, 0), (0, 2), (2, 2), (2, 0), (0, 1), (1, 2), (2, 1), (1, 0)]
        cells = np.stack(
            [number[j : m - 2 + j : 2, i : n - 2 + i : 2].ravel() for j, i in at], axis=1
        )
        if not callable(group):
            return cls(nodes, {group: cells})
        middles = nodes[cells[:, :4]].mean(axis=1)
        names = [group(*middle) for middle in middles]
        for middle, name in zip(middles, names):
            if not isinstance(name, str):
                raise InputError(f"`group` gives {name!r} at {tuple(middle.tolist())}, expected a name")
        chosen = {name: np.array([other == name for other in names]) for name in names}
        return cls(nodes, {name: cells[mask] for name, mask in chosen.items()})

    @classmethod
    def from_meshio(cls, mesh: Any) -> Mesh:
        """A mesh of meshio: groups and lines by `cell_sets`, Gmsh's physical names, MED's families, or the names of cell
        data that meshio makes of `cell_sets` in VTU and XDMF."""
        groups: dict[str, list[Any]] = {}
        lines: dict[str, list[Any]] = {}
        names = {(int(dim), int(tag)): name for name, (tag, dim) in mesh.field_data.items()}
        tags = mesh.cell_data.get("gmsh:physical")
        for number, block in enumerate(mesh.cells):
            if block.type not in _MESHIO:
                raise InputError(
                    f"the mesh has cells `{block.type}`, which Pilum has not, expected {', '.join(_MESHIO)}"
                )
            _, dim = _MESHIO[block.type]
            to = groups if dim == 2 else lines
            sets = {
                name: np.arange(len(block.data))[chosen[number]]
                for name, chosen in mesh.cell_sets.items()
                if not name.startswith("gmsh:") and chosen[number] is not None
            }
            if tags is not None:
                # A negative number is that of a part of the geometry that is turned round; 0 is that of no group.
                of_block = np.abs(np.asarray(tags[number]))
                for tag in np.unique(of_block[of_block != 0]):
                    name = names.get((dim, int(tag)), str(tag))
                    chosen, known = np.flatnonzero(of_block == tag), sets.get(name, np.arange(0))
                    sets[name] = np.concatenate([known, np.setdiff1d(chosen, known)])
            for name, chosen in (*_families(mesh, number), *_joined(mesh, number, sets)):
                sets.setdefault(name, chosen)
            for name, chosen in sets.items():
                if len(chosen):
                    to.setdefault(name, []).append(np.asarray(block.data)[chosen])
        if not groups:
            raise InputError("the mesh has no named groups of cells: `cell_sets`, or physical names")
        return cls(mesh.points, groups, lines)

    @classmethod
    def read(cls, path: str | PathLike[str]) -> Mesh:
        """A mesh of a file that meshio reads, such as VTU, XDMF, MED, or Gmsh's."""
        return cls.from_meshio(_meshio().read(path))

    def write(self, path: str | PathLike[str]) -> None:
        """Writes a file that `read` takes: `.msh` in Gmsh's format 2.2, which a case takes as well, any other by meshio."""
        if Path(path).suffix == ".msh":
            Path(path).write_bytes(self._content())
            return
        mesh = self.to_meshio()
        names = list(mesh.cell_sets)
        # A cell is in one group or line.
        numbers = [np.full(len(block.data), -1, dtype=np.int64) for block in mesh.cells]
        for number, name in enumerate(names):
            for of_block, chosen in zip(numbers, mesh.cell_sets[name]):
                of_block[chosen] = number
        mesh.cell_sets = {}
        if Path(path).suffix == ".med":
            # A family has a number below 0, and its name.
            mesh.cell_tags = {-1 - number: [name] for number, name in enumerate(names)}
            mesh.cell_data = {"cell_tags": [-1 - of_block for of_block in numbers]}
        elif any("-" in name or " " in name for name in names):
            raise InputError("a name with `-` or a blank is not read back from this format", hint="`.msh` takes any")
        elif Path(path).suffix == ".xdmf" and len(kinds := {block.type for block in mesh.cells}) > 1 and kinds - _MIXED:
            raise InputError(f"meshio 5.3.5 cannot read XDMF with these cells together: {', '.join(sorted(kinds))}")
        else:
            mesh.cell_data = {"-".join(names): numbers}
        mesh.write(path)

    def to_meshio(self) -> Any:
        """The mesh for meshio: a block of cells for each kind, groups and lines by `cell_sets`."""
        kinds = {(dim, n): kind for kind, (n, dim) in _MESHIO.items()}
        blocks: dict[str, list[NDArray[np.int64]]] = {}
        places: list[tuple[str, str, NDArray[np.int64]]] = []
        for parts_of, dimension in ((self.groups, 2), (self.lines, 1)):
            for name, parts in parts_of.items():
                for part in parts:
                    kind = kinds[min(dimension, part.shape[1] - 1), part.shape[1]]
                    block = blocks.setdefault(kind, [])
                    done = sum(map(len, block))
                    block.append(part)
                    places.append((name, kind, np.arange(done, done + len(part))))
        none = np.arange(0)
        sets = {
            name: [
                np.concatenate([none, *(own for other, of, own in places if (other, of) == (name, kind))])
                for kind in blocks
            ]
            for name in dict.fromkeys(name for name, _, _ in places)
        }
        nodes = np.zeros((len(self.nodes), 3))
        nodes[:, : self.nodes.shape[1]] = self.nodes
        cells = [(kind, np.concatenate(parts)) for kind, parts in blocks.items()]
        return _meshio().Mesh(nodes, cells, cell_sets=sets)

    def name_line(self, name: str, where: Callable[[Any, Any], Any]) -> None:
        """Names the line of the edges whose ends and middle fulfil a condition.

        `mesh.name_line("top", lambda x, y: y == 1.0)`: `where` takes arrays and gives one of booleans.
        """
        if not callable(where):
            raise InputError(f"line `{name}`: expected a condition, a function of x and y")
        # Edges of first order have no middle, which is -1.
        found = [_edges(part) for parts in self.groups.values() for part in parts]
        edges = np.concatenate(found) if found else np.empty((0, 3), dtype=np.int64)
        at = self.nodes[edges]
        is_first = edges[:, 2] < 0
        at[is_first, 2] = (at[is_first, 0] + at[is_first, 1]) / 2
        fulfilled = np.asarray(where(at[..., 0], at[..., 1]))
        if fulfilled.ndim == 0:
            fulfilled = np.broadcast_to(fulfilled, edges.shape)
        if fulfilled.shape != edges.shape or fulfilled.dtype.kind != "b":
            raise InputError(
                f"line `{name}`: `where` gives {fulfilled.dtype} of shape {fulfilled.shape} of coordinates of shape "
                f"{edges.shape}, expected true or false for each",
                hint="conditions on arrays go together with & and |, each in parentheses",
            )
        chosen = edges[np.all(fulfilled, axis=1)]
        if not len(chosen):
            raise InputError(f"line `{name}`: there is no such edge")
        own = np.column_stack([np.sort(chosen[:, :2], axis=1), chosen[:, 2]])
        _, first = np.unique(own, axis=0, return_index=True)
        chosen = chosen[np.sort(first)]
        is_first = chosen[:, 2] < 0
        parts = [chosen[~is_first], chosen[is_first, :2]]
        self.lines[name] = [part for part in parts if len(part)]

    def _content(self) -> bytes:
        """The mesh as a file of Gmsh, format 2.2 in bytes: what reads files reads it."""
        blocks: list[tuple[int, int, NDArray[np.int64]]] = []
        named: list[tuple[int, int, str]] = []
        for kinds, parts_of in ((_SOLIDS, self.groups), (_LINES, self.lines)):
            for name, parts in parts_of.items():
                tag = len(named) + 1
                for dim in sorted({_dimension(kinds[part.shape[1]]) for part in parts}):
                    named.append((dim, tag, name))
                blocks += [(kinds[part.shape[1]], tag, part) for part in parts if len(part)]
        text = [b"$MeshFormat\n2.2 1 8\n", np.int32(1).tobytes(), b"\n$EndMeshFormat\n"]
        names = "".join(f'{dim} {tag} "{name}"\n' for dim, tag, name in named)
        text.append(f"$PhysicalNames\n{len(named)}\n{names}$EndPhysicalNames\n".encode())
        nodes = np.zeros(len(self.nodes), dtype=[("number", "<i4"), ("at", "<f8", 3)])
        nodes["number"] = np.arange(1, len(nodes) + 1)
        nodes["at"][:, : self.nodes.shape[1]] = self.nodes
        text += [f"$Nodes\n{len(nodes)}\n".encode(), nodes.tobytes(), b"\n$EndNodes\n"]
        total = sum(len(part) for _, _, part in blocks)
        text.append(f"$Elements\n{total}\n".encode())
        done = 0
        for kind, tag, part in blocks:
            rows = np.empty((len(part), 3 + part.shape[1]), dtype="<i4")
            rows[:, 0] = np.arange(done + 1, done + len(part) + 1)
            rows[:, 1:3] = tag
            rows[:, 3:] = part + 1
            text += [np.array([kind, len(part), 2], dtype="<i4").tobytes(), rows.tobytes()]
            done += len(part)
        return b"".join([*text, b"\n$EndElements\n"])

    def __repr__(self) -> str:
        groups = ", ".join(f"{name} ({_count(parts)})" for name, parts in self.groups.items())
        lines = ", ".join(f"{name} ({_count(parts)})" for name, parts in self.lines.items())
        return f"<pilum.Mesh: {len(self.nodes)} nodes; groups {groups}; lines {lines}>"


def _meshio() -> Any:
    try:
        return importlib.import_module("meshio")
    except ImportError:
        raise InputError("meshio is not installed", hint="pip install meshio; MED and XDMF need h5py, too") from None


def _families(mesh: Any, number: int) -> Iterator[tuple[str, NDArray[np.int64]]]:
    """Names of MED's families in a block, with its cells."""
    tags = mesh.cell_data.get("cell_tags")
    for tag, names in (getattr(mesh, "cell_tags", None) or {}).items():
        for name in names if tags is not None else ():
            yield name, np.flatnonzero(np.asarray(tags[number]) == tag)


def _joined(mesh: Any, number: int, sets: Mapping[str, Any]) -> Iterator[tuple[str, NDArray[np.int64]]]:
    """What meshio makes of `cell_sets` in files that have none: a number for each, and all names as that of the data."""
    for key, data in mesh.cell_data.items():
        values, names = np.asarray(data[number]), key.split("-")
        is_number = values.dtype.kind in "iu" and values.ndim == 1
        if sets or ":" in key or key == "cell_tags" or not is_number:
            continue
        all_values = np.concatenate([np.asarray(part) for part in data])
        if len(names) == len(np.unique(all_values[all_values >= 0])):
            for index, name in enumerate(names):
                yield name, np.flatnonzero(values == index)


def _array(name: str, values: Any) -> NDArray[Any]:
    """An array; what is masked is no value."""
    if np.ma.is_masked(values):
        raise InputError(f"{name}: some values of the array are masked", hint="`filled` gives them some")
    try:
        return np.asarray(values)
    except ValueError as error:
        raise InputError(f"{name}: {error}") from None


def _numbers(name: str, values: ArrayLike) -> NDArray[np.float64]:
    """Numbers. Texts and objects are refused, though NumPy would convert some."""
    array = _array(name, values)
    if array.dtype.kind not in "biuf":
        raise InputError(f"{name}: found an array of {array.dtype}, expected numbers")
    return array.astype(np.float64)


def _edges(part: NDArray[np.int64]) -> NDArray[np.int64]:
    """Edges of cells: two ends, and the middle or -1."""
    n = 3 if part.shape[1] in (3, 6) else 4
    edges = np.full((len(part), n, 3), -1, dtype=np.int64)
    edges[..., :2] = part[:, _ENDS[n]]
    if part.shape[1] > n:
        edges[..., 2] = part[:, n : 2 * n]
    return edges.reshape(-1, 3)


def _dimension(kind: int) -> int:
    """Dimension of one of Gmsh's kinds."""
    return {15: 0, 1: 1, 8: 1}.get(kind, 2)


def _count(parts: Sequence[NDArray[np.int64]]) -> int:
    return sum(len(part) for part in parts)
