"""Wrong uses. mypy and pyright find each line that ends in `wrong`, and no other."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

import pilum


def laws(law: pilum.Law, state: pilum.State, jumps: NDArray[np.float64], name: str) -> None:
    print(law.integrate(jumps, tangent=None)[1].shape)  # wrong
    print(law.integrate(jumps, tangent=None)[1][0])  # wrong
    law.integrate(jumps, tangent="secant")  # wrong
    law.integrate(jumps, tangent=name)  # wrong
    law.integrate(jumps, state, None)  # wrong
    law.integrate(jumps, jumps)  # wrong
    law.integrate(jumps, dt="1")  # wrong
    law.integrate(jumps, tangents=None)  # wrong
    first, second = law.integrate(jumps)  # wrong
    print(law.integrate(jumps)[0].stress)  # wrong
    pilum.Law("elastic", hypothesis="2d")  # wrong


def runs(problem: pilum.Problem, results: str) -> None:
    print(pilum.run("case.toml").histroy)  # wrong
    print(problem.run().histroy)  # wrong
    print(pilum.run("case.toml", variant="soft")["soft"])  # wrong
    pilum.run("case.toml", variant="soft").history.where("push")  # wrong
    pilum.run(problem, variant="soft")  # wrong
    pilum.run("case.toml", results)  # wrong
    pilum.run("case.toml", resume="yes")  # wrong
    pilum.run("case.toml", watch=lambda progress: progress.iteration)  # wrong
    pilum.run(3)  # wrong
    number: int = pilum.run("case.toml")  # wrong
    number = pilum.point("shear.toml", variant="50_kPa")  # wrong


def steps(simulation: pilum.Simulation) -> None:
    print(simulation.step()["phase"])  # wrong
    for one in simulation:
        print(one["phases"])  # wrong
        print(one.phase)  # wrong
        one["unreliable"].upper()  # wrong
        name: str = one["increment"]  # wrong
        anything: Any = one["time"] + one["phase"]  # wrong
    simulation.step(2)  # wrong
