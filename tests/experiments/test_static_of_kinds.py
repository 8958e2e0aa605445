"""The single states of any robot: slides, balls, free bodies, springs; and edited arms: what agrees, and that nothing raises."""

import dataclasses

import numpy as np
import pytest
from edited import CART, MODELS, STONE, XML, robot, setup_between, setup_of
from models import random_tree

import tmt
from compare.engines.mujoco.accelerations import convective_accelerations
from compare.experiment import Setup
from compare.experiments import acceleration, figures_sketch, gravity, kinematics, mass, parameters, published
from compare.judge.entries import scales

MODULES = (kinematics, mass, gravity, acceleration)
BODY = '<inertial pos="0.1 0 0" mass="1" diaginertia="1e-3 1e-3 1e-3"/></body></worldbody></mujoco>'
ROBOTS = {
    "a random tree": random_tree(3, joints=4),
    "springs without gravity": CART.replace("0 0 -9.81", "0 0 0"),
    "weightless by its flag": STONE.replace("<worldbody>", '<option><flag gravity="disable"/></option><worldbody>'),
    "far from the origin": STONE.replace('pos="0.4 -0.3 1.2"', 'pos="1000 2000 10"'),
    "nothing acts at rest": f'<mujoco><option gravity="0 0 0"/><worldbody><body><joint axis="0 0 1"/>{BODY}',
    "slides alone": '<mujoco><worldbody><body><joint type="slide" axis="1 0 0"/><joint type="slide" axis="0 1 1"/>'
    + BODY,
    "no exact gradient": f'<mujoco><worldbody><body><joint type="ball" stiffness="3"/>{BODY}',
}


def failing(result) -> list:
    return [str(check) for check in result.checks if not check.passed]


def drawn(module, setup):
    """The result of an experiment, of which every figure can be drawn."""
    result = module.rows(setup)
    for figure in module.figures(result, setup.robot):
        name, fig, caption = figure()
        assert name.startswith((result.experiment, setup.robot.name)) and fig.axes and "nan" not in caption
    return result


@pytest.mark.parametrize("name", ROBOTS)
def test_every_quantity_of_a_robot_of_any_joints_agrees_and_every_figure_is_drawn(name):
    setup = setup_between(ROBOTS[name], states=5)
    for module in MODULES:
        assert failing(drawn(module, setup)) == []
    figures_sketch.draw_sketch(setup.robot)


@pytest.mark.parametrize("name", ["gravity off by its flag", "a feather"])
def test_nothing_raises_of_an_edited_arm(name):
    setup = setup_of(XML.replace(*MODELS[name]), make=Setup, states=5, exact_states=1, size="small")
    for module in (parameters, published, *MODULES):
        drawn(module, setup)


def test_the_units_of_mixed_joints_are_named():
    setup = setup_between(CART, states=3)
    results = [module.rows(setup) for module in MODULES]
    units = {row["quantity"]: row["unit"] for result in results for row in result.rows}
    assert not any(map(failing, results))
    assert units["holding torque"] == units["bias"] == "N m or N" and units["qdd"] == "rad/s2 or m/s2"
    assert units["T_b"] == "m/rad or m/m" and units["Mbar"] == "kg m2 or kg m or kg"
    assert units["dp_rail/dt + D qd at TMT's qdd, no gravity"] == "N"


@pytest.mark.parametrize("armature, left", [((), ("linear", "angular")), ((0.0, 0.0, 0.0, 0.1, 0.2, 0.0), ("linear",))])
def test_a_free_robot_is_compared_with_its_momenta(armature, left):
    """Rotors that differ between the axes of a ball leave the angular momentum out."""
    setup = setup_between(STONE, states=3)
    tree = dataclasses.replace(setup.robot.tree, armature=armature or setup.robot.tree.armature)
    setup = dataclasses.replace(setup, robot=dataclasses.replace(setup.robot, tree=tree))
    found = {row["quantity"] for row in acceleration.rows(setup).rows if "momentum/dt" in row["quantity"]}
    assert found == {f"d{of} momentum/dt at {name}'s qdd, no gravity" for of in left for name in ("TMT", "MuJoCo")}


@pytest.mark.parametrize("text", [CART, STONE], ids=["cart", "stone"])
def test_the_gradient_of_the_potential_energy_is_the_holding_torque(text):
    """But for a ball with a spring, which the cart has."""
    tree, rng = robot(text).tree, np.random.default_rng(8)
    q = np.array([tree.coordinates.move(list(tree.zero), list(u)) for u in rng.normal(size=(4, tree.coordinates.nv))])
    exact = gravity.has_exact_gradient(tree)
    held = tmt.gravity_balance(q, tree) + tmt.spring_torque(q, tree)
    off = np.abs(gravity.gradient(lambda states: tmt.potential_energy(states, tree), q, tree) - held)
    assert off[:, exact].max() < 1e-12 and exact.sum() >= 3 and exact.all() == (text == STONE)
    assert off[:, ~exact].max(initial=0.0) > 1e-3 or text == STONE


def test_a_wrong_rate_of_mujocos_jacobian_is_named_and_decides_nothing():
    """mj_jacDot of MuJoCo 4.0 leaves out what a ball does to a slide after it: found by central differences."""
    model = f'<mujoco><worldbody><body><joint type="ball"/><joint type="slide" axis="1 0 0"/>{BODY}'
    setup = setup_between(model, states=10)
    result, sample, tree = kinematics.rows(setup), setup.random, setup.robot.tree
    assert failing(result) == []
    dynamics, scale = setup.compared()["mujoco"], scales(tree, True, sample.q, sample.qd).v_conv
    by_rates, _ = dynamics.convective_terms(sample.q, sample.qd)
    by_accelerations, _ = convective_accelerations(dynamics, sample.q, sample.qd)
    wrong, right = (kinematics.wrong_rates(setup, sample, found, scale) for found in (by_rates, by_accelerations))
    is_wrong = np.abs(by_rates - by_accelerations).max() > 1e-3
    assert bool(wrong) == is_wrong == any("mj_jacDot" in note for note in result.notes)
    assert not right and "mj_jacDot" in kinematics.wrong_rates(setup, sample, by_accelerations + 0.1, scale)
