"""Computes model.json, next to this file, in Kratos GeoMechanics, and writes nodes.csv for `pilum import`.

Units kN, m, kPa; stresses 11 22 33 12, tension positive; forces of the whole turn, or kN/m. The laws are libraries of
Pilum, called as user materials of Abaqus."""

import json
import pathlib
import sys

import KratosMultiphysics as km
import KratosMultiphysics.GeoMechanicsApplication as geo
import KratosMultiphysics.LinearSolversApplication  # registers solvers
from KratosMultiphysics import python_linear_solver_factory

HERE = pathlib.Path(__file__).resolve().parent
FIRST = 1e-3  # part of the first increment of a phase that goes before it
MOST_ITERATIONS = 60


def variable(name):
    return km.KratosGlobals.GetVariable(name)


def properties(part, number, group):
    """The law, and what elements of a porous medium want, though nothing flows."""
    table = part.CreateNewProperties(number)
    table[km.THICKNESS] = 1.0
    for name, value in (("DENSITY_SOLID", 0.0), ("DENSITY_WATER", 0.0), ("POROSITY", 0.3),
                        ("BULK_MODULUS_SOLID", 1e9), ("BULK_MODULUS_FLUID", 1e6), ("PERMEABILITY_XX", 1e-9),
                        ("PERMEABILITY_YY", 1e-9), ("PERMEABILITY_XY", 0.0), ("BIOT_COEFFICIENT", 1.0),
                        ("RETENTION_LAW", "SaturatedLaw"), ("SATURATED_SATURATION", 1.0),
                        ("IGNORE_UNDRAINED", True)):
        table[variable(name)] = value
    table[km.DYNAMIC_VISCOSITY] = 1e-6
    parameters = list(group["parameters"])
    while parameters and parameters[-1]["by_default"]:
        parameters.pop()
    values = [parameter["value"] for parameter in parameters]
    if None in values:
        sys.exit(f"law {group['law']}: a parameter in the middle is left out, which Kratos cannot pass on")
    table[variable("UDSM_NAME")] = group["library"]
    table[variable("IS_FORTRAN_UDSM")] = True
    table[variable("UMAT_PARAMETERS")] = km.Vector(values)
    table[variable("STATE_VARIABLES")] = km.Vector([0.0] * group["n_internal"])
    table[km.CONSTITUTIVE_LAW] = km.KratosGlobals.GetConstitutiveLaw("SmallStrainUMAT2DPlaneStrainLaw").Clone()
    return table


def build(problem):
    model = km.Model()
    main = model.CreateModelPart("main", 2)
    for one in (km.DISPLACEMENT, km.REACTION, km.VOLUME_ACCELERATION, km.VELOCITY, km.ACCELERATION,
                km.WATER_PRESSURE, km.REACTION_WATER_PRESSURE, km.NORMAL_CONTACT_STRESS,
                km.TANGENTIAL_CONTACT_STRESS, km.NEGATIVE_FACE_PRESSURE, km.POSITIVE_FACE_PRESSURE):
        main.AddNodalSolutionStepVariable(one)
    for name in ("DT_WATER_PRESSURE", "NORMAL_FLUID_FLUX", "POINT_LOAD", "LINE_LOAD", "HYDRAULIC_HEAD"):
        main.AddNodalSolutionStepVariable(variable(name))
    main.ProcessInfo[km.DOMAIN_SIZE] = 2
    for i, (x, y) in enumerate(problem["nodes"]):
        main.CreateNewNode(i + 1, x, y, 0.0)
    tables = [properties(main, i + 1, group) for i, group in enumerate(problem["groups"])]
    kind = "SmallStrainUPwDiffOrder" + ("Axisymmetric" if problem["axisymmetric"] else "") + "Element2D"
    for i, element in enumerate(problem["elements"]):
        nodes = [node + 1 for node in element["nodes"]]
        main.CreateNewElement(f"{kind}{len(nodes)}N", i + 1, nodes, tables[element["group"]])
    loaded = sorted({node for load in problem["loads"] for node in load["nodes"]})
    for i, node in enumerate(loaded):
        main.CreateNewCondition("UPwForceCondition2D1N", i + 1, [node + 1], tables[0])
    add = km.VariableUtils()
    add.AddDof(km.DISPLACEMENT_X, km.REACTION_X, main)
    add.AddDof(km.DISPLACEMENT_Y, km.REACTION_Y, main)
    add.AddDof(km.WATER_PRESSURE, km.REACTION_WATER_PRESSURE, main)
    for node in main.Nodes:
        node.Fix(km.WATER_PRESSURE)
    for held in problem["held"]:
        for node in held["nodes"]:
            main.Nodes[node + 1].Fix(COMPONENTS[held["component"]])
    main.SetBufferSize(2)
    return model, main


COMPONENTS = (km.DISPLACEMENT_X, km.DISPLACEMENT_Y)


def solver(part):
    linear = python_linear_solver_factory.ConstructSolver(
        km.Parameters('{"solver_type": "LinearSolversApplication.sparse_lu"}'))
    builder = km.ResidualBasedBlockBuilderAndSolver(linear)
    criteria = km.AndCriteria(km.DisplacementCriteria(1e-10, 1e-14), km.ResidualCriteria(1e-9, 1e-9))
    strategy = km.ResidualBasedNewtonRaphsonStrategy(
        part, km.ResidualBasedIncrementalUpdateStaticScheme(), criteria, builder, MOST_ITERATIONS, True, False, False)
    strategy.SetEchoLevel(0)
    strategy.Initialize()
    return strategy


def prescribe(problem, part, step, share):
    """Displacements and forces a share of the way from the step before to this one."""
    def at(values):
        return values[step] + share * (values[step + 1] - values[step])

    for held in problem["held"]:
        value = at([0.0, *held["values"]])
        for node in held["nodes"]:
            part.Nodes[node + 1].SetSolutionStepValue(COMPONENTS[held["component"]], 0, value)
    sums = {}
    for load in problem["loads"]:
        factor = at(load["factors"])
        for node, (x, y) in zip(load["nodes"], load["forces"]):
            before = sums.get(node, (0.0, 0.0))
            sums[node] = before[0] + factor * x, before[1] + factor * y
    for node, (x, y) in sums.items():
        part.Nodes[node + 1].SetSolutionStepValue(variable("POINT_LOAD"), 0, [x, y, 0.0])


def displacements(part):
    return [tuple(node.GetSolutionStepValue(c) for c in COMPONENTS) for node in part.Nodes]


def main():
    km.Logger.GetDefaultOutput().SetSeverity(km.Logger.Severity.WARNING)
    problem = json.loads((HERE / "model.json").read_text())
    model, part = build(problem)
    strategy = solver(part)
    steps = problem["steps"]
    before, last = None, displacements(part)
    time, count = 0.0, 0
    with open(HERE / "nodes.csv", "w", encoding="utf-8") as file:
        file.write("step,node,u_0,u_1,r_0,r_1\n")
        for step, of in enumerate(steps):
            begins = step == 0 or steps[step - 1]["phase"] != of["phase"]
            # The iteration starts from displacements that go on as they went. With only the prescribed ones moved,
            # the ground next to them would yield at once, and full Newton iterations cycle.
            shares = (FIRST, 1.0) if begins else (1.0,)
            start, done = time, 0.0
            for share in shares:
                time, count = start + share * (of["time"] - start), count + 1
                part.CloneTimeStep(time)
                part.ProcessInfo[km.STEP] = count
                part.ProcessInfo[km.DELTA_TIME] = (share - done) * (of["time"] - start)
                strategy.InitializeSolutionStep()
                strategy.Predict()
                if before and not (begins and share == FIRST):
                    ratio = (share - done) / (FIRST if begins else length)
                    for node, old, new in zip(part.Nodes, before, last):
                        for c, a, b in zip(COMPONENTS, old, new):
                            node.SetSolutionStepValue(c, 0, b + ratio * (b - a))
                length = share - done
                done = share
                prescribe(problem, part, step, share)
                if not strategy.SolveSolutionStep():
                    sys.exit(f"no equilibrium in phase {of['phase']}, increment {of['increment']}")
                strategy.FinalizeSolutionStep()
                before, last = last, displacements(part)
            for node in part.Nodes:
                values = [node.GetSolutionStepValue(c) for c in (*COMPONENTS, km.REACTION_X, km.REACTION_Y)]
                file.write(",".join(map(repr, (step, node.Id - 1, *values))) + "\n")


main()
