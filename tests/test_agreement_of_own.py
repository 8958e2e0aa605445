"""assert_agrees and differences: equations of one's own compared with MuJoCo, in Python."""

import os
from pathlib import Path

import mujoco
import numpy as np
import pytest
import sympy
from double_pendulum import (
    NAMES,
    ORDER,
    PENDULUM,
    READING,
    RIGHT,
    TREE,
    acceleration,
    bias,
    gravity,
    mass_matrix,
    message_of,
)
from double_pendulum import given_states as given_states
from models import PATHS

import compare
import tmt
from compare.engines.mujoco import read
from compare.joint_map import joint_map
from compare.judge.entries import Entries
from compare.judge.scale import EPS, FACTOR
from compare.robots.file import robot_of

ROOT = Path(__file__).resolve().parent.parent


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
    assert "coefficient of knee'^2: yours is -1 times the right one" in message_of(bias=(wrong, symbols))


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
     "joints=['hip', 'knee+90deg']"),
])  # fmt: skip
def test_the_message_says_how_to_state_the_joints(brought, stated):
    """Both senses at once change nothing: the pendulum's mirror image."""
    if stated is None:
        compare.assert_agrees(PENDULUM, **brought)
        return
    text = message_of(**brought)
    assert f"state it as {stated}" in text
    compare.assert_agrees(PENDULUM, **brought, joints=eval(stated.removeprefix("joints=")))


def test_joints_that_are_stated_wrongly_are_stated_anew():
    text = message_of(**EXCHANGED, joints=["knee", "-hip"])
    assert "state it as joints=['knee', 'hip']" in text
    assert "That is to take the place of joints=['knee', '-hip']." in text
    assert text.splitlines()[-1] == "Compared with joints=['knee', '-hip']."


SHORT = {  # stated, what is right
    "a sense": (["knee", "hip"], ["knee", "-hip"]),
    "a zero": (["knee", "hip"], ["knee+30deg", "hip"]),
    "units": (["-knee", "hip"], ["-knee in deg", "hip in deg"]),
    "one too many": (["hip", "-knee"], ["hip", "knee"]),
}


@pytest.mark.parametrize("stated, right", SHORT.values(), ids=SHORT)
def test_the_step_that_is_missing_is_told_together_with_what_is_stated(stated, right):
    of = joint_map(robot_of(READING, "p").coordinates, right)
    brought = {
        "mass_matrix": lambda q: of.own_mass_matrix(mass_matrix(of.positions(q))),
        "bias": lambda q, v: of.own_forces(bias(of.positions(q), of.speeds(v))),
    }
    text = message_of(**brought, joints=stated)
    told = text.partition("state it as joints=")[2].partition(")")[0]
    compare.assert_agrees(PENDULUM, **brought, joints=eval(told))
    assert text.index("state it as") < text.find("would explain it") or "would explain it" not in text


def test_joints_after_joints():
    coordinates = robot_of(READING, "p").coordinates
    first, then = joint_map(coordinates, ["-knee+90deg", "hip in deg"]), joint_map(coordinates, ["knee", "-hip+0.3rad"])
    both = then.after(first, coordinates)
    q, v = np.random.default_rng(0).uniform(-1.0, 1.0, (2, 5, 2))
    assert [joint.name for joint in both.joints] == ["hip", "knee"] and both.joints[0].unit == "deg"
    inner = first.own_positions(q)
    assert np.allclose(np.cos(both.own_positions(q)), np.cos(then.own_positions(inner)))
    assert np.allclose(both.own_speeds(v), then.own_speeds(first.own_speeds(v)))
    degrees = joint_map(coordinates, ["hip", "knee in deg"])
    assert degrees.after(degrees, coordinates) is None
