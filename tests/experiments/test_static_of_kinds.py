"""The single states of any robot: slides, balls, free bodies, springs; and edited arms: what agrees, and that nothing raises."""

import dataclasses

import numpy as np
import pytest
from crane import crane
from edited import MODELS, XML, setup_of
from jointed import CART, STONE, robot, setup_between
from models import PATHS, random_tree

import tmt
from compare.engines.mujoco import load
from compare.engines.mujoco.accelerations import convective_accelerations
from compare.experiments import acceleration, figures_sketch, gravity, kinematics, mass, parameters, published
from compare.judge.entries import scales
from compare.setup import Setup, engines

MODULES = (kinematics, mass, gravity, acceleration)
RNG = np.random.default_rng(8)
BODY = '<inertial pos="0.1 0 0" mass="1" diaginertia="1e-3 1e-3 1e-3"/></body></worldbody></mujoco>'


def failing(result) -> list:
    return [str(check) for check in result.checks if not check.passed]


def drawn(module, setup):
    """The result of an experiment, of which every figure can be drawn."""
    result = module.rows(setup)
    for figure in module.figures(result, setup.robot):
        name, fig, caption = figure()
        assert name.startswith((result.experiment, setup.robot.name)) and fig.axes and "nan" not in caption
    assert not any("nan" in note for note in result.notes)
    return result


ROBOTS = {
    "a random tree": (random_tree(3, joints=4), 10),
    "a large one": (PATHS["quadruped"], 3),
    "springs without gravity": (CART.replace("0 0 -9.81", "0 0 0"), 5),
    "weightless by its flag": (STONE.replace("<worldbody>", '<option><flag gravity="disable"/></option><worldbody>'), 5),
    "far from the origin": (STONE.replace('pos="0.1 0.2 1"', 'pos="1000 2000 10"'), 5),
    "nothing acts at rest": (
        f'<mujoco><option gravity="0 0 0"/><worldbody><body><joint axis="0 0 1"/>{BODY}', 5),
    "slides alone": (
        f'<mujoco><worldbody><body><joint type="slide" axis="1 0 0"/><joint type="slide" axis="0 1 1"/>{BODY}', 5),
    "no exact gradient": (f'<mujoco><worldbody><body><joint type="ball" stiffness="3"/>{BODY}', 5),
}  # fmt: skip


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=pytest.mark.slow) if name == "a large one" else name for name in ROBOTS]
)
def test_every_quantity_of_a_robot_of_any_joints_agrees_and_every_figure_is_drawn(name):
    source, states = ROBOTS[name]
    setup = setup_between(source, states=states)
    for module in MODULES:
        assert failing(drawn(module, setup)) == []
    figures_sketch.draw_sketch(setup.robot)


@pytest.mark.parametrize("name", ["the arm", "gravity off by its flag", "a muscle's activation", "a feather"])
def test_nothing_raises_of_an_edited_arm(name):
    setup = setup_of(XML.replace(*MODELS[name]) if name != "the arm" else XML)
    for module in (parameters, published, *MODULES):
        result = drawn(module, setup)
        assert name != "the arm" or failing(result) == []


def test_a_robot_of_four_hinges_passes_and_is_drawn(tmp_path):
    robot = crane(tmp_path)
    setup = Setup.small(robot, engines(load(robot.mjcf, robot.tree)))
    for module in (parameters, *MODULES):
        assert failing(drawn(module, setup)) == []


def test_the_units_of_mixed_joints_are_named():
    setup = setup_between(CART, states=3)
    units = {row["quantity"]: row["unit"] for module in MODULES for row in module.rows(setup).rows}
    assert units["holding torque"] == units["bias"] == "N m or N" and units["qdd"] == "rad/s2 or m/s2"
    assert units["T_b"] == "m/rad or m/m" and units["Mbar"] == "kg m2 or kg m or kg"
    assert units["dp_rail/dt + D qd at TMT's qdd, no gravity"] == "N"


@pytest.mark.parametrize(
    "armature, left", [((), ("linear", "angular")), ((0.0, 0.0, 0.0, 0.1, 0.2, 0.0, 0.0), ("linear",))]
)
def test_a_free_robot_is_compared_with_its_momenta(armature, left):
    """Rotors that differ between the axes of a ball leave the angular momentum out."""
    setup = setup_between(STONE, states=3)
    tree = dataclasses.replace(setup.robot.tree, armature=armature or setup.robot.tree.armature)
    setup = dataclasses.replace(setup, robot=dataclasses.replace(setup.robot, tree=tree))
    found = {row["quantity"] for row in acceleration.rows(setup).rows if "momentum/dt" in row["quantity"]}
    assert found == {
        f"d{which} momentum/dt at {name}'s qdd, no gravity" for which in left for name in ("TMT", "MuJoCo")
    }


@pytest.mark.parametrize("text", [CART, STONE], ids=["cart", "stone"])
def test_the_gradient_of_the_potential_energy_is_the_holding_torque(text):
    tree = robot(text).tree
    q = np.array([tree.coordinates.move(list(tree.zero), list(u)) for u in RNG.normal(size=(4, tree.coordinates.nv))])
    exact = gravity.has_exact_gradient(tree)
    held = tmt.gravity_balance(q, tree) + tmt.spring_torque(q, tree)
    off = np.abs(gravity.gradient(lambda states: tmt.potential_energy(states, tree), q, tree) - held)
    assert off[:, exact].max() < 1e-12 and exact.sum() >= 3
    assert exact.all() == (text == STONE) and (
        text == STONE or off[:, ~exact].max() > 1e-3
    )  # the cart's ball has a spring


def test_a_wrong_rate_of_mujocos_jacobian_is_named_and_decides_nothing():
    """mj_jacDot of MuJoCo 4.0 leaves out what a ball does to a slide after it: found by central differences."""
    setup = setup_between(
        f'<mujoco><worldbody><body><joint type="ball"/><joint type="slide" axis="1 0 0"/>{BODY}', states=10
    )
    result, sample, tree = kinematics.rows(setup), setup.random, setup.robot.tree
    assert failing(result) == []
    dynamics, scale = setup.compared()["mujoco"], scales(tree, True, sample.q, sample.qd).v_conv
    by_rates, _ = dynamics.convective_terms(sample.q, sample.qd)
    by_accelerations, _ = convective_accelerations(dynamics, sample.q, sample.qd)
    wrong, right = (kinematics.wrong_rates(setup, sample, found, scale) for found in (by_rates, by_accelerations))
    assert (
        bool(wrong) == (np.abs(by_rates - by_accelerations).max() > 1e-3) == any("mj_jacDot" in n for n in result.notes)
    )
    assert not right and "mj_jacDot" in kinematics.wrong_rates(setup, sample, by_accelerations + 0.1, scale)
