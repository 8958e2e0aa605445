"""assert_agrees: its message, what cannot be compared, random states, and the package's own face."""

import inspect
import subprocess
import sys
import time
import warnings
from pathlib import Path

import numpy as np
import pytest
from double_pendulum import (
    PENDULUM,
    RIGHT,
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
from compare.engines.mujoco import ModelError, read
from compare.engines.own import OwnError
from compare.joint_map import JointsError

ROOT = Path(__file__).resolve().parent.parent


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
    assert lines[6].startswith("Probable cause: No single change that is tried explains all of this, nor do two")
    assert lines[-1] == (
        "Compared with joints=['hip', 'knee']; another order, or '-hip', 'hip+90deg' and 'hip in deg', can be stated."
    )
    assert not any(line.startswith("gravity") for line in lines)


@pytest.mark.parametrize("brought, cause", [
    ({"bias": wrong_bias}, "h[hip], coefficient of knee'^2: yours is -1 times the right one."),
    ({"mass_matrix": mass_matrix, "bias": wrong_bias}, "h[hip], coefficient of knee'^2: yours is -1 times the right one."),
    ({"gravity": lambda q: -gravity(q)}, "gravity"), ({"gravity": lambda q: gravity(q) * [1, 2]}, "h[knee] at rest"),
    ({"acceleration": lambda q, v, t: np.linalg.solve(mass_matrix(q), t - bias(q, v))}, "damping in the acceleration: left out"),
    ({"acceleration": lambda q, v, t: acceleration(q, v, -t)}, "torque in the acceleration: of the other sign"),
    ({"acceleration": lambda q, v, t: np.linalg.solve(mass_matrix(q), t - wrong_bias(q, v) - np.array([0.3, 0]) * v)},
     "h[hip], coefficient of knee'^2: yours is -1 times the right one."),
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
    assert "Probable cause: h[hip], coefficient of knee'^2: yours is -1 times the right one.\n" in message_of(
        mass_matrix=mass_matrix, bias=values, q=q, qd=qd
    )


def test_there_is_no_cause_of_what_is_no_number():
    text = message_of(mass_matrix=lambda q: np.full((2, 2), np.nan))
    assert "cause" not in text and "mass_matrix is not finite at q = [" in text


def test_one_triangle_alone_is_wrong(given):
    values = given.values["mass_matrix"].copy()
    values[:, 0, 1] += 0.1
    text = message_of(mass_matrix=values, q=given.states["q"])
    assert "Probable cause: Your M is not symmetric: M[hip][knee] is " in text and "entries 12 / 48" in text


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
    assert "mass_matrix raised ArithmeticError: too far (test_agreement_in_words.py, line " in text
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


def test_import_compare_loads_neither_mujoco_nor_llvmlite():
    program = (
        "import sys, compare; from compare import assert_agrees, differences; assert 'differences' in dir(compare)\n"
        "print({'mujoco', 'llvmlite', 'scipy', 'pandas', 'matplotlib'} & set(sys.modules))"
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


def test_help_says_first_what_it_does_and_names_every_field():
    for function in (compare.assert_agrees, compare.differences):
        assert len(str(inspect.signature(function))) < 400
    fields = compare.differences(PENDULUM, bias=bias, states=1)[0]
    assert all(f"{name}:" in fields.__doc__ or f"{name}," in fields.__doc__ for name in fields._fields)


@pytest.mark.parametrize("more, said", [
    ({"q": np.zeros((5, 2)), "states": 500}, "states=500 is not used: the 5 states of q are compared"),
    ({"states": 10**6}, "random states in place of 1,000,000"),
])  # fmt: skip
def test_states_that_are_not_compared_are_said(more, said, monkeypatch):
    monkeypatch.setattr("compare.states.MOST_NUMBERS", 120)
    with pytest.warns(UserWarning, match=said) as caught:
        compare.assert_agrees(PENDULUM, mass_matrix=mass_matrix, **more)
    assert caught[0].filename == __file__


def test_what_is_neither_a_function_nor_numbers():
    with pytest.raises(ValueError, match="; a function, or an array of its values at q, is expected"):
        compare.assert_agrees(PENDULUM, mass_matrix=inspect)
