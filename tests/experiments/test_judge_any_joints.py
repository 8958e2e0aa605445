"""Robots of any joints at states: they agree, they are drawn, and an error of a number fails the checks that depend on it."""

import numpy as np
import pytest
from helpers.edited import CART, STONE, setup_between
from models import random_tree

from compare.experiments import figures_sketch, functions, states
from compare.judge.entries import Entries
from compare.judge.scale import EPS, FACTOR

BODY = '<inertial pos="0.1 0 0" mass="1" diaginertia="1e-3 1e-3 1e-3"/></body></worldbody></mujoco>'
ROBOTS = {
    "a random tree": random_tree(3, joints=4), "springs without gravity": CART.replace("0 0 -9.81", "0 0 0"),
    "far from the origin": STONE.replace('pos="0.4 -0.3 1.2"', 'pos="1000 2000 10"'),
    "nothing acts at rest": f'<mujoco><option gravity="0 0 0"/><worldbody><body><joint axis="0 0 1"/>{BODY}',
    "slides alone": '<mujoco><worldbody><body><joint type="slide" axis="1 0 0"/><joint type="slide" axis="0 1 1"/>' + BODY,
    "a ball with a spring": f'<mujoco><worldbody><body><joint type="ball" stiffness="3"/>{BODY}',
    "a slide after a ball": f'<mujoco><worldbody><body><joint type="ball"/><joint type="slide" axis="1 0 0"/>{BODY}',
}  # fmt: skip
SEEDED = {  # an error in a file: the checks that must fail
    "a slide's axis": (CART, 'axis="1 0.2 0"', 'axis="1 0.200001 0"', ["kinematics T_b", "mass Mbar", "gravity holding"]),
    "the armature of a ball": (CART, 'armature="0.01"', 'armature="0.01000001"', ["mass Mbar", "acceleration qdd"]),
    "where a slide's spring rests": (CART, 'springref="0.1"', 'springref="0.100001"', [
        "gravity holding torque, springs", "acceleration qdd", "acceleration potential"]),
    "a ball's centre": (CART, 'pos="0 0.01 0"', 'pos="0 0.010001 0"', ["kinematics T_b", "acceleration bias"]),
    "a free body's centre": (STONE, "0.03 -0.02 0.05", "0.030001 -0.02 0.05", ["kinematics x_b", "acceleration bias"]),
}  # fmt: skip


@pytest.mark.parametrize("name", ROBOTS)
def test_every_quantity_of_a_robot_of_any_joints_agrees_and_it_is_drawn(name):
    setup = setup_between(ROBOTS[name], states=5)
    for experiment in map(functions, ("kinematics", "mass", "gravity", "acceleration")):
        result = experiment.rows(setup)
        assert [str(check) for check in result.checks if not check.passed] == []
    figures_sketch.draw_sketch(setup.robot)


@pytest.mark.parametrize("name, unit, force", [
    ("slides alone", "kg", "N"), ("a ball with a spring", "kg m2", "N m"),
    ("a slide after a ball", "kg m2 or kg m or kg", "N m or N"),
])  # fmt: skip
def test_units_are_those_of_the_joints_and_the_tolerance_of_springs_is_of_the_sums(name, unit, force):
    setup = setup_between(ROBOTS[name], states=5)
    checks = states.rows("mass", setup).checks + states.rows("gravity", setup).checks
    units = {check.quantity: check.unit for check in checks}
    assert (units["Mbar"], units["holding torque"]) == (unit, force)
    held = [check for check in checks if check.quantity == "holding torque, springs too"]
    of = Entries(setup.robot.tree, setup.random.q)
    assert len(held) == 2 * setup.robot.tree.has_springs
    sums = FACTOR * EPS * (of.weight + of.springs)
    assert all(np.isclose(check.tolerance, sums, atol=0.0).any() for check in held[1:])


@pytest.mark.parametrize("text, old, new, expected", SEEDED.values(), ids=SEEDED)
def test_an_error_of_a_number_fails_the_checks_that_depend_on_it(text, old, new, expected):
    assert text.count(old) == 1
    setup = setup_between(text, text.replace(old, new), states=10)
    results = [functions(name).rows(setup) for name in {name.split()[0] for name in expected}]
    checks = [check for result in results for check in result.checks if check.failed]
    failed = [f"{check.experiment} {check.quantity}" for check in checks]
    assert all(any(name.startswith(named) for name in failed) for named in expected)
