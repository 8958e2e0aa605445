"""assert_agrees and differences: equations of one's own compared with MuJoCo, in Python."""

import inspect
import os
import subprocess
import sys
import time
import types
import warnings
from pathlib import Path

import mujoco
import numpy as np
import pytest
import sympy
from models import PATHS

import compare
import tmt
from compare.engines.mujoco import ModelError, engine, read
from compare.engines.own import OwnError
from compare.joint_map import JointsError, joint_map
from compare.judge.entries import Entries
from compare.judge.scale import EPS, FACTOR
from compare.robots.file import robot_of

ROOT = Path(__file__).resolve().parent.parent
PENDULUM = """
<mujoco>
  <worldbody>
    <body name="upper">
      <joint name="hip" axis="0 1 0" damping="0.3"/>
      <inertial pos="0 0 -0.5" mass="1" diaginertia="0.1 0.1 0.02"/>
      <body name="lower" pos="0 0 -1">
        <joint name="knee" axis="0 1 0"/>
        <inertial pos="0 0 -0.5" mass="2" diaginertia="0.2 0.2 0.02"/>
      </body>
    </body>
  </worldbody>
</mujoco>
"""
READING = read(PENDULUM)
TREE = READING.tree
NAMES = ("mass_matrix", "bias", "gravity", "acceleration")
ORDER = [1, 0]


def mass_matrix(q):
    """Of the pendulum, of one state."""
    c = np.cos(q[1])
    return np.array([[3.05 + 2 * c, 0.7 + c], [0.7 + c, 0.7]])


def bias(q, qd, of_square=1.0):
    s, g = np.sin(q[1]), 9.81
    lower = g * np.sin(q[0] + q[1])
    return np.array(
        [-s * (2 * qd[0] * qd[1] + of_square * qd[1] ** 2) + 2.5 * g * np.sin(q[0]) + lower, s * qd[0] ** 2 + lower]
    )


def gravity(q):
    return bias(q, np.zeros(2))


def acceleration(q, qd, tau):
    return np.linalg.solve(mass_matrix(q), tau - bias(q, qd) - np.array([0.3, 0.0]) * qd)


RIGHT = {"mass_matrix": mass_matrix, "bias": bias, "gravity": gravity, "acceleration": acceleration}


def wrong_bias(q, qd):
    return bias(q, qd, of_square=-1.0)


def message_of(**brought):
    with pytest.raises(AssertionError) as error:
        compare.assert_agrees(PENDULUM, **brought)
    return str(error.value)


@pytest.fixture
def given(rng):
    """States, and MuJoCo's values of every quantity."""
    q, qd, tau = rng.uniform(-2.0, 2.0, (3, 12, 2))
    theirs = engine(READING).of(robot_of(READING, "a pendulum").case())
    values = {
        "mass_matrix": theirs.mass_matrix(q), "bias": theirs.bias(q, qd), "gravity": theirs.gravity_balance(q),
        "acceleration": theirs.acceleration(q, qd, tau),
    }  # fmt: skip
    return types.SimpleNamespace(states={"q": q, "qd": qd, "tau": tau}, values=values)


# what may be brought


@pytest.mark.parametrize("names", [NAMES, *((name,) for name in NAMES), ("mass_matrix", "bias"), ("gravity", "bias")])
def test_the_right_equations_agree(names):
    brought = {name: RIGHT[name] for name in names}
    assert compare.assert_agrees(PENDULUM, **brought) is None
    found = compare.differences(PENDULUM, **brought)
    assert all(one.ratio <= 1.0 and one.cause == "" for one in found)
    entries = sum(4 if name == "mass_matrix" else 2 for name in names)
    assert len(found) == 100 * entries and {one.quantity for one in found} == set(names)


def test_a_path_text_and_a_compiled_model_are_the_same(tmp_path, monkeypatch):
    path = tmp_path / "pendulum.xml"
    path.write_text(PENDULUM)
    monkeypatch.chdir(tmp_path)
    model = mujoco.MjModel.from_xml_string(PENDULUM)
    before = model.opt.disableflags, model.opt.integrator, model.dof_damping.copy()
    found = [
        compare.differences(mjcf, bias=bias, seed=3) for mjcf in (PENDULUM, path, str(path), "pendulum.xml", model)
    ]
    assert all(one == found[0] for one in found[1:])
    assert (model.opt.disableflags, model.opt.integrator) == before[:2] and np.array_equal(model.dof_damping, before[2])
    assert os.listdir() == ["pendulum.xml"]  # no log, no cache


def test_contacts_limits_and_the_like_of_a_compiled_model_are_off():
    """As they are where a file is compared with tmt's equations."""
    for name in ("mixed", "gripper", "loop"):
        tree = read(PATHS[name]).tree
        brought = {
            "mass_matrix": lambda q, t=tree: tmt.mass_matrix(q, t), "bias": lambda q, v, t=tree: tmt.bias(q, v, t),
            "gravity": lambda q, t=tree: tmt.gravity_balance(q, t),
            "acceleration": lambda q, v, tau, t=tree: tmt.acceleration(q, v, tau, t),
        }  # fmt: skip
        compare.assert_agrees(mujoco.MjModel.from_xml_path(str(PATHS[name])), **brought)
        compare.assert_agrees(PATHS[name], **brought, states=10)


def test_values_as_arrays_at_the_given_states(given):
    compare.assert_agrees(PENDULUM, **given.values, **given.states)
    flat = given.values | {"mass_matrix": given.values["mass_matrix"].reshape(12, 4)}  # a row of a CSV
    compare.assert_agrees(PENDULUM, **flat, **given.states)
    compare.assert_agrees(PENDULUM, mass_matrix=given.values["mass_matrix"].tolist(), q=given.states["q"].tolist())
    compare.assert_agrees(PENDULUM, mass_matrix=given.values["mass_matrix"], bias=bias, q=given.states["q"], qd=0.0)


def test_a_csv_as_numpy_reads_it(given, tmp_path):
    table = np.column_stack([*given.states.values(), given.values["mass_matrix"].reshape(12, 4), given.values["bias"]])
    np.savetxt(tmp_path / "export.csv", table, delimiter=",", fmt="%.17g")
    rows = np.loadtxt(tmp_path / "export.csv", delimiter=",")
    compare.assert_agrees(PENDULUM, q=rows[:, :2], qd=rows[:, 2:4], mass_matrix=rows[:, 6:10], bias=rows[:, 10:])


def test_one_state_without_a_batch(given):
    q, qd, tau = (part[0] for part in given.states.values())
    one = {name: value[0] for name, value in given.values.items()}
    compare.assert_agrees(PENDULUM, **one, q=q, qd=qd, tau=tau)
    compare.assert_agrees(PENDULUM, **RIGHT, q=q, qd=qd, tau=tau)


def test_one_joint_whose_table_has_one_column():
    inertial = '<inertial pos="1 0 0" mass="1" diaginertia="1 1 1"/>'
    text = f'<mujoco><worldbody><body><joint name="j" axis="0 1 0"/>{inertial}</body></worldbody></mujoco>'
    q = np.linspace(-1.0, 1.0, 5)
    compare.assert_agrees(
        text, q=q, qd=0.0, mass_matrix=np.full(5, 2.0), bias=-9.81 * np.cos(q), gravity=-9.81 * np.cos(q)
    )
    compare.assert_agrees(text, mass_matrix=lambda q: [[2.0]], gravity=lambda q: -9.81 * np.cos(q))


def test_sympy_matrices_with_their_symbols():
    a, b, da, db = symbols = sympy.symbols("a b da db")
    c, s, g = sympy.cos(b), sympy.sin(b), 9.81
    M = sympy.Matrix([[3.05 + 2 * c, 0.7 + c], [0.7 + c, 0.7]])
    lower = g * sympy.sin(a + b)
    h = sympy.Matrix([-s * (2 * da * db + db**2) + 2.5 * g * sympy.sin(a) + lower, s * da**2 + lower])
    compare.assert_agrees(PENDULUM, mass_matrix=(M, [a, b]), bias=(h, symbols))
    wrong = h + sympy.Matrix([2 * s * db**2, 0])
    assert "coefficient of qd1^2: yours is -1 times the right one" in message_of(bias=(wrong, symbols))


@pytest.mark.parametrize("batch", [False, True])
def test_functions_of_one_state_or_of_a_batch(batch):
    tree = TREE
    seen = []

    def of_tmt(q):
        seen.append(q.ndim)
        assert batch or q.ndim == 1
        return tmt.mass_matrix(q, tree)

    compare.assert_agrees(PENDULUM, mass_matrix=of_tmt)
    assert (seen.count(2) > 0 and len(seen) < 10) if batch else len(seen) >= 100


# the tolerance


def scale_of(name, given):
    scale = Entries(TREE, *(given.states[part] for part in ("q", "qd")))
    tau = given.states["tau"]
    return np.broadcast_to({
        "mass_matrix": scale.mass_matrix, "bias": scale.bias, "gravity": scale.weight,
        "acceleration": scale.acceleration(scale.force(tau), given.values["acceleration"]),
    }[name], given.values[name].shape)  # fmt: skip


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("rtol", [0.0, 1e-6])
@pytest.mark.parametrize("share, agrees", [(0.99, True), (1.01, False)])
def test_just_inside_and_just_outside_of_the_tolerance(name, rtol, share, agrees, given):
    values = given.values[name].copy()
    at = (7, *(1,) * (values.ndim - 1))
    values[at] += share * (FACTOR * EPS + rtol) * scale_of(name, given)[at]
    brought = {name: values, **given.states, "rtol": rtol}
    worst = compare.differences(PENDULUM, **brought)[0]
    assert (worst.ratio <= 1.0) is agrees and worst.ratio == pytest.approx(share, rel=1e-2)
    assert worst.tolerance == pytest.approx((FACTOR * EPS + rtol) * scale_of(name, given)[at], rel=1e-9)
    if agrees:
        compare.assert_agrees(PENDULUM, **brought)
    elif name == "acceleration":  # whose cause is not sought
        assert f"{name}: mismatched entries 1 / " in message_of(**brought)


def test_differences_are_every_entry_with_the_largest_ratio_first(given):
    values = given.values["bias"].copy()
    values[5, 1] += 1e-3
    values[2, 0] -= 1e-2
    found = compare.differences(PENDULUM, bias=values, **given.states)
    assert len(found) == 24 and [one.ratio for one in found] == sorted((one.ratio for one in found), reverse=True)
    first, second, third = found[:3]
    assert {(one.entry, one.state.number) for one in (first, second)} == {("h[hip]", 2), ("h[knee]", 5)}
    assert third.ratio <= 1.0 and third.cause == "" and first.cause == second.cause != ""
    for one in found:
        row, column = one.state.number, ["h[hip]", "h[knee]"].index(one.entry)
        assert one.yours == values[row, column] and one.mujoco == given.values["bias"][row, column]
        assert one.difference == one.yours - one.mujoco and one.quantity == "bias"
        assert np.allclose(one.state.q, given.states["q"][row]) and np.allclose(one.state.qd, given.states["qd"][row])
        assert np.allclose(one.state.tau, given.states["tau"][row])


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_what_is_not_finite_has_no_ratio(value, given):
    values = given.values["mass_matrix"].copy()
    values[3, 0, 1] = value
    worst = compare.differences(PENDULUM, mass_matrix=values, q=given.states["q"])[0]
    assert worst.ratio == np.inf and worst.entry == "M[hip][knee]" and worst.state.number == 3
    text = message_of(mass_matrix=values, q=given.states["q"])
    assert "yours is not a finite number" in text and "M[hip][knee] at state 3" in text


def test_rounded_constants_agree_with_rtol_and_without_it_their_digits_are_said(monkeypatch):
    monkeypatch.setattr("compare.agreement.why.SECONDS_OF_CAUSE", 0.1)

    def rounded(q):
        return mass_matrix(q) * [[1.0001, 1.0], [1.0, 0.9999]]

    text = message_of(mass_matrix=rounded)
    line = next(line for line in text.splitlines() if line.startswith("Yours agree to 4 digits"))
    rtol = float(line.rpartition("rtol=")[2].rstrip("."))
    assert rtol < 1e-3
    compare.assert_agrees(PENDULUM, mass_matrix=rounded, rtol=rtol)
    assert "digits" not in message_of(mass_matrix=lambda q: mass_matrix(q) * 1.2)


def test_a_slip_is_no_rounding_however_far_from_the_origin_the_model_stands(monkeypatch):
    """There the terms of each entry are large, and a difference of a tenth is a thousandth of them."""
    monkeypatch.setattr("compare.agreement.why.SECONDS_OF_CAUSE", 0.1)
    aloft = PENDULUM.replace("<worldbody>", '<worldbody><body pos="0 0 20">').replace(
        "</worldbody>", "</body></worldbody>"
    )
    assert aloft.count("20") == 1
    compare.assert_agrees(aloft, mass_matrix=mass_matrix)
    for factor, said in ((1.1, False), (1.0001, True)):
        with pytest.raises(AssertionError) as raised:
            compare.assert_agrees(aloft, mass_matrix=lambda q, factor=factor: mass_matrix(q) * factor)
        assert ("if your constants are rounded" in str(raised.value)) is said


# joints

STATED = ["-knee+90deg in deg", "hip"]
EXCHANGED = {
    "mass_matrix": lambda q: mass_matrix(q[ORDER])[ORDER][:, ORDER],
    "bias": lambda q, qd: bias(q[ORDER], qd[ORDER])[ORDER],
}


def turned():
    of = joint_map(robot_of(READING, "p").coordinates, STATED)

    def each(function):
        return lambda *rows: np.array([function(*one) for one in zip(*map(np.atleast_2d, rows))])

    return {
        "mass_matrix": lambda q: of.own_mass_matrix(each(mass_matrix)(of.positions(q)))[0],
        "bias": lambda q, v: of.own_forces(each(bias)(of.positions(q), of.speeds(v)))[0],
        "gravity": lambda q: of.own_forces(each(gravity)(of.positions(q)))[0],
        "acceleration": lambda q, v, t: of.own_forces(each(acceleration)(of.positions(q), of.speeds(v), of.forces(t)))[
            0
        ],
    }, of


def test_joints_as_they_are_stated_functions_and_arrays(given):
    functions, of = turned()
    compare.assert_agrees(PENDULUM, **functions, joints=STATED)
    q, qd, tau = (
        of.own_positions(given.states["q"]),
        of.own_speeds(given.states["qd"]),
        of.own_forces(given.states["tau"]),
    )
    arrays = {name: of.own_forces(values) for name, values in given.values.items() if name != "mass_matrix"}
    arrays["mass_matrix"] = of.own_mass_matrix(given.values["mass_matrix"])
    compare.assert_agrees(PENDULUM, **arrays, q=q, qd=qd, tau=tau, joints=STATED)
    compare.assert_agrees(PENDULUM, **functions, q=q, qd=qd, tau=tau, joints=STATED)
    arrays["mass_matrix"][4, 0, 1] += 1.0
    worst = compare.differences(PENDULUM, **arrays, q=q, qd=qd, tau=tau, joints=STATED)[0]
    assert worst.entry == "M[knee][hip]" and np.allclose(worst.state.q, q[4]) and np.allclose(worst.state.qd, qd[4])


@pytest.mark.parametrize("brought, stated", [
    (EXCHANGED, "joints=['knee', 'hip']"),
    ({"mass_matrix": lambda q: mass_matrix(-q), "bias": lambda q, v: -bias(-q, -v)}, None),
    ({"mass_matrix": lambda q: mass_matrix(np.radians(q)), "bias": lambda q, v: bias(np.radians(q), np.radians(v))},
     "joints=['hip in deg', 'knee in deg']"),
    ({"mass_matrix": lambda q: mass_matrix(q - [0, np.pi / 2]), "bias": lambda q, v: bias(q - [0, np.pi / 2], v)},
     "'knee+90deg'"),
])  # fmt: skip
def test_the_message_says_how_to_state_the_joints(brought, stated):
    """Both senses at once change nothing: the pendulum's mirror image."""
    if stated is None:
        compare.assert_agrees(PENDULUM, **brought)
        return
    text = message_of(**brought)
    assert f"state it as {stated}" in text
    joints = eval(stated.removeprefix("joints=")) if stated.startswith("joints") else ["hip", "knee+90deg"]
    compare.assert_agrees(PENDULUM, **brought, joints=joints)


def test_joints_that_are_stated_wrongly_are_stated_anew():
    text = message_of(**EXCHANGED, joints=["knee", "-hip"])
    assert "state it as joints=['knee', 'hip']" in text
    assert "That is to take the place of joints=['knee', '-hip']." in text
    assert text.splitlines()[-1] == "Compared with joints=['knee', '-hip']."


# the message


def test_the_message_in_the_manner_of_numpy_testing(given):
    values = given.values["bias"].copy()
    values[7, 1] += 0.25
    lines = message_of(bias=values, gravity=given.values["gravity"], **given.states).splitlines()
    assert lines[0] == "Not equal to MuJoCo to tolerance (64 eps) x the scale of each entry"
    assert lines[1] == "bias: mismatched entries 1 / 24 (4.17 %), at 1 / 12 states"
    q, qd = (given.states[name][7] for name in ("q", "qd"))
    assert lines[2].startswith(
        f"  worst: h[knee] at state 7, q = [{q[0]:.6g}, {q[1]:.6g}], qd = [{qd[0]:.6g}, {qd[1]:.6g}]"
    )
    assert float(lines[3].removeprefix("    yours:  ")) == values[7, 1]
    assert float(lines[4].removeprefix("    MuJoCo: ")) == given.values["bias"][7, 1]
    assert lines[5].startswith("    difference: 0.25, ") and "times its tolerance of" in lines[5]
    assert lines[6].startswith("Probable cause: None of the changes that are tried, nor two of them, explains this")
    assert lines[-1] == (
        "Compared with joints=['hip', 'knee']; another order, or '-hip', 'hip+90deg' and 'hip in deg', can be stated."
    )
    assert not any(line.startswith("gravity") for line in lines)


@pytest.mark.parametrize("brought, cause", [
    ({"bias": wrong_bias}, "h[0], coefficient of qd1^2: yours is -1 times the right one."),
    ({"mass_matrix": mass_matrix, "bias": wrong_bias}, "h[0], coefficient of qd1^2: yours is -1 times the right one."),
    ({"gravity": lambda q: -gravity(q)}, "gravity"), ({"gravity": lambda q: gravity(q) * [1, 2]}, "h[1] at rest"),
    ({"acceleration": lambda q, v, t: np.linalg.solve(mass_matrix(q), t - bias(q, v))}, "damping in the acceleration: left out"),
    ({"acceleration": lambda q, v, t: acceleration(q, v, -t)}, "torque in the acceleration: of the other sign"),
    ({"acceleration": lambda q, v, t: np.linalg.solve(mass_matrix(q), t - wrong_bias(q, v) - np.array([0.3, 0]) * v)},
     "h[0], coefficient of qd1^2: yours is -1 times the right one."),
    (RIGHT | {"acceleration": lambda q, v, t: acceleration(q, v, t) * [1.0, 1.1]}, "mass_matrix and bias agree"),
    (RIGHT | {"bias": lambda q, v: bias(q, v) + 0.1 * v}, "damping of every joint in h: 0.1 N m s/rad in place of 0"),
    (RIGHT | {"bias": lambda q, v: bias(q, v) + 0.1 * v[::-1]}, "Your bias is linear in qd: is damping in it?"),
])  # fmt: skip
def test_the_probable_cause_of(brought, cause):
    assert cause in message_of(**brought)


def test_the_cause_is_sought_where_there_are_values(rng):
    q, qd = rng.uniform(-2.0, 2.0, (2, 50, 2))
    values = np.array([wrong_bias(*state) for state in zip(q, qd)])
    values[:30] = np.nan
    assert "Probable cause: h[0], coefficient of qd1^2: yours is -1 times the right one.\n" in message_of(
        mass_matrix=mass_matrix, bias=values, q=q, qd=qd
    )


def test_there_is_no_cause_of_what_is_no_number():
    text = message_of(mass_matrix=lambda q: np.full((2, 2), np.nan))
    assert "cause" not in text and "mass_matrix is not finite at q = [" in text


def test_one_triangle_alone_is_wrong(given):
    values = given.values["mass_matrix"].copy()
    values[:, 0, 1] += 0.1
    text = message_of(mass_matrix=values, q=given.states["q"])
    assert "Probable cause: Your M is not symmetric: M[0][1] is " in text and "entries 12 / 48" in text


def test_values_of_accelerations_alone_have_no_cause_of_their_own(given):
    values = given.values["acceleration"] * [1.0, 1.1]
    assert "give mass_matrix and bias too" in message_of(acceleration=values, **given.states)
    undamped = np.array([np.linalg.solve(mass_matrix(q), t - bias(q, v)) for q, v, t in zip(*given.states.values())])
    assert "damping in the acceleration: left out" in message_of(acceleration=undamped, **given.states)


def test_a_function_that_changes_its_argument_does_not_agree():
    def changing(q):
        M = mass_matrix(q)
        q += 1.0
        return M

    text = message_of(mass_matrix=changing)
    assert text.splitlines()[0] == "Equal to MuJoCo, but" and "mass_matrix changes its argument q at q = [" in text


def test_one_that_raises_later_is_said():
    def raising(q):
        if q[0] > 2.0:
            raise ArithmeticError("too far")
        return mass_matrix(q)

    text = message_of(mass_matrix=raising)
    assert "mass_matrix raised ArithmeticError: too far (test_agreement_of_own.py, line " in text
    assert "yours is not a finite number" in text


# what cannot be compared


@pytest.mark.parametrize("brought, said", [
    ({}, "there is nothing to compare"), ({"bias": bias, "rtol": -1.0}, "rtol is -1.0"),
    ({"bias": bias, "rtol": "x"}, "rtol is 'x'"), ({"bias": bias, "states": 0}, "states is 0; a whole number"),
    ({"bias": bias, "states": 2.5}, "states is 2.5"), ({"bias": bias, "seed": -1}, "seed is -1"),
    ({"bias": np.zeros((3, 2))}, "bias is an array of values, but not q; q of shape"),
    ({"bias": bias, "qd": 0.0}, "qd is given, but not q"),
    ({"bias": bias, "q": np.zeros((3, 2))}, r"bias depends on qd; qd of shape \(3, 2\) is expected, or 0.0"),
    ({"acceleration": acceleration, "q": np.zeros((3, 2)), "qd": 0.0}, "acceleration depends on tau"),
    ({"bias": bias, "q": np.zeros((3, 3)), "qd": 0.0}, r"q has shape \(3, 3\); \(states, 2\) is expected"),
    ({"bias": bias, "q": np.zeros((3, 2)), "qd": np.zeros((2, 2))}, r"qd has shape \(2, 2\); \(3, 2\) is expected"),
    ({"bias": bias, "q": [[0, np.nan]], "qd": 0.0}, "q has values that are not finite"),
    ({"bias": bias, "q": [["a", "b"]], "qd": 0.0}, "q is .* real numbers of shape"),
    ({"bias": np.zeros((3, 3)), "q": np.zeros((3, 2)), "qd": 0.0}, r"bias has shape \(3, 3\); \(3, 2\) is expected"),
    ({"bias": "h", "q": np.zeros((3, 2)), "qd": 0.0}, "bias is 'h'; real numbers of shape"),
    ({"mass_matrix": np.zeros((3, 2)), "q": np.zeros((3, 2))}, r"mass_matrix has shape \(3, 2\); \(3, 2, 2\) is expected"),
])  # fmt: skip
def test_what_cannot_be_compared_is_one_line(brought, said):
    for function in (compare.assert_agrees, compare.differences):
        with pytest.raises(ValueError, match=said) as error:
            function(PENDULUM, **brought)
        assert "\n" not in str(error.value)


@pytest.mark.parametrize("mjcf, said", [
    ("nowhere.xml", "cannot read nowhere.xml: No such file"), (3, "a int cannot be read; a path, MJCF text or an MjModel"),
    ("<mujoco><worldbody/></mujoco>", "the text cannot be compared: it has no joint"), ("<a>", "the text is not MJCF"),
])  # fmt: skip
def test_models_that_cannot_be_compared(mjcf, said):
    with pytest.raises(ModelError, match=said) as error:
        compare.assert_agrees(mjcf, bias=bias)
    assert "\n" not in str(error.value)


def test_functions_and_joints_that_cannot_be_used():
    with pytest.raises(OwnError, match=r"bias has shape \(2, 2\); \(2,\) is expected, at q = \["):
        compare.assert_agrees(PENDULUM, bias=lambda q, v: np.eye(2))
    with pytest.raises(JointsError, match="there is no joint 'foot'"):
        compare.assert_agrees(PENDULUM, bias=bias, joints=["hip", "foot"])


def test_a_quaternion_of_another_length():
    q = np.tile(read(PATHS["pendulum_ball"]).qpos0, (3, 1))
    q[1] *= 1.1
    with pytest.raises(ValueError, match="is no quaternion of length 1 at every state"):
        compare.assert_agrees(PATHS["pendulum_ball"], mass_matrix=lambda q: np.eye(6), q=q)


# states and time


def test_random_states_are_the_same_by_the_same_seed():
    one, same, other = (compare.differences(PENDULUM, bias=bias, seed=seed, states=5) for seed in (1, 1, 2))
    assert one == same and {d.state for d in one}.isdisjoint({d.state for d in other})
    assert len({d.state for d in one}) == 5


def test_slow_functions_are_compared_at_fewer_states_and_that_is_said(monkeypatch):
    monkeypatch.setattr("compare.agreement.given.OWN_SECONDS", 0.2)

    def slow(q):
        time.sleep(0.02)
        return mass_matrix(q)

    with pytest.warns(UserWarning, match="states in place of 100: your functions take") as caught:
        found = compare.differences(PENDULUM, mass_matrix=slow)
    assert caught[0].filename == __file__ or caught[0].filename.endswith("agreement/__init__.py")
    assert 4 <= len(found) <= 40
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        q = np.zeros((15, 2))
        assert len(compare.differences(PENDULUM, mass_matrix=slow, q=q)) == 60  # all that are given


# the package


def test_import_compare_loads_neither_mujoco_nor_numba():
    program = (
        "import sys, compare; from compare import assert_agrees, differences; assert 'differences' in dir(compare)\n"
        "print({'mujoco', 'numba', 'scipy', 'pandas', 'matplotlib'} & set(sys.modules))"
    )
    run = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, cwd=ROOT)
    assert run.stdout == "set()\n", run.stderr


def test_the_signature_is_the_one_that_is_promised():
    expected = (
        "(mjcf, *, mass_matrix=None, bias=None, gravity=None, acceleration=None, q=None, qd=None, tau=None, joints=None, "
        "rtol=0.0, states=100, seed=0)"
    )
    for function in (compare.assert_agrees, compare.differences):
        plain = inspect.signature(function)
        plain = plain.replace(
            parameters=[p.replace(annotation=p.empty) for p in plain.parameters.values()], return_annotation=plain.empty
        )
        assert str(plain) == expected
    with pytest.raises(AttributeError, match="has no attribute 'agrees'"):
        _ = compare.agrees
