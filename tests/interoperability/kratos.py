"""The bonded pile of cases/bonded_pile in Kratos GeoMechanics, its soil a law of ours by the entry of Abaqus user
materials. Kratos knows no initial stress of an element's own here, so c' = c + σ_0 tan φ stands for the
confinement, which is the same for Mohr–Coulomb.

    kratos.py SYMBOL LIBRARY INCREMENTS PARAMETER...   SYMBOL: umat or umat_

Prints JSON: head force (compression positive, N) and iterations by increment. Units m, kN, kPa."""

import json
import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "host" / "benches"))

import KratosMultiphysics as km
import KratosMultiphysics.GeoMechanicsApplication as geo  # registers elements and laws
import KratosMultiphysics.LinearSolversApplication  # registers solvers
from KratosMultiphysics import python_linear_solver_factory
from chamber import INCREMENTS, MESHES, PILE, PUSH, Mesh

MOST_ITERATIONS = 60
FIRST = 1e-3


def variable(name):
    return km.KratosGlobals.GetVariable(name)


def law(name):
    return km.KratosGlobals.GetConstitutiveLaw(name).Clone()


def properties(part, number):
    """What elements of a porous medium want, though nothing flows."""
    table = part.CreateNewProperties(number)
    table[km.THICKNESS] = 1.0
    for name, value in (("DENSITY_SOLID", 0.0), ("DENSITY_WATER", 0.0), ("POROSITY", 0.3),
                        ("BULK_MODULUS_SOLID", 1e9), ("BULK_MODULUS_FLUID", 1e6), ("PERMEABILITY_XX", 1e-9),
                        ("PERMEABILITY_YY", 1e-9), ("PERMEABILITY_XY", 0.0), ("BIOT_COEFFICIENT", 1.0),
                        ("RETENTION_LAW", "SaturatedLaw"), ("SATURATED_SATURATION", 1.0),
                        ("IGNORE_UNDRAINED", True)):
        table[variable(name)] = value
    table[km.DYNAMIC_VISCOSITY] = 1e-6
    return table


def build(mesh, library, symbol, parameters):
    part = km.Model()
    main = part.CreateModelPart("main", 2)
    for one in (km.DISPLACEMENT, km.REACTION, km.VOLUME_ACCELERATION, km.VELOCITY, km.ACCELERATION,
                km.WATER_PRESSURE, km.REACTION_WATER_PRESSURE, km.NORMAL_CONTACT_STRESS,
                km.TANGENTIAL_CONTACT_STRESS, km.NEGATIVE_FACE_PRESSURE, km.POSITIVE_FACE_PRESSURE):
        main.AddNodalSolutionStepVariable(one)
    for name in ("DT_WATER_PRESSURE", "NORMAL_FLUID_FLUX", "POINT_LOAD", "LINE_LOAD", "HYDRAULIC_HEAD"):
        main.AddNodalSolutionStepVariable(variable(name))
    main.ProcessInfo[km.DOMAIN_SIZE] = 2
    for i, (x, y) in enumerate(mesh.nodes):
        main.CreateNewNode(i + 1, x, y, 0.0)
    soil, pile = properties(main, 1), properties(main, 2)
    soil[variable("UDSM_NAME")] = library
    soil[variable("IS_FORTRAN_UDSM")] = symbol == "umat_"
    soil[variable("UMAT_PARAMETERS")] = km.Vector(parameters)
    soil[variable("STATE_VARIABLES")] = km.Vector([0.0, 0.0])
    soil[km.CONSTITUTIVE_LAW] = law("SmallStrainUMAT2DPlaneStrainLaw")
    pile[km.YOUNG_MODULUS], pile[km.POISSON_RATIO] = PILE["young_modulus"], PILE["poisson_ratio"]
    pile[km.CONSTITUTIVE_LAW] = law("GeoLinearElasticPlaneStrain2DLaw")
    for i, (nodes, in_pile) in enumerate(zip(mesh.elements, mesh.in_pile)):
        main.CreateNewElement("SmallStrainUPwDiffOrderAxisymmetricElement2D8N", i + 1,
                              [node + 1 for node in nodes], pile if in_pile else soil)
    add = km.VariableUtils()
    add.AddDof(km.DISPLACEMENT_X, km.REACTION_X, main)
    add.AddDof(km.DISPLACEMENT_Y, km.REACTION_Y, main)
    add.AddDof(km.WATER_PRESSURE, km.REACTION_WATER_PRESSURE, main)
    for node in main.Nodes:
        node.Fix(km.WATER_PRESSURE)
    for line, component in (("axis", km.DISPLACEMENT_X), ("wall", km.DISPLACEMENT_X),
                            ("bottom", km.DISPLACEMENT_Y), ("head", km.DISPLACEMENT_Y)):
        for node in mesh.nodes_of(line):
            main.Nodes[node + 1].Fix(component)
    main.SetBufferSize(2)
    return part, main


def main():
    symbol, library, increments, *parameters = sys.argv[1:]
    km.Logger.GetDefaultOutput().SetSeverity(km.Logger.Severity.WARNING)
    mesh = Mesh(*MESHES["m200"])
    model, part = build(mesh, library, symbol, [float(value) for value in parameters])
    linear = python_linear_solver_factory.ConstructSolver(
        km.Parameters('{"solver_type": "LinearSolversApplication.sparse_lu"}'))
    builder = km.ResidualBasedBlockBuilderAndSolver(linear)
    criteria = km.AndCriteria(km.DisplacementCriteria(1e-10, 1e-14), km.ResidualCriteria(1e-9, 1e-9))
    strategy = km.ResidualBasedNewtonRaphsonStrategy(
        part, km.ResidualBasedIncrementalUpdateStaticScheme(), criteria, builder, MOST_ITERATIONS, True, False, False)
    strategy.SetEchoLevel(0)
    strategy.Initialize()
    head = [part.Nodes[node + 1] for node in mesh.nodes_of("head")]
    iterations = []
    # The iteration starts from the last displacements in proportion, the first of them from a very small push. With
    # the head alone displaced, the soil next to it would yield at once, and full Newton iterations cycle.
    times = [FIRST, *range(1, int(increments) + 1)]
    for step, (before, time) in enumerate(zip([None, *times], times)):
        part.CloneTimeStep(float(time))
        part.ProcessInfo[km.STEP], part.ProcessInfo[km.DELTA_TIME] = step + 1, time - (before or 0.0)
        strategy.InitializeSolutionStep()
        strategy.Predict()
        if before:
            for node in part.Nodes:
                for component in (km.DISPLACEMENT_X, km.DISPLACEMENT_Y):
                    value = node.GetSolutionStepValue(component)
                    node.SetSolutionStepValue(component, 0, value * time / before)
        for node in head:
            node.SetSolutionStepValue(km.DISPLACEMENT_Y, 0, -PUSH * time / INCREMENTS)
        converged = strategy.SolveSolutionStep()
        strategy.FinalizeSolutionStep()
        iterations.append(part.ProcessInfo[km.NL_ITERATION_NUMBER])
        if not converged:
            sys.exit(f"no equilibrium at time {time} of {increments}")
    force = -1000.0 * sum(node.GetSolutionStepValue(km.REACTION_Y) for node in head)
    print(json.dumps({"head_force": force, "iterations": iterations}))


main()
