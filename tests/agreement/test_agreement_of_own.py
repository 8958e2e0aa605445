"""assert_agrees and differences: equations of one's own compared with MuJoCo, in Python."""

import os
import time
import warnings
from functools import partial
from pathlib import Path

import mujoco
import numpy as np
import pytest
import sympy
from helpers.own_equations import XML as PENDULUM
from helpers.own_equations import acceleration, bias, gravity, mass_matrix, wrong_bias
from models import PATHS

import compare
from compare.engines.mujoco import engine, read
from compare.judge.entries import Entries
from compare.judge.scale import EPS, FACTOR
from compare.robots.file import robot_of
from compare.robots.joint_map import joint_map

READING = read(PENDULUM)
TREE, ROBOT = READING.tree, robot_of(READING, "a pendulum")
SIGN = "h[hip], coefficient of knee'^2: yours is -1 times"
RIGHT = {"mass_matrix": mass_matrix, "bias": bias, "gravity": gravity, "acceleration": acceleration}
agrees, differences = partial(compare.assert_agrees, PENDULUM), partial(compare.differences, PENDULUM)


@pytest.fixture(name="given")
def given_states():
    """States, and MuJoCo's values of every quantity."""
    q, qd, tau = np.random.default_rng(2019).uniform(-2.0, 2.0, (3, 12, 2))
    theirs = engine(READING).of(ROBOT.case())
    values = [theirs.mass_matrix(q), theirs.bias(q, qd), theirs.gravity_balance(q)]
    values.append(theirs.acceleration(q, qd, tau))
    return {"q": q, "qd": qd, "tau": tau}, dict(zip(RIGHT, values))


def message_of(mjcf=PENDULUM, **brought):
    with pytest.raises(AssertionError) as error:
        compare.assert_agrees(mjcf, **brought)
    return str(error.value)


def test_a_path_text_and_a_compiled_model_are_compared_at_the_same_states(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("pendulum.xml").write_text(PENDULUM)
    model = mujoco.MjModel.from_xml_string(PENDULUM)
    before = model.opt.disableflags, model.opt.integrator, model.dof_damping.tolist()
    models = PENDULUM, Path("pendulum.xml"), "pendulum.xml", model
    found, *same = [compare.differences(one, bias=bias, seed=3, states=5) for one in models]
    assert all(one == found for one in same)
    asked, others = ({one.state for one in of} for of in (found, differences(bias=bias, states=5)))
    assert len(asked) == 5 and asked.isdisjoint(others)
    assert (model.opt.disableflags, model.opt.integrator, model.dof_damping.tolist()) == before
    assert os.listdir() == ["pendulum.xml"]  # no log, no cache


def test_values_as_arrays_at_the_given_states(given):
    states, values = given
    M, h, q = values["mass_matrix"], values["bias"], states["q"]
    first, alone = ({name: part[0] for name, part in arrays.items()} for arrays in given)
    agrees(**values, **states)
    assert all(one.ratio <= 1.0 and one.cause == "" for one in differences(**values, **states))
    agrees(mass_matrix=M.tolist(), bias=bias, q=q.tolist(), qd=0.0)
    agrees(**alone, **first)  # without a batch
    agrees(mass_matrix=M[..., None], bias=h[..., None].astype(object), **states)
    agrees(mass_matrix=sympy.Matrix(M[0]), bias=sympy.Matrix(h[0]), **first)
    agrees(mass_matrix=M.reshape(12, 4), bias=h, **states)  # as in the rows of a file


@pytest.mark.parametrize("rtol", [0.0, 1e-6])
@pytest.mark.parametrize("name", RIGHT)
def test_just_inside_and_just_outside_of_the_tolerance(name, rtol, given, monkeypatch):
    monkeypatch.setattr("compare.agreement.why.SECONDS_OF_CAUSE", 0.05)
    states, values = given
    scale = Entries(TREE, states["q"], states["qd"])
    of_name = {
        "mass_matrix": scale.mass_matrix, "bias": scale.bias, "gravity": scale.weight,
        "acceleration": scale.acceleration(scale.force(states["tau"]), values["acceleration"]),
    }[name]  # fmt: skip
    at = (7, *(1,) * (values[name].ndim - 1))
    largest = np.abs(values[name]).max(axis=0)[at[1:]]  # of MuJoCo's, about
    allowed = FACTOR * EPS * np.broadcast_to(of_name, values[name].shape)[at] + rtol * largest
    for share in (0.99, 1.01):
        changed = values[name].copy()
        changed[at] += share * allowed
        worst = differences(**{name: changed}, **states, rtol=rtol)[0]
        assert (worst.ratio <= 1.0) is (share < 1.0) and worst.ratio == pytest.approx(share, rel=1e-2)
        assert worst.tolerance == pytest.approx(allowed, rel=1e-9)
        if share < 1.0:
            agrees(**{name: changed}, **states, rtol=rtol)
    assert f"{name}: mismatched entries 1 / " in message_of(**{name: changed}, **states, rtol=rtol)


def at_height(z):
    aloft = PENDULUM.replace("<worldbody>", f'<worldbody><body pos="0 0 {z}">')
    return aloft.replace("</worldbody>", "</body></worldbody>")


def advised(mjcf=PENDULUM, **brought):
    _, found, rtol = message_of(mjcf, **brought).partition("state rtol=")
    return float(rtol.split()[0].rstrip(".")) if found else None


FOUR_BAR = """<mujoco model="bar"><worldbody><body name="crank"><joint name="crank" axis="0 1 0"/>
  <inertial pos="0 0 -0.1" mass="1" diaginertia=".01 .01 .01"/><body name="coupler" pos="0 0 -0.2">
  <joint name="turn" axis="0 1 0"/><inertial pos="0.1 0 0" mass="1" diaginertia=".01 .01 .01"/></body></body></worldbody>
  <equality><connect name="pin" body1="coupler" body2="world" anchor="0.3 0 0"/></equality></mujoco>"""


@pytest.mark.parametrize("brought", [
    {"mass_matrix": lambda q: [[0.3]]}, {"mass_matrix": np.ones((3, 1, 1)), "q": np.zeros((3, 2))},
    {"mass_matrix": np.ones((3, 1, 1)), "q": np.zeros((3, 1))},
])  # fmt: skip
def test_equations_of_a_closed_loop_hear_that_it_cannot_be_compared(brought):
    with pytest.raises(ValueError, match=r"closed loop cannot be compared by joint coordinates.*") as caught:
        compare.assert_agrees(FOUR_BAR, **brought)
    assert "1 equality constraint (pin)" in str(caught.value)


def test_a_function_is_called_once_at_each_state():
    states = []

    def counted(q, qd):
        states.append((*q, *qd))
        return bias(q, qd)

    agrees(bias=counted, gravity=lambda q: counted(q, 0.0 * q), states=30)
    assert len(states) == len(set(states)) == 60


@pytest.mark.parametrize("share, passes", [(1e-3, True), (0.4, False)])
def test_rtol_is_of_the_values_of_an_entry_wherever_its_terms_are(share, passes):
    """Aloft the terms of M are large; one entry at one state of many that is off by a third of it does not pass."""
    q = np.random.default_rng(4).uniform(-1.0, 1.0, (50, 2))
    M = np.array([mass_matrix(row) for row in q])
    M[7, 1, 1] *= 1.0 + share
    (worst, *_) = compare.differences(at_height(20), mass_matrix=M, q=q, rtol=2e-3)
    assert (worst.ratio <= 1.0) is passes and worst.entry == "M[knee][knee]"


@pytest.mark.parametrize("height, share, rounds", [(0, 0.98e-6, 1), (0, 1.02e-6, 0), (20, 1e-3, 0)])
def test_constants_rounded_to_six_digits_get_an_rtol_however_far_away(height, share, rounds, monkeypatch):
    """Far away the terms of each entry are large, and a slip is small compared with them."""
    monkeypatch.setattr("compare.agreement.why.SECONDS_OF_CAUSE", 0.0)
    scaled = {"mass_matrix": lambda q: mass_matrix(q) * (1.0 + share)}
    rtol = advised(at_height(height), **scaled)
    assert (rtol is not None) == rounds
    if rounds:
        compare.assert_agrees(at_height(height), **scaled, rtol=rtol)


def test_no_rtol_is_advised_beside_a_cause_or_another_rtol_or_without_numbers(given):
    states, values = given
    noise = 1.0 + 1e-7 * np.random.default_rng(0).normal(size=(12, 2, 2))
    noisy = {"mass_matrix": values["mass_matrix"] * (noise + np.swapaxes(noise, 1, 2)) / 2.0} | states
    assert 1e-8 < advised(**noisy) < 1e-6 and advised(**noisy, rtol=1e-9) is None
    of_knee = 20.0 * np.diag([0.0, 1.0]) * (noise - 1.0)  # 2e-6: small beside the largest entry alone
    noisy["mass_matrix"] = values["mass_matrix"] + of_knee
    assert advised(**noisy) is None
    scaled = values["mass_matrix"] * (1.0 + 1e-7)  # a factor of all is a cause
    assert advised(mass_matrix=scaled, **states) is None
    bad = np.where(states["q"] > 1.0, np.nan, values["bias"])
    assert advised(mass_matrix=values["mass_matrix"], bias=bad, **states) is None


STATED = ["-knee+90deg in deg", "hip"]


def in_joints(of):
    functions = {"mass_matrix": lambda q: of.own_mass_matrix(mass_matrix(of.positions(q)))}
    return functions | {"bias": lambda q, v: of.own_forces(bias(of.positions(q), of.speeds(v)))}


def test_functions_and_arrays_in_stated_joints(given):
    of = joint_map(ROBOT.coordinates, STATED)

    def follows(q, v, tau):
        return of.own_forces(acceleration(of.positions(q), of.speeds(v), of.forces(tau)))

    functions = in_joints(of) | {"acceleration": follows}
    (q, qd, tau), values = given[0].values(), given[1]
    states = {"q": of.own_positions(q), "qd": of.own_speeds(qd), "tau": of.own_forces(tau)}
    arrays = {name: of.own_forces(value) for name, value in values.items()}
    arrays["mass_matrix"] = of.own_mass_matrix(values["mass_matrix"])
    for brought in (functions, arrays | states, functions | states):
        agrees(**brought, joints=STATED)
    arrays["mass_matrix"][4, 0, 1] += 1.0
    worst = differences(**arrays, **states, joints=STATED)[0]
    assert worst.entry == "M[knee][hip]" and np.allclose(worst.state.q, states["q"][4])


@pytest.mark.parametrize("stated, right", [
    (None, ["knee", "hip"]), (None, ["hip", "knee+90deg"]), (["-knee", "hip"], ["-knee in deg", "hip in deg"]),
    (["hip", "-knee"], ["hip", "knee"]),
])  # fmt: skip
def test_the_message_says_how_to_state_the_joints(stated, right):
    functions = in_joints(joint_map(ROBOT.coordinates, right))
    text = message_of(**functions, joints=stated)
    told = text.partition("state it as joints=")[2].partition(")")[0].partition("]")[0] + "]"
    agrees(**functions, joints=eval(told))


def changing(q):
    M = mass_matrix(q)
    q += 1.0
    return M


@pytest.mark.parametrize("brought, cause", [
    ({"mass_matrix": mass_matrix, "bias": wrong_bias}, SIGN), ({"gravity": lambda q: gravity(q) * [1, 2]}, "gravity of h[knee]"),
    ({"acceleration": lambda q, v, t: acceleration(q, v, t, damping=0.0)}, "damping in the acceleration"),
    ({"acceleration": lambda q, v, t: acceleration(q, v, -t)}, "torque in the acceleration"),
    ({"acceleration": lambda q, v, t: acceleration(q, v, t, wrong_bias)}, SIGN),
    (RIGHT | {"acceleration": lambda q, v, t: acceleration(q, v, t) * [1.0, 1.1]}, "mass_matrix and bias"),
    (RIGHT | {"bias": lambda q, v: bias(q, v) + 0.1 * v}, "0.1 N m s/rad"),
    ({"mass_matrix": changing}, "and at 99 more states"),
    (RIGHT | {"bias": wrong_bias, "acceleration": lambda q, v, t: acceleration(q, v, -t, wrong_bias)}, "torque in the acc"),
    (RIGHT | {"bias": wrong_bias, "acceleration": lambda q, v, t: [1.0, 1.1] * acceleration(q, v, t, wrong_bias)}, "another"),
    ({"mass_matrix": mass_matrix, "bias": bias, "gravity": lambda q: 1.2 * gravity(q)}, "z: -11.772"),
    ({"mass_matrix": lambda q: mass_matrix(q) + [[0.0, 0.1], [0.0, 0.0]]}, "symmetric: M[hip][knee]"),
])  # fmt: skip
def test_the_probable_cause_of(brought, cause):
    assert cause in message_of(**brought)


def test_no_other_error_is_told_where_accelerations_follow_from_a_wrong_bias():
    follows = RIGHT | {"bias": wrong_bias, "acceleration": lambda q, v, t: acceleration(q, v, t, wrong_bias)}
    assert message_of(**follows).count("acceleration") == 1 and SIGN in message_of(**follows)


def test_the_cause_is_sought_where_there_are_values():
    q, qd, tau = np.random.default_rng(1).uniform(-2.0, 2.0, (3, 50, 2))
    values = np.array([wrong_bias(*state) for state in zip(q, qd)])
    values[:30] = np.nan
    assert SIGN in message_of(mass_matrix=mass_matrix, bias=values, q=q, qd=qd)
    worst = differences(bias=values, q=q, qd=qd)[0]
    assert worst.ratio == np.inf and worst.state.number < 30
    assert "cause" not in message_of(mass_matrix=lambda q: np.full((2, 2), np.nan))
    rare = lambda q, v: bias(q, v) + [0.5 * (q[0] > 3.0), 0.0]  # noqa: E731, at none of the first states
    assert "Differs: gravity alone, in h[hip]" in message_of(mass_matrix=mass_matrix, bias=rare)
    values = np.array([1.1 * acceleration(*state) for state in zip(q, qd, tau)])
    assert "give mass_matrix and bias" in message_of(acceleration=values, q=q, qd=qd, tau=tau)


TURNED = np.tile(read(PATHS["pendulum_ball"]).qpos0, (3, 1)) * np.array([1.0, 1.1, 1.0])[:, None]
THREE = np.zeros((3, 2))


@pytest.mark.parametrize("brought, word", [
    ({}, "acceleration"), ({"bias": bias, "rtol": -1.0}, "rtol is -1.0"), ({"bias": bias, "states": 2.5}, "states is 2.5"),
    ({"bias": THREE}, "bias .* not given"), ({"bias": bias, "qd": 0.0}, "qd .* not given"), ({"bias": "h"}, "bias is 'h'"),
    ({"acceleration": acceleration, "q": THREE, "qd": 0.0}, "depends on tau"), ({"mjcf": 3, "bias": bias}, "int"),
    ({"bias": bias, "q": THREE, "qd": np.eye(2)}, r"qd has shape \(2, 2\); expected \(3, 2\)"),
    ({"bias": bias, "q": [[0, np.nan]], "qd": 0.0}, "finite"), ({"bias": bias, "q": [["a", "b"]], "qd": 0.0}, "q is "),
    ({"bias": np.eye(3), "q": THREE, "qd": 0.0}, r"bias has shape \(3, 3\); expected \(3, 2\)"),
    ({"bias": THREE.T, "q": THREE, "qd": 0.0}, r"bias has shape \(2, 3\); expected \(3, 2\)"),
    ({"mass_matrix": np.zeros((2, 2, 3)), "q": THREE}, r"shape \(2, 2, 3\); expected \(3, 2, 2\)"),
    ({"mjcf": "nowhere.xml", "bias": bias}, "nowhere.xml"), ({"bias": bias, "joints": ["hip", "foot"]}, "'foot'"),
    ({"mjcf": PATHS["pendulum_ball"], "mass_matrix": lambda q: np.eye(6), "q": TURNED}, "length 1"),
])  # fmt: skip
def test_what_cannot_be_compared_is_one_line(brought, word):
    for function in (compare.assert_agrees, compare.differences):
        with pytest.raises(ValueError, match=word) as error:
            function(**{"mjcf": PENDULUM} | brought)
        assert "\n" not in str(error.value)


def test_states_that_are_not_compared_are_warned_of(monkeypatch):
    def slow(q):
        time.sleep(0.02)
        return mass_matrix(q)

    monkeypatch.setattr("compare.agreement.comparison.OWN_SECONDS", 0.2)
    with pytest.warns(UserWarning, match="100"):
        assert 4 <= len(differences(mass_matrix=slow)) <= 40
    monkeypatch.setattr("compare.robots.states.MOST_NUMBERS", 120)
    for more, word in (({"q": THREE, "states": 500}, "500"), ({"states": 10**6}, "1,000,000")):
        with pytest.warns(UserWarning, match=word) as caught:
            agrees(mass_matrix=mass_matrix, **more)
        assert caught[0].filename == __file__


def table(count=20):
    q, qd = np.random.default_rng(3).uniform(-2.0, 2.0, (2, count, 2))
    return {"q": q, "qd": qd}, np.array([bias(*state) for state in zip(q, qd)])


def with_a_wrong_entry(h):
    h[4, 1] += 0.01
    return h


def scattered(h):
    return h * (1.0 + 1e-3 * np.random.default_rng(1).normal(size=h.shape))


@pytest.mark.parametrize("count, change, more, said, is_said", [
    (20, with_a_wrong_entry, {}, "1 row of 20 of your bias is wrong: row 4 has h[knee]", True),
    (20, lambda h: np.roll(h, 1, axis=0), {}, "shifted by one: each has the values of the row before", True),
    (20, lambda h: h[:, ::-1], {}, "exchanged: h[hip] holds h[knee], h[knee] holds h[hip]", True),
    (20, lambda h: h.round(3), {}, "rounded to 3 decimals; it differs by no more than that", True),
    (7, with_a_wrong_entry, {}, "1 row of", False), (8, with_a_wrong_entry, {}, "1 row of", True),
    (40, scattered, {"rtol": 1e-4}, "rows of 40", False), (40, with_a_wrong_entry, {"rtol": 1e-6}, "1 row of 40", True),
    (200, lambda h: h + 0.01 * np.sin(7.0 * table(200)[0]["q"]) * [1.0, 0.0], {}, "noise", False),
])  # fmt: skip
def test_a_slip_of_a_table_is_named(count, change, more, said, is_said):
    """Of eight rows on, where all others are right to rounding; a difference in one entry alone is no noise."""
    states, h = table(count)
    assert (said in message_of(bias=change(h), **states, **more)) is is_said


HEAVIER = PENDULUM.replace('mass="2"', 'mass="2.2"')


@pytest.mark.parametrize("of", ["bias", "acceleration"])
def test_a_wrong_number_in_values_with_noise_has_its_uncertainty(of):
    """200 rows with 0.1 % noise: 2 kg to within four of the deviations that are said; noise alone is no cause."""
    rng = np.random.default_rng(5)
    states = dict(zip(("q", "qd", "tau"), rng.uniform(-2.0, 2.0, (3, 200, 2))))
    function = RIGHT[of]
    if of == "bias":
        del states["tau"]
    values = np.array([function(*state) for state in zip(*states.values())])
    values = values * (1.0 + 1e-3 * rng.normal(size=values.shape))
    said = message_of(HEAVIER, **{of: values}, **states).partition("Probable cause: mass of body")[2].split()
    value, deviation = float(said[1]), float(said[3])
    assert abs(value - 2.0) < 4.0 * deviation < 0.01 and said[4:7] == ["kg", "instead", "of"]
    alone = message_of(**{of: values}, **states)
    assert "Probable cause" not in alone and "differ by noise of 0." in alone and "rows of 200" not in alone


def test_a_function_whose_values_scatter_has_an_error_and_no_noise():
    """A table of the same values has noise; a function is asked for more of them, and what differs is said."""
    q, qd = np.random.default_rng(5).uniform(-3.0, 3.0, (2, 100, 2))

    def erratic(q, qd):
        return np.asarray(bias(q, qd)) * (1.0 + 1e-3 * np.sin(1e5 * np.asarray(q)))

    of_table = message_of(bias=np.array([erratic(*state) for state in zip(q, qd)]), q=q, qd=qd)
    assert "differ by noise of 0." in of_table and "noise" not in message_of(bias=erratic)


def test_accelerations_in_which_one_joint_never_moves_follow_from_no_mass_matrix():
    def of_hip(q, qd, tau):
        return np.array(acceleration(q, qd, tau)) * [1.0, 0.0]

    said = message_of(acceleration=of_hip)
    assert "qdd[knee]" in said and "Probable cause" not in said


@pytest.mark.parametrize("qd, warns", [(np.zeros((3, 2)), True), (0.0, False), (np.eye(3, 2), False)])
def test_a_table_without_speeds_says_that_velocity_terms_were_not_compared(qd, warns):
    q = np.random.default_rng(1).uniform(-1.0, 1.0, (3, 2))
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        agrees(bias=bias, q=q, qd=qd)
        agrees(mass_matrix=mass_matrix, q=q, qd=qd)
    said = [("velocity terms" in str(one.message), one.filename) for one in caught]
    assert said == [(True, __file__)] * warns


def test_an_entry_that_agrees_has_no_cause():
    found = differences(mass_matrix=mass_matrix, bias=wrong_bias)
    assert {row.cause == "" for row in found if row.ratio <= 1.0} == {True}
    assert {SIGN in row.cause for row in found if row.ratio > 1.0} == {True}


@pytest.mark.parametrize("word, brought", [
    ("shifted", lambda h, noise: {"mass_matrix": [[[3.0 + x, 1.0], [1.0, 0.7]] for x in noise]}),
    ("exchanged", lambda h, noise: {"bias": np.column_stack([h[:, 1], h[:, 1] + noise])}),
    ("single", lambda h, noise: {"mass_matrix": np.round(noise)[:, None, None] + np.eye(2)}),
])  # fmt: skip
def test_a_slip_that_explains_a_part_alone_is_not_named(word, brought):
    """Right entries that are constant, one column of two, whole numbers."""
    states, h = table()
    assert word not in message_of(**brought(h, 9.0 * np.random.default_rng(4).normal(size=len(h))), **states)


@pytest.mark.parametrize("values, is_single", [
    (np.full((20, 2, 2), 0.5) + np.eye(2), False),
    (np.float32(np.random.default_rng(1).normal(size=(20, 1, 1)) + np.eye(2)), True),
])  # fmt: skip
def test_numbers_have_single_precision_where_they_need_all_of_it(values, is_single):
    assert ("float32" in message_of(mass_matrix=values, q=table()[0]["q"])) is is_single


@pytest.mark.parametrize("more, is_rounded", [(0.0, True), (0.05, False)])
def test_a_table_whose_states_are_rounded_too(more, is_rounded):
    (states, h) = table()
    rounded = {name: part.round(2) for name, part in states.items()}
    message = message_of(bias=h.round(2) + more, **rounded)
    assert ("to 2 decimals, and so are its states" in message) is is_rounded


def test_a_torque_on_which_accelerations_do_not_depend_is_named():
    said = message_of(acceleration=lambda q, v, t: acceleration(q, v, [1.0, 0.0] * t))
    assert "tau of knee: your acceleration does not depend" in said


@pytest.mark.parametrize("force, is_found", [
    (lambda q, v: [0.0, 0.0], True), (lambda q, v: [0.0, 0.2 * v[1]], True), (lambda q, v: [np.sin(3.0 * q[0]), 0.0], False),
])  # fmt: skip
def test_a_gear_is_the_cause_where_nothing_else_is_left_over(force, is_found):
    geared = lambda q, v, t: acceleration(q, v, [25.0, 1.0] * t - np.array(force(q, v)))  # noqa: E731
    message = message_of(acceleration=geared)
    assert "tau of hip: your acceleration takes 25 times it" in message
    assert ("Probable cause: tau of hip" in message) is is_found


def test_accelerations_alone_have_a_mass_matrix_and_a_bias():
    heavier = PENDULUM.replace('mass="2"', 'mass="2.5"')
    message = message_of(heavier, acceleration=acceleration)
    assert "mass of body 2: 2 kg instead of 2.5" in message.replace("body2", "body 2")
    sprung = PENDULUM.replace('damping="0.3"', 'damping="0.3" stiffness="4" springref="30"')
    in_degrees = lambda q, v, t: acceleration(q, v, t - [4.0, 0.0] * (q - 30.0))  # noqa: E731
    of_degrees = message_of(sprung, acceleration=in_degrees)
    assert "springref of hip: 30 rad instead of 0.5235987756 (degrees?)" in of_degrees


@pytest.mark.parametrize("share, says", [(0.75, True), (0.5, False)])
def test_equations_with_the_gravcomp_of_the_file_are_said_to_agree(share, says):
    """A pendulum of 2 kg at 0.5 m, three quarters of whose weight the file takes."""
    text = """<mujoco><worldbody><body name="bob" gravcomp="0.75"><joint name="hip" axis="0 1 0"/>
<inertial pos="0 0 -0.5" mass="2" diaginertia="0.1 0.1 0.01"/></body></worldbody></mujoco>"""
    bias = lambda q, qd: (1.0 - share) * 9.81 * np.sin(q)  # noqa: E731
    said = message_of(text, mass_matrix=lambda q: [[0.6]], bias=bias)
    assert ("gravcomp of bob: with it your equations agree" in said) == says
