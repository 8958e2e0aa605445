"""The single states of any robot, of slides, balls, free bodies, springs: what agrees, what fails, and their figures."""

import numpy as np
import pytest
from edited import CART, STONE, setup_between
from models import random_tree

from compare.core.text import say
from compare.experiments import acceleration, figures_sketch, gravity, kinematics, mass, module
from compare.experiments import figures as draw
from compare.judge.agree import AgreementResult
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
def test_every_quantity_of_a_robot_of_any_joints_agrees_and_every_figure_is_drawn(name):
    setup = setup_between(ROBOTS[name], states=5)
    for experiment in (kinematics, mass, gravity, acceleration):
        result = experiment.rows(setup)
        assert [str(check) for check in result.checks if not check.passed] == []
        for figure in experiment.figures(result, setup.robot):
            name, fig, caption = figure()
            assert name.startswith((result.experiment, setup.robot.name))
            assert fig.axes and "nan" not in say(caption)
    figures_sketch.draw_sketch(setup.robot)


@pytest.mark.parametrize("name, unit, force", [
    ("slides alone", "kg", "N"), ("a ball with a spring", "kg m2", "N m"),
    ("a slide after a ball", "kg m2 or kg m or kg", "N m or N"),
])  # fmt: skip
def test_units_are_those_of_the_joints_and_the_tolerance_of_springs_is_of_the_sums(name, unit, force):
    setup = setup_between(ROBOTS[name], states=5)
    checks = mass.rows(setup).checks + gravity.rows(setup).checks
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
    results = [module(name).rows(setup) for name in {name.split()[0] for name in expected}]
    checks = [check for result in results for check in result.checks if check.failed]
    failed = [f"{check.experiment} {check.quantity}" for check in checks]
    assert all(any(name.startswith(named) for name in failed) for named in expected)


def test_the_caption_of_distances_says_who_is_how_far_from_what():
    of_mass = {"difference": [1.0, 5.0], "from_exact": [1.5, 2.0], "mujoco_from_exact": [2.5, 3.0]}
    of_bias = dict.fromkeys(of_mass, np.array([0.5, 0.7]))
    of_mass = {name: np.array(values) for name, values in of_mass.items()}
    result = AgreementResult("mass", distances={"random states": {"Mbar": of_mass, "bias": of_bias}})
    *_, caption = draw.draw_distances(result, ["Mbar", "bias"])
    expected = {"worst": 5.0, "of_worst": "Mbar", "exact": True}
    assert caption.kind == "distances" and {name: caption.values[name] for name in expected} == expected
    assert "5 eps" in say(caption)
