"""What is known of postures and of one step of each method, without a run; which postures of a file are looked at."""

import dataclasses

import numpy as np
import pytest
from models import PATHS

from compare.engines.mujoco import reading
from compare.experiments.stability import choice, departure, limits
from compare.experiments.stability.subjects import MOST_POSTURES, subjects_of
from compare.robots.arm import ARM
from compare.robots.file import robot_of
from compare.setup import engines
from compare.truth.linear import held
from compare.truth.postures import all_of_kind, of_kind, posture_names
from compare.truth.steps import region

BENT, BALL = held(ARM, "bent"), held(ARM, "ball catch")
SWING = """<mujoco><worldbody><body><joint name="swing" axis="0 1 0"/>
  <geom type="sphere" size="0.1" pos="0 0 0.5" mass="2"/></body></worldbody>{keys}</mujoco>"""
CART_POLE = """<mujoco><worldbody><body><joint name="rail" type="slide" axis="1 0 0" damping="1"/>
  <geom type="sphere" size="0.1" mass="1"/><body><joint name="pole" axis="0 1 0" damping="0.1"/>
  <geom type="sphere" size="0.1" pos="0 0 0.5" mass="2"/></body></body></worldbody></mujoco>"""


@pytest.mark.parametrize("name, kind, rates", [
    ("zero", "marginal", [0.0, 0.0]), ("hanging", "centre", [10.995j, 4.975j, 4.867j]),
    ("upright", "saddle", [10.995, 4.975, 4.867]), ("ball catch", "saddle", [7.513, 5.300]),
    ("bent", "centre", [9.101j, 5.039j, 4.314j]),
])  # fmt: skip
def test_what_each_posture_is(name, kind, rates):
    at = held(ARM, name)
    values = at.modes[0]
    assert at.kind == kind and all(np.abs(values - rate).min() < 5e-4 for rate in rates)
    assert np.abs(values.sum()) < 1e-9  # undamped: they come in opposite pairs


def test_the_posture_that_stands_for_a_kind_is_the_robots_choice_or_the_first():
    assert (all_of_kind(ARM, "centre"), all_of_kind(ARM, "saddle")) == (("bent", "hanging"), ("ball catch", "upright"))
    postures = {name: ARM.postures[name] for name in ("upright", "ball catch")}
    other = dataclasses.replace(ARM, kinds={}, postures=postures)
    assert all_of_kind(other, "saddle") == ("upright", "ball catch") and of_kind(other, "centre") is None


@pytest.mark.parametrize("name, imaginary, real", [
    ("semi_implicit_euler", 2.0, None), ("implicit", 2.0, None), ("rk4", 2.0 * np.sqrt(2.0), 2.785294),
    ("explicit_euler", 0.0, 2.0),
])  # fmt: skip
def test_known_limits_on_the_axes(name, imaginary, real):
    below, above = region(name, 1j * (imaginary + np.array([-1e-4, 1e-4])))
    assert above > 1.0 + 1e-9 and (below < 1.0 + 1e-12 or imaginary == 0.0)
    if real:
        assert region(name, np.array([-real + 1e-5 + 0j])) < 1.0 < region(name, np.array([-real - 1e-5 + 0j]))


@pytest.mark.parametrize("name", ["implicit_midpoint", "gauss_legendre_4"])
def test_a_stable_method_has_no_limit_but_on_a_saddle(name):
    far = np.linspace(1e-3, 20.0, 400)
    assert region(name, 1j * far).max() < 1.0 + 1e-12 and region(name, -far + 0j).max() < 1.0
    assert BENT.limit(name) == ("never_fails", None) and BALL.limit(name) == ("always_fails", None)


@pytest.mark.parametrize("at, name, product", [
    (BENT, "rk4", 2.0 * np.sqrt(2.0)), (held(ARM, "hanging"), "implicit", 2.0),
    (held(ARM, "bent", 50.0), "rk4", 2.785294),  # damped it meets the real limit at the stiffest mode
])  # fmt: skip
def test_limit_of_the_arm_is_that_of_its_fastest_mode(at, name, product):
    kind, dt = at.limit(name)
    assert kind == "finite" and dt * np.abs(at.modes[0]).max() == pytest.approx(product, rel=1e-6)


# of robots that are read from a file


def read(source):
    found = reading.read(source)
    return robot_of(found, "robot.xml"), reading.engine(found)


def test_of_many_keyframes_the_first_are_looked_at():
    keys = "".join(f'<key name="k{i}" qpos="{0.3 * i}"/>' for i in range(9))
    seen = subjects_of(read(SWING.format(keys=f"<keyframe>{keys}</keyframe>"))[0])
    assert posture_names(seen.robot) == (*(f"k{i}" for i in range(MOST_POSTURES)), "at rest")
    assert seen.centres[-1] == "at rest" and seen.left_out
    assert not np.abs(held(seen.robot, "at rest").tau).max() > 1e-6


def test_a_marginal_posture_that_nothing_pushes_is_named():
    seen = subjects_of(read(PATHS["gripper"])[0])
    assert seen.marginal is None and any("open, held, is marginal" in text for text in seen.left_out)


def test_a_limit_is_sought_about_the_predicted_one_and_found_again():
    robot, mujoco = read(SWING.format(keys=""))
    at, known = held(subjects_of(robot).robot, "at rest"), engines(mujoco)
    predicted, rk4 = at.limit("rk4")[1], known["mujoco"].methods["RK4"]
    seen, observed = limits.observed_limit(rk4, known, at, 1000, limits.tried_at(at, predicted))
    assert seen == "finite" and observed == pytest.approx(predicted, rel=1e-3)
    assert departure.not_lost(held(robot, "qpos0"), 1e-9)
    assert not departure.not_lost(held(robot, "qpos0"), 1e-18)  # which rounding swamps


def test_a_cart_with_a_pole_leaves_as_predicted_and_its_column_names_both_units(result):
    robot, mujoco = read(CART_POLE)
    known = engines(mujoco)
    rows = departure.departures(1 / 512, held(robot, "qpos0"), known, (known["mujoco"].methods["RK4"],))
    assert "perturbation_m_or_rad" in rows[0] and "perturbation_rad" not in rows[0]
    departure.check_departures(result, rows)
    assert len(result.checks) > 5 and all(check.passed for check in result.checks)
    # methods that solve their stages are not run for a file
    names = {method.name for method in choice.explicit(choice.all_methods(known))}
    assert {"rk4", "RK4", "implicit"} <= names and not {"gauss_legendre_4", "implicit_midpoint"} & names
