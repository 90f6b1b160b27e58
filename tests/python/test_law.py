"""Laws on arrays: against closed forms, the driver of the program, differences and direct calls."""

from __future__ import annotations

import copy
import math
import multiprocessing
import pickle
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest

import pilum
from conftest import TABLE_4, compiled

COULOMB = dict(
    normal_stiffness=1e6, shear_stiffness=5e5, cohesion=0.0, friction_angle=30.0, dilatancy_angle=0.0
)


def slips(n: int) -> np.ndarray:
    """Jumps of n points, from none to 2 mm."""
    return np.column_stack([np.zeros(n), np.linspace(0.0, 2e-3, n)])


def test_friction_of_coulomb() -> None:
    """τ = min(k_t u, σ tan φ), in closed form."""
    law = pilum.Law("coulomb_joint", **COULOMB)
    assert law.components == ["n", "t"] and law.hypothesis == "interface_2d"
    start = law.initial(50, flux=[-100.0, 0.0])
    tractions, tangents, state = law.integrate(slips(50), start)
    strength = 100.0 * math.tan(math.radians(30.0))
    expected = np.minimum(5e5 * slips(50)[:, 1], strength)
    np.testing.assert_allclose(tractions[:, 1], expected, rtol=1e-12, atol=1e-10)
    np.testing.assert_allclose(tractions[:, 0], -100.0, rtol=1e-12)
    assert tangents.shape == (50, 2, 2)
    np.testing.assert_allclose(tangents[1], [[1e6, 0.0], [0.0, 5e5]], rtol=1e-12)
    slip = slips(50)[:, 1] - strength / 5e5
    np.testing.assert_allclose(state["plastic_slip"], np.maximum(slip, 0.0), atol=1e-15)
    assert (state.time, state.increment, len(state)) == (1.0, 1, 50)


def test_the_driver_of_the_program_comes_to_the_same() -> None:
    """A path of 40 increments with imposed jumps, point for point the same numbers."""
    table = pilum.point(
        {
            "law": "mepi",
            "hypothesis": "interface_2d",
            "parameters": TABLE_4,
            "initial": {"traction": {"n": -100.0, "t": 0.0}},
            "segment": [{"increments": 40, "control": {"n": {"jump": -1e-5}, "t": {"jump": 2e-3}}}],
        }
    )
    law = pilum.Law("mepi", **TABLE_4)
    state = law.initial(3, flux=[-100.0, 0.0])
    for row in range(1, 41):
        jump = [table["jump_n"][row], table["jump_t"][row]]
        tractions, _, state = law.integrate(np.tile(jump, (3, 1)), state)
        expected = [table["traction_n"][row], table["traction_t"][row]]
        np.testing.assert_allclose(tractions, np.tile(expected, (3, 1)), rtol=1e-9)
    assert abs(tractions[0, 1]) > 50.0
    assert state.increment == 40


def test_tangents_are_derivatives() -> None:
    """Against central differences of the tractions."""
    law = pilum.Law("mepi", **TABLE_4)
    start = law.initial(20, flux=[-100.0, 0.0])
    jumps = np.column_stack([np.full(20, 1e-6), np.linspace(1e-5, 1e-3, 20)])
    _, tangents, _ = law.integrate(jumps, start)
    for column in range(2):
        step = np.zeros(2)
        step[column] = 1e-9
        above, none, _ = law.integrate(jumps + step, start, tangent=None)
        below, _, _ = law.integrate(jumps - step, start, tangent=None)
        assert none is None
        # The third derivatives of the update times the square of the step, and round-off of 100 kPa over it.
        np.testing.assert_allclose((above - below) / 2e-9, tangents[:, :, column], rtol=1e-5, atol=1.0)
    _, elastic, _ = law.integrate(jumps, start, tangent="elastic")
    # K = k σ_n^N of the normal stress at the start.
    stiffness = np.diag([0.86e5, 0.37e5]) * 100.0**0.55
    np.testing.assert_allclose(elastic, np.tile(stiffness, (20, 1, 1)), rtol=1e-12)


def test_arrays_are_read_in_any_order_and_left_alone() -> None:
    law = pilum.Law("mepi", **TABLE_4)
    start = law.initial(1000, flux=[-100.0, 0.0])
    jumps = slips(1000)
    expected, _, _ = law.integrate(jumps, start)
    wide = np.zeros((2000, 6))
    wide[::2, ::3] = jumps
    for other in (np.asfortranarray(jumps), wide[::2, ::3], jumps.astype(">f8"), jumps.tolist()):
        before = np.array(other, copy=True)
        tractions, _, _ = law.integrate(other, start)
        assert np.array_equal(tractions, expected)
        assert np.array_equal(before, other)
    single = jumps.astype(np.float32)
    assert np.array_equal(
        law.integrate(single, start)[0], law.integrate(single.astype(float), start)[0]
    )


def test_an_array_may_be_written_in_between_increments() -> None:
    """A loop that adds to its jumps in place goes the same path as one that makes new arrays."""
    law = pilum.Law("coulomb_joint", **COULOMB)
    jumps, state = np.zeros((4, 2)), law.initial(4, flux=[-50.0, 0.0])
    fresh = state
    for number in range(1, 30):
        jumps[:, 1] += 1e-5
        tractions, _, state = law.integrate(jumps, state)
        again, _, fresh = law.integrate(np.tile([0.0, number * 1e-5], (4, 1)), fresh)
        np.testing.assert_allclose(tractions, again, rtol=1e-12)


def test_a_state_may_keep_the_array_itself() -> None:
    law = pilum.Law("mepi", **TABLE_4)
    start, jumps = law.initial(100, flux=[-100.0, 0.0]), slips(100)
    expected, _, _ = law.integrate(jumps, start)
    found, _, kept = law.integrate(jumps, start, copy=False)
    assert np.array_equal(found, expected) and np.shares_memory(kept.gradient, jumps)
    # Its memory is not used again, since it is not the state's.
    before = jumps.copy()
    _, _, later = law.integrate(2 * jumps, start, out=kept)
    assert np.array_equal(jumps, before) and not np.shares_memory(later.gradient, jumps)
    for other in (np.asfortranarray(jumps), jumps.tolist()):
        assert np.array_equal(law.integrate(other, start, copy=False)[0], expected)


def test_a_state_is_made_of_what_was_kept_of_it() -> None:
    """The increments after it are those of the state itself, to the bit."""
    law = pilum.Law("mepi", **TABLE_4)
    _, _, state = law.integrate(slips(20), law.initial(20, flux=[-100.0, 0.0]), dt=0.5)
    kept = {"gradient": state.gradient.copy(), "flux": state.flux.copy(), "internal": state.internal.copy()}
    again = law.initial(**kept, time=state.time, increment=state.increment)
    assert (again.time, again.increment) == (0.5, 1)
    for name, array in kept.items():
        assert np.array_equal(getattr(again, name), array)
    expected, tangents, end = law.integrate(2 * slips(20), state)
    found, others, last = law.integrate(2 * slips(20), again)
    assert np.array_equal(found, expected) and np.array_equal(others, tangents)
    assert np.array_equal(last.internal, end.internal) and last.increment == end.increment
    # Its own variables are others: it would answer otherwise.
    fresh = law.initial(gradient=kept["gradient"], flux=kept["flux"])
    assert not np.array_equal(law.integrate(2 * slips(20), fresh)[0], expected)
    # One row applies to all points; another number of rows, or of variables, is refused.
    one = law.initial(3, internal=state.internal[5])
    assert np.array_equal(one.internal, np.tile(state.internal[5], (3, 1)))
    with pytest.raises(ValueError, match="internal: found 20 rows, expected 4"):
        law.initial(4, internal=state.internal)
    with pytest.raises(ValueError, match="internal: found shape"):
        law.initial(20, internal=state.flux[:, :1])
    with pytest.raises(ValueError, match="time: -1 is no time"):
        law.initial(20, flux=[-100.0, 0.0], time=-1.0)


def test_a_joint_that_is_open_goes_on() -> None:
    """Nothing starts there, as the law says; what was kept does."""
    parameters = {key: value for key, value in TABLE_4.items() if key != "sigma_ni"}
    law = pilum.Law("mepi", **parameters)
    opening = np.array([[1e-3, 0.0]])
    _, _, state = law.integrate(opening, law.initial(flux=[-100.0, 0.0]))
    assert np.array_equal(state.flux, [[0.0, 0.0]])
    with pytest.raises(pilum.LawError, match="not compressive"):
        law.initial(flux=state.flux)
    again = law.initial(gradient=state.gradient, flux=state.flux, internal=state.internal)
    assert np.array_equal(law.integrate(-opening, again)[0], law.integrate(-opening, state)[0])


def test_what_is_handed_out_cannot_be_spoilt() -> None:
    law = pilum.Law("coulomb_joint", **COULOMB)
    tractions, tangents, state = law.integrate(slips(5), law.initial(5, flux=[-100.0, 0.0]))
    for array in (tractions, tangents, state.flux, state.gradient, state.internal):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 1.0
        with pytest.raises(ValueError, match="WRITEABLE"):
            array.setflags(write=True)
    # Nothing was copied on the way out.
    assert np.shares_memory(tractions, state.flux)


def test_memory_is_used_again() -> None:
    law = pilum.Law("mepi", **TABLE_4)
    start = law.initial(100, flux=[-100.0, 0.0])
    first, tangents, old = law.integrate(slips(100), start)
    again, others, state = law.integrate(slips(100), start, out=old)
    assert np.shares_memory(first, again) and np.shares_memory(tangents, others)
    fresh, expected, _ = law.integrate(slips(100), start)
    assert np.array_equal(again, fresh) and np.array_equal(others, expected)
    with pytest.raises(ValueError, match="not needed any more"):
        law.integrate(slips(100), state, out=state)
    with pytest.raises(ValueError, match="out: a state of other points"):
        law.integrate(slips(100), start, out=law.initial(3, flux=[-100.0, 0.0]))


def test_a_state_that_was_given_as_out_is_none_any_more() -> None:
    law = pilum.Law("coulomb_joint", **COULOMB)
    start = law.initial(3, flux=[-100.0, 0.0])
    _, _, old = law.integrate(slips(3), start)
    _, _, state = law.integrate(2.0 * slips(3), start, out=old)
    for use in (
        lambda: old.flux,
        lambda: old.gradient,
        lambda: old["plastic_slip"],
        lambda: law.integrate(slips(3), old),
        lambda: law.integrate(slips(3), start, out=old),
    ):
        with pytest.raises(ValueError, match="given as `out`"):
            use()
    assert "none any more" in repr(old) and state.flux.shape == (3, 2)
    # An increment that comes to no end spoils it, and it may serve another one.
    _, _, spare = law.integrate(slips(3), start)
    with pytest.raises(pilum.LawError):
        law.integrate(np.full((3, 2), np.nan), start, out=spare)
    with pytest.raises(ValueError, match="came to no end"):
        law.integrate(slips(3), spare)
    law.integrate(slips(3), start, out=spare)
    # Arrays handed out of a state cannot start an increment that writes into it.
    _, _, spare = law.integrate(slips(3), start)
    with pytest.raises(ValueError, match="its memory is in use"):
        law.integrate(spare.gradient, start, out=spare)


def test_laws_and_states_travel_between_processes() -> None:
    law = pilum.Law("mepi", **TABLE_4)
    start = law.initial(4, flux=[-100.0, 0.0])
    tractions, _, state = law.integrate(slips(4), start)
    other, kept = pickle.loads(pickle.dumps((law, state)))
    assert (other.id, other.hypothesis, other.parameters) == (law.id, law.hypothesis, law.parameters)
    assert (kept.time, kept.increment) == (state.time, state.increment)
    np.testing.assert_array_equal(kept.flux, tractions)
    np.testing.assert_array_equal(other.integrate(2 * slips(4), kept)[0], law.integrate(2 * slips(4), state)[0])
    elastic = pilum.Law("elastic", hypothesis="3d", parameters={"young_modulus": 1e4}, poisson_ratio=0.3)
    again = pickle.loads(pickle.dumps(elastic))
    assert again.hypothesis == "3d" and again.parameters == elastic.parameters
    assert copy.copy(law) is law and copy.deepcopy(law) is law


def test_the_lock_is_released() -> None:
    """Another thread of Python counts while a law is called."""
    law = pilum.Law("mepi", **TABLE_4)
    start = law.initial(400_000, flux=[-100.0, 0.0])
    jumps = slips(400_000)
    counted, ends = [0], threading.Event()

    def count() -> None:
        while not ends.is_set():
            counted[0] += 1
            time.sleep(0)

    counter = threading.Thread(target=count)
    counter.start()
    before = counted[0]
    law.integrate(jumps, start)
    during = counted[0] - before
    ends.set()
    counter.join()
    # With the lock held it could count at most where it is taken and given back.
    assert during > 100, during


def test_a_fork_of_python_calls_laws() -> None:
    law = pilum.Law("coulomb_joint", **COULOMB)
    expected, _, _ = law.integrate(slips(10), law.initial(10, flux=[-100.0, 0.0]))
    with multiprocessing.get_context("fork").Pool(2) as pool:
        results = pool.map(_in_fork, [law.id] * 4)
    for found in results:
        assert np.array_equal(found, expected)


def _in_fork(law: str) -> np.ndarray:
    made = pilum.Law(law, **COULOMB)
    return np.array(made.integrate(slips(10), made.initial(10, flux=[-100.0, 0.0]))[0])


def test_an_umat_by_the_same_class(tmp_path: Path) -> None:
    """A joint as a routine of Abaqus, with its sidecar: the closed form; from several threads, which end."""
    library = compiled("umat/joint.f", tmp_path, "-ffixed-line-length-none")
    law = pilum.Law(
        "umat_joint", adapter="umat", library=library, normal_stiffness=1e6, shear_stiffness=5e5, friction=0.5
    )
    start = law.initial(50, flux=[-100.0, 0.0])
    expected = np.minimum(5e5 * slips(50)[:, 1], 50.0)

    def shear(_: int) -> np.ndarray:
        return np.array(law.integrate(slips(50), start)[0][:, 1])

    for _ in range(2):
        with ThreadPoolExecutor(3) as threads:
            for found in threads.map(shear, range(6)):
                np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-9)


def test_an_mfront_behaviour_by_the_same_class() -> None:
    """Our own library exports MFront's interface too: both ways give the same."""
    values = dict(young_modulus=34e3, poisson_ratio=0.3, cohesion=1.0, friction_angle=36.5, dilatancy_angle=12.0)
    names = dict(zip(["YoungModulus", "PoissonRatio", "Cohesion", "FrictionAngle", "DilatancyAngle"], values.values()))
    ours = pilum.Law("mohr_coulomb", hypothesis="axisymmetric", **values)
    theirs = pilum.Law("MohrCoulomb", hypothesis="axisymmetric", adapter="mfront", library=ours.library, **names)
    strain = np.zeros((20, 4))
    strain[:, 1] = -np.linspace(0.0, 2e-2, 20)
    stress = [-100.0, -100.0, -100.0, 0.0]
    found = [law.integrate(strain, law.initial(20, flux=stress))[:2] for law in (ours, theirs)]
    np.testing.assert_allclose(found[0][0], found[1][0], rtol=1e-10)
    np.testing.assert_allclose(found[0][1], found[1][1], rtol=1e-7, atol=1e-3)
    assert found[0][0][-1, 1] < -300.0


def test_a_soil_model_of_plaxis_by_the_same_class(tmp_path: Path) -> None:
    """Uniaxial strain of an elastic soil: σ_22 = (λ + 2G) ε."""
    (tmp_path / "soil.f90").write_text(UDSM)
    library = compiled(str(tmp_path / "soil.f90"), tmp_path)
    law = pilum.Law("model_1", hypothesis="axisymmetric", adapter="udsm", library=library, E=34e3, nu=0.3)
    stress, tangents, _ = law.integrate([[0.0, -1e-3, 0.0, 0.0]])
    expected = -1e-3 * 34e3 * 0.7 / (1.3 * 0.4)
    np.testing.assert_allclose(stress[0, 1], expected, rtol=1e-12)
    np.testing.assert_allclose(tangents[0, 1, 1], 34e3 * 0.7 / (1.3 * 0.4), rtol=1e-12)


def test_a_shear_zone_and_initial_variables() -> None:
    zone = pilum.Law(
        "elastic", hypothesis="interface_2d", adapter="shear_zone", thickness=0.01, young_modulus=1e4, poisson_ratio=0.0
    )
    tractions, _, _ = zone.integrate([[1e-5, 0.0]])
    # E over the thickness, since ν is zero.
    np.testing.assert_allclose(tractions[0, 0], 1e4 * 1e-3, rtol=1e-12)
    law = pilum.Law("coulomb_joint", **COULOMB, initial={"plastic_slip": 0.25})
    assert law.initial(3)["plastic_slip"].tolist() == [0.25] * 3


@pytest.mark.parametrize(
    ("make", "says"),
    [
        (lambda: pilum.Law("mepi"), "needs parameter"),
        (lambda: pilum.Law("mepi", **{**TABLE_4, "kn": 1.0}), "has no parameter `kn`"),
        (lambda: pilum.Law("mepi", **{**TABLE_4, "k_n": -1.0}), "is outside"),
        (lambda: pilum.Law("mepi", **{**TABLE_4, "k_n": "much"}), "expected a number"),
        (lambda: pilum.Law("elastic", young_modulus=1.0, poisson_ratio=0.3), "several hypotheses"),
        (lambda: pilum.Law("mepi", hypothesis="3d", **TABLE_4), "is made for interface_2d"),
        (lambda: pilum.Law("coulomb_joint", **COULOMB, initial={"slip": 1.0}), "no internal variable `slip`"),
        (lambda: pilum.Law("mepi", parameters=TABLE_4, k_n=2.0), "`k_n` is given twice"),
        (lambda: pilum.Law("elastic", adapter="umat", library="none.so"), "there is no file"),
    ],
)
def test_mistakes_are_input_errors(make, says: str) -> None:
    with pytest.raises(pilum.InputError, match=says) as caught:
        make()
    assert isinstance(caught.value, ValueError)
    assert caught.value.file is None and caught.value.message in str(caught.value)


def test_hints_are_attributes() -> None:
    with pytest.raises(pilum.InputError) as caught:
        pilum.Law("mepi", **{**TABLE_4, "mu_c": 1.0})
    assert "mu_c0" in str(caught.value.hint)
    assert str(caught.value.text).startswith("mu_c") and caught.value.key == "mu_c"
    with pytest.raises(pilum.LawError, match="no library with law `mepy`") as missing:
        pilum.Law("mepy")
    assert "mepi" in str(missing.value.hint)
    with pytest.raises(ValueError, match="there is no hypothesis `2d`"):
        pilum.Law("mepi", hypothesis="2d", **TABLE_4)


def test_a_law_that_cannot_follow_says_where() -> None:
    law = pilum.Law("mepi", **TABLE_4)
    jumps = slips(10)
    jumps[7, 1] = math.nan
    with pytest.raises(pilum.LawError) as caught:
        law.integrate(jumps, law.initial(10, flux=[-100.0, 0.0]))
    error = caught.value
    assert (error.law, error.point) == ("mepi", 7) and "point 7 (from 0)" in str(error)
    assert error.outcome in {"argument", "domain", "numeric"} and error.cause


def test_shapes_are_checked() -> None:
    law = pilum.Law("coulomb_joint", **COULOMB)
    start = law.initial(4)
    for wrong, says in [
        (np.zeros((4, 3)), r"found shape \(4, 3\), expected \(n, 2\)"),
        (np.zeros((5, 2)), "found 5 rows, expected 4"),
        (np.zeros((2, 2, 2)), "expected an array of shape"),
        ([["a", "b"]], "gradient: found an array of <U1, expected numbers"),
        ([["1", "2"]] * 4, "gradient: found an array of <U1, expected numbers"),
        ([[None, 1.0]] * 4, "gradient: found an array of object, expected numbers"),
        (np.zeros((4, 2), dtype=complex), "gradient: found an array of complex128"),
        (np.ma.masked_equal([[0.0, 1.0]] * 4, 1.0), "gradient: some values of the array are masked"),
    ]:
        with pytest.raises(ValueError, match=says):
            law.integrate(wrong, start)
    with pytest.raises(ValueError, match="is no time"):
        law.integrate(slips(4), start, dt=-1.0)
    with pytest.raises(ValueError, match="tangent"):
        law.integrate(slips(4), start, tangent="secant")
    for wrong in (np.zeros((4, 3)), np.zeros((3, 2))):
        with pytest.raises(ValueError, match="positions: found"):
            law.integrate(slips(4), start, positions=wrong)
    assert law.integrate(np.ma.masked_equal(slips(4), -1.0), start)[0].shape == (4, 2)
    plane, whole = (
        pilum.Law("elastic", hypothesis=kind, young_modulus=1e4, poisson_ratio=0.3) for kind in ("plane_strain", "3d")
    )
    with pytest.raises(ValueError, match="of another hypothesis"):
        whole.integrate(np.zeros((2, 6)), plane.initial(2))
    other = pilum.Law("mepi", **TABLE_4)
    with pytest.raises(ValueError, match="one of another law"):
        law.integrate(slips(4), other.initial(4, flux=[-100.0, 0.0]))
    assert law.integrate(np.zeros((0, 2)))[0].shape == (0, 2)


def test_warnings_are_warnings() -> None:
    with pytest.warns(pilum.PilumWarning, match="outside its usual range"):
        pilum.Law("elastic", hypothesis="3d", young_modulus=1e20, poisson_ratio=0.3)


def test_a_warning_points_at_the_line_of_the_caller() -> None:
    import inspect

    with pytest.warns(pilum.PilumWarning) as caught:
        line = inspect.currentframe().f_lineno + 1  # type: ignore[union-attr]
        pilum.Law("elastic", hypothesis="3d", young_modulus=1e20, poisson_ratio=0.3)
    assert {(one.filename, one.lineno) for one in caught} == {(__file__, line)}


def misaligned(values: np.ndarray) -> np.ndarray:
    """The same numbers, a byte further than where a number should lie."""
    memory = np.zeros(values.nbytes + 1, dtype=np.uint8)[1:]
    array = memory.view(np.float64).reshape(values.shape)
    array[...] = values
    assert array.flags.c_contiguous and (not array.size or not array.flags.aligned)
    return array


def test_arrays_that_are_not_aligned_are_named() -> None:
    law = pilum.Law("coulomb_joint", **COULOMB)
    start, jumps = law.initial(4, flux=[-100.0, 0.0]), misaligned(slips(4))
    for name, call in [
        ("gradient", lambda: law.integrate(jumps, start)),
        ("gradient", lambda: law.integrate(jumps, start, copy=False)),
        ("positions", lambda: law.integrate(slips(4), start, positions=jumps)),
        ("flux", lambda: law.initial(flux=jumps)),
        ("gradient", lambda: law.initial(gradient=jumps)),
        ("internal", lambda: law.initial(4, internal=misaligned(np.zeros((4, len(law.variables)))))),
    ]:
        with pytest.raises(pilum.Error, match=rf"^{name}: .*not aligned.*`{name}.copy\(\)`"):
            call()
    assert np.array_equal(law.integrate(jumps.copy(), start)[0], law.integrate(slips(4), start)[0])
    # Arrays that are copied anyway may be misaligned; empty arrays have no alignment.
    assert np.array_equal(law.integrate(jumps[::2], law.initial(2))[0], law.integrate(slips(4)[::2], law.initial(2))[0])
    assert len(law.integrate(misaligned(np.zeros((0, 2))))[0]) == 0


def test_whatever_pilum_refuses_is_an_error_of_pilum() -> None:
    """And one of the classes of Python that it was before there were others."""
    law = pilum.Law("coulomb_joint", **COULOMB)
    start = law.initial(4)
    table = pilum.Table({"a": np.zeros(3)})
    for kind, call in [
        (ValueError, lambda: law.integrate(np.zeros((4, 3)), start)),
        (ValueError, lambda: law.integrate(np.zeros((5, 2)), start)),
        (ValueError, lambda: law.integrate(np.zeros((2, 2, 2)), start)),
        (ValueError, lambda: law.integrate([["a", "b"]], start)),
        (ValueError, lambda: law.integrate([[0.0, 1.0], [0.0]], start)),
        (ValueError, lambda: law.integrate(slips(4), start, positions=np.zeros((4, 3)))),
        (ValueError, lambda: law.integrate(slips(4), start, dt=-1.0)),
        (ValueError, lambda: law.integrate(slips(4), start, tangent="secant")),
        (ValueError, lambda: law.integrate(slips(4), start, out=start)),
        (ValueError, lambda: law.initial(4, flux=np.zeros((3, 2)))),
        (ValueError, lambda: law.initial(time=-1.0)),
        (ValueError, lambda: pilum.Law("mepi", hypothesis="2d", **TABLE_4)),
        (ValueError, lambda: pilum.Law("mepi", isolate=-1.0, **TABLE_4)),
        (ValueError, lambda: pilum.Table({"a": np.zeros((3, 2))})),
        (TypeError, lambda: pilum.Law("mepi", **{**TABLE_4, "k_n": object()})),
        (TypeError, lambda: pilum.run({"mesh": [None]})),
        (KeyError, lambda: start["plastic"]),
        (KeyError, lambda: table["b"]),
        (MemoryError, lambda: law.initial(2**62)),
    ]:
        with pytest.raises(kind) as caught:
            call()
        error = caught.value
        assert isinstance(error, pilum.Error) and str(error) == error.message != "", repr(error)
        again = pickle.loads(pickle.dumps(error))
        assert type(again) is type(error) and str(again) == str(error)


def test_laws_describe_themselves() -> None:
    assert {"mepi", "elastic", "mohr_coulomb", "coulomb_joint"} <= set(pilum.laws())
    told = pilum.describe("mepi")
    units = {parameter["id"]: parameter["unit"] for parameter in told["parameters"]}
    assert units["k_n"] == "kPa^(1-N)/m" and units["t"] == "m", units
    law = pilum.Law("mepi", **TABLE_4)
    assert law.parameters["k_n"] == 0.86e5 and law.parameters["scheme"] == "implicit"
    assert pilum.Law("mepi", parameters=law.parameters).parameters == law.parameters
    assert len(law.sha256) == 64 and law.library.is_file()
    assert 'pilum.Law("mepi"' in repr(law) and "3 points" in repr(law.initial(3, flux=[-100.0, 0.0]))


def test_a_library_that_crashes_takes_nobody_along(tmp_path: Path) -> None:
    library = compiled("bad_abort.c", tmp_path, f"-I{pilum.include()}")
    with pytest.raises(pilum.Error) as caught:
        law = pilum.Law("fixture", hypothesis="interface_2d", law_path=[library.parent], isolate=5.0,
                        normal_stiffness=1.0, shear_stiffness=1.0)
        law.integrate([[1e-3, 0.0]])
    assert "crash" in str(caught.value) or "signal" in str(caught.value), str(caught.value)


def test_calls_cost_little_beside_the_law() -> None:
    """The overhead of a call is below a hundredth of 10⁵ points of MEPI (CPU time)."""
    law = pilum.Law("mepi", **TABLE_4)

    def cost(n: int, times: int) -> float:
        start, out = (law.initial(n, flux=[-100.0, 0.0]) for _ in range(2))
        jumps = np.full((n, 2), [0.0, 1e-5])
        _, _, out = law.integrate(jumps, start, out=out)
        least = math.inf
        for _ in range(7):
            begin = time.process_time()
            for _ in range(times):
                _, _, out = law.integrate(jumps, start, out=out)
            least = min(least, (time.process_time() - begin) / times)
        return least

    assert cost(1, 200) < 0.01 * cost(100_000, 2)


UDSM = """
subroutine User_Mod(IDTask, iMod, IsUndr, iStep, iTer, iEl, Int, X, Y, Z, Time0, dTime, Props, Sig0, Swp0, StVar0, &
    dEps, D, BulkW, Sig, Swp, StVar, ipl, nStat, NonSym, iStrsDep, iTimeDep, iTang, iPrjDir, iPrjLen, iAbort)
  implicit none
  integer :: IDTask, iMod, IsUndr, iStep, iTer, iEl, Int, ipl, nStat, NonSym, iStrsDep, iTimeDep, iTang, iPrjDir(*)
  integer :: iPrjLen, iAbort, i
  real(8) :: X, Y, Z, Time0, dTime, Props(50), Sig0(20), Swp0, StVar0(*), dEps(12), D(6, 6), BulkW, Sig(6), Swp, StVar(*)
  real(8) :: g, c(6, 6)
  g = Props(1) / (2 * (1 + Props(2)))
  c = 0
  c(1:3, 1:3) = 2 * g * Props(2) / (1 - 2 * Props(2))
  do i = 1, 3
    c(i, i) = c(i, i) + 2 * g
    c(i + 3, i + 3) = g
  end do
  if (IDTask == 2) Sig = Sig0(1:6) + matmul(c, dEps(1:6))
  if (IDTask == 3 .or. IDTask == 6) D = c
  if (IDTask == 4) nStat = 0
  if (IDTask == 5) iTang = 1
end subroutine
subroutine GetParamCount(iMod, n)
  integer :: iMod, n
  n = 2
end subroutine
subroutine GetParamName(iMod, iParam, Name)
  integer :: iMod, iParam
  character(len=*) :: Name
  Name = 'E'
  if (iParam == 2) Name = '@n#'
end subroutine
"""


def test_points_beyond_all_memory_are_refused() -> None:
    law = pilum.Law("elastic", young_modulus=1e4, poisson_ratio=0.3, hypothesis="plane_strain")
    for points in (2**40, 2**62):
        with pytest.raises(MemoryError, match="points"):
            law.initial(points)


def test_a_start_whose_memory_is_written_to_is_refused() -> None:
    law = pilum.Law("elastic", young_modulus=1e4, poisson_ratio=0.3, hypothesis="plane_strain")
    n = 400_000
    strain = np.full((n, len(law.components)), 1e-6)
    first, other = law.initial(n), law.initial(n)
    seen: list[str] = []

    held = [first]

    def onto_first() -> None:
        for _ in range(5):
            try:
                held[0] = law.integrate(strain, other, out=held[0])[2]
            except ValueError as error:
                seen.append(str(error))

    thread = threading.Thread(target=onto_first)
    thread.start()
    while thread.is_alive():
        try:
            law.integrate(strain[:n], held[0], tangent=None)
        except ValueError as error:
            seen.append(str(error))
    thread.join()
    assert all("in use" in message or "given as `out`" in message for message in seen), seen
