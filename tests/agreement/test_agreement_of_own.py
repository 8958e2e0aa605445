"""assert_agrees and differences: equations of one's own compared with MuJoCo, in Python."""

import os
from pathlib import Path

import mujoco
import numpy as np
import pytest
import sympy
from helpers.own_agreement import (
    PENDULUM,
    RIGHT,
    ROBOT,
    TREE,
    agrees,
    differences,
    message_of,
)
from helpers.own_equations import acceleration, bias, mass_matrix

import compare
from compare.judge.entries import Entries
from compare.judge.scale import EPS, FACTOR
from compare.robots.joint_map import joint_map


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
        assert worst.tolerance == pytest.approx(allowed, rel=1e-9, abs=0.0)
        assert worst.difference == pytest.approx(share * allowed, rel=1e-2, abs=0.0)
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
