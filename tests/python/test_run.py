"""Runs of cases: against the command, and as the tools of notebooks take them."""

from __future__ import annotations

import csv
import os
import shutil
import signal
import subprocess
import sys
import sysconfig
import threading
import time
from pathlib import Path

import numpy as np
import pytest

import pilum
from conftest import ROOT, TABLE_4, compiled, missing

CHAMBER = pilum.cases() / "chamber_mesh1"
SHORT = {"phase.loading.increments": 10}
SOIL = dict(law="elastic", parameters=dict(young_modulus=1e4, poisson_ratio=0.3))

# Soil that flows in time.
SLOW = dict(
    law="mohr_coulomb",
    parameters=dict(
        young_modulus=1e4, poisson_ratio=0.3, cohesion=50.0, friction_angle=30.0, dilatancy_angle=0.0, relaxation_time=1.0
    ),
)

# A column of soil on its base, loaded from above.
COLUMN = dict(
    analysis="plane_strain",
    mesh=dict(
        columns=[dict(n=1, to=1.0)],
        rows=[dict(n=2, to=2.0)],
        lines=dict(base=dict(y=0.0), top=dict(y=2.0), sides=dict(x=0.0), other=dict(x=1.0)),
        region=[dict(group="soil")],
    ),
    laws=dict(soil=SOIL),
    groups=dict(soil=dict(formulation="solid", law="soil")),
    supports=[
        dict(line="base", fixed=["x", "y"]),
        dict(line="sides", fixed=["x"]),
        dict(line="other", fixed=["x"]),
    ],
    phase=[dict(name="load", increments=4, pressure=[dict(line="top", value=100.0)])],
    probes=dict(w=dict(line="top", quantity="displacement_y", scale=-1.0)),
)


def command() -> str:
    """The command that came with the package."""
    return str(Path(sysconfig.get_path("scripts")) / "pilum")


def test_the_command_is_there_and_comes_to_the_same_bits(chamber: pilum.Results, here: Path) -> None:
    version = subprocess.run([command(), "--version"], capture_output=True, text=True, check=True)
    assert version.stdout.split() == ["pilum", pilum.__version__]
    arguments = ["run", str(CHAMBER), "--set", "phase.loading.increments=10", "--out", "theirs"]
    subprocess.run([command(), *arguments], check=True, capture_output=True)
    for table in ("history.csv", "profile.csv"):
        theirs = (here / "theirs" / table).read_text()
        assert (chamber.folder / table).read_text() == theirs
    as_module = subprocess.run([sys.executable, "-m", "pilum", "laws"], capture_output=True, text=True)
    assert "mepi" in as_module.stdout


def test_tables_are_arrays(chamber: pilum.Results) -> None:
    with open(chamber.folder / "history.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    history = chamber.history
    assert list(history) == list(rows[0]) and len(history) == len(rows) == 16
    assert history["tau_shaft"].tolist() == [float(row["tau_shaft"]) for row in rows]
    assert history["increment"].dtype == np.int64 and history["phase"][-1] == "loading"
    last = chamber.profile.where(phase="loading", increment=10)
    assert 0 < len(last) < len(chamber.profile)
    # Friction is below its peak of 0.7 everywhere.
    assert np.all(np.abs(last["traction_t"]) <= 0.7 * np.abs(last["traction_n"]) * (1 + 1e-9))
    assert chamber.status == "done" and chamber.warnings == chamber.summary["warnings"]
    with pytest.raises(KeyError, match="there is no column `tau`: phase, increment"):
        history["tau"]
    with pytest.raises(pilum.InputError, match="no `pile.csv`") as caught:
        chamber.pile
    assert "[pile]" in str(caught.value.hint)
    with pytest.raises(pilum.InputError, match="not the folder of a run"):
        pilum.Results(chamber.folder.parent)


def test_fields_are_arrays(chamber: pilum.Results) -> None:
    fields = chamber.fields
    assert len(fields) == 3 and fields.times.tolist() == sorted(fields.times)
    last = fields[-1]
    assert last["displacement"].shape == last.nodes.shape
    head = last.nodes[:, 1] == last.nodes[:, 1].max()
    pile = head & (last.nodes[:, 0] <= 0.010)
    np.testing.assert_allclose(last["displacement"][pile, 1], -0.005, rtol=1e-12)
    assert last["stress_22"].shape == (len(last.cells),) == fields["stress_22"].shape
    assert {len(cell) for cell in last.cells} == {8}
    table = last.table
    assert len(table) == len(last.cells) and table["y"].min() > -0.03
    with pytest.raises(KeyError, match="there is no field"):
        last["stress"]


def test_pandas_and_polars_take_tables(chamber: pilum.Results) -> None:
    pandas, polars = pytest.importorskip("pandas"), pytest.importorskip("polars")
    frame = pandas.DataFrame(dict(chamber.history))
    assert frame["q_t"].tolist() == chamber.history["q_t"].tolist()
    arrow = polars.DataFrame(chamber.history)
    assert arrow.columns == chamber.history.names and len(arrow) == 16
    for name in arrow.columns:
        assert arrow[name].to_list() == chamber.history[name].tolist()
    assert arrow.schema["phase"] == polars.String and arrow.schema["increment"] == polars.Int64
    # Nobody has to take a stream that was asked for.
    for _ in range(100):
        chamber.profile.__arrow_c_stream__()
    read = pandas.DataFrame.from_arrow(chamber.history) if hasattr(pandas.DataFrame, "from_arrow") else frame
    assert read["tau_shaft"].tolist() == chamber.history["tau_shaft"].tolist()


@pytest.fixture(scope="module")
def named(tmp_path_factory: pytest.TempPathFactory) -> pilum.Results:
    """Phases and a group with names that others take for missing values or numbers; a law absent for 100 rows."""
    joint = pilum.Law(
        "coulomb_joint", normal_stiffness=1e6, shear_stiffness=1e6, cohesion=0.0, friction_angle=30.0, dilatancy_angle=0.0
    )
    case = {
        **COLUMN,
        "mesh": {**COLUMN["mesh"], "lines": {**COLUMN["mesh"]["lines"], "joint": dict(y=1.0)}},
        "laws": dict(soil=SOIL, joint=joint, mepi=pilum.Law("mepi", **TABLE_4)),
        "groups": {**COLUMN["groups"], "1": dict(formulation="zero_thickness", line="joint", law="joint")},
        "supports": [dict(line="base", fixed=["x", "y"]), dict(line="top", fixed=["x"])],
        "phase": [
            dict(name="null", increments=50, pressure=[dict(line="top", value=100.0)]),
            dict(name="NA", increments=2, laws={"1": "mepi"}),
            dict(name="None", increments=1),
            dict(name="1", increments=1),
        ],
        "output": dict(profile="increments"),
    }
    folder = tmp_path_factory.mktemp("named") / "results/pile"
    return pilum.run(case, results=folder)


def test_names_are_texts_and_empty_cells_are_missing(named: pilum.Results) -> None:
    pandas, polars, pyarrow = (pytest.importorskip(tool) for tool in ("pandas", "polars", "pyarrow"))
    profile = named.profile
    expected = [("null", 50), ("NA", 2), ("None", 1), ("1", 1)]
    rows = len(profile) // 54
    phases = [name for name, increments in expected for _ in range(increments * rows)]
    law = next(name for name, values in profile.items() if values.dtype.kind == "f" and np.isnan(values[:100]).all())
    assert profile["phase"].tolist() == phases and set(profile["group"]) == {"1"}
    assert np.isnan(profile[law]).sum() == 50 * rows > 100
    assert named.history["phase"].tolist() == [name for name, increments in expected for _ in range(increments)]
    assert len(profile.where(phase="1", group="1")) == rows
    for frame in (pandas.DataFrame(profile), polars.DataFrame(profile), polars.DataFrame(pyarrow.table(profile))):
        assert frame["phase"].to_list() == phases and set(frame["group"].to_list()) == {"1"}
        np.testing.assert_array_equal(frame[law].to_numpy(), profile[law])


@pytest.mark.parametrize("tool", ["pandas", "polars"])
def test_the_page_says_what_to_pass(tool: str, named: pilum.Results, monkeypatch: pytest.MonkeyPatch) -> None:
    """The blocks of the page, in a folder with those results. Without their options both read something else."""
    module = pytest.importorskip(tool)
    page = (ROOT / "host/docs/how-to/read-results.md").read_text()
    block = page.split(f"# with_{tool}.py\n")[1].split("```")[0]
    monkeypatch.chdir(named.folder.parents[1])
    space: dict = {}
    exec(block, space)
    read, profile = space["profile"], named.profile
    assert list(read.columns) == profile.names
    for name, values in profile.items():
        if values.dtype.kind == "U":
            assert read[name].to_list() == values.tolist()
        else:
            np.testing.assert_array_equal(read[name].to_numpy(), values)
    careless = module.read_csv("results/pile/profile.csv")
    assert any(careless[name].dtype != read[name].dtype for name in profile)


def test_a_table_that_is_not_aligned_goes_to_others() -> None:
    pyarrow = pytest.importorskip("pyarrow")
    numbers = np.zeros(25, dtype=np.uint8)[1:].view(np.float64)
    numbers[:] = [1.0, 2.0, 3.0]
    assert not numbers.flags.aligned
    assert pyarrow.table(pilum.Table({"a": numbers}))["a"].to_pylist() == [1.0, 2.0, 3.0]


def test_notebooks_show_the_report(chamber: pilum.Results, tmp_path: Path) -> None:
    page = chamber._repr_html_()
    assert page.startswith("<iframe srcdoc=") and "&lt;!doctype html" in page.lower()
    assert chamber.report.is_file()
    assert chamber.history._repr_html_().count("<tr>") == 17
    assert "done" in repr(chamber) and "16 rows" in repr(chamber.history)


def test_a_figure_in_three_lines(chamber: pilum.Results, here: Path) -> None:
    matplotlib = pytest.importorskip("matplotlib")
    matplotlib.use("agg")
    import matplotlib.pyplot as plt

    push = chamber.history.where(phase="loading")
    plt.plot(push["w_t"], push["tau_shaft"])
    plt.savefig("friction.png")
    assert (here / "friction.png").stat().st_size > 5000


def test_pyvista_opens_fields(chamber: pilum.Results) -> None:
    try:
        import pyvista
    except ImportError:
        missing("pyvista")
    field = chamber.fields[-1]
    grid = field.to_pyvista()
    assert grid.n_cells == len(field.cells) and grid.n_points == len(field.nodes)
    assert np.array_equal(grid.cell_data["stress_22"], field["stress_22"])
    assert np.array_equal(grid.point_data["displacement"][:, :2], field["displacement"])
    reader = pyvista.get_reader(chamber.fields.path)
    assert list(reader.time_values) == chamber.fields.times.tolist()


def test_a_case_is_a_dictionary(here: Path) -> None:
    """Uniaxial compression: w = q h (1 + ν)(1 − 2ν)/(E (1 − ν))."""
    results = pilum.run(COLUMN, results="column")
    expected = 100.0 * 2.0 * 1.3 * 0.4 / (1e4 * 0.7)
    np.testing.assert_allclose(results.history["w"][-1], expected, rtol=1e-9)
    law = pilum.Law("elastic", hypothesis="plane_strain", young_modulus=1e4, poisson_ratio=0.3)
    same = pilum.run(pilum.Problem({**COLUMN, "laws": {"soil": law}}, name="column2"))
    assert same.folder == Path("results/column2")
    assert same.history["w"].tolist() == results.history["w"].tolist()
    stiffer = pilum.run(COLUMN, set={"laws.soil.parameters.young_modulus": 2e4}, results="stiffer")
    np.testing.assert_allclose(stiffer.history["w"], results.history["w"] / 2, rtol=1e-9)


def test_variants_are_a_dictionary(here: Path) -> None:
    stiff = dict(name="stiff", laws=dict(soil=dict(parameters=dict(young_modulus=2e4))))
    case = {**COLUMN, "variant": [dict(name="soft"), stiff]}
    runs = pilum.run(case, results="both")
    assert list(runs) == ["soft", "stiff"]
    np.testing.assert_allclose(runs["soft"].history["w"], 2 * runs["stiff"].history["w"], rtol=1e-9)
    assert (here / "both/report.html").is_file()
    one = pilum.run(case, variant="stiff", results="one")
    assert one.history["w"].tolist() == runs["stiff"].history["w"].tolist()
    with pytest.raises(pilum.InputError, match="no variant `hard`"):
        pilum.run(case, variant="hard", results="none")


def test_drivers_have_variants_too(here: Path) -> None:
    tables = pilum.point(pilum.cases() / "shear_box/fontainebleau.toml")
    assert list(tables) == ["50_kPa", "100_kPa", "200_kPa"]
    # The peak friction of Table I is approached.
    ratio = -tables["100_kPa"]["traction_t"][-1] / tables["100_kPa"]["traction_n"][-1]
    assert 0.7 < ratio < 0.78
    one = pilum.point(pilum.cases() / "shear_box/fontainebleau.toml", variant="50_kPa")
    assert one["traction_t"].tolist() == tables["50_kPa"]["traction_t"].tolist()


def test_who_watches_is_told(here: Path) -> None:
    seen: list[pilum.Progress] = []
    main = threading.get_ident()

    def watch(progress: pilum.Progress) -> None:
        assert threading.get_ident() == main
        seen.append(progress)

    pilum.run(COLUMN, results="watched", watch=watch)
    assert [p.increment for p in seen] == [1, 2, 3, 4]
    assert seen[0].phase == "load" and seen[0].of == 4 and seen[0].iterations >= 0


def test_who_watches_may_stop_and_go_on(here: Path) -> None:
    class Enough(Exception):
        pass

    def watch(progress: pilum.Progress) -> None:
        if progress.increment == 2:
            raise Enough

    with pytest.raises(Enough):
        pilum.run(COLUMN, results="stopped", watch=watch, checkpoints=0.0)
    stopped = pilum.Results("stopped")
    assert stopped.status == "interrupted" and len(stopped.history) == 2
    seen = []
    whole = pilum.run(COLUMN, results="stopped", resume=True, watch=lambda p: seen.append(p.increment))
    assert seen == [3, 4]
    assert whole.history["w"].tolist() == pilum.run(COLUMN, results="straight").history["w"].tolist()


def test_ctrl_c_stops_a_run(here: Path) -> None:
    def interrupt() -> None:
        time.sleep(0.5)
        os.kill(os.getpid(), signal.SIGINT)

    threading.Thread(target=interrupt).start()
    begin = time.monotonic()
    with pytest.raises(KeyboardInterrupt):
        pilum.run(CHAMBER, set={"phase.loading.increments": 100_000}, results="long")
    # The increment under way and a second of grace, on a machine that has other work.
    assert time.monotonic() - begin < 20.0
    assert pilum.Results("long").status == "interrupted"


def test_mistakes_in_files_have_their_place(here: Path) -> None:
    shutil.copytree(CHAMBER, here / "case")
    text = (here / "case/case.toml").read_text().replace("young_modulus = 34e3", "youngs_modulus = 34e3")
    (here / "case/case.toml").write_text(text)
    with pytest.raises(pilum.InputError) as caught:
        pilum.run(here / "case", results="none")
    error = caught.value
    line = next(i for i, row in enumerate(text.splitlines(), 1) if "youngs_modulus" in row)
    assert (error.file, error.line) == (str(here / "case/case.toml"), line)
    assert "young_modulus" in str(error.hint) and f"case.toml:{line}:" in str(error)
    with pytest.raises(pilum.InputError, match="cannot read") as unreadable:
        pilum.run("nowhere.toml")
    assert "No such file" in str(unreadable.value)


@pytest.mark.parametrize(
    ("change", "says"),
    [
        (dict(groups=dict(soil=dict(formulation="solid", law="sand"))), "there is no law `sand`|sand"),
        (dict(phase=[dict(name="load", increments=0)]), "increments"),
        (dict(supports=[dict(line="bottom", fixed=["x"])]), "there is no line `bottom`"),
        (dict(solver=dict(metod="auto")), "unknown"),
    ],
)
def test_mistakes_in_dictionaries_show_what_was_written(here: Path, change: dict, says: str) -> None:
    with pytest.raises(pilum.InputError, match=says) as caught:
        pilum.run({**COLUMN, **change}, results="none")
    assert caught.value.file is None and caught.value.text
    key = caught.value.key
    assert key is not None and f"\n  in: {key}\n" in str(caught.value)
    assert not (here / "none").exists()


def test_mistakes_in_settings_have_their_key(here: Path) -> None:
    for case in (COLUMN, CHAMBER):
        phase = "load" if case is COLUMN else "loading"
        with pytest.raises(pilum.InputError, match="unknown key `incremens`") as caught:
            pilum.run(case, set={f"phase.{phase}.incremens": 3}, results="none")
        error = caught.value
        assert (error.file, error.line, error.key) == (None, None, f"phase.{phase}.incremens")
        assert "--set" not in str(error)
    broken = {**COLUMN, "phase": [{**COLUMN["phase"][0], "pressure": [dict(line="top", valeu=1.0)]}]}
    with pytest.raises(pilum.InputError) as caught:
        pilum.run(broken, results="none")
    assert caught.value.key == "phase.load.pressure.1.valeu"


def test_warnings_name_keys_of_what_nobody_wrote_as_a_file(here: Path) -> None:
    """A law that depends on time in a phase without one."""
    slow = {**COLUMN, "laws": {"soil": SLOW}}
    with pytest.warns(pilum.PilumWarning) as caught:
        pilum.run(slow)
    messages = [str(warning.message) for warning in caught]
    assert any(message.startswith("`phase.load.name`: ") for message in messages), messages


def test_warnings_point_at_the_line_of_the_caller(here: Path) -> None:
    """However deep in the package they come up."""
    stiff = dict(law="elastic", parameters=dict(young_modulus=1e20, poisson_ratio=0.3))
    case, slow = {**COLUMN, "laws": {"soil": stiff}}, {**COLUMN, "laws": {"soil": SLOW}}
    problem, simulation = pilum.Problem(case), pilum.Problem(slow).start()
    driver = {
        **stiff,
        "hypothesis": "plane_strain",
        "segment": [{"increments": 1, "control": {"22": {"strain": -1e-3}}}],
    }
    for call in (
        lambda: pilum.run(case),
        lambda: problem.run(),
        lambda: problem.start(),
        lambda: simulation.step(),
        lambda: pilum.point(driver),
    ):
        with pytest.warns(pilum.PilumWarning) as caught:
            call()
        assert {(one.filename, one.lineno) for one in caught} == {(__file__, call.__code__.co_firstlineno)}


def test_values_of_no_file_are_refused() -> None:
    with pytest.raises(TypeError, match="analysis: a file has no values of the type `object`"):
        pilum.run({**COLUMN, "analysis": object()})
    with pytest.raises(pilum.InputError, match="said to the Problem"):
        pilum.run(pilum.Problem(COLUMN), variant="a")


def test_checkpoints_are_some_time_after_one_another(here: Path) -> None:
    for wrong in (-1.0, float("nan")):
        with pytest.raises(pilum.InputError, match="checkpoints: expected the seconds between them, or None"):
            pilum.run(COLUMN, checkpoints=wrong)
    assert pilum.run(COLUMN, checkpoints=None).status == "done"


def test_results_travel_between_processes(here: Path) -> None:
    import pickle

    results = pilum.run(COLUMN, set={"output.fields": "phases"})
    early = pickle.loads(pickle.dumps(results))
    history = results.history
    late = pickle.loads(pickle.dumps(results))
    for again in (early, late):
        assert again.folder == results.folder and again.status == "done"
        np.testing.assert_array_equal(again.history["w"], history["w"])
    table = pickle.loads(pickle.dumps(history))
    assert isinstance(table, pilum.Table) and table.names == history.names and len(table) == len(history)
    field = pickle.loads(pickle.dumps(results.fields[-1]))
    np.testing.assert_array_equal(field["displacement"], results.fields[-1]["displacement"])


def test_no_equilibrium_says_where(here: Path) -> None:
    """A block on a joint with friction, which is pulled harder than it holds."""
    results = here / "slides"
    case = {
        **COLUMN,
        "mesh": {**COLUMN["mesh"], "lines": {**COLUMN["mesh"]["lines"], "joint": dict(y=1.0)}},
        "laws": dict(
            soil=SOIL,
            joint=pilum.Law(
                "coulomb_joint",
                normal_stiffness=1e6,
                shear_stiffness=1e6,
                cohesion=0.0,
                friction_angle=30.0,
                dilatancy_angle=0.0,
            ),
        ),
        "groups": dict(
            soil=dict(formulation="solid", law="soil"),
            joint=dict(formulation="zero_thickness", line="joint", law="joint"),
        ),
        "supports": [dict(line="base", fixed=["x", "y"])],
        "phase": [
            dict(name="press", increments=1, pressure=[dict(line="top", value=100.0)]),
            dict(name="pull", increments=10, force=[dict(line="top", x=80.0)]),
        ],
        "probes": {},
    }
    with pytest.raises(pilum.NoEquilibriumError) as caught:
        pilum.run(case, results=results)
    error = caught.value
    # It topples, at the latest where friction holds no more: 100 tan 30° = 57.7 kN/m of 80, in the eighth of ten.
    assert error.phase == "pull" and 1 <= error.increment <= 8 and error.cause
    assert "pull" in str(error.place) and error.reached is not None and error.reached < 8
    found = pilum.Results(results)
    assert found.status == "no equilibrium" and found.history["increment"][-1] == error.increment - 1


def test_errors_travel_between_processes() -> None:
    import pickle

    error = pilum.LawError("it fails", law="mepi", point=3, hint="less")
    again = pickle.loads(pickle.dumps(error))
    assert (str(again), again.law, again.point) == (str(error), "mepi", 3)


def test_a_law_is_built_with_the_headers(here: Path) -> None:
    """The fixture of a correct law, with the headers in the package alone."""
    (here / "good.c").write_text('#include "law.h"\n')
    fixtures = Path(__file__).resolve().parents[1] / "fixtures"
    library = compiled(str(here / "good.c"), here, f"-I{pilum.include()}", f"-I{fixtures}")
    found = pilum.laws(law_path=[library.parent])
    assert found["fixture"] == library
    assert (pilum.include().parents[1] / "share/pilum/pilum_law.f90").is_file()


def test_licences_of_what_is_inside_are_there() -> None:
    pages = pilum.include().parents[1] / "share/doc/pilum"
    text = (pages / "licences.txt").read_text()
    for crate in ("faer", "pyo3", "numpy", "arrow-array"):
        assert f"\n{crate} " in text, crate


def test_results_of_another_run_are_not_taken_for_these(here: Path) -> None:
    first = pilum.run(COLUMN, results="same")
    once = first.history["w"][-1]
    softer = {**COLUMN, "laws": {"soil": {**SOIL, "parameters": {**SOIL["parameters"], "young_modulus": 5e3}}}}
    again = pilum.run(softer, results="same")
    assert again.history["w"][-1] == pytest.approx(2.0 * once)
    for name in ("profile", "fields", "summary", "points"):
        with pytest.raises(pilum.InputError, match="another run has written"):
            getattr(first, name)


def test_a_table_goes_to_pandas_by_columns(here: Path) -> None:
    pandas = pytest.importorskip("pandas")
    history = pilum.run(COLUMN).history
    frame = pandas.DataFrame(history)
    assert list(frame.columns) == history.names
    assert frame.shape == (len(history), len(history.names))
    np.testing.assert_array_equal(frame["w"].to_numpy(), history["w"])
    with pytest.raises(KeyError, match="there is no column `nothing`"):
        history["nothing"]


def test_a_law_keeps_its_library_in_a_case(here: Path) -> None:
    folder = here / "own"
    folder.mkdir()
    theirs = pilum.Law("elastic", **SOIL["parameters"], hypothesis="plane_strain").library
    library = folder / theirs.name
    # Other bytes, the same law.
    library.write_bytes(theirs.read_bytes() + b"\0")
    own = pilum.Law("elastic", law_path=[folder], **SOIL["parameters"], hypothesis="plane_strain")
    assert own.library == library and own.law_path == [folder]
    done = pilum.run({**COLUMN, "laws": {"soil": own}}, results="own_results")
    assert own.sha256 in str(done.summary["laws"])
    apart = pilum.Law("elastic", isolate=5.0, **SOIL["parameters"], hypothesis="plane_strain")
    assert apart.isolate == 5.0
    assert pilum.Problem({**COLUMN, "laws": {"soil": apart}})._isolate == 5.0


def test_what_holds_itself_is_no_case() -> None:
    endless: dict = {}
    endless["mesh"] = endless
    deep: list = []
    for _ in range(5000):
        deep = [deep]
    for case in (endless, {"mesh": deep}):
        with pytest.raises(TypeError, match="hold themselves"):
            pilum.run(case)
    with pytest.raises(TypeError, match="hold themselves"):
        pilum.Law("elastic", parameters=endless)
