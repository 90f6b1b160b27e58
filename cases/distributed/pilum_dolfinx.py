"""Laws of Pilum in DOLFINx, on as many ranks as MPI has: solids, interfaces, equilibrium, and states to go on from.

`Points` carries a law at the quadrature points that a rank owns, in one call of `pilum.Law` for all of them. `Body`
makes solids and interfaces of them, and finds equilibrium. Laws are libraries that are opened; nothing is linked.
Units and signs are Pilum's: kN, m, kPa, tension and opening positive, γ = 2ε.
"""

from __future__ import annotations

import shutil
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from time import process_time
from typing import Any

try:
    import dolfinx_solver  # noqa: F401  # the wheel must be imported first; other installations lack it
except ModuleNotFoundError:
    pass
import basix
import basix.ufl
import dolfinx
import numpy as np
import pilum
import ufl
from dolfinx import fem
from dolfinx import mesh as meshes
from dolfinx.fem import petsc
from grid_case import Case, Interface, WrongInput
from mpi4py import MPI
from petsc4py import PETSc

DEGREE = 5  # 3 × 3 points a cell
TOLERANCE = 1e-7  # of a correction, relative to the displacements (2-norms)
MOST_ITERATIONS = 40
KEPT = ("gradient", "flux", "internal", "tangents")
POINTS = {
    "nodes": ([-1.0, 0.0, 1.0], [1 / 3, 4 / 3, 1 / 3]),
    "full": ([-np.sqrt(0.6), 0.0, np.sqrt(0.6)], [5 / 9, 8 / 9, 5 / 9]),
    "reduced": ([-1 / np.sqrt(3.0), 1 / np.sqrt(3.0)], [1.0, 1.0]),
}


class NoEquilibrium(Exception):
    """There is no equilibrium, or none was found."""


class LawFailed(Exception):
    """A law cannot be used, or cannot carry a point."""


def law_of(table: dict[str, Any], hypothesis: str, law_path: list[Path]) -> pilum.Law:
    """The law that a table of a case file describes."""
    table = dict(table)
    try:
        return pilum.Law(table.pop("law"), hypothesis=hypothesis, law_path=law_path, **table)
    except pilum.InputError as error:
        raise WrongInput(str(error)) from None
    except (pilum.Error, ValueError) as error:
        raise LawFailed(str(error)) from None


class Points:
    """A law at points of this rank. The state at the start of the increment stays until `accept`."""

    def __init__(
        self, law: pilum.Law, owners: np.ndarray, each: int, stress: np.ndarray, at: np.ndarray, dt: float
    ) -> None:
        """`owners` are the numbers of cells or facets in the case, each with `each` points; `stress` has a row a
        point, `at` its coordinates (m)."""
        self.law, self.owners, self.each, self.at = law, owners, each, np.ascontiguousarray(at)
        self.start = self._calling(law.initial, len(stress), flux=stress)
        self.end: pilum.State | None = None
        # Those at the start: an increment begins with what the one before it ended with.
        at_rest = self.start.gradient
        _, self.tangents, _ = self._calling(law.integrate, at_rest, self.start, dt=dt, positions=self.at)
        self.trial = self.tangents

    def _calling(self, call: Callable[..., Any], *arguments: Any, **named: Any) -> Any:
        """Calls the law, and says where it fails."""
        try:
            return call(*arguments, **named)
        except pilum.LawError as error:
            if error.point is None:
                raise
            x, y = self.at[error.point]
            raise LawFailed(f"at ({x:.6g}, {y:.6g}): {error}") from None

    def carry(self, gradients: np.ndarray, dt: float) -> tuple[np.ndarray, np.ndarray]:
        """Fluxes (n, c) and tangents (n, c, c) at these strains or jumps, from the start of the increment."""
        flux, self.trial, self.end = self._calling(
            self.law.integrate, gradients, self.start, dt=dt, out=self.end, positions=self.at
        )
        return flux, self.trial

    def accept(self) -> None:
        """The increment is over: its end is the next one's start."""
        if self.end is not None:
            self.start, self.tangents, self.end = self.end, self.trial, None

    def kept(self) -> dict[str, np.ndarray]:
        """What a state consists of, a row for each owner."""
        arrays = {name: getattr(self.start, name, self.tangents) for name in KEPT}
        shape = (len(self.owners), self.each)
        return {"owner": self.owners} | {name: a.reshape(*shape, *a.shape[1:]) for name, a in arrays.items()}

    def go_on_from(self, kept: dict[str, np.ndarray], time: float, increment: int) -> None:
        """Takes over what `kept` gave, of any rank's points."""
        rows = _rows_of(self.owners, kept["owner"])
        arrays = {name: kept[name][rows] for name in KEPT}
        arrays = {name: a.reshape(a.shape[0] * a.shape[1], *a.shape[2:]) for name, a in arrays.items()}
        self.tangents = arrays.pop("tangents")
        self.start = self.law.initial(len(self.at), time=time, increment=increment, **arrays)


def _rows_of(wanted: np.ndarray, known: np.ndarray) -> np.ndarray:
    """Positions of numbers among others."""
    order = np.argsort(known)
    return order[np.searchsorted(known, wanted, sorter=order)] if len(wanted) else np.zeros(0, dtype=int)


@dataclass
class Joints:
    """The facets of an interface on this rank."""

    points: Points
    blocks: np.ndarray  # (n, 6): three blocks of unknowns of the minus side, three of the plus side
    shape: np.ndarray  # (n, q, 6): jump = Σ shape · displacement
    weight: np.ndarray  # (n, q): length, in axisymmetry area of the whole turn
    axes: np.ndarray  # (n, 2, 2): across and along the facet

    def jumps(self, u: np.ndarray) -> np.ndarray:
        return np.einsum("nqb,nbc,nac->nqa", self.shape, u[self.blocks], self.axes).reshape(-1, 2)

    def forces(self, traction: np.ndarray) -> np.ndarray:
        t = traction.reshape(*self.weight.shape, 2)
        return np.einsum("nq,nqb,nqa,nac->nbc", self.weight, self.shape, t, self.axes)

    def stiffness(self, tangent: np.ndarray) -> np.ndarray:
        """Shape (n, 12, 12)."""
        d = tangent.reshape(*self.weight.shape, 2, 2)
        k = np.einsum("nq,nqb,nqd,nqae,nac,nef->nbcdf", *[self.weight, self.shape, self.shape, d, self.axes, self.axes])
        return k.reshape(len(self.weight), 12, 12)


class Body:
    """A case on the ranks of a communicator."""

    def __init__(self, comm: MPI.Comm, case: Case) -> None:
        self.comm, self.case = comm, case
        self.dt = case.time / case.increments
        self.mesh = _distributed(comm, case)
        topology = self.mesh.topology
        topology.create_connectivity(1, 2)
        self.n_owned = topology.index_map(2).size_local
        self.number = np.asarray(topology.original_cell_index)  # of the cells, in the case
        self.tolerance = 1e-9 * max(np.ptp(case.vertices, axis=0))

        # The 8-node quad: its unknowns are those at the corners and a mean along each edge.
        legendre = {
            "lagrange_variant": basix.LagrangeVariant.legendre,
            "dpc_variant": basix.DPCVariant.legendre,
        }
        self.element = basix.create_element(
            basix.ElementFamily.serendipity, basix.CellType.quadrilateral, 2, **legendre
        )
        quad = basix.ufl.element("S", "quadrilateral", 2, shape=(2,), **legendre)
        self.V = fem.functionspace(self.mesh, quad)
        self.u, self.du = fem.Function(self.V), fem.Function(self.V)
        one = fem.Function(self.V)
        one.interpolate(lambda p: np.ones((2, p.shape[1])))
        self.one = one.x.array.copy()  # a translation by 1 m in both directions

        quadrature = lambda shape: fem.functionspace(  # noqa: E731
            self.mesh,
            basix.ufl.quadrature_element("quadrilateral", value_shape=shape, degree=DEGREE, scheme="default"),
        )
        self.stress, self.tangent = fem.Function(quadrature((4,))), fem.Function(quadrature((4, 4)))
        self._forms()
        self._solids()
        self._joints()
        self._matrix()
        self._loads()
        self.reached, self.time = 0, 0.0
        self.spent = {"laws": 0.0, "assembly": 0.0, "solution": 0.0}  # s of this rank's processor

    # --- setting up -------------------------------------------------------------------------------------------------

    def _forms(self) -> None:
        measure = {"domain": self.mesh, "metadata": {"quadrature_degree": DEGREE, "quadrature_scheme": "default"}}
        dx = ufl.Measure("dx", **measure)
        r = ufl.SpatialCoordinate(self.mesh)[0]
        whole = 2 * np.pi * r if self.case.axisymmetric else 1.0
        zero = 0.0 * r

        def strain(v: Any) -> Any:
            hoop = v[0] / r if self.case.axisymmetric else zero
            return ufl.as_vector([v[0].dx(0), v[1].dx(1), hoop, v[0].dx(1) + v[1].dx(0)])

        test, trial = ufl.TestFunction(self.V), ufl.TrialFunction(self.V)
        self.inner = fem.form(whole * ufl.inner(self.stress, strain(test)) * dx)
        self.stiffness = fem.form(whole * ufl.inner(ufl.dot(self.tangent, strain(trial)), strain(test)) * dx)
        points, _ = basix.make_quadrature(basix.CellType.quadrilateral, DEGREE)
        self.per_cell = len(points)
        self.strain = fem.Expression(strain(self.u), points)
        self.place = fem.Expression(ufl.SpatialCoordinate(self.mesh), points)

        facets, tags, terms = [], [], 0.0 * test[0] * dx
        for tag, (line, _) in enumerate(self.case.pressures):
            facets.append(self._edges(line, meshes.locate_entities_boundary))
            tags.append(np.full(len(facets[-1]), tag, dtype=np.int32))
        if facets:
            order = np.argsort(np.concatenate(facets), kind="stable")
            marks = meshes.meshtags(self.mesh, 1, np.concatenate(facets)[order], np.concatenate(tags)[order])
            ds = ufl.Measure("ds", subdomain_data=marks, **measure)
            for tag, (_, value) in enumerate(self.case.pressures):
                terms -= whole * value * ufl.dot(ufl.FacetNormal(self.mesh), test) * ds(tag)
        self.outer = fem.form(terms)

    def _matrix(self) -> None:
        """The matrix, with room for what the two sides of interfaces know of each other, and its solver."""
        pattern = fem.create_sparsity_pattern(self.stiffness)
        for joint in self.joints:
            for blocks in joint.blocks:
                pattern.insert(blocks, blocks)
        pattern.finalize()
        self.A = dolfinx.cpp.la.petsc.create_matrix(self.comm, pattern)
        self.solver = PETSc.KSP().create(self.comm)
        self.solver.setType("preonly")
        self.solver.getPC().setType("lu")
        self.solver.getPC().setFactorSolverType("mumps")

    def _edges(self, name: str, locate: Callable[..., np.ndarray] = meshes.locate_entities) -> np.ndarray:
        line = self.case.lines[name]
        found = locate(self.mesh, 1, lambda p: line.holds(p, self.tolerance))
        if self.comm.allreduce(len(found)) == 0:
            raise WrongInput(f"{self.case.file}: mesh.lines.{name}: no element has a side on it")
        return found

    def _solids(self) -> None:
        hypothesis = "axisymmetric" if self.case.axisymmetric else "plane_strain"
        here = {int(number): cell for cell, number in enumerate(self.number[: self.n_owned])}
        self.here = here
        self.solids: list[tuple[np.ndarray, np.ndarray, Points]] = []
        every = self._together(
            lambda: {n: law_of(s.law, hypothesis, self.case.law_path) for n, s in self.case.solids.items()}
        )
        self.laws = dict(every)
        for name, solid in self.case.solids.items():
            numbers = np.array([number for number in solid.cells if number in here], dtype=np.int64)
            cells = np.array([here[number] for number in numbers], dtype=np.int32)
            rows = self.stress.function_space.dofmap.list[cells].ravel()
            at = self.place.eval(self.mesh, cells).reshape(-1, 2)
            stress = np.tile(solid.stress, (len(rows), 1))
            points = self._together(lambda: Points(every[name], numbers, self.per_cell, stress, at, self.dt))
            self.solids.append((cells, rows, points))

    def _joints(self) -> None:
        self.joints: list[Joints] = []
        stress_of = {int(cell): solid.stress for solid in self.case.solids.values() for cell in solid.cells}
        for name, interface in self.case.interfaces.items():
            law = self._together(lambda: law_of(interface.law, "interface_2d", self.case.law_path))
            self.laws[name] = law
            facets = [
                facet
                for facet, (minus, plus) in enumerate(interface.cells.tolist())
                if minus in self.here and plus in self.here
            ]
            if self.comm.allreduce(len(facets)) != len(interface.cells):
                raise RuntimeError(f"interface {name}: its two sides are on different ranks")
            self.joints.append(
                self._together(lambda: self._joint(law, interface, np.array(facets, dtype=int), stress_of))
            )

    def _joint(
        self, law: pilum.Law, interface: Interface, facets: np.ndarray, stress_of: dict[int, np.ndarray]
    ) -> Joints:
        n, q = len(facets), len(POINTS[interface.points][0])
        blocks, shape = np.zeros((n, 6), dtype=np.int32), np.zeros((n, q, 6))
        weight, axes, at, stress = np.zeros((n, q)), np.zeros((n, 2, 2)), np.zeros((n, q, 2)), np.zeros((n, q, 2))
        geometry = self.mesh.geometry
        for row, facet in enumerate(facets):
            a, b = interface.ends[facet]
            # A node on the axis of symmetry stands for no area: Gauss points there, as many.
            on_axis = self.case.axisymmetric and min(a[0], b[0]) <= self.tolerance
            rule = "full" if interface.points == "nodes" and on_axis else interface.points
            xi, weights = (np.array(values) for values in POINTS[rule])
            length = np.linalg.norm(b - a)
            along = (b - a) / length
            # Both axes towards increasing coordinates, as Pilum has them.
            along = along if along[np.abs(along).argmax()] > 0.0 else -along
            across = np.array([-along[1], along[0]])
            across = across if across[np.abs(across).argmax()] > 0.0 else -across
            axes[row] = across, along
            at[row] = (a + b) / 2 + np.outer(xi, (b - a) / 2)
            weight[row] = weights * length / 2 * (2 * np.pi * at[row][:, 0] if self.case.axisymmetric else 1.0)
            for side, sign in enumerate((-1.0, 1.0)):
                cell = self.here[int(interface.cells[facet, side])]
                corners = geometry.x[geometry.dofmap[cell], :2]
                inside = geometry.cmap.pull_back(at[row], corners)
                values = self.element.tabulate(0, inside)[0, :, :, 0]
                local = np.flatnonzero(np.abs(values).max(axis=0) > 1e-9)
                # At the nodes alone a mean along the edge shows only in its middle; it is there.
                blocks[row, 3 * side : 3 * side + 3] = self.V.dofmap.cell_dofs(cell)[local]
                shape[row, :, 3 * side : 3 * side + 3] = sign * values[:, local]
            s = stress_of[int(interface.cells[facet, 0])]
            tensor = np.array([[s[0], s[3]], [s[3], s[1]]])
            stress[row] = [across @ tensor @ across, along @ tensor @ across]
        points = Points(law, facets, q, stress.reshape(-1, 2), at.reshape(-1, 2), self.dt)
        return Joints(points, blocks, shape, weight, axes)

    def _loads(self) -> None:
        """Unknowns that are held or led, and the forces of the start."""
        # In the order of the file: all ranks ask for the same line at a time.
        names = dict.fromkeys(name for name, *_ in [*self.case.fixed, *self.case.prescribed])
        self.lines = {name: self._unknowns(name) for name in names}
        self.led = np.full(len(self.u.x.array), np.nan)
        for name, component in self.case.fixed:
            self.led[2 * self.lines[name] + component] = 0.0
        for name, component, value in self.case.prescribed:
            rows = 2 * self.lines[name] + component
            self.led[rows] = value * self.one[rows]
        owned = 2 * self.V.dofmap.index_map.size_local
        first = 2 * self.V.dofmap.index_map.local_range[0]
        self.held = np.flatnonzero(~np.isnan(self.led))
        self.held_globally = (first + self.held[self.held < owned]).astype(PETSc.IntType)
        self.pressure = self._vector(self.outer)
        # The unbalanced forces at the start are carried to equilibrium in proportion to the phase, as in Pilum.
        self.before = self._inner_forces([flux for flux, _ in self._at_start()])

    def _unknowns(self, name: str) -> np.ndarray:
        """Blocks of unknowns on the edges along a line."""
        return fem.locate_dofs_topological(self.V, 1, self._edges(name))

    # --- computing --------------------------------------------------------------------------------------------------

    def _together(self, work: Callable[[], Any]) -> Any:
        return together(self.comm, work)

    def _vector(self, form: fem.Form) -> PETSc.Vec:
        b = petsc.assemble_vector(form)
        b.ghostUpdate(addv=PETSc.InsertMode.ADD, mode=PETSc.ScatterMode.REVERSE)
        return b

    def _inner_forces(self, tractions: list[np.ndarray]) -> PETSc.Vec:
        b = petsc.assemble_vector(self.inner)
        with b.localForm() as local:
            array = local.array_w.reshape(-1, 2)
            for joint, traction in zip(self.joints, tractions, strict=True):
                np.add.at(array, joint.blocks, joint.forces(traction))
        b.ghostUpdate(addv=PETSc.InsertMode.ADD, mode=PETSc.ScatterMode.REVERSE)
        return b

    def _take_stress(self, rows: np.ndarray, flux: np.ndarray, tangents: np.ndarray) -> None:
        """Stresses and tangents of solids, for the forms."""
        self.stress.x.array.reshape(-1, 4)[rows] = flux
        self.tangent.x.array.reshape(-1, 16)[rows] = tangents.reshape(-1, 16)

    def _at_start(self) -> list[tuple[np.ndarray, np.ndarray]]:
        """Stresses and tangents as the increment begins; those of interfaces."""
        for _, rows, points in self.solids:
            self._take_stress(rows, points.start.flux, points.tangents)
        return [(joint.points.start.flux, joint.points.tangents) for joint in self.joints]

    def _call_laws(self) -> list[tuple[np.ndarray, np.ndarray]]:
        """Stresses and tangents at the displacements of this moment; those of interfaces."""

        def calls() -> list[tuple[np.ndarray, np.ndarray]]:
            for cells, rows, points in self.solids:
                strains = self.strain.eval(self.mesh, cells).reshape(-1, 4)
                self._take_stress(rows, *points.carry(strains, self.dt))
            u = self.u.x.array.reshape(-1, 2)
            return [joint.points.carry(joint.jumps(u), self.dt) for joint in self.joints]

        return self._together(calls)

    def _factorise(self, tangents: list[np.ndarray]) -> None:
        self.A.zeroEntries()
        petsc.assemble_matrix(self.A, self.stiffness)
        for joint, tangent in zip(self.joints, tangents, strict=True):
            unknowns = (2 * joint.blocks[:, :, None] + np.arange(2)).reshape(-1, 12).astype(PETSc.IntType)
            for rows, k in zip(unknowns, joint.stiffness(tangent), strict=True):
                self.A.setValuesLocal(rows, rows, k.ravel(), addv=PETSc.InsertMode.ADD)
        self.A.assemble()

    def advance(self) -> int:
        """Finds equilibrium at the end of the next increment, and returns the iterations.

        Raises NoEquilibrium or LawFailed; the state is then that of the increment before.
        """
        case, u = self.case, self.u.x.array
        share = (self.reached + 1) / case.increments
        before = u.copy()
        try:
            answers = self._at_start()
            for iteration in range(1, MOST_ITERATIONS + 1):
                clock = process_time()
                force = self._inner_forces([flux for flux, _ in answers])
                force.scale(-1.0)
                force.axpy(share, self.pressure)
                force.axpy(1.0 - share, self.before)
                self._factorise([tangent for _, tangent in answers])
                step = self.du.x.petsc_vec
                self.du.x.array[:] = 0.0
                self.du.x.array[self.held] = share * self.led[self.held] - u[self.held]
                self.A.zeroRowsColumns(self.held_globally, 1.0, step, force)
                clock = self._count("assembly", clock)
                self.solver.setOperators(self.A)
                self.solver.solve(force, step)
                self.du.x.scatter_forward()
                if self.solver.getConvergedReason() < 0 or not np.isfinite(self._norm(self.du)):
                    raise NoEquilibrium("the matrix is singular")
                u += self.du.x.array
                clock = self._count("solution", clock)
                answers = self._call_laws()
                self._count("laws", clock)
                if self._norm(self.du) <= TOLERANCE * self._norm(self.u):
                    break
            else:
                raise NoEquilibrium(f"not found in {MOST_ITERATIONS} iterations; more increments may help")
        except (NoEquilibrium, LawFailed) as error:
            u[:] = before
            raise type(error)(f"increment {self.reached + 1} of {case.increments}: {error}") from None
        for points in self._every():
            points.accept()
        self.reached += 1
        self.time += self.dt
        self.force = self._inner_forces([flux for flux, _ in answers])
        self.force.axpy(-share, self.pressure)
        return iteration

    def _count(self, part: str, since: float) -> float:
        now = process_time()
        self.spent[part] += now - since
        return now

    def _norm(self, u: fem.Function) -> float:
        owned = u.x.array[: 2 * self.V.dofmap.index_map.size_local]
        return float(np.sqrt(self.comm.allreduce(owned @ owned)))

    def _every(self) -> list[Points]:
        return [points for *_, points in self.solids] + [joint.points for joint in self.joints]

    def reaction(self, line: str) -> np.ndarray:
        """Sum of internal less external forces on a line, x and y: kN of the whole turn, or kN/m."""
        blocks, owned = self.lines[line], self.V.dofmap.index_map.size_local
        blocks = blocks[blocks < owned]
        # The work of the forces on a translation of the line.
        values = self.force.array.reshape(-1, 2)[blocks] * self.one.reshape(-1, 2)[blocks]
        return self.comm.allreduce(values.sum(axis=0))

    # --- going on later ---------------------------------------------------------------------------------------------

    def keep(self, folder: Path, mark: str) -> None:
        """Writes the state into a folder, a file for each rank: of no use to a run with another `mark`.

        The state before it is removed once this one is whole.
        """
        here = folder / f"{self.reached}"
        mine = slice(self.n_owned)
        arrays = {"cell": self.number[mine], "u": self.u.x.array.reshape(-1, 2)[self.V.dofmap.list[mine]]}
        for number, points in enumerate(self._every()):
            arrays |= {f"{number}_{name}": array for name, array in points.kept().items()}

        def write() -> None:
            here.mkdir(parents=True, exist_ok=True)
            np.savez(here / f"{self.comm.rank}.npz", mark=mark, time=self.time, **arrays)

        self._together(write)
        if self.comm.rank == 0:
            (folder / "new").write_text(f"{self.reached} {self.comm.size}\n")
            (folder / "new").replace(folder / "latest")
            for other in folder.iterdir():
                if other.is_dir() and other.name != here.name:
                    shutil.rmtree(other)

    def go_on_from(self, folder: Path, mark: str) -> None:
        """Takes over a state that `keep` wrote, on however many ranks. Raises WrongInput."""
        self._together(lambda: self._take(folder, mark))
        self.u.x.scatter_forward()

    def _take(self, folder: Path, mark: str) -> None:
        try:
            reached, ranks = (int(word) for word in (folder / "latest").read_text().split())
            files = [np.load(folder / f"{reached}" / f"{rank}.npz") for rank in range(ranks)]
        except (OSError, ValueError) as error:
            raise WrongInput(f"{folder}: no state to go on from: {error}") from None
        if any(str(file["mark"]) != mark for file in files):
            raise WrongInput(f"{folder}: its state is that of another case, or of other laws")
        all_of = lambda name: np.concatenate([file[name] for file in files])  # noqa: E731
        self.reached, self.time = reached, float(files[0]["time"])
        rows = _rows_of(self.number, all_of("cell"))
        self.u.x.array.reshape(-1, 2)[self.V.dofmap.list] = all_of("u")[rows]
        for number, points in enumerate(self._every()):
            kept = {name: all_of(f"{number}_{name}") for name in ("owner", *KEPT)}
            points.go_on_from(kept, self.time, reached)


def together(comm: MPI.Comm, work: Callable[[], Any]) -> Any:
    """Does something that may fail on some ranks only: then all of them raise it, and none waits for ever."""
    result, met = None, None
    try:
        result = work()
    except pilum.Error as error:
        met = LawFailed, str(error)
    except (LawFailed, WrongInput) as error:
        met = type(error), str(error)
    except OSError as error:
        met = WrongInput, str(error)
    errors = comm.allgather(met)
    for rank, one in enumerate(errors):
        if one:
            kind, text = one
            raise kind(text if all(other == one for other in errors) else f"rank {rank}: {text}")
    return result


def _distributed(comm: MPI.Comm, case: Case) -> meshes.Mesh:
    """The mesh, shared out so that the cells on both sides of an interface are on one rank.

    Rank 0 gives all cells. They go where DOLFINx's partitioner sends them, except that cells that interfaces join
    follow the first of them.
    """
    vertices, cells = case.vertices, case.cells.astype(np.int64)
    if comm.rank:
        vertices, cells = vertices[:0], cells[:0]
    leader = np.arange(len(cells))
    for interface in case.interfaces.values() if comm.rank == 0 else ():
        for minus, plus in interface.cells.tolist():
            a, b = leader[minus], leader[plus]
            leader[leader == max(a, b)] = min(a, b)
    default = meshes.create_cell_partitioner(meshes.GhostMode.none, 2)

    def partition(comm: MPI.Comm, n: int, types: Any, given: Any) -> Any:
        rank_of = default(comm, n, types, given).array
        return dolfinx.graph.adjacencylist(
            rank_of[leader].astype(np.int32), np.arange(len(cells) + 1, dtype=np.int32)
        )._cpp_object

    coordinates = basix.ufl.element("Lagrange", "quadrilateral", 1, shape=(2,))
    return meshes.create_mesh(comm, cells, coordinates, vertices, partition if comm.size > 1 else None)
