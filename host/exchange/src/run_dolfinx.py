"""Computes model.json, next to this file, in DOLFINx, and writes nodes.csv for `pilum import`.

Units kN, m, kPa; stresses 11 22 33 12, tension positive; forces of the whole turn, or kN/m. The laws are libraries of
Pilum, called by its package for Python, as in cases/distributed. One process."""

import json
import pathlib
import sys

import numpy as np
import pilum

sys.path.insert(0, str(pilum.cases() / "distributed"))
from pilum_dolfinx import Points, law_of  # imports the wheel of DOLFINx first

import basix
import basix.ufl
import ufl
from dolfinx import fem
from dolfinx import mesh as meshes
from dolfinx.fem import petsc
from mpi4py import MPI
from petsc4py import PETSc

HERE = pathlib.Path(__file__).resolve().parent
MOST_ITERATIONS, TOLERANCE = 60, 1e-10  # of a correction, relative to the displacements
# By nodes of an element: cell, family, nodes in the order of DOLFINx, degree of the full and the reduced rule.
KINDS = {
    6: ("triangle", "P", [0, 1, 2, 4, 5, 3], {False: 2, True: 2}),
    8: ("quadrilateral", "S", [0, 1, 3, 2, 4, 7, 5, 6], {False: 5, True: 3}),
    9: ("quadrilateral", "Q", [0, 1, 3, 2, 4, 7, 5, 6, 8], {False: 5, True: 3}),
}


def parameters(group, folders):
    """Parameters that the case gives; of a choice its name."""
    choices = {p["id"]: p.get("choices") for p in pilum.describe(group["law"], law_path=folders)["parameters"]}
    given = {p["id"]: p["value"] for p in group["parameters"] if not p["by_default"]}
    return {name: choices[name][int(value)] if choices[name] else value for name, value in given.items()}


class Ground:
    """Solids with their laws, in unknowns at the nodes of the model."""

    def __init__(self, problem):
        elements = problem["elements"]
        cell, family, order, degrees = KINDS[len(elements[0]["nodes"])]
        nodes = np.array([element["nodes"] for element in elements])[:, order]
        n_corners = 3 if cell == "triangle" else 4
        used, corners = np.unique(nodes[:, :n_corners], return_inverse=True)
        vertices = np.array(problem["nodes"])[used]
        shape = basix.ufl.element("Lagrange", cell, 1, shape=(2,))
        self.mesh = meshes.create_mesh(MPI.COMM_SELF, corners.reshape(-1, n_corners).astype(np.int64), shape, vertices)
        number = np.asarray(self.mesh.topology.original_cell_index)
        variants = {"lagrange_variant": basix.LagrangeVariant.legendre, "dpc_variant": basix.DPCVariant.legendre}
        variants = variants if family == "S" else {}
        self.V = fem.functionspace(self.mesh, basix.ufl.element(family, cell, 2, shape=(2,), **variants))
        self.u = fem.Function(self.V)
        blocks = self.V.dofmap.list
        self.block = np.full(len(problem["nodes"]), -1)
        self.block[nodes[number]] = blocks
        self._nodal(blocks, family)
        self.parts = [self._part(problem, group, number, cell, degrees) for group in range(len(problem["groups"]))]
        self.parts = [part for part in self.parts if part]

    def _nodal(self, blocks, family):
        """Unknowns of DOLFINx from values at nodes: on a side of an 8-node quad the unknown is the mean along it."""
        n = self.V.dofmap.index_map.size_local
        self.T = PETSc.Mat().createAIJ([2 * n, 2 * n], nnz=3, comm=MPI.COMM_SELF)
        ends = ((0, 1), (0, 2), (1, 3), (2, 3)) if family == "S" else ()
        rows = {block: {block: 1.0} for block in blocks.ravel()}
        for of_cell in blocks:
            for side, (a, b) in enumerate(ends):
                own = of_cell[4 + side]
                rows[own] = {own: 4 / 6, of_cell[a]: 1 / 6, of_cell[b]: 1 / 6}
        for row, parts in rows.items():
            for column, part in parts.items():
                for c in range(2):
                    self.T.setValue(2 * row + c, 2 * column + c, part)
        self.T.assemble()

    def _part(self, problem, group, number, cell, degrees):
        """A group: its forms, and its law at its points."""
        of = problem["groups"][group]
        cells = np.flatnonzero([problem["elements"][i]["group"] == group for i in number]).astype(np.int32)
        if not len(cells):
            return None
        degree = degrees[of["reduced"]]
        rule = {"quadrature_degree": degree, "quadrature_scheme": "default"}
        dx = ufl.Measure("dx", domain=self.mesh, subdomain_data=[(1, cells)], metadata=rule)(1)
        x = ufl.SpatialCoordinate(self.mesh)
        whole = 2 * np.pi * x[0] if problem["axisymmetric"] else 1.0

        def strain(v):
            hoop = v[0] / x[0] if problem["axisymmetric"] else 0.0 * x[0]
            return ufl.as_vector([v[0].dx(0), v[1].dx(1), hoop, v[0].dx(1) + v[1].dx(0)])

        def values(*shape):
            element = basix.ufl.quadrature_element(cell, value_shape=shape, degree=degree, scheme="default")
            return fem.Function(fem.functionspace(self.mesh, element))

        stress, tangent = values(4), values(4, 4)
        test, trial = ufl.TestFunction(self.V), ufl.TrialFunction(self.V)
        inner = fem.form(whole * ufl.inner(stress, strain(test)) * dx)
        stiffness = fem.form(whole * ufl.inner(ufl.dot(tangent, strain(trial)), strain(test)) * dx)
        at, _ = basix.make_quadrature(getattr(basix.CellType, cell), degree)
        place = fem.Expression(x, at).eval(self.mesh, cells).reshape(-1, 2)
        folders = [pathlib.Path(of["library"]).parent]
        table = {"law": of["law"], "parameters": parameters(of, folders)}
        law = law_of(table, "axisymmetric" if problem["axisymmetric"] else "plane_strain", folders)
        start = np.tile(of["initial_stress"], (len(place), 1))
        points = Points(law, cells, len(at), start, place, problem["steps"][0]["time"])
        rows = stress.function_space.dofmap.list[cells].ravel()
        return points, fem.Expression(strain(self.u), at), cells, rows, (stress, tangent), (inner, stiffness)

    def forces(self, dt=None):
        """Nodal forces and stiffness with the stresses of the laws: at the start, or a time step later at `u`."""
        force, stiffness = None, None
        for points, strain, cells, rows, (stress, tangent), forms in self.parts:
            flux, moduli = points.start.flux, points.tangents
            if dt is not None:
                flux, moduli = points.carry(strain.eval(self.mesh, cells).reshape(-1, 4), dt)
            stress.x.array.reshape(-1, 4)[rows] = flux
            tangent.x.array.reshape(-1, 16)[rows] = np.reshape(moduli, (-1, 16))
            own, matrix = petsc.assemble_vector(forms[0]), petsc.assemble_matrix(forms[1])
            matrix.assemble()
            if force is None:
                force, stiffness = own, matrix
            else:
                force.axpy(1.0, own)
                stiffness.axpy(1.0, matrix)
        nodal = force.duplicate()
        self.T.multTranspose(force, nodal)
        return nodal.array.reshape(-1, 2).copy(), stiffness.PtAP(self.T)

    def move(self, w):
        """Takes displacements of nodes."""
        vector = self.T.createVecRight()
        vector.array[:] = w.ravel()
        self.u.x.array[:] = (self.T * vector).array


def solved(stiffness, right, held, values):
    """The correction by these forces, with that of held unknowns."""
    x, b = stiffness.createVecRight(), stiffness.createVecRight()
    x.array[held], b.array[:] = values, right
    stiffness.zeroRowsColumns(held.astype(PETSc.IntType), 1.0, x, b)
    solver = PETSc.KSP().create(stiffness.comm)
    solver.setType("preonly")
    solver.getPC().setType("lu")
    solver.getPC().setFactorSolverType("mumps")
    solver.setOperators(stiffness)
    solver.solve(b, x)
    return x.array.reshape(-1, 2).copy()


def main():
    problem = json.loads((HERE / "model.json").read_text())
    ground, steps = Ground(problem), problem["steps"]
    block, n = ground.block, ground.V.dofmap.index_map.size_local
    w, time, held = np.zeros((n, 2)), 0.0, {}
    for one in problem["held"]:
        held.update({2 * block[node] + one["component"]: one["values"] for node in one["nodes"]})
    unknowns = np.array(list(held), dtype=int)
    with open(HERE / "nodes.csv", "w", encoding="utf-8") as file:
        file.write("step,node,u_0,u_1,r_0,r_1\n")
        for step, of in enumerate(steps):
            external, dt = np.zeros((n, 2)), of["time"] - time
            for load in problem["loads"]:
                np.add.at(external, block[load["nodes"]], load["factors"][step + 1] * np.array(load["forces"]))
            wanted = np.array([values[step] for values in held.values()])
            force, stiffness = ground.forces()
            for _ in range(MOST_ITERATIONS):
                right = (external - force).ravel()
                change = solved(stiffness, right, unknowns, wanted - w.ravel()[unknowns])
                w += change
                ground.move(w)
                force, stiffness = ground.forces(dt)
                if np.linalg.norm(change) <= TOLERANCE * np.linalg.norm(w):
                    break
            else:
                sys.exit(f"no equilibrium in phase {of['phase']}, increment {of['increment']}")
            for points, *_ in ground.parts:
                points.accept()
            time = of["time"]
            for node, row in enumerate(np.hstack([w, force - external])[block].tolist()):
                file.write(",".join(map(repr, (step, node, *row))) + "\n")


main()
