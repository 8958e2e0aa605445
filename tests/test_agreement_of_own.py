"""assert_agrees and differences: equations of one's own compared with MuJoCo, in Python."""

import inspect
import os
import subprocess
import sys
import time
import warnings
from pathlib import Path

import mujoco
import numpy as np
import pytest
import sympy
from double_pendulum import (
    NAMES,
    PENDULUM,
    READING,
    RIGHT,
    TREE,
    acceleration,
    bias,
    gravity,
    mass_matrix,
    message_of,
    wrong_bias,
)
from double_pendulum import given_states as given_states
from models import PATHS

import compare
import tmt
from compare.engines.mujoco import ModelError, read
from compare.engines.own import OwnError
from compare.joint_map import JointsError, joint_map
from compare.judge.entries import Entries
from compare.judge.scale import EPS, FACTOR
from compare.robots.file import robot_of

ROOT = Path(__file__).resolve().parent.parent
SIGN = "h[hip], coefficient of knee'^2: yours is -1 times"


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
    found = [compare.differences(one, bias=bias, seed=3) for one in (PENDULUM, path, str(path), "pendulum.xml", model)]
    assert all(one == found[0] for one in found[1:])
    assert (model.opt.disableflags, model.opt.integrator) == before[:2] and np.array_equal(model.dof_damping, before[2])
    assert os.listdir() == ["pendulum.xml"]  # no log, no cache


@pytest.mark.parametrize("name", ["mixed", "gripper", "loop"])
def test_contacts_limits_and_the_like_of_a_compiled_model_are_off(name):
    tree = read(PATHS[name]).tree
    brought = {
        "mass_matrix": lambda q: tmt.mass_matrix(q, tree), "bias": lambda q, v: tmt.bias(q, v, tree),
        "gravity": lambda q: tmt.gravity_balance(q, tree), "acceleration": lambda q, v, tau: tmt.acceleration(q, v, tau, tree),
    }  # fmt: skip
    compare.assert_agrees(mujoco.MjModel.from_xml_path(str(PATHS[name])), **brought, states=10)
    compare.assert_agrees(PATHS[name], **brought, states=10)


def test_values_as_arrays_at_the_given_states(given, tmp_path):
    compare.assert_agrees(PENDULUM, **given.values, **given.states)
    compare.assert_agrees(PENDULUM, mass_matrix=given.values["mass_matrix"].tolist(), q=given.states["q"].tolist())
    compare.assert_agrees(PENDULUM, mass_matrix=given.values["mass_matrix"], bias=bias, q=given.states["q"], qd=0.0)
    table = np.column_stack([*given.states.values(), given.values["mass_matrix"].reshape(12, 4), given.values["bias"]])
    np.savetxt(tmp_path / "export.csv", table, delimiter=",", fmt="%.17g")
    rows = np.loadtxt(tmp_path / "export.csv", delimiter=",")
    compare.assert_agrees(PENDULUM, q=rows[:, :2], qd=rows[:, 2:4], mass_matrix=rows[:, 6:10], bias=rows[:, 10:])
    q, qd, tau = (part[0] for part in given.states.values())
    for one in ({name: value[0] for name, value in given.values.items()}, RIGHT):  # one state without a batch
        compare.assert_agrees(PENDULUM, **one, q=q, qd=qd, tau=tau)


def test_one_joint_whose_table_has_one_column():
    inertial = '<inertial pos="1 0 0" mass="1" diaginertia="1 1 1"/>'
    text = f'<mujoco><worldbody><body><joint name="j" axis="0 1 0"/>{inertial}</body></worldbody></mujoco>'
    q = np.linspace(-1.0, 1.0, 5)
    weight = -9.81 * np.cos(q)
    compare.assert_agrees(text, q=q, qd=0.0, mass_matrix=np.full(5, 2.0), bias=weight, gravity=weight)
    compare.assert_agrees(text, mass_matrix=lambda q: [[2.0]], gravity=lambda q: -9.81 * np.cos(q))


def test_sympy_matrices_with_their_symbols():
    a, b, da, db = symbols = sympy.symbols("a b da db")
    c, s, g = sympy.cos(b), sympy.sin(b), 9.81
    M = sympy.Matrix([[3.05 + 2 * c, 0.7 + c], [0.7 + c, 0.7]])
    lower = g * sympy.sin(a + b)
    h = sympy.Matrix([-s * (2 * da * db + db**2) + 2.5 * g * sympy.sin(a) + lower, s * da**2 + lower])
    compare.assert_agrees(PENDULUM, mass_matrix=(M, [a, b]), bias=(h, symbols))
    assert SIGN in message_of(bias=(h + sympy.Matrix([2 * s * db**2, 0]), symbols))


@pytest.mark.parametrize("batch", [False, True])
def test_functions_of_one_state_or_of_a_batch(batch):
    seen = []

    def of_tmt(q):
        seen.append(q.ndim)
        assert batch or q.ndim == 1
        return tmt.mass_matrix(q, TREE)

    compare.assert_agrees(PENDULUM, mass_matrix=of_tmt)
    assert (seen.count(2) > 0 and len(seen) < 10) if batch else len(seen) >= 100


# the tolerance


def scale_of(name, given):
    scale, tau = Entries(TREE, given.states["q"], given.states["qd"]), given.states["tau"]
    return np.broadcast_to({
        "mass_matrix": scale.mass_matrix, "bias": scale.bias, "gravity": scale.weight,
        "acceleration": scale.acceleration(scale.force(tau), given.values["acceleration"]),
    }[name], given.values[name].shape)  # fmt: skip


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("rtol", [0.0, 1e-6])
@pytest.mark.parametrize("share, agrees", [(0.99, True), (1.01, False)])
def test_just_inside_and_just_outside_of_the_tolerance(name, rtol, share, agrees, given, monkeypatch):
    monkeypatch.setattr("compare.agreement.why.SECONDS_OF_CAUSE", 0.05)
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
        for name, part in given.states.items():
            assert np.allclose(getattr(one.state, name), part[row])


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_a_value_that_is_not_finite_has_no_ratio(value, given):
    values = given.values["mass_matrix"].copy()
    values[3, 0, 1] = value
    worst = compare.differences(PENDULUM, mass_matrix=values, q=given.states["q"])[0]
    assert worst.ratio == np.inf and worst.entry == "M[hip][knee]" and worst.state.number == 3


@pytest.mark.parametrize("height, factors", [(0, (1.2, 1.0001)), (20, (1.1, 1.0001))])
def test_only_rounded_constants_get_an_rtol_however_far_from_the_origin_the_model_stands(height, factors, monkeypatch):
    """Far away the terms of each entry are large, and a difference of a tenth is a thousandth of them."""
    monkeypatch.setattr("compare.agreement.why.SECONDS_OF_CAUSE", 0.1)
    aloft = PENDULUM.replace("<worldbody>", f'<worldbody><body pos="0 0 {height}">')
    aloft = aloft.replace("</worldbody>", "</body></worldbody>")
    for factor, is_rounded in zip(factors, (False, True)):

        def scaled(q, factor=factor):
            return mass_matrix(q) * factor

        with pytest.raises(AssertionError) as raised:
            compare.assert_agrees(aloft, mass_matrix=scaled)
        _, found, rtol = str(raised.value).partition("rtol=")
        assert bool(found) is is_rounded
        if is_rounded:
            compare.assert_agrees(aloft, mass_matrix=scaled, rtol=float(rtol.split()[0].rstrip(".")))


# joints

STATED = ["-knee+90deg in deg", "hip"]


def in_joints(stated):
    """The right equations of one state, in other joints, and these."""
    of = joint_map(robot_of(READING, "p").coordinates, stated)
    return {
        "mass_matrix": lambda q: of.own_mass_matrix(mass_matrix(of.positions(q))),
        "bias": lambda q, v: of.own_forces(bias(of.positions(q), of.speeds(v))),
        "gravity": lambda q: of.own_forces(gravity(of.positions(q))),
        "acceleration": lambda q, v, t: of.own_forces(acceleration(of.positions(q), of.speeds(v), of.forces(t))),
    }, of


def test_functions_and_arrays_in_stated_joints(given):
    functions, of = in_joints(STATED)
    compare.assert_agrees(PENDULUM, **functions, joints=STATED)
    turned = of.own_positions(given.states["q"]), of.own_speeds(given.states["qd"]), of.own_forces(given.states["tau"])
    q, qd, tau = turned
    arrays = {name: of.own_forces(values) for name, values in given.values.items() if name != "mass_matrix"}
    arrays["mass_matrix"] = of.own_mass_matrix(given.values["mass_matrix"])
    compare.assert_agrees(PENDULUM, **arrays, q=q, qd=qd, tau=tau, joints=STATED)
    compare.assert_agrees(PENDULUM, **functions, q=q, qd=qd, tau=tau, joints=STATED)
    arrays["mass_matrix"][4, 0, 1] += 1.0
    worst = compare.differences(PENDULUM, **arrays, q=q, qd=qd, tau=tau, joints=STATED)[0]
    assert worst.entry == "M[knee][hip]" and np.allclose(worst.state.q, q[4]) and np.allclose(worst.state.qd, qd[4])


JOINTS = {  # stated, right
    "order": (None, ["knee", "hip"]),
    "units of all": (None, ["hip in deg", "knee in deg"]),
    "zero": (None, ["hip", "knee+90deg"]),
    "stated wrongly": (["knee", "-hip"], ["knee", "hip"]),
    "sense, after an order": (["knee", "hip"], ["knee", "-hip"]),
    "zero, after an order": (["knee", "hip"], ["knee+30deg", "hip"]),
    "units, after a sense": (["-knee", "hip"], ["-knee in deg", "hip in deg"]),
    "one too many": (["hip", "-knee"], ["hip", "knee"]),
}


@pytest.mark.parametrize("stated, right", JOINTS.values(), ids=JOINTS)
def test_the_message_says_how_to_state_the_joints(stated, right):
    functions, _ = in_joints(right)
    brought = {name: functions[name] for name in ("mass_matrix", "bias")}
    text = message_of(**brought, joints=stated)
    told = text.partition("state it as joints=")[2].partition(")")[0].partition("]")[0] + "]"
    compare.assert_agrees(PENDULUM, **brought, joints=eval(told))
    if stated:
        assert str(stated) in text.splitlines()[-1]


def test_both_senses_at_once_are_the_mirror_image_of_the_pendulum():
    compare.assert_agrees(PENDULUM, mass_matrix=lambda q: mass_matrix(-q), bias=lambda q, v: -bias(-q, -v))


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


# the message


def test_the_message_has_the_worst_entry_with_its_state(given):
    values = given.values["bias"].copy()
    values[7, 1] += 0.25
    lines = message_of(bias=values, gravity=given.values["gravity"], **given.states).splitlines()
    assert lines[1] == "bias: mismatched entries 1 / 24 (4.17 %), at 1 / 12 states"
    q, qd = (given.states[name][7] for name in ("q", "qd"))
    state = f"q = [{q[0]:.6g}, {q[1]:.6g}], qd = [{qd[0]:.6g}, {qd[1]:.6g}]"
    assert lines[2].startswith(f"  worst: h[knee] at state 7, {state}")
    assert float(lines[3].split()[-1]) == values[7, 1] and float(lines[4].split()[-1]) == given.values["bias"][7, 1]
    assert " 0.25, " in lines[5] and not any(line.startswith("gravity") for line in lines)


@pytest.mark.parametrize("brought, cause", [
    ({"bias": wrong_bias}, SIGN), ({"mass_matrix": mass_matrix, "bias": wrong_bias}, SIGN),
    ({"gravity": lambda q: -gravity(q)}, "gravity"), ({"gravity": lambda q: gravity(q) * [1, 2]}, "h[knee] at rest"),
    ({"acceleration": lambda q, v, t: np.linalg.solve(mass_matrix(q), t - bias(q, v))}, "damping in the acceleration"),
    ({"acceleration": lambda q, v, t: acceleration(q, v, -t)}, "torque in the acceleration"),
    ({"acceleration": lambda q, v, t: np.linalg.solve(mass_matrix(q), t - wrong_bias(q, v) - np.array([0.3, 0]) * v)}, SIGN),
    (RIGHT | {"acceleration": lambda q, v, t: acceleration(q, v, t) * [1.0, 1.1]}, "mass_matrix and bias"),
    (RIGHT | {"bias": lambda q, v: bias(q, v) + 0.1 * v}, "0.1 N m s/rad"),
    (RIGHT | {"bias": lambda q, v: bias(q, v) + 0.1 * v[::-1]}, "damping"),
])  # fmt: skip
def test_the_probable_cause_of(brought, cause):
    assert cause in message_of(**brought).partition("Probable cause: ")[2]


def test_the_cause_is_sought_where_there_are_values(rng):
    q, qd = rng.uniform(-2.0, 2.0, (2, 50, 2))
    values = np.array([wrong_bias(*state) for state in zip(q, qd)])
    values[:30] = np.nan
    assert SIGN in message_of(mass_matrix=mass_matrix, bias=values, q=q, qd=qd)
    nowhere = message_of(mass_matrix=lambda q: np.full((2, 2), np.nan))
    assert "cause" not in nowhere and "mass_matrix is not finite at q = [" in nowhere


def test_causes_of_tables(given):
    values = given.values["mass_matrix"].copy()
    values[:, 0, 1] += 0.1  # one triangle alone
    text = message_of(mass_matrix=values, q=given.states["q"])
    assert "symmetric: M[hip][knee]" in text and "entries 12 / 48" in text
    scaled = message_of(acceleration=given.values["acceleration"] * [1.0, 1.1], **given.states)
    assert "give mass_matrix and bias" in scaled
    undamped = np.array([np.linalg.solve(mass_matrix(q), t - bias(q, v)) for q, v, t in zip(*given.states.values())])
    assert "damping in the acceleration" in message_of(acceleration=undamped, **given.states)


def test_functions_that_change_their_argument_or_raise_later_do_not_agree():
    def changing(q):
        M = mass_matrix(q)
        q += 1.0
        return M

    def raising(q):
        if q[0] > 2.0:
            raise ArithmeticError("too far")
        return mass_matrix(q)

    assert "mass_matrix changes its argument q at q = [" in message_of(mass_matrix=changing)
    assert "ArithmeticError: too far (test_agreement_of_own.py, line " in message_of(mass_matrix=raising)


# what cannot be compared


@pytest.mark.parametrize("brought, word", [
    ({}, "acceleration"), ({"bias": bias, "rtol": -1.0}, "rtol is -1.0"), ({"bias": bias, "rtol": "x"}, "rtol is 'x'"),
    ({"bias": bias, "states": 0}, "states is 0"), ({"bias": bias, "states": 2.5}, "states is 2.5"),
    ({"bias": bias, "seed": -1}, "seed is -1"), ({"bias": np.zeros((3, 2))}, "bias .* not q"),
    ({"bias": bias, "qd": 0.0}, "qd .* not q"), ({"bias": bias, "q": np.zeros((3, 2))}, r"qd of shape \(3, 2\)"),
    ({"acceleration": acceleration, "q": np.zeros((3, 2)), "qd": 0.0}, "depends on tau"),
    ({"bias": bias, "q": np.zeros((3, 3)), "qd": 0.0}, r"q has shape \(3, 3\); \(states, 2\)"),
    ({"bias": bias, "q": np.zeros((3, 2)), "qd": np.zeros((2, 2))}, r"qd has shape \(2, 2\); \(3, 2\)"),
    ({"bias": bias, "q": [[0, np.nan]], "qd": 0.0}, "finite"), ({"bias": bias, "q": [["a", "b"]], "qd": 0.0}, "q is "),
    ({"bias": np.zeros((3, 3)), "q": np.zeros((3, 2)), "qd": 0.0}, r"bias has shape \(3, 3\); \(3, 2\)"),
    ({"bias": "h", "q": np.zeros((3, 2)), "qd": 0.0}, "bias is 'h'"), ({"mass_matrix": inspect}, "mass_matrix is "),
    ({"mass_matrix": np.zeros((3, 2)), "q": np.zeros((3, 2))}, r"mass_matrix has shape \(3, 2\); \(3, 2, 2\)"),
])  # fmt: skip
def test_what_cannot_be_compared_is_one_line(brought, word):
    for function in (compare.assert_agrees, compare.differences):
        with pytest.raises(ValueError, match=word) as error:
            function(PENDULUM, **brought)
        assert "\n" not in str(error.value)


TURNED = np.tile(read(PATHS["pendulum_ball"]).qpos0, (3, 1)) * np.array([1.0, 1.1, 1.0])[:, None]


@pytest.mark.parametrize("mjcf, brought, error, word", [
    ("nowhere.xml", {"bias": bias}, ModelError, "nowhere.xml"), (3, {"bias": bias}, ModelError, "int"),
    ("<mujoco><worldbody/></mujoco>", {"bias": bias}, ModelError, "no joint"), ("<a>", {"bias": bias}, ModelError, "MJCF"),
    (PENDULUM, {"bias": lambda q, v: np.eye(2)}, OwnError, r"\(2, 2\); \(2,\) .* at q = \["),
    (PENDULUM, {"bias": bias, "joints": ["hip", "foot"]}, JointsError, "'foot'"),
    (PATHS["pendulum_ball"], {"mass_matrix": lambda q: np.eye(6), "q": TURNED}, ValueError, "length 1"),
])  # fmt: skip
def test_models_functions_and_joints_that_cannot_be_used(mjcf, brought, error, word):
    with pytest.raises(error, match=word) as raised:
        compare.assert_agrees(mjcf, **brought)
    assert "\n" not in str(raised.value)


# states and time


def test_random_states_are_the_same_by_the_same_seed():
    one, same, other = (compare.differences(PENDULUM, bias=bias, seed=seed, states=5) for seed in (1, 1, 2))
    assert one == same and {d.state for d in one}.isdisjoint({d.state for d in other})
    assert len({d.state for d in one}) == 5


def test_slow_functions_are_compared_at_fewer_states_with_a_warning(monkeypatch):
    monkeypatch.setattr("compare.agreement.given.OWN_SECONDS", 0.2)

    def slow(q):
        time.sleep(0.02)
        return mass_matrix(q)

    with pytest.warns(UserWarning, match="100"):
        found = compare.differences(PENDULUM, mass_matrix=slow)
    assert 4 <= len(found) <= 40
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert len(compare.differences(PENDULUM, mass_matrix=slow, q=np.zeros((15, 2)))) == 60  # all that are given


@pytest.mark.parametrize(
    "more, word", [({"q": np.zeros((5, 2)), "states": 500}, "500"), ({"states": 10**6}, "1,000,000")]
)
def test_states_that_are_not_compared_are_warned_of(more, word, monkeypatch):
    monkeypatch.setattr("compare.states.MOST_NUMBERS", 120)
    with pytest.warns(UserWarning, match=word) as caught:
        compare.assert_agrees(PENDULUM, mass_matrix=mass_matrix, **more)
    assert caught[0].filename == __file__


# the package


def test_import_compare_loads_neither_mujoco_nor_llvmlite():
    program = (
        "import sys, compare; from compare import assert_agrees, differences; assert 'differences' in dir(compare)\n"
        "print({'mujoco', 'llvmlite', 'scipy', 'pandas', 'matplotlib'} & set(sys.modules))"
    )
    run = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, cwd=ROOT)
    assert run.stdout == "set()\n", run.stderr


def test_both_functions_take_the_same_and_every_field_is_explained():
    one, other = (list(inspect.signature(f).parameters.values()) for f in (compare.assert_agrees, compare.differences))
    assert [(p.name, p.kind, p.default) for p in one] == [(p.name, p.kind, p.default) for p in other]
    assert [p.name for p in one] == ["mjcf", *NAMES, "q", "qd", "tau", "joints", "rtol", "states", "seed"]
    fields = compare.differences(PENDULUM, bias=bias, states=1)[0]
    assert all(f"{name}:" in fields.__doc__ or f"{name}," in fields.__doc__ for name in fields._fields)
    with pytest.raises(AttributeError):
        _ = compare.agrees
