"""Pilum: finite elements for soil-structure interfaces, whose constitutive laws are plugins.

`Law` calls a law for arrays of points, `point` leads one along a path, `run` runs a case, `Problem` and
`Simulation` go through one step by step. Units are kN, m, kPa, angles in degrees; tension and opening are
positive, shear strains are γ = 2ε. Nothing but NumPy is needed.
"""

from __future__ import annotations

import os

from . import _pilum
from ._calibrate import Calibration, calibrate
from ._errors import (
    Error,
    InputError,
    InternalError,
    LawError,
    NoEquilibriumError,
    PilumWarning,
)
from ._fields import Field, Fields
from ._fit_problem import CalibrationProblem
from ._mesh import Mesh
from ._pilum import Law, Simulation, SimulationState, State, describe, laws
from ._results import Results
from ._run import Problem, Progress, Step, point, run
from ._study import Study, study
from ._table import Table
from ._tools import Check, check, report, table
from ._where import _ready, cases, include, program

__version__: str = _pilum.__version__

__all__ = [
    "Calibration",
    "CalibrationProblem",
    "Check",
    "Error",
    "Field",
    "Fields",
    "InputError",
    "InternalError",
    "Law",
    "LawError",
    "Mesh",
    "NoEquilibriumError",
    "PilumWarning",
    "Problem",
    "Progress",
    "Results",
    "Simulation",
    "SimulationState",
    "State",
    "Step",
    "Study",
    "Table",
    "calibrate",
    "cases",
    "check",
    "describe",
    "include",
    "laws",
    "point",
    "program",
    "report",
    "run",
    "study",
    "table",
]

_ready()
_pilum.stands_for(program())
if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_pilum.goes_on_as_copy)
