#!/usr/bin/env bash
# Kratos 10.4.4 (KratosConstitutiveLawsApplication, PyPI): a cube of SmallStrainIsotropicDamage3DModifiedMohrCoulomb, E = 10 000 kPa, nu = 0.3,
# strength 30 kPa in compression, 10 kPa in tension, FRICTION_ANGLE 30, is sheared by 0.01: once alone, once compressed by 1e-3 of that.
# A good guess: both reach the same shear strength, to about 1e-3.
# Seen: compressed, the shear stress ends at 7.51 kPa; alone, in pure shear, it is elastic without end: 38.46 kPa = G gamma. Where the sum of the
# normal stresses is below 2e-16, the law takes the equivalent stress as 0. A FRICTION_ANGLE of 0, as of an undrained clay, is taken as 32
# degrees; of that a warning tells.
# Source: custom_constitutive/auxiliary_files/yield_surfaces/modified_mohr_coulomb_yield_surface.h of the application, CalculateEquivalentStress.
set -euo pipefail
place=$(mktemp -d) && trap 'rm -rf "$place"' EXIT && cd "$place"
python3 -m venv python
# The one needs the other, and does not say so to pip.
python/bin/pip -q --disable-pip-version-check install KratosConstitutiveLawsApplication==10.4.4 KratosStructuralMechanicsApplication==10.4.4
cat >shear.py <<'PYTHON'
import sys
from importlib.metadata import version

import KratosMultiphysics as kratos
import KratosMultiphysics.StructuralMechanicsApplication  # noqa: F401
import KratosMultiphysics.ConstitutiveLawsApplication as laws

CORNERS = ((0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1))
SHEAR, STEPS = 0.01, 10
MATERIAL = {
    "YOUNG_MODULUS": 1e4, "POISSON_RATIO": 0.3, "DENSITY": 0.0, "YIELD_STRESS_COMPRESSION": 30.0, "YIELD_STRESS_TENSION": 10.0,
    "FRACTURE_ENERGY": 1e3, "SOFTENING_TYPE": 1,
}


def stress(compression, friction_angle):
    model = kratos.Model()
    part = model.CreateModelPart("cube")
    part.ProcessInfo[kratos.DOMAIN_SIZE] = 3
    for variable in (kratos.DISPLACEMENT, kratos.REACTION, kratos.VOLUME_ACCELERATION):
        part.AddNodalSolutionStepVariable(variable)
    for number, corner in enumerate(CORNERS, 1):
        part.CreateNewNode(number, *map(float, corner))
    soil = part.CreateNewProperties(1)
    for name, value in {**MATERIAL, "FRICTION_ANGLE": friction_angle}.items():
        soil.SetValue(kratos.KratosGlobals.GetVariable(name), value)
    soil.SetValue(kratos.CONSTITUTIVE_LAW, laws.SmallStrainIsotropicDamage3DModifiedMohrCoulomb())
    cube = part.CreateNewElement("SmallDisplacementElement3D8N", 1, list(range(1, 9)), soil)
    for along in "XYZ":
        displacement, reaction = (kratos.KratosGlobals.GetVariable(f"{name}_{along}") for name in ("DISPLACEMENT", "REACTION"))
        kratos.VariableUtils().AddDof(displacement, reaction, part)
        for node in part.Nodes:
            node.Fix(displacement)
    scheme = kratos.ResidualBasedIncrementalUpdateStaticScheme()
    builder = kratos.ResidualBasedBlockBuilderAndSolver(kratos.SkylineLUFactorizationSolver())
    strategy = kratos.ResidualBasedNewtonRaphsonStrategy(part, scheme, kratos.ResidualCriteria(1e-8, 1e-8), builder, 5, True, False, False)
    strategy.SetEchoLevel(0)
    strategy.Check()
    strategy.Initialize()
    for step in range(1, STEPS + 1):
        part.CloneTimeStep(float(step))
        for node in part.Nodes:
            shear = SHEAR * step / STEPS * node.Z0
            node.SetSolutionStepValue(kratos.DISPLACEMENT, [shear, 0, -compression * shear])
        strategy.Solve()
    return list(cube.CalculateOnIntegrationPoints(kratos.CAUCHY_STRESS_VECTOR, part.ProcessInfo)[0])


cases = {"pure shear": (0, 30), "compressed by 1e-3": (1e-3, 30), "0 degrees, by 0.3": (0.3, 0), "32 degrees, by 0.3": (0.3, 32)}
found = {name: stress(compression, float(angle)) for name, (compression, angle) in cases.items()}
print("Kratos", version("KratosConstitutiveLawsApplication"), "xx yy zz xy yz zx:")
for name, values in found.items():
    print(f"{name}:", *(f"{value + 0:.4f}" for value in values))
elastic = 1e4 / 2.6 * SHEAR
none, thirty_two = found["0 degrees, by 0.3"], found["32 degrees, by 0.3"]
right = abs(found["pure shear"][5] - elastic) < 1e-9 and abs(found["compressed by 1e-3"][5] - 7.51) < 0.01
sys.exit(not (right and none == thirty_two and thirty_two[5] < 0.5 * elastic))
PYTHON
OMP_NUM_THREADS=1 python/bin/python shear.py >log.txt 2>&1 && same=0 || same=$?
grep -m 1 "assumed equal" log.txt || same=1
sed -n '/^Kratos /,/^32 /p' log.txt
[ "$same" = 0 ] && echo "as written" || { tail -5 log.txt; echo "CHANGED"; exit 1; }
