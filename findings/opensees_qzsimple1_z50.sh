#!/usr/bin/env bash
# OpenSees 3.7.1 (openseespy 3.7.1.2, PyPI): a spring of the toe of a pile, QzSimple1, q_ult = 100, z_50 = 0.01, is pressed to z_50.
# A good guess: it carries half of q_ult, as its documentation defines z_50 for monotonic loading.
# Seen: 45.5 (clay, type 1) and 47.4 (sand, type 2). The steps do not matter.
# Source: the command manual of OpenSees, QzSimple1 Material; SRC/material/uniaxial/PY/QzSimple1.cpp.
set -euo pipefail
place=$(mktemp -d) && trap 'rm -rf "$place"' EXIT && cd "$place"
python3 -m venv python && python/bin/pip -q --disable-pip-version-check install openseespy==3.7.1.2
cat >press.py <<'PYTHON'
import sys

import openseespy.opensees as ops

Q_ULT, Z_50 = 100.0, 0.01


def force(kind, steps):
    ops.wipe()
    ops.model("basic", "-ndm", 1, "-ndf", 1)
    ops.node(1, 0.0)
    ops.node(2, 0.0)
    ops.fix(1, 1)
    ops.uniaxialMaterial("QzSimple1", 1, kind, Q_ULT, Z_50, 0.0, 0.0)
    ops.element("zeroLength", 1, 1, 2, "-mat", 1, "-dir", 1)
    ops.timeSeries("Linear", 1)
    ops.pattern("Plain", 1, 1)
    ops.load(2, -1.0)
    ops.constraints("Plain")
    ops.numberer("Plain")
    ops.system("BandGeneral")
    ops.test("NormUnbalance", 1e-9, 100)
    ops.algorithm("Newton")
    ops.integrator("DisplacementControl", 2, 1, -Z_50 / steps)
    ops.analysis("Static")
    if ops.analyze(steps) != 0 or abs(ops.nodeDisp(2, 1) + Z_50) > 1e-12:
        sys.exit("not at z_50")
    ops.reactions()
    return ops.nodeReaction(1, 1)


print(f"OpenSees {ops.version()}")
found = {(kind, steps): force(kind, steps) for kind in (1, 2) for steps in (100, 1000)}
for (kind, steps), value in found.items():
    print(f"type {kind}, {steps} steps: {value:.4f} of {Q_ULT:g}")
sys.exit(any(abs(value - {1: 45.5, 2: 47.4}[kind]) > 0.1 for (kind, _), value in found.items()))
PYTHON
python/bin/python press.py && echo "as written" || { echo "CHANGED"; exit 1; }
