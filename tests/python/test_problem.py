"""Problems from arrays, stepped: against closed forms and runs of the program."""

from __future__ import annotations

import copy
import math
import os
import pickle
import signal
import threading
import time
from pathlib import Path
from typing import get_type_hints

import numpy as np
import pytest

import pilum
from conftest import compiled

CHAMBER = pilum.cases() / "chamber_mesh1"
JOINT = dict(normal_stiffness=1e7, shear_stiffness=1e6, cohesion=0.0, friction_angle=30.0, dilatancy_angle=0.0)


def slice_mesh(x: list[float] | None = None) -> pilum.Mesh:
    """Columns: pile, layer, ground; 0.2 m high."""

    def group(r: float, _z: float) -> str:
        return "pile" if r < 0.1 else "shaft" if r < 0.11 else "ground"

    mesh = pilum.Mesh.grid([0.0, 0.1, 0.11, 0.2, 0.5, 1.0], [0.0, 0.2], group)
    mesh.name_line("axis", lambda r, z: r == 0.0)
    mesh.name_line("outside", lambda r, z: r == 1.0)
    mesh.name_line("bottom", lambda r, z: z == 0.0)
    mesh.name_line("top", lambda r, z: z == 0.2)
    mesh.name_line("head", lambda r, z: (z == 0.2) & (r <= 0.1))
    return mesh


def slice_case() -> dict:
    """A slice of a pile in elastic ground behind a thin layer of Coulomb's friction, pushed down by 2 mm."""
    stress = {"11": -100.0, "22": 0.0, "33": -100.0, "12": 0.0}
    return dict(
        analysis="axisymmetric",
        laws=dict(
            steel=dict(law="elastic", parameters=dict(young_modulus=2e8, poisson_ratio=0.3)),
            sand=dict(law="elastic", parameters=dict(young_modulus=5e4, poisson_ratio=0.3)),
            friction=pilum.Law("coulomb_joint", **JOINT),
        ),
        groups=dict(
            pile=dict(formulation="solid", law="steel", initial_stress=stress),
            shaft=dict(formulation="thin_layer", law="friction", initial_stress=stress),
            ground=dict(formulation="solid", law="sand", initial_stress=stress),
        ),
        supports=[
            dict(line="axis", fixed=["r"]),
            dict(line="outside", fixed=["r", "z"]),
            dict(line="bottom", fixed=["r"]),
            dict(line="top", fixed=["r"]),
        ],
        phase=[dict(name="push", increments=10, displacement=[dict(line="head", z=-2e-3)])],
    )


# What the shaft carries where it yields: σ tan φ over its middle surface.
SHAFT = 100.0 * math.tan(math.radians(30.0)) * 2.0 * math.pi * 0.105 * 0.2


def pushed(simulation: pilum.Simulation, head: str = "head") -> list[float]:
    return [-simulation.reaction(head)[1] for _ in simulation]


def pushed_to(simulation: pilum.Simulation, phase: str) -> float:
    """Load of the head at the end of a phase."""
    for step in simulation:
        if step["phase"] == phase and step["increment"] == step["of"]:
            break
    return -simulation.reaction("head")[1]


def test_a_slice_of_a_pile_from_arrays() -> None:
    simulation = pilum.Problem(slice_case(), slice_mesh()).start()
    assert simulation.groups == ["pile", "shaft", "ground"] and "head" in simulation.lines
    told = simulation.step()
    assert told is not None
    assert {"phase": "push", "increment": 1, "of": 10, "time": 0.1}.items() <= told.items()
    curve = pushed(simulation)
    assert len(curve) == 9 and simulation.step() is None
    assert abs(curve[-1] / SHAFT - 1.0) < 0.05, (curve, SHAFT)
    assert simulation.displacement("head")[1] == pytest.approx(-2e-3, rel=1e-12)
    top = simulation.nodes[:, 1] == 0.2
    head = top & (simulation.nodes[:, 0] <= 0.1)
    np.testing.assert_allclose(simulation.displacements[head, 1], -2e-3, rtol=1e-12)
    np.testing.assert_allclose(-simulation.reactions[head, 1].sum(), curve[-1], rtol=1e-12)
    shaft = simulation.group("shaft")
    ratio = np.abs(shaft["traction"][:, 1] / shaft["traction"][:, 0])
    # Two thirds of the points slide; those that the layer's own elasticity still helps are below.
    assert ratio.max() == pytest.approx(math.tan(math.radians(30.0)), rel=1e-9)
    assert np.sum(np.isclose(ratio, ratio.max(), rtol=1e-9)) >= 6
    assert set(shaft) >= {"element", "point", "position", "jump", "traction", "plastic_slip"}
    ground = simulation.group("ground")
    assert ground["stress"].shape == ground["strain"].shape == (len(ground["element"]), 4)


def test_meshio_comes_to_the_same_bits(tmp_path: Path) -> None:
    meshio = pytest.importorskip("meshio")
    mesh = slice_mesh()
    cells, sets = [], {}
    for kind, parts in (("quad8", mesh.groups), ("line3", mesh.lines)):
        for name, blocks in parts.items():
            sets[name] = len(cells)
            cells.append((kind, np.concatenate(blocks)))
    by_sets = meshio.Mesh(
        mesh.nodes,
        cells,
        cell_sets={
            name: [np.arange(len(c)) if i == number else np.array([], dtype=int) for i, (_, c) in enumerate(cells)]
            for name, number in sets.items()
        },
    )
    tags = [np.full(len(c), number + 1) for number, (_, c) in enumerate(cells)]
    dims = {"quad8": 2, "line3": 1}
    by_tags = meshio.Mesh(
        np.column_stack([mesh.nodes, np.zeros(len(mesh.nodes))]),
        cells,
        cell_data={"gmsh:physical": tags, "gmsh:geometrical": tags},
        field_data={n: np.array([i + 1, dims[cells[i][0]]]) for n, i in sets.items()},
    )
    expected = pushed(pilum.Problem(slice_case(), mesh).start())
    for other in (by_sets, by_tags):
        assert pushed(pilum.Problem(slice_case(), other).start()) == expected
    # Also by way of a file, which the program reads unchanged.
    meshio.write(tmp_path / "slice.msh", by_tags, file_format="gmsh22", binary=False)
    from_file = {**slice_case(), "mesh": {"file": tmp_path / "slice.msh"}}
    np.testing.assert_allclose(pushed(pilum.Problem(from_file).start()), expected, rtol=1e-9)


@pytest.mark.parametrize("ending", ["vtu", "med", "msh"])
def test_meshes_are_written_and_read(tmp_path: Path, ending: str) -> None:
    pytest.importorskip("meshio")
    if ending == "med":
        pytest.importorskip("h5py")
    mesh = slice_mesh()
    mesh.write(tmp_path / f"slice.{ending}")
    again = pilum.Mesh.read(tmp_path / f"slice.{ending}")

    def nodes_of(parts: dict[str, list[np.ndarray]]) -> dict[str, list[list[int]]]:
        return {name: sorted(np.concatenate(blocks).tolist()) for name, blocks in parts.items()}

    assert nodes_of(again.groups) == nodes_of(mesh.groups)
    assert nodes_of(again.lines) == nodes_of(mesh.lines)
    np.testing.assert_array_equal(np.asarray(again.nodes)[:, :2], mesh.nodes)
    with pytest.raises(pilum.InputError, match="XDMF with these cells together: line3, quad8"):
        mesh.write(tmp_path / "slice.xdmf")


def test_meshio_keeps_names_of_entities_that_are_turned_round(tmp_path: Path) -> None:
    """Format 4.1 writes the number of a physical curve with a minus where it is drawn the other way round."""
    meshio = pytest.importorskip("meshio")
    path = tmp_path / "turned.msh"
    path.write_text(
        "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n"
        '$PhysicalNames\n4\n1 1 "bottom"\n1 2 "top"\n2 3 "block"\n2 4 "whole"\n$EndPhysicalNames\n'
        "$Entities\n0 3 1 0\n1 0 0 0 1 0 0 1 1 0\n2 0 1 0 1 1 0 1 -2 0\n4 0 0 0 0 1 0 1 -2 0\n"
        "1 0 0 0 1 1 0 2 -3 4 0\n$EndEntities\n"
        "$Nodes\n1 4 1 4\n2 1 0 4\n1\n2\n3\n4\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n$EndNodes\n"
        "$Elements\n4 4 1 4\n1 1 1 1\n1 1 2\n1 2 1 1\n2 3 4\n1 4 1 1\n3 4 1\n2 1 3 1\n4 1 2 3 4\n$EndElements\n"
    )
    mesh = pilum.Mesh.from_meshio(meshio.read(path))
    assert {name: sum(map(len, parts)) for name, parts in mesh.lines.items()} == {"bottom": 1, "top": 2}
    assert sorted(mesh.groups) == ["block", "whole"]
    # Cells in no physical group have the number 0, and no name.
    nameless = meshio.Mesh(
        mesh.nodes, [("quad", [[0, 1, 2, 3]])], cell_data={"gmsh:physical": [np.array([0])]}
    )
    with pytest.raises(pilum.InputError, match="no named groups"):
        pilum.Mesh.from_meshio(nameless)
    prism = meshio.Mesh(np.zeros((6, 3)), [("wedge", [[0, 1, 2, 3, 4, 5]])], cell_sets={"a": [[0]]})
    with pytest.raises(pilum.InputError, match="cells `wedge`, which Pilum has not"):
        pilum.Mesh.from_meshio(prism)


def test_cells_of_first_order_get_middles() -> None:
    """Quads of 4 nodes and lines of two come to what quads of 8 come to, quads of 9 near it."""
    meshio = pytest.importorskip("meshio")
    mesh = slice_mesh()
    expected = pushed(pilum.Problem(slice_case(), mesh).start())
    lines = {name: [part[:, :2] for part in parts] for name, parts in mesh.lines.items()}
    groups = {name: [part[:, :4] for part in parts] for name, parts in mesh.groups.items()}
    first = pilum.Mesh(mesh.nodes, groups, lines)
    simulation = pilum.Problem(slice_case(), first).start()
    np.testing.assert_allclose(pushed(simulation), expected, rtol=1e-9)
    rows = simulation.mesh_rows
    assert len(rows) == len(simulation.nodes) and 0 < np.sum(rows >= 0) < len(rows)
    np.testing.assert_array_equal(simulation.nodes[rows >= 0], mesh.nodes[rows[rows >= 0]])
    # By meshio, with the nodes that are needed no more left in place.
    cells = [("quad", np.concatenate(parts)) for parts in groups.values()]
    cells += [("line", np.concatenate(parts)) for parts in lines.values()]
    sets = {
        name: [np.arange(len(c)) if i == number else np.array([], dtype=int) for i, (_, c) in enumerate(cells)]
        for number, name in enumerate([*groups, *lines])
    }
    linear = meshio.Mesh(mesh.nodes, cells, cell_sets=sets)
    np.testing.assert_allclose(pushed(pilum.Problem(slice_case(), linear).start()), expected, rtol=1e-9)
    # Lines by a condition, on a mesh of both orders.
    mixed = pilum.Mesh(mesh.nodes, {**mesh.groups, "pile": groups["pile"]})
    for name, parts in mesh.lines.items():
        at = {tuple(place) for part in parts for place in mesh.nodes[part].reshape(-1, 2).tolist()}
        on = np.vectorize(lambda x, y, at=at: (x, y) in at)
        mixed.name_line(name, on)
    np.testing.assert_allclose(pushed(pilum.Problem(slice_case(), mixed).start()), expected, rtol=1e-9)
    # A middle more.
    nodes, groups9 = mesh.nodes, {}
    for name, parts in mesh.groups.items():
        quads = np.concatenate(parts)
        middle = len(nodes) + np.arange(len(quads))
        nodes = np.vstack([nodes, mesh.nodes[quads[:, :4]].mean(axis=1)])
        groups9[name] = np.column_stack([quads, middle])
    nine = pilum.Mesh(nodes, groups9, mesh.lines)
    np.testing.assert_allclose(pushed(pilum.Problem(slice_case(), nine).start()), expected, rtol=0.02)


def test_triangles_and_an_interface_without_thickness() -> None:
    """A block of triangles on another, pressed and sheared: the joint carries σ tan φ."""
    mesh = pilum.Mesh.grid([0.0, 1.0], [0.0, 0.5, 1.0])
    quads = np.concatenate(mesh.groups["ground"])
    nodes, extra = mesh.nodes, []
    for quad in quads:
        extra.append(nodes[quad[[0, 2]]].mean(axis=0))
    middle = len(nodes) + np.arange(len(quads))
    nodes = np.vstack([nodes, extra])
    lower = np.column_stack([quads[:, [0, 1, 2, 4, 5]], middle])
    upper = np.column_stack([quads[:, [0, 2, 3]], middle, quads[:, [6, 7]]])
    mesh = pilum.Mesh(nodes, {"blocks": np.concatenate([lower, upper])})
    for name, y in (("bottom", 0.0), ("joint", 0.5), ("top", 1.0)):
        mesh.name_line(name, lambda _x, at, y=y: at == y)
    case = dict(
        analysis="plane_strain",
        laws=dict(
            block=dict(law="elastic", parameters=dict(young_modulus=1e7, poisson_ratio=0.2)),
            joint=pilum.Law("coulomb_joint", **{**JOINT, "normal_stiffness": 1e6, "shear_stiffness": 5e5}),
        ),
        groups=dict(
            blocks=dict(formulation="solid", law="block"),
            joint=dict(formulation="zero_thickness", line="joint", law="joint"),
        ),
        supports=[dict(line="bottom", fixed=["x", "y"])],
        phase=[
            dict(name="press", increments=1, pressure=[dict(line="top", value=100.0)], displacement=[dict(line="top", x=0.0)]),
            dict(name="push", increments=10, displacement=[dict(line="top", x=1e-3)]),
        ],
    )
    simulation = pilum.Problem(case, mesh).start()
    simulation.run()
    assert abs(simulation.reaction("top")[0]) == pytest.approx(100.0 * math.tan(math.radians(30.0)), rel=1e-6)


def test_steps_are_those_of_a_run(here: Path) -> None:
    """The chamber, stepped in memory and run into a folder."""
    short = {"phase.loading.increments": 10}
    results = pilum.run(CHAMBER, set=short, results="run")
    simulation = pilum.Problem(CHAMBER, set=short).start()
    loads = pushed(simulation, "pile_head")
    np.testing.assert_allclose(loads, results.history["q_t"], rtol=1e-9, atol=1e-9)
    assert not (here / "results").exists()


def load_test() -> pilum.Problem:
    """A short pile, loaded before its load test, which ends at a net load of 20 kN."""

    def group(r: float, z: float) -> str:
        return "ground" if r > 0.11 or z < -1.0 else "pile" if r < 0.1 else "shaft"

    mesh = pilum.Mesh.grid([0.0, 0.1, 0.11, 0.3, 1.0], [-2.0, -1.0, 0.0], group)
    mesh.name_line("axis", lambda r, z: r == 0.0)
    mesh.name_line("outside", lambda r, z: r == 1.0)
    mesh.name_line("bottom", lambda r, z: z == -2.0)
    mesh.name_line("head", lambda r, z: (z == 0.0) & (r <= 0.1))
    mesh.name_line("base", lambda r, z: (z == -1.0) & (r <= 0.1))
    case = slice_case()
    case["supports"] = [{"line": "axis", "fixed": ["r"]}, {"line": "outside", "fixed": ["r"]}, {"line": "bottom", "fixed": ["r", "z"]}]
    case["pile"] = {"group": "pile", "shaft": "shaft", "base": "base", "head": "head"}
    until = {"quantity": "pile_head_load_net", "reaches": 20.0}
    case["phase"] = [
        {"name": "dead load", "increments": 2, "displacement": [{"line": "head", "z": -1e-4}]},
        {"name": "test", "increments": 10, "reset_displacements": True, "displacement": [{"line": "head", "z": -1e-3}], "until": until},
    ]
    return pilum.Problem(case, mesh)


def test_a_load_test_ends_at_its_net_load(here: Path) -> None:
    problem = load_test()
    simulation = problem.start()
    first = pushed_to(simulation, "dead load")
    assert first > 1.0
    simulation.step()
    state = simulation.state()
    other = simulation.copy()
    assert state is not None and (state.phase, state.increment) == (1, 1)
    loads = pushed(simulation)
    # The net load is what a load cell shows: the reaction less that at the reset; `until` is met within 1 %.
    assert 20.0 <= loads[-1] - first <= 20.2
    assert simulation.step() is None and simulation.time < 2.0
    history = problem.run("run").history
    assert history["pile_head_load"][-1] == pytest.approx(loads[-1], rel=1e-9)
    assert history["pile_head_load_net"][-1] == pytest.approx(loads[-1] - first, rel=1e-9)
    # Others in the same state end alike.
    assert pushed(other) == loads
    simulation.go_to(state)
    assert pushed(simulation) == loads
    fresh = problem.start()
    fresh.go_to(state)
    assert pushed(fresh) == loads


def test_a_step_has_the_keys_of_its_type() -> None:
    simulation = pilum.Problem(slice_case(), slice_mesh()).start()
    kinds = get_type_hints(pilum.Step)
    for told in (simulation.step(), next(simulation)):
        assert told is not None and told.keys() == kinds.keys()
        for key, value in told.items():
            assert isinstance(value, kinds[key]), key


def test_copies_go_their_own_ways() -> None:
    simulation = pilum.Problem(slice_case(), slice_mesh()).start()
    fresh = copy.copy(simulation)
    for _ in range(4):
        simulation.step()
    state = simulation.state()
    assert state is not None and (state.phase, state.increment) == (0, 4)
    other = copy.deepcopy(simulation)
    assert other.time == simulation.time == pytest.approx(0.4)
    rest = pushed(simulation)
    assert pushed(other) == rest
    simulation.go_to(state)
    assert simulation.time == pytest.approx(0.4) and pushed(simulation) == rest
    assert fresh.time == 0.0 and pushed(fresh)[4:] == rest
    # At the end there is a state too, and a copy of the end is at the end.
    assert fresh.step() is None and fresh.state() is not None
    assert fresh.copy().step() is None and fresh.copy().time == fresh.time == pytest.approx(1.0)
    assert pilum.Problem(slice_case(), slice_mesh()).start().state() is None


def test_another_problem_takes_no_state() -> None:
    simulation = pilum.Problem(slice_case(), slice_mesh()).start()
    simulation.step()
    state = simulation.state()
    assert state is not None
    with pytest.raises(pilum.InputError, match="another mesh"):
        pilum.Problem(CHAMBER).start().go_to(state)


def test_two_threads_do_not_share_one_simulation() -> None:
    simulation = pilum.Problem(CHAMBER, set={"phase.loading.increments": 200}).start()
    refused: list[RuntimeError] = []
    worker = threading.Thread(target=simulation.run)
    worker.start()
    while worker.is_alive() and not refused:
        try:
            simulation.time  # noqa: B018
        except RuntimeError as error:
            refused.append(error)
    worker.join()
    assert refused and "another thread" in str(refused[0]) and isinstance(refused[0], pilum.Error)
    assert simulation.step() is None


def test_ctrl_c_leaves_a_simulation_that_goes_on() -> None:
    simulation = pilum.Problem(CHAMBER, set={"phase.loading.increments": 100_000}).start()

    def interrupt() -> None:
        time.sleep(0.4)
        os.kill(os.getpid(), signal.SIGINT)

    threading.Thread(target=interrupt).start()
    with pytest.raises(KeyboardInterrupt):
        simulation.run()
    reached = simulation.time
    assert reached > 0.0
    assert simulation.step() is not None and simulation.time > reached


@pytest.mark.parametrize(
    ("make", "says"),
    [
        (lambda: pilum.Mesh([[0.0]], {}), "nodes: found shape"),
        (lambda: pilum.Mesh([[0.0, 0.0]], {"a": [[0, 1, 2, 3, 4, 5]]}), "node 5 is none of 0 to 0"),
        (lambda: pilum.Mesh([[0.0, 0.0]], {"a": [[0, 0, 0, 0, 0]]}), r"expected whole numbers of shape \(m, 8\)"),
        (lambda: pilum.Mesh([[0.0, 0.0]], {"a": [[0.0] * 6]}), "expected whole numbers"),
        (lambda: pilum.Mesh([[0.0, 0.0]], {'a"': [[0] * 6]}), "neither quotes"),
        (lambda: pilum.Mesh([[0.0, 0.0]], {"a": [[-3] * 6]}), "node -3 is none of 0 to 0"),
        (lambda: pilum.Mesh([["0", "1"]], {}), "nodes: found an array of <U1, expected numbers"),
        (lambda: pilum.Mesh(np.ma.masked_less([[0.0, -1.0]], 0.0), {}), "nodes: some values of the array are masked"),
        (lambda: pilum.Mesh([[0.0, 1.0], [0.0]], {}), "nodes: "),
        (lambda: pilum.Mesh.grid([0.0], [0.0, 1.0]), "two values that rise"),
        (lambda: pilum.Mesh.grid(["a", "b"], [0.0, 1.0]), "x: found an array of <U1, expected numbers"),
        (lambda: pilum.Mesh.grid([0.0, math.inf], [0.0, 1.0]), "two values that rise"),
        (lambda: pilum.Mesh.grid([0.0, 1.0], [0.0, 1.0], lambda x, y: None), r"`group` gives None at \(0.5, 0.5\)"),
        (lambda: slice_mesh().name_line("odd", lambda x, y: [True, False]), "expected true or false for each"),
        (lambda: slice_mesh().name_line("odd", lambda x, y: x), "`where` gives float64 of shape"),
        (lambda: slice_mesh().name_line("odd", 1.0), "expected a condition, a function"),
        (lambda: slice_mesh().name_line("none", lambda x, y: x > 9.0), "no such edge"),
        (lambda: pilum.Problem(CHAMBER, slice_mesh()), "goes with a case that is a dictionary"),
    ],
)
def test_meshes_are_checked(make, says: str) -> None:
    with pytest.raises(pilum.InputError, match=says):
        make()


def test_what_the_mesh_lacks_is_said() -> None:
    case = slice_case()
    case["groups"]["rock"] = dict(formulation="solid", law="sand")
    with pytest.raises(pilum.InputError, match="has no physical surface `rock`"):
        pilum.Problem(case, slice_mesh()).start()
    simulation = pilum.Problem(slice_case(), slice_mesh()).start()
    with pytest.raises(KeyError, match="there is no line `heads`.*head"):
        simulation.reaction("heads")
    with pytest.raises(KeyError, match="there is no group `sand`") as caught:
        simulation.group("sand")
    assert isinstance(caught.value, pilum.Error)


def test_a_law_that_crashes_says_where(tmp_path: Path) -> None:
    """A library that aborts, called in a separate process."""
    library = compiled("bad_abort.c", tmp_path, f"-I{pilum.include()}")
    case = slice_case()
    case["law_path"] = [library.parent]
    case["laws"]["friction"] = {"law": "fixture", "parameters": {"normal_stiffness": 1e7, "shear_stiffness": 1e6}}
    with pytest.raises(pilum.LawError) as caught:
        pilum.Problem(case, slice_mesh(), isolate=5.0).start().run()
    error = caught.value
    assert (error.group, error.law) == ("shaft", "fixture")
    assert error.element == 1 and error.point is not None and error.position is not None
    assert "signal 6" in str(error.cause) or "crashed" in str(error.cause), error.cause


def block() -> tuple[dict, pilum.Mesh]:
    """A block on a joint with friction, which is pressed, and pulled harder than it holds: 100 tan 30° of 80 kN/m."""
    mesh = pilum.Mesh.grid([0.0, 1.0], [0.0, 0.5, 1.0])
    for name, y in (("bottom", 0.0), ("joint", 0.5), ("top", 1.0)):
        mesh.name_line(name, lambda _x, at, y=y: at == y)
    case = dict(
        analysis="plane_strain",
        laws=dict(
            block=dict(law="elastic", parameters=dict(young_modulus=1e7, poisson_ratio=0.2)),
            joint=pilum.Law("coulomb_joint", **{**JOINT, "normal_stiffness": 1e6, "shear_stiffness": 5e5}),
        ),
        groups=dict(
            ground=dict(formulation="solid", law="block"),
            joint=dict(formulation="zero_thickness", line="joint", law="joint"),
        ),
        supports=[dict(line="bottom", fixed=["x", "y"])],
        phase=[
            dict(name="press", increments=1, pressure=[dict(line="top", value=100.0)]),
            dict(name="pull", increments=10, force=[dict(line="top", x=80.0)]),
        ],
    )
    return case, mesh


def test_after_an_increment_that_fails_the_state_says_where_it_is() -> None:
    simulation = pilum.Problem(*block()).start()
    whole = None
    with pytest.raises(pilum.NoEquilibriumError) as caught:
        for told in simulation:
            whole = simulation.state()
            assert whole is not None and whole.reached == whole.increment == told["increment"]
            assert "next" not in repr(whole)
    assert whole is not None
    state = simulation.state()
    assert state is not None and state.increment == whole.increment == caught.value.increment - 1
    # The last state in equilibrium is within the increment, and both say so: 57.7 of 80 kN/m at the latest.
    assert state.increment < state.reached == pytest.approx(caught.value.reached, rel=1e-9)
    assert simulation.time == pytest.approx(1.0 + state.reached / 10.0, rel=1e-12)
    part = f"{state.reached - state.increment:.4f}"
    assert f"increment {state.increment} and {part} of the next" in repr(state)
    simulation.go_to(whole)
    again = simulation.state()
    assert again is not None and again.reached == whole.increment


def test_a_first_increment_that_fails_leaves_nothing_to_copy() -> None:
    case, mesh = block()
    case["phase"][1].update(increments=1)
    simulation = pilum.Problem(case, mesh).start()
    with pytest.raises(pilum.NoEquilibriumError):
        simulation.run()
    assert simulation.state() is None
    with pytest.raises(pilum.InputError, match="no state that a copy could go on from"):
        simulation.copy()


def test_a_state_goes_to_the_same_problem_alone() -> None:
    simulation = pilum.Problem(slice_case(), slice_mesh()).start()
    simulation.step()
    simulation.step()
    state = simulation.state()
    assert state is not None
    softer, wider, faster, longer = slice_case(), slice_case(), slice_case(), slice_case()
    softer["laws"]["sand"]["parameters"]["young_modulus"] = 4e4
    wider["supports"][1]["fixed"] = ["r"]
    faster["phase"][0]["displacement"] = [dict(line="head", z=-3e-3)]
    longer["phase"].append(dict(name="on", increments=5, displacement=[dict(line="head", z=-3e-3)]))
    moved = slice_mesh()
    moved.nodes[:, 0] *= 1.0 + 1e-9
    for case, mesh, says in [
        (softer, slice_mesh(), "another group `ground`: another law, other parameters"),
        (wider, slice_mesh(), "other supports"),
        (faster, slice_mesh(), "another phase `push`"),
        (slice_case(), moved, "another mesh"),
    ]:
        with pytest.raises(pilum.InputError, match=says):
            pilum.Problem(case, mesh).start().go_to(state)
    # Later phases may differ, and how equilibrium is sought.
    other = pilum.Problem({**longer, "solver": dict(max_iterations=50)}, slice_mesh()).start()
    other.go_to(state)
    np.testing.assert_allclose(pushed(other)[:8], pushed(simulation), rtol=1e-9)


def test_rows_of_results_are_those_of_the_mesh() -> None:
    """A node that no cell has, in the midst, is left out: what stands behind it says which row it was."""
    mesh = slice_mesh()
    at = 7
    nodes = np.insert(mesh.nodes, at, [0.4, 0.1], axis=0)
    moved = {
        kind: {name: [part + (part >= at) for part in parts] for name, parts in getattr(mesh, kind).items()}
        for kind in ("groups", "lines")
    }
    plain = pilum.Problem(slice_case(), mesh).start()
    assert plain.mesh_rows.tolist() == list(range(len(mesh.nodes)))
    with pytest.warns(pilum.PilumWarning, match="1 node belongs to no triangle or quad"):
        simulation = pilum.Problem(slice_case(), pilum.Mesh(nodes, **moved)).start()
    rows = simulation.mesh_rows
    assert at not in rows and len(rows) == len(nodes) - 1
    np.testing.assert_array_equal(nodes[rows], simulation.nodes)
    simulation.step()
    plain.step()
    of_mesh = np.full(nodes.shape, np.nan)
    of_mesh[rows] = simulation.displacements
    np.testing.assert_allclose(np.delete(of_mesh, at, axis=0), plain.displacements, rtol=1e-9, atol=1e-15)
    # Both sides of an interface have separate nodes.
    case, mesh = block()
    rows = pilum.Problem(case, mesh).start().mesh_rows
    assert rows[: len(mesh.nodes)].tolist() == list(range(len(mesh.nodes)))
    assert rows[len(mesh.nodes) :].tolist() == [-1] * 3


def test_a_simulation_is_not_pickled_and_its_problem_is() -> None:
    problem = pickle.loads(pickle.dumps(pilum.Problem(slice_case(), slice_mesh())))
    simulation = problem.start()
    simulation.step()
    with pytest.raises(TypeError, match="a simulation cannot be pickled: its laws are at work.*pickle its Problem"):
        pickle.dumps(simulation)
    with pytest.raises(TypeError, match="a state of a simulation cannot be pickled"):
        pickle.dumps(simulation.state())
    mesh = slice_mesh()
    again = pickle.loads(pickle.dumps(mesh))
    np.testing.assert_array_equal(again.nodes, mesh.nodes)
    assert list(again.lines) == list(mesh.lines) and list(again.groups) == list(mesh.groups)


def test_a_mesh_of_arrays_is_counted_as_arrays_are() -> None:
    mesh = slice_mesh()
    mesh.nodes[3, 0] = -1.0
    with pytest.raises(pilum.InputError, match=r"the mesh: node 3 \(from 0\) is at x = -1, across the axis"):
        pilum.Problem(slice_case(), mesh).start()
    mesh = slice_mesh()
    mesh.groups["ground"][0][1, 4] = mesh.groups["ground"][0][1, 0]
    with pytest.raises(pilum.InputError, match=r"the mesh: cell 1 \(from 0\) of `ground` has the node \d+ \(from 0\) twice"):
        pilum.Problem(slice_case(), mesh).start()
    mesh = slice_mesh()
    mesh.groups["ground"][0] = np.vstack([mesh.groups["ground"][0], mesh.groups["ground"][0][:1]])
    with pytest.raises(pilum.InputError, match=r"cell 0 \(from 0\) of `ground` and cell 3 \(from 0\) of `ground` have the same"):
        pilum.Problem(slice_case(), mesh).start()


def test_a_law_of_another_hypothesis_is_refused(here: Path) -> None:
    case = slice_case()
    case["laws"]["sand"] = pilum.Law("elastic", hypothesis="plane_strain", young_modulus=5e4, poisson_ratio=0.3)
    problem = pilum.Problem(case, slice_mesh())
    for take in (problem.start, problem.run):
        with pytest.raises(pilum.InputError, match="`sand` was made for the hypothesis `plane_strain`.*`axisymmetric`"):
            take()
    case["laws"]["sand"] = pilum.Law("elastic", hypothesis="axisymmetric", young_modulus=5e4, poisson_ratio=0.3)
    assert pilum.Problem(case, slice_mesh()).start().step() is not None
