# pyright: strict
"""Right uses. It is read by mypy and pyright, which have nothing to say, and never executed."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Literal, cast

import numpy as np
from numpy.typing import NDArray
from typing_extensions import assert_type

import pilum

Numbers = NDArray[np.float64]
Operator = Literal["consistent", "elastic"]


def laws(law: pilum.Law, jumps: Numbers, chosen: Operator | None) -> None:
    start = law.initial(3, flux=[-100.0, 0.0])
    flux, tangents, end = law.integrate(jumps, start)
    assert_type(flux, Numbers)
    assert_type(tangents, Numbers)
    assert_type(end, pilum.State)
    assert_type(end["plastic_slip"], Numbers)
    assert_type(law.integrate(jumps, start, tangent="elastic")[1], Numbers)
    assert_type(law.integrate(jumps, start, tangent=None), tuple[Numbers, None, pilum.State])
    assert_type(law.integrate(jumps, start, tangent=chosen)[1], Numbers | None)
    assert_type(law.integrate([[0.0, 1e-3]], out=start, dt=0.5, copy=False)[1].shape, tuple[Any, ...])


def runs(case: Mapping[str, Any]) -> None:
    results = pilum.run(case, set={"phase.push.increments": 80}, watch=lambda progress: print(progress.cut_backs))
    assert_type(results, pilum.Results | Any)
    print(results.history["w"], results.profile.where(phase="push"), results.fields[-1]["stress_22"])
    assert_type(pilum.run(case, variant="soft"), pilum.Results)
    assert_type(pilum.run(case, variant="soft").history, pilum.Table)
    assert_type(pilum.run(pilum.Problem(case)), pilum.Results | Any)
    both = cast("dict[str, pilum.Results]", pilum.run("case.toml"))
    print(both["soft"].status)
    assert_type(pilum.point("shear.toml", variant="50_kPa"), pilum.Table)
    print(pilum.point("shear.toml")["traction_t"])


def steps(simulation: pilum.Simulation) -> None:
    done = simulation.step()
    assert_type(done, pilum.Step | None)
    if done is not None:
        assert_type(done["phase"], str)
        assert_type(done["time"], float)
        assert_type(done["iterations"], int)
        assert_type(done["unreliable"], str | None)
    for one in simulation:
        assert_type(one, pilum.Step)
        assert_type(one["increment"] / one["of"], float)


def fits() -> None:
    found = pilum.calibrate("box.toml", set={"starts": 2})
    assert_type(found, pilum.Calibration)
    problem = pilum.CalibrationProblem("box.toml", calibration=found)
    print(problem.residuals([1.0, 2.0]) @ problem.jacobian(problem.best))
    assert_type(problem.log_likelihood(problem.start), float)
    assert_type(pilum.study("study.toml", sample=[[1.0, 2.0]]).curves, pilum.Table)
    assert_type(pilum.check("mepi").passed, bool)
    assert_type(pilum.table(["a", "b"]), pilum.Table)
    print(pilum.report("a", print=True).name)


def errors() -> None:
    try:
        pilum.run("case.toml")
    except (pilum.NoEquilibriumError, ValueError) as error:
        print(error)
    except pilum.Error as error:
        assert_type(error.increment, int | None)
