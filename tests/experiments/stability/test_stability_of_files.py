"""Which postures of a robot that is read from a file are looked at, and what is said of the others."""

import numpy as np
import pytest
from models import PATHS

from compare.engines.mujoco import reading
from compare.experiments import stability
from compare.experiments.stability import choice, departure, limits
from compare.experiments.stability.subjects import MOST_POSTURES, subjects_of
from compare.robots.arm import ARM
from compare.robots.file import robot_of
from compare.setup import Setup, engines
from compare.truth.linear import held
from compare.truth.postures import posture_names

SWING = """<mujoco><worldbody><body><joint name="swing" axis="0 1 0"/>
  <geom type="sphere" size="0.1" pos="0 0 0.5" mass="2"/></body></worldbody>{keys}</mujoco>"""
CART_POLE = """<mujoco><worldbody><body><joint name="rail" type="slide" axis="1 0 0" damping="1"/>
  <geom type="sphere" size="0.1" mass="1"/><body><joint name="pole" axis="0 1 0" damping="0.1"/>
  <geom type="sphere" size="0.1" pos="0 0 0.5" mass="2"/></body></body></worldbody></mujoco>"""


def read(source):
    found = reading.read(source)
    return robot_of(found, "robot.xml"), reading.engine(found)


def test_of_many_keyframes_the_first_are_looked_at_and_named():
    keys = "".join(f'<key name="k{i}" qpos="{0.3 * i}"/>' for i in range(9))
    robot, _ = read(SWING.format(keys=f"<keyframe>{keys}</keyframe>"))
    assert len(posture_names(robot)) > MOST_POSTURES
    seen = subjects_of(robot)
    first = [f"k{i}" for i in range(MOST_POSTURES)]
    assert posture_names(seen.robot) == (*first, "at rest") and seen.centres[-1] == "at rest"
    assert any(f"the first {MOST_POSTURES} are looked at: {', '.join(first)}." in text for text in seen.left_out)
    assert not np.abs(held(seen.robot, "at rest").tau).max() > 1e-6
    assert posture_names(subjects_of(ARM).robot) == tuple(ARM.postures)


@pytest.mark.parametrize("name, words", [
    ("free_body", ("no rest under gravity", "every rate is zero")),
    ("loop", ("found downhill from qpos0",)),
])  # fmt: skip
def test_what_a_file_lacks_is_said(name, words):
    seen = subjects_of(read(PATHS[name])[0])
    assert all(any(word in text for text in seen.left_out) for word in words)


@pytest.mark.parametrize("source, marginal", [
    (PATHS["free_body"], "Posture qpos0"), (PATHS["gripper"], "Posture open"), (SWING.format(keys=""), None),
])  # fmt: skip
def test_a_marginal_posture_that_nothing_pushes_is_not_denied(source, marginal):
    left_out = subjects_of(read(source)[0]).left_out
    none = any("named postures is marginal" in text for text in left_out)
    assert none == (marginal is None)
    assert none or any(text.startswith(f"{marginal}, held, is marginal, but nothing pushes") for text in left_out)


def test_regions_without_an_eigenvalue_are_not_drawn():
    robot, mujoco = read(PATHS["free_body"])
    result = stability.rows(Setup.quick(robot, engines(mujoco)))
    assert not result.curves["points"] and not list(stability.figures(result, robot))


def test_a_limit_is_sought_about_the_predicted_one_and_found_again():
    robot, mujoco = read(SWING.format(keys=""))
    at, known = held(subjects_of(robot).robot, "at rest"), engines(mujoco)
    predicted = at.limit("rk4")[1]
    seen, observed = limits.observed_limit(
        known["mujoco"].methods["RK4"], known, at, 1000, limits.tried_at(at, predicted)
    )
    assert seen == "finite" and observed == pytest.approx(predicted, rel=1e-3)
    assert limits.tried_at(held(ARM, "bent"), predicted) is limits.TRIED_STEPS


def test_what_grew_far_and_came_back_has_grown():
    decayed, far = np.array([1e-9, 0.5]), np.array([1e-9, 1.1e4])
    assert not limits.grows(decayed, decayed) and limits.grows(far, decayed)


def test_a_perturbation_that_rounding_swamps_is_left_out():
    robot, _ = read(SWING.format(keys=""))
    at = held(robot, "qpos0")
    assert departure.not_lost(at, 1e-9) and not departure.not_lost(at, 1e-18)


def test_a_cart_with_a_pole_leaves_as_predicted_and_its_column_names_both_units(result):
    robot, mujoco = read(CART_POLE)
    known, at = engines(mujoco), held(robot, "qpos0")
    rows = departure.departures(1 / 512, at, known, (known["mujoco"].methods["RK4"],))
    assert "perturbation_m_or_rad" in rows[0] and "perturbation_rad" not in rows[0]
    departure.check_departures(result, rows)
    assert len(result.checks) > 5 and all(check.passed for check in result.checks)
    assert "m or rad)" in result.notes[0]


def test_methods_that_solve_their_stages_are_not_run_for_a_file():
    _, mujoco = read(CART_POLE)
    names = {method.name for method in choice.explicit(choice.all_methods(engines(mujoco)))}
    assert {"rk4", "RK4", "implicit"} <= names and not {"gauss_legendre_4", "implicit_midpoint"} & names
