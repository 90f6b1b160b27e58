"""Case files of Pilum for an engine that runs on many ranks: the part of them that it computes, and no more.

A case on a grid (`mesh.columns`, `mesh.rows`), with solids and interfaces without thickness, one phase, supports,
pressures and prescribed displacements. Other keys of a file are refused by name, so that nothing is left out
silently. Probes, figures, `pile`, `output` and `solver` control what Pilum shows and how it iterates: they are
ignored. The keys: host/docs/reference/case.md.
"""

from __future__ import annotations

import difflib
import tomllib
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

AXES = {"x": 0, "r": 0, "y": 1, "z": 1}
STRESS = ["11", "22", "33", "12"]
PASSED_OVER = {"probes", "figure", "pile", "output", "solver"}


class WrongInput(Exception):
    """The file, or what was asked for, is wrong: whoever wrote it has to act."""


@dataclass
class Line:
    """A straight line along the grid: one coordinate is fixed, the other has an extent."""

    axis: int
    at: float
    extent: tuple[float, float]

    def holds(self, x: np.ndarray, tolerance: float) -> np.ndarray:
        """Whether points, shape (2 or 3, n), lie on it."""
        low, high = self.extent
        along = x[1 - self.axis]
        across = np.abs(x[self.axis] - self.at) <= tolerance
        return across & (along >= low - tolerance) & (along <= high + tolerance)


@dataclass
class Solid:
    """A group of 8-node quads."""

    cells: np.ndarray
    law: dict[str, Any]
    stress: np.ndarray


@dataclass
class Interface:
    """An interface without thickness: jump = displacement of the plus side less that of the minus side."""

    cells: np.ndarray  # (n, 2): on the minus side, on the plus side, towards increasing coordinates
    ends: np.ndarray  # (n, 2, 2): the ends of each facet, m
    law: dict[str, Any]
    points: str  # "nodes", "full" or "reduced"


@dataclass
class Case:
    """What an engine computes. Cells and vertices are counted from 0, in the order of the grid."""

    file: Path
    title: str
    axisymmetric: bool
    vertices: np.ndarray  # (n, 2), m; doubled along interfaces
    cells: np.ndarray  # (n, 4), corners as a tensor product
    solids: dict[str, Solid]
    interfaces: dict[str, Interface]
    lines: dict[str, Line]
    fixed: list[tuple[str, int]]  # line, component
    prescribed: list[tuple[str, int, float]]  # line, component, m at the end of the phase
    pressures: list[tuple[str, float]]  # line, kPa towards the body
    increments: int
    time: float
    law_path: list[Path] = field(default_factory=list)


def load(path: str | Path, variant: str | None = None) -> Case:
    """Reads a case: a file, or a folder with `case.toml`.

    Raises WrongInput, with file and key.
    """
    path = Path(path)
    path = path / "case.toml" if path.is_dir() else path
    table = _merged(path, [])
    variants = {one.get("name"): one for one in table.pop("variant", [])}
    if variant is not None or variants:
        if variant not in variants:
            found = "is missing" if variant is None else f"is `{variant}`"
            raise WrongInput(f"{path}: --variant {found}, there is: {', '.join(map(str, variants)) or 'none'}")
        own = {key: value for key, value in variants[variant].items() if key != "name"}
        table = _over(table, own)
    return _Reader(path).case(table)


def _merged(path: Path, seen: list[Path]) -> dict[str, Any]:
    """A file over its base."""
    if path.resolve() in seen:
        raise WrongInput(f"{path}: base: it is a base of itself")
    try:
        table = tomllib.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise WrongInput(f"{path}: {error.strerror}") from None
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise WrongInput(f"{path}: {error}") from None
    base = table.pop("base", None)
    if base is None:
        return table
    below = path.parent / str(base)
    below = below / "case.toml" if below.is_dir() else below
    return _over(_merged(below, [*seen, path.resolve()]), table)


def _over(below: dict[str, Any], above: dict[str, Any]) -> dict[str, Any]:
    """Tables are merged by key, arrays whose entries have a name by name; everything else replaces."""
    merged = dict(below)
    for key, value in above.items():
        known = merged.get(key)
        if isinstance(value, dict) and isinstance(known, dict):
            merged[key] = _over(known, value)
        elif _are_named(value) and _are_named(known):
            entries = {entry["name"]: entry for entry in known}
            for entry in value:
                entries[entry["name"]] = _over(entries.get(entry["name"], {}), entry)
            merged[key] = list(entries.values())
        else:
            merged[key] = value
    return merged


def _are_named(value: Any) -> bool:
    return isinstance(value, list) and all(isinstance(entry, dict) and "name" in entry for entry in value)


class _Reader:
    """Reads tables, and names the key of what is wrong."""

    def __init__(self, path: Path) -> None:
        self.path = path

    def wrong(self, key: str, message: str) -> WrongInput:
        return WrongInput(f"{self.path}: {key}: {message}")

    def table(self, value: Any, key: str, known: set[str], needed: set[str] = frozenset()) -> dict[str, Any]:  # type: ignore[assignment]
        """A table with known keys only."""
        if not isinstance(value, dict):
            raise self.wrong(key, "expected a table")
        for name in value:
            if name not in known:
                near = difflib.get_close_matches(name, known, 1)
                hint = f"; did you mean `{near[0]}`?" if near else f", which takes: {', '.join(sorted(known))}"
                raise self.wrong(f"{key}.{name}".lstrip("."), f"not in a distributed run{hint}")
        for name in needed - value.keys():
            raise self.wrong(f"{key}.{name}".lstrip("."), "is missing")
        return value

    def number(self, value: Any, key: str) -> float:
        if isinstance(value, bool) or not isinstance(value, (int, float)) or not np.isfinite(value):
            raise self.wrong(key, f"found {value!r}, expected a number")
        return float(value)

    def count(self, value: Any, key: str) -> int:
        if isinstance(value, bool) or not isinstance(value, int) or value < 1:
            raise self.wrong(key, f"found {value!r}, expected a whole number of at least 1")
        return value

    def one_of(self, value: Any, key: str, names: Any) -> Any:
        if value not in names:
            raise self.wrong(key, f"found {value!r}, there is: {', '.join(sorted(names)) or 'none'}")
        return value

    def case(self, table: dict[str, Any]) -> Case:
        known = {"title", "analysis", "law_path", "mesh", "laws", "groups", "supports", "phase"} | PASSED_OVER
        self.table(table, "", known, {"analysis", "mesh", "laws", "groups", "phase"})
        analysis = self.one_of(table["analysis"], "analysis", {"axisymmetric", "plane_strain"})
        mesh = self.table(
            table["mesh"], "mesh", {"origin", "columns", "rows", "region", "lines"}, {"columns", "rows", "region"}
        )
        origin = mesh.get("origin", [0.0, 0.0])
        x, y = (self.grid(origin[axis], mesh[name], f"mesh.{name}") for axis, name in enumerate(("columns", "rows")))
        self.lines = {name: self.line(value, name, x, y) for name, value in mesh.get("lines", {}).items()}
        group_of = self.regions(mesh["region"], x, y)

        columns, rows = np.meshgrid(np.arange(len(x) - 1), np.arange(len(y) - 1))
        first = (rows * len(x) + columns).ravel()
        cells = np.column_stack([first, first + 1, first + len(x), first + len(x) + 1])
        vertices = np.column_stack([np.tile(x, len(y)), np.repeat(y, len(x))])

        laws = {name: self.law(value, name) for name, value in table["laws"].items()}
        solids, written = self.solids(table["groups"], laws, group_of)
        found = {name: self.facets(name, one, vertices, cells, x, y) for name, one in written.items()}
        every = [pair for pairs, _ in found.values() for pair in map(tuple, pairs)]
        if len(set(every)) < len(every):
            raise self.wrong("groups", "two interfaces share a facet")
        self.check_stress(solids, found)
        interfaces = {
            name: Interface(*found[name], laws[one["law"]], one.get("integration", "nodes"))
            for name, one in written.items()
        }
        doubled, cells = split(vertices, cells, {frozenset(pair) for pair in every})
        return self.loaded(
            table,
            Case(
                file=self.path,
                title=str(table.get("title", self.path.parent.name)),
                axisymmetric=analysis == "axisymmetric",
                vertices=doubled,
                cells=cells,
                solids=solids,
                interfaces=interfaces,
                lines=self.lines,
                fixed=[],
                prescribed=[],
                pressures=[],
                increments=1,
                time=1.0,
                law_path=[self.path.parent / str(folder) for folder in table.get("law_path", [])],
            ),
        )

    def grid(self, origin: Any, parts: Any, key: str) -> np.ndarray:
        """Coordinates of the grid lines."""
        at = [self.number(origin, "mesh.origin")]
        for part in parts:
            self.table(part, key, {"n", "to", "ratio"}, {"n", "to"})
            n, to = self.count(part["n"], f"{key}.n"), self.number(part["to"], f"{key}.to")
            ratio, start = self.number(part.get("ratio", 1.0), f"{key}.ratio"), at[-1]
            if to <= start or ratio <= 0.0:
                raise self.wrong(key, "`to` has to rise, and `ratio` to be positive")
            sizes = ratio ** np.arange(n)
            at += list(start + (to - start) * np.cumsum(sizes)[:-1] / sizes.sum()) + [to]
        return np.array(at)

    def line(self, value: Any, name: str, x: np.ndarray, y: np.ndarray) -> Line:
        key = f"mesh.lines.{name}"
        at: list[Any] = [None, None]
        for letter, where in self.table(value, key, set(AXES)).items():
            at[AXES[letter]] = where
        fixed = [axis for axis in (0, 1) if at[axis] is not None and not isinstance(at[axis], list)]
        if len(fixed) != 1:
            raise self.wrong(key, "expected one coordinate, and an extent of the other one or nothing")
        axis = fixed[0]
        other = (x, y)[1 - axis]
        extent = at[1 - axis] or [other[0], other[-1]]
        low, high = (self.number(end, key) for end in extent)
        return Line(axis, self.number(at[axis], key), (low, high))

    def regions(self, regions: Any, x: np.ndarray, y: np.ndarray) -> np.ndarray:
        """The group of every cell, by name; later regions override earlier ones."""
        groups = np.full((len(y) - 1, len(x) - 1), "", dtype=object)
        middles = [(grid[1:] + grid[:-1]) / 2 for grid in (x, y)]
        for region in regions:
            self.table(region, "mesh.region", {"group", *AXES}, {"group"})
            inside = [np.ones(len(middle), dtype=bool) for middle in middles]
            for letter in (letter for letter in AXES if letter in region):
                grid, axis = (x, y)[AXES[letter]], AXES[letter]
                ends = [self.number(end, "mesh.region") for end in region[letter]]
                for end in ends:
                    if np.abs(grid - end).min() > 1e-9 * np.ptp(grid):
                        raise self.wrong(f"mesh.region.{letter}", f"{end} is no grid line")
                inside[axis] = (middles[axis] > ends[0]) & (middles[axis] < ends[1])
            groups[np.ix_(inside[1], inside[0])] = region["group"]
        if (groups == "").any():
            raise self.wrong("mesh.region", "there are elements outside all regions")
        return groups.ravel()

    def law(self, value: Any, name: str) -> dict[str, Any]:
        """Arguments of `pilum.Law`, which checks the keys itself. Paths are relative to the file."""
        if not isinstance(value, dict) or "law" not in value:
            raise self.wrong(f"laws.{name}.law", "is missing")
        law = dict(value)
        for key in ("library", "sidecar"):
            if key in law:
                law[key] = str(self.path.parent / law[key])
        return law

    def solids(self, groups: Any, laws: Any, group_of: np.ndarray) -> tuple[dict[str, Solid], dict[str, Any]]:
        """Groups of solids, and the tables of the interfaces."""
        solids, interfaces = {}, {}
        for name, group in groups.items():
            key = f"groups.{name}"
            self.table(
                group,
                key,
                {"formulation", "law", "integration", "initial_stress", "line"},
                {"formulation", "law"},
            )
            self.one_of(group["law"], f"{key}.law", laws)
            formulation = self.one_of(group["formulation"], f"{key}.formulation", {"solid", "zero_thickness"})
            if formulation == "zero_thickness":
                if "initial_stress" in group:
                    raise self.wrong(key, "an interface takes the stress of the ground beside it")
                self.one_of(group.get("integration", "nodes"), f"{key}.integration", {"nodes", "full", "reduced"})
                self.one_of(group.get("line"), f"{key}.line", self.lines)
                interfaces[name] = group
                continue
            if group.get("integration") != "full":
                raise self.wrong(f"{key}.integration", 'solids have 3 × 3 points here: `integration = "full"`')
            written = self.table(
                group.get("initial_stress", {}), f"{key}.initial_stress", {*STRESS, *(f"stress_{c}" for c in STRESS)}
            )
            stress = [
                self.number(written.get(c, written.get(f"stress_{c}", 0.0)), f"{key}.initial_stress") for c in STRESS
            ]
            solids[name] = Solid(np.flatnonzero(group_of == name), laws[group["law"]], np.array(stress))
        for name in set(group_of) - solids.keys():
            raise self.wrong(f"groups.{name}", "is missing: a region is of this group")
        return solids, interfaces

    def facets(
        self, name: str, group: Any, vertices: np.ndarray, cells: np.ndarray, x: np.ndarray, y: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """The cells on either side of an interface, and the ends of its facets."""
        key, line = f"groups.{name}.line", self.lines[group["line"]]
        tolerance = 1e-9 * max(np.ptp(x), np.ptp(y))
        grid = (x, y)[line.axis]
        number = int(np.abs(grid - line.at).argmin())
        if abs(grid[number] - line.at) > tolerance or number in (0, len(grid) - 1):
            raise self.wrong(key, "it lies on no grid line inside the body")
        n = [len(x) - 1, len(y) - 1]
        place = np.arange(n[1 - line.axis])
        strides = (1, n[0])
        plus = place * strides[1 - line.axis] + number * strides[line.axis]
        pairs = np.column_stack([plus - strides[line.axis], plus])
        # The first corners of the cell on the plus side lie on the line.
        ends = vertices[cells[plus][:, [0, 2] if line.axis == 0 else [0, 1]]]
        on = line.holds(ends.mean(axis=1).T, tolerance)
        if not on.any():
            raise self.wrong(key, "no element has a side on it")
        return pairs[on], ends[on]

    def check_stress(self, solids: dict[str, Solid], found: Any) -> None:
        """Interfaces start with the stress of the ground on both sides, which has to be the same there."""
        all_cells = {int(cell): solid for solid in solids.values() for cell in solid.cells}
        for name, (pairs, _) in found.items():
            for minus, plus in pairs:
                if not np.array_equal(all_cells[int(minus)].stress, all_cells[int(plus)].stress):
                    raise self.wrong(f"groups.{name}", "the initial stress is not the same on its two sides")

    def loaded(self, table: dict[str, Any], case: Case) -> Case:
        """Supports and the phase."""
        for support in table.get("supports", []):
            self.table(support, "supports", {"line", "fixed"}, {"line", "fixed"})
            line = self.one_of(support["line"], "supports.line", self.lines)
            case.fixed += [(line, AXES[self.one_of(c, "supports.fixed", AXES)]) for c in support["fixed"]]
        if len(table["phase"]) != 1:
            raise self.wrong("phase", f"found {len(table['phase'])}, a distributed run has one")
        phase = self.table(
            table["phase"][0],
            "phase",
            {"name", "increments", "time", "displacement", "pressure"},
            {"increments"},
        )
        case.increments = self.count(phase["increments"], "phase.increments")
        case.time = self.number(phase.get("time", 1.0), "phase.time")
        for one in phase.get("displacement", []):
            self.table(one, "phase.displacement", {"line", *AXES}, {"line"})
            line = self.one_of(one["line"], "phase.displacement.line", self.lines)
            for letter in (letter for letter in AXES if letter in one):
                case.prescribed.append((line, AXES[letter], self.number(one[letter], "phase.displacement")))
        for one in phase.get("pressure", []):
            self.table(one, "phase.pressure", {"line", "value"}, {"line", "value"})
            line = self.one_of(one["line"], "phase.pressure.line", self.lines)
            case.pressures.append((line, self.number(one["value"], "phase.pressure.value")))
        return case


def split(vertices: np.ndarray, cells: np.ndarray, cut: set[frozenset[int]]) -> tuple[np.ndarray, np.ndarray]:
    """Doubles vertices between cells that `cut` names in pairs: one for each part that hangs together round a vertex.

    A line that ends inside the body leaves its last vertex single; one that ends on the outline opens it.
    """
    cells, copies = cells.copy(), []
    around: dict[int, list[int]] = {int(v): [] for pair in cut for cell in pair for v in cells[cell]}
    for cell, corners in enumerate(cells.tolist()):
        for vertex in corners:
            if vertex in around:
                around[vertex].append(cell)
    original = cells.copy()
    for vertex, near in around.items():
        parts: list[set[int]] = [{cell} for cell in near]
        for a in near:
            for b in near:
                share = np.intersect1d(original[a], original[b])
                if a < b and len(share) == 2 and frozenset((a, b)) not in cut:
                    joined = [part for part in parts if a in part or b in part]
                    parts = [part for part in parts if part not in joined] + [set().union(*joined)]
        for part in parts[1:]:
            for cell in part:
                cells[cell, original[cell] == vertex] = len(vertices) + len(copies)
            copies.append(vertices[vertex])
    return np.vstack([vertices, *copies]), cells
