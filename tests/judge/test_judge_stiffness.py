"""Robots of files that are too stiff: just inside and just outside of what is followed."""

import re

import numpy as np
import pytest
from judged import BOTH

from compare.case import Scene
from compare.engines.mujoco import reading
from compare.judge.run import leaves_no_digits
from compare.robots.arm import ARM
from compare.robots.file import robot_of
from compare.truth.reference import has_no_reference

SPRING = """<mujoco><worldbody><body><joint name="swing" axis="0 1 0" stiffness="{stiffness}"/>
  <inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/></body></worldbody></mujoco>"""
DT = 1.0 / 8192


def with_rate(rate):
    return robot_of(reading.read(SPRING.format(stiffness=repr(rate**2))), "spring.xml")


@BOTH
def test_a_rate_that_leaves_no_digits_after_two_steps(share, passes):
    robot = with_rate(share * (1e-3 / 64 / 2.0**-52) ** 0.25 / DT)
    assert np.isclose(robot.cases[0].scene.dt, DT)
    why = leaves_no_digits(robot)
    assert (why is None) is passes
    assert passes or re.search(r"fastest rate, 4.2e\+06 per second, is 5.2e\+02 over a step of 1.2e-04 s", why)


@pytest.mark.parametrize("rate, known", [(1e3, True), (3e6, False), (1e7, False)])
def test_a_reference_in_doubles_is_not_asked_of_a_rate_with_which_it_diverges(rate, known):
    assert (has_no_reference(with_rate(rate)) is None) is known


def test_nothing_is_left_out_of_the_arm():
    assert leaves_no_digits(ARM) is None and has_no_reference(ARM) is None
    assert leaves_no_digits(ARM.with_scenes((Scene("mine", "bent"),))) is None
