#!/usr/bin/env bash
# Kratos 10.4.4 (KratosStructuralMechanicsApplication, PyPI): an axisymmetric element stands on its base, and its two upper nodes, at r = 0 and
# r = 1, carry the nodal loads -1 and -2: first on PointLoadCondition2D1N, then on AxisymPointLoadCondition2D1N.
# A good guess: the condition made for axisymmetry takes forces of the whole turn, or of a radian, wherever the node is: a pile's head load
# can be put on its axis.
# Seen: it multiplies POINT_LOAD by 2 pi r: a load on the axis does nothing, without a word, and the reactions are 4 pi. With the plain condition
# the loads are of the whole turn, and the reactions 3. THICKNESS, if the properties have it, divides the loads.
# Source: custom_conditions/axisym_point_load_condition.cpp of the application, GetPointLoadIntegrationWeight.
set -euo pipefail
place=$(mktemp -d) && trap 'rm -rf "$place"' EXIT && cd "$place"
python3 -m venv python && python/bin/pip -q --disable-pip-version-check install KratosStructuralMechanicsApplication==10.4.4
cat >press.py <<'PYTHON'
import math
import sys
from importlib.metadata import version

import KratosMultiphysics as kratos
import KratosMultiphysics.StructuralMechanicsApplication as structural

X, Y, Z = kratos.DISPLACEMENT_X, kratos.DISPLACEMENT_Y, kratos.DISPLACEMENT_Z
CORNERS, BASE, LOADS = ((0, 0), (1, 0), (1, 1), (0, 1)), (1, 2), {4: -1.0, 3: -2.0}


def reactions(condition, thickness=None):
    model = kratos.Model()
    part = model.CreateModelPart("ring")
    part.ProcessInfo[kratos.DOMAIN_SIZE] = 2
    for variable in (kratos.DISPLACEMENT, kratos.REACTION, structural.POINT_LOAD, kratos.VOLUME_ACCELERATION):
        part.AddNodalSolutionStepVariable(variable)
    for number, (r, z) in enumerate(CORNERS, 1):
        part.CreateNewNode(number, r, z, 0)
    elastic = part.CreateNewProperties(1)
    for name, value in ((kratos.YOUNG_MODULUS, 1e6), (kratos.POISSON_RATIO, 0), (kratos.DENSITY, 0), (kratos.THICKNESS, thickness)):
        if value is not None:
            elastic.SetValue(name, float(value))
    elastic.SetValue(kratos.CONSTITUTIVE_LAW, structural.LinearElasticAxisym2DLaw())
    part.CreateNewElement("AxisymSmallDisplacementElement2D4N", 1, [1, 2, 3, 4], elastic)
    for node, load in LOADS.items():
        part.CreateNewCondition(condition, node, [node], elastic)
        part.Nodes[node].SetSolutionStepValue(structural.POINT_LOAD, [0, load, 0])
    for along, reaction in ((X, kratos.REACTION_X), (Y, kratos.REACTION_Y), (Z, kratos.REACTION_Z)):
        kratos.VariableUtils().AddDof(along, reaction, part)
    for node in part.Nodes:
        node.Fix(X)
        node.Fix(Z)
        if node.Id in BASE:
            node.Fix(Y)
    for element in part.Elements:
        element.Initialize(part.ProcessInfo)
    builder = kratos.ResidualBasedBlockBuilderAndSolver(kratos.SkylineLUFactorizationSolver())
    scheme = kratos.ResidualBasedIncrementalUpdateStaticScheme()
    strategy = kratos.ResidualBasedLinearStrategy(part, scheme, builder, True, False, False, False)
    strategy.SetEchoLevel(0)
    strategy.Check()
    strategy.Solve()
    return sum(part.Nodes[node].GetSolutionStepValue(kratos.REACTION_Y) for node in BASE)


print(f"Kratos {version('KratosStructuralMechanicsApplication')}, nodal loads -1 at r = 0, -2 at r = 1:")
expected = {
    ("PointLoadCondition2D1N", None): 3,
    ("AxisymPointLoadCondition2D1N", None): 4 * math.pi,
    ("AxisymPointLoadCondition2D1N", 2): 2 * math.pi,
}
found = {key: reactions(*key) for key in expected}
for (condition, thickness), force in found.items():
    print(f"{condition}, THICKNESS {thickness}: reactions {force:.9f}")
sys.exit(any(abs(found[key] - force) > 1e-9 for key, force in expected.items()))
PYTHON
python/bin/python press.py && echo "as written" || { echo "CHANGED"; exit 1; }
