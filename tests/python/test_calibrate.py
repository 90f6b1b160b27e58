"""Calibrations and studies in Python have the numbers of the commands, and of SciPy; of lmfit, emcee and SALib in notebooks."""

from __future__ import annotations

import importlib
import pickle
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import pilum
from conftest import missing

TRUE = dict(shear_stiffness=1e5, cohesion=5.0, friction_angle=31.0)
SLIP = np.array([0.1, 0.2, 0.3, 0.4, 0.5, 0.75, 1.0, 1.5, 2.0, 2.5, 3.0])
STRESSES = (50, 100, 200)

DRIVER = """law = "coulomb_joint"
hypothesis = "interface_2d"
parameters = { normal_stiffness = 1e6, shear_stiffness = 8e4, cohesion = 2.0, friction_angle = 25.0, dilatancy_angle = 0.0 }
segment = [{ increments = 30, control = { t = { jump = 3e-3 } } }, { increments = 2, control = { t = { jump = 2e-3 } } }]
"""

CASE = """title = "A block on an interface"
analysis = "plane_strain"
[mesh]
columns = [{ n = 1, to = 1.0 }]
rows = [{ n = 1, to = 0.5 }, { n = 1, to = 1.0 }]
lines = { bottom = { y = 0.0 }, joint = { y = 0.5 }, top = { y = 1.0 } }
region = [{ group = "blocks" }]
[laws]
block = { law = "elastic", parameters = { young_modulus = 1e7, poisson_ratio = 0.2 } }
joint = { law = "coulomb_joint", parameters = { normal_stiffness = 1e6, shear_stiffness = 5e5, cohesion = 0.0, friction_angle = 30.0, dilatancy_angle = 0.0 } }
[groups]
blocks = { formulation = "solid", integration = "full", law = "block" }
joint = { formulation = "zero_thickness", line = "joint", law = "joint" }
[[supports]]
line = "bottom"
fixed = ["x", "y"]
[[phase]]
name = "weight"
increments = 1
pressure = [{ line = "top", value = 100.0 }]
[[phase]]
name = "push"
increments = 4
displacement = [{ line = "top", x = 2e-3 }]
[probes]
tau = { group = "joint", quantity = "traction_t" }
u = { line = "top", quantity = "displacement_x" }
"""

CHAMBER = f"""base = "{(pilum.cases() / "chamber_mesh1/case.toml").as_posix()}"
[[phase]]
name = "loading"
increments = 4
"""

STUDY = """case = "chamber.toml"
method = "saltelli"
runs = 8
parameter = [
  { name = "mu_p", key = "laws.mepi.parameters.mu_p", uniform = [0.6, 0.8] },
  { name = "young_modulus", key = "laws.sand.parameters.young_modulus", uniform = [25e3, 45e3] },
]
outputs = { shaft = { probe = "q_s" } }
"""


def needed(module: str) -> Any:
    """A module of `requirements.txt`."""
    try:
        return importlib.import_module(module)
    except ImportError:
        missing(module)


def shear(stress: float) -> np.ndarray:
    """Shear stress of a Coulomb joint over slip, in closed form."""
    strength = TRUE["cohesion"] + stress * np.tan(np.radians(TRUE["friction_angle"]))
    return np.minimum(TRUE["shear_stiffness"] * 1e-3 * SLIP, strength)


def write_boxes(folder: Path, test: str = "", curve: str = "") -> Path:
    """Three shear boxes, with what each test and curve has beside."""
    random = np.random.default_rng(7)
    columns = [SLIP, *(shear(stress) + random.normal(0.0, 0.5, SLIP.size) for stress in STRESSES)]
    rows = "".join(",".join(f"{value:.4f}" for value in row) + "\n" for row in zip(*columns))
    (folder / "boxes.csv").write_text("slip,50,100,200\n" + rows)
    variants = "".join(f'[[variant]]\nname = "{s}"\ninitial.traction.n = -{s}.0\n' for s in STRESSES)
    (folder / "driver.toml").write_text(DRIVER + variants)
    tests = "".join(
        f'[[test]]\nname = "{s}"\ndriver = "driver.toml"\nvariant = "{s}"\n{test}\ncurve = [{{ x = "u_t", y = "traction_t", '
        f'segment = 1, measured = {{ file = "boxes.csv", x = "slip", y = "{s}" }}, noise = 0.5{curve} }}]\n'
        for s in STRESSES
    )
    head = 'starts = 1\nprofiles = false\nfree = { shear_stiffness = { min = 1e4, max = 1e6 }, cohesion = {}, friction_angle = {} }\n'
    (folder / "boxes.toml").write_text(head + tests)
    return folder / "boxes.toml"


@pytest.fixture(scope="module")
def boxes(tmp_path_factory: pytest.TempPathFactory) -> tuple[pilum.Calibration, pilum.CalibrationProblem]:
    folder = tmp_path_factory.mktemp("boxes")
    file = write_boxes(folder)
    calibration = pilum.calibrate(file, results=folder / "out", set={"profiles": True})
    return calibration, pilum.CalibrationProblem(file, calibration=calibration)


def test_a_calibration_is_an_object(boxes: tuple[pilum.Calibration, pilum.CalibrationProblem]) -> None:
    calibration, _ = boxes
    assert calibration.names == list(TRUE)
    deviation = (calibration.values - list(TRUE.values())) / calibration.errors
    assert np.all(np.abs(deviation) < 3.0)
    assert np.all(np.diff(calibration.intervals) > 0.0)
    assert np.allclose(np.diag(calibration.covariance), calibration.errors**2)
    assert {name: r.shape for name, r in calibration.residuals.items()} == {str(s): (11,) for s in STRESSES}
    total = sum(r @ r for r in calibration.residuals.values())
    assert total == pytest.approx(calibration.sum_of_squares, rel=1e-12)
    assert set(calibration.profiles) == set(TRUE) and set(calibration.figures) == set(calibration.summary["figures"])
    assert "<svg" in calibration._repr_html_() and calibration.report.is_file()
    frame = calibration.to_pandas()
    assert frame.loc["cohesion", "value"] == calibration.values[1]


@pytest.mark.parametrize(
    ("test", "curve"),
    [
        ("weight = 3.0", ", weight = 0.5, relative_noise = 0.02"),
        ("", ", offset_y = { min = -2.0, max = 2.0 }, offset_x = { min = -0.02, max = 0.05 }"),
    ],
)
def test_residuals_are_those_of_the_command(test: str, curve: str, here: Path) -> None:
    problem = pilum.CalibrationProblem(write_boxes(here, test, curve))
    calibration = pilum.calibrate("boxes.toml")
    assert problem.names == calibration.names
    residuals = problem.residuals(calibration.values)
    assert residuals @ residuals == pytest.approx(calibration.sum_of_squares, rel=1e-9)


def test_a_case_is_a_test(here: Path) -> None:
    (here / "case.toml").write_text(CASE)
    (here / "push.csv").write_text("u,tau\n0.0006,58.0\n0.0012,57.5\n0.002,58.1\n")
    (here / "push.toml").write_text(
        'starts = 1\nprofiles = false\nfree.phi = { parameter = "friction_angle", laws = ["joint"] }\n'
        '[[test]]\nname = "push"\ncase = "case.toml"\n'
        'curve = [{ x = "u", y = "tau", measured = { file = "push.csv", x = "u", y = "tau" } }]\n'
    )
    calibration = pilum.calibrate("push.toml")
    problem = pilum.CalibrationProblem("push.toml", calibration=calibration)
    residuals = problem.residuals(problem.best)
    assert residuals @ residuals == pytest.approx(calibration.sum_of_squares, rel=1e-9)
    # Differences with half the step of cases: the error of both falls with its square, 1e-6.
    sides = [problem.residuals(problem.best * factor) for factor in (1.0005, 0.9995)]
    differences = (sides[0] - sides[1]) / (1e-3 * problem.best[0])
    assert np.allclose(problem.jacobian(problem.best)[:, 0], differences, atol=0.0, rtol=1e-4)


def test_derivatives_and_likelihood(boxes: tuple[pilum.Calibration, pilum.CalibrationProblem]) -> None:
    calibration, problem = boxes
    jacobian = problem.jacobian(problem.best)
    # Closed form: a sliding box follows cohesion and friction, a sticking one the stiffness.
    cohesion, friction = problem.best[1], np.radians(problem.best[2])
    expected = np.zeros_like(jacobian)
    for box, stress in enumerate(STRESSES):
        strength = cohesion + stress * np.tan(friction)
        sticks = problem.best[0] * 1e-3 * SLIP < strength
        rows = slice(11 * box, 11 * (box + 1))
        slope = stress / np.cos(friction) ** 2 * np.pi / 180.0
        expected[rows] = np.where(sticks[:, None], [[1.0, 0.0, 0.0]], [[0.0, 1.0, slope]]) / 0.5
        expected[rows, 0] *= 1e-3 * SLIP
    scale = np.abs(expected).max(axis=0)
    assert np.allclose(jacobian / scale, expected / scale, atol=1e-6)
    covariance = np.linalg.inv(jacobian.T @ jacobian) * problem.scatter**2
    assert np.allclose(covariance, calibration.covariance, rtol=1e-5)
    away = problem.best * [1.01, 1.0, 1.0]
    residuals = [problem.residuals(theta) for theta in (problem.best, away)]
    fall = (residuals[1] @ residuals[1] - residuals[0] @ residuals[0]) / (2.0 * problem.scatter**2)
    assert problem.log_likelihood(problem.best) - problem.log_likelihood(away) == pytest.approx(fall, rel=1e-9)
    assert problem.log_likelihood(-problem.best) == -np.inf
    with pytest.raises(pilum.InputError, match="shape"):
        problem.log_likelihood([1.0])
    with pytest.raises(pilum.InputError, match="no array of 3 numbers"):
        problem.residuals({"cohesion": 5.0})  # type: ignore[arg-type]
    with pytest.raises(pilum.InputError, match="`scatter` is 0.0, expected above 0"):
        problem.log_likelihood(problem.best, 0.0)
    for function in (problem.residuals, problem.jacobian):
        with pytest.raises(pilum.InputError, match="`shear_stiffness` is -1, outside .10000, 1000000.") as caught:
            function([-1.0, 5.0, 31.0])
        assert caught.value.key == "shear_stiffness" and "in:" not in str(caught.value)
        with pytest.raises(pilum.InputError, match="`cohesion` is NaN"):
            function([1e5, np.nan, 31.0])


def test_rates_of_the_law_are_differences_that_need_no_step(
    boxes: tuple[pilum.Calibration, pilum.CalibrationProblem],
) -> None:
    _, problem = boxes
    # Away from a place where a box begins to slide at a measured point.
    theta = np.array([0.93e5, 5.3, 30.3])
    jacobian = problem.jacobian(theta)
    for place, value in enumerate(theta):
        # Central differences of a computed curve, which is not linear: their error falls with the square of the step.
        errors = []
        for step in (1e-3, 1e-4):
            sides = [theta.copy(), theta.copy()]
            sides[0][place] += step * value
            sides[1][place] -= step * value
            change = problem.residuals(sides[0]) - problem.residuals(sides[1])
            errors.append(np.abs(change / (2.0 * step * value) - jacobian[:, place]).max())
        assert errors[1] < 1e-6 * np.abs(jacobian[:, place]).max()
        assert errors[1] < 0.02 * errors[0] + 1e-8 * np.abs(jacobian[:, place]).max()  # the driver's tolerance


def test_scipy_finds_what_the_command_finds(boxes: tuple[pilum.Calibration, pilum.CalibrationProblem]) -> None:
    optimize = needed("scipy.optimize")
    calibration, problem = boxes
    problem = pickle.loads(pickle.dumps(problem))  # as for processes of a pool
    found = optimize.least_squares(
        problem.residuals, problem.start, problem.jacobian, bounds=problem.bounds.T, x_scale="jac"
    )
    assert np.allclose(found.x, calibration.values, atol=0.0, rtol=1e-4)
    assert 2.0 * found.cost == pytest.approx(calibration.sum_of_squares, rel=1e-6)


def test_names_belong_to_their_laws(here: Path) -> None:
    """A driver and a case share a name; one of drivers alone goes first, and a fixed one counts."""
    write_boxes(here)
    (here / "case.toml").write_text(CASE)
    (here / "push.csv").write_text("u,tau\n0.0006,58.0\n0.0012,57.5\n0.002,58.1\n")
    shared = '{ parameter = "friction_angle", laws = ["joint"] }'
    box = 'driver = "driver.toml"\ncurve = [{ x = "u_t", y = "traction_t", segment = 1, measured = { file = "boxes.csv", x = "slip", y = '
    (here / "both.toml").write_text(
        f'starts = 1\nprofiles = false\nfree = {{ shear_stiffness = {{}}, phi = {shared} }}\nfixed.cohesion = {{ value = 5.0 }}\n'
        f'[[test]]\nname = "100"\nvariant = "100"\nstands_for = "joint"\n{box}"100" }} }}]\n'
        '[[test]]\nname = "push"\ncase = "case.toml"\n'
        'curve = [{ x = "u", y = "tau", measured = { file = "push.csv", x = "u", y = "tau" } }]\n'
        '[[stage]]\nname = "stiffness"\nfree = ["shear_stiffness"]\ntests = ["100"]\n'
        '[[stage]]\nname = "all"\nfree = ["shear_stiffness", "phi"]\n'
    )
    calibration = pilum.calibrate("both.toml")
    problem = pilum.CalibrationProblem("both.toml", calibration=calibration)
    residuals = problem.residuals(problem.best)
    assert residuals @ residuals == pytest.approx(calibration.sum_of_squares, rel=1e-9)
    jacobian = problem.jacobian(problem.best)
    assert np.all(jacobian[11:, 0] == 0.0) and np.any(jacobian[:11, 1] != 0.0) and np.any(jacobian[11:, 1] != 0.0)


def test_a_wrong_calibration_names_its_place(here: Path) -> None:
    file = write_boxes(here)
    file.write_text(file.read_text().replace("starts = 1", "starts = 0"))
    with pytest.raises(pilum.InputError, match="expected 1 to 1000") as caught:
        pilum.calibrate(file)
    assert (caught.value.file, caught.value.line, caught.value.key) == (str(file), 1, "starts")
    assert pickle.loads(pickle.dumps(caught.value)).line == 1
    with pytest.raises(pilum.InputError, match="calibration.json"):
        pilum.Calibration(here)


@pytest.fixture(scope="module")
def saltelli(tmp_path_factory: pytest.TempPathFactory) -> pilum.Study:
    folder = tmp_path_factory.mktemp("study")
    (folder / "chamber.toml").write_text(CHAMBER)
    (folder / "study.toml").write_text(STUDY)
    return pilum.study(folder / "study.toml", results=folder / "out")
    with pytest.raises(pilum.InputError, match="expected 1 to 1000") as caught:
        pilum.calibrate(file, set={"starts": 2000})
    assert (caught.value.file, caught.value.key) == (None, "starts") and "--set" not in str(caught.value)


def test_a_study_is_an_object(saltelli: pilum.Study) -> None:
    assert (saltelli.parameters, saltelli.outputs) == (["mu_p", "young_modulus"], ["shaft"])
    assert saltelli.sample.shape == (32, 2) and set(saltelli.runs["state"]) == {"done"}
    keys = [parameter["keys"][0] for parameter in saltelli.summary["parameters"]]
    case = saltelli.folder.parent / "chamber.toml"
    alone = pilum.run(case, set=dict(zip(keys, saltelli.sample[4].tolist())), results=saltelli.folder.parent / "alone")
    assert alone.history["q_s"][-1] == saltelli.runs["shaft"][4]
    frame = saltelli.to_pandas()
    assert list(frame.columns) == ["folder", "mu_p", "young_modulus", "shaft", "state", "reason"] and frame.index[0] == 1
    assert saltelli.curves["run"].tolist() == list(np.repeat(np.arange(1, 33), len(saltelli.results(1).history)))
    arrow = needed("pyarrow").table(saltelli.curves)
    assert arrow.num_rows == len(saltelli.curves) and "q_s" in arrow.column_names
    assert "<table>" in saltelli._repr_html_()
    assert pilum.table(saltelli.folder)["shaft"].tolist() == saltelli.runs["shaft"].tolist()


def test_a_wrong_sample_is_refused(here: Path) -> None:
    (here / "chamber.toml").write_text(CHAMBER)
    (here / "study.toml").write_text(STUDY)
    with pytest.raises(pilum.InputError, match=r"shape \(2, 3\)"):
        pilum.study("study.toml", sample=np.zeros((2, 3)))
    with pytest.raises(pilum.InputError, match="no `young_modulus`"):
        pilum.study("study.toml", sample={"mu_p": [0.7]})
    with pytest.raises(pilum.InputError) as caught:
        pilum.study({"case": "chamber.toml", "method": "lst"})
    assert (caught.value.file, caught.value.key) == (None, "method")


def test_whole_numbers_of_a_sample_are_the_nearest(here: Path) -> None:
    (here / "chamber.toml").write_text(CHAMBER)
    whole = {"name": "increments", "key": "phase.loading.increments", "whole": True}
    asked = {"case": "chamber.toml", "parameter": [whole], "outputs": {"shaft": {"probe": "q_s"}}}
    study = pilum.study(asked, sample=[[2.2], [2.8]])
    assert study.runs["increments"].tolist() == [2, 3]
    assert [len(study.curves.where(run=run, phase="loading")) for run in (1, 2)] == [2, 3]
    for wrong in ("many", np.nan):
        with pytest.raises(pilum.InputError, match="the sample of `increments`"):
            pilum.study(asked, sample=[[wrong]], results="wrong")


def test_checks_and_reports(saltelli: pilum.Study) -> None:
    checked = pilum.check("elastic", only=["library-opens"])
    assert checked.passed and checked.counts["passed"] >= 1 and "library-opens" in checked._repr_html_()
    with pytest.raises(pilum.Error):
        pilum.check("no_such_law")
    page = pilum.report(saltelli.folder / "00001", print=True)
    assert page == saltelli.folder / "00001/report.html" and "<html" in page.read_text()
