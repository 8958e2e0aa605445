"""assert_agrees: the probable cause of a difference, of functions, tables and accelerations alone."""

import time
import warnings
from functools import partial

import numpy as np
import pytest
from helpers.own_agreement import (
    PENDULUM,
    RIGHT,
    SIGN,
    agrees,
    differences,
    message_of,
)
from helpers.own_equations import acceleration, bias, gravity, mass_matrix, wrong_bias
from models import PATHS

import compare
from compare.engines.mujoco import read


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


@pytest.mark.parametrize(
    "ask", [partial(compare.assert_agrees, mass_matrix=mass_matrix), compare.step_limits, compare.tree]
)
def test_a_text_that_is_no_model_is_said_to_be_none_and_a_path_to_be_missing(ask):
    for text, said in (("hello world", "neither the path of a file nor MJCF"), ("none.xml", "No such file")):
        with pytest.raises(ValueError, match=said):
            ask(text)


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
