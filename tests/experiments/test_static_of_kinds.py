"""The single states of any robot: slides, balls, free bodies, springs; what is compared, what is said, and what is drawn."""

import dataclasses

import numpy as np
import pytest
from jointed import CART, STONE, robot, setup_between
from models import PATHS, random_tree

import tmt
from compare import setup as parts
from compare.engines.mujoco import reading
from compare.engines.mujoco.accelerations import convective_accelerations
from compare.experiments import acceleration, figures, figures_sketch, gravity, kinematics, mass
from compare.judge.check import Result
from compare.judge.entries import scales
from compare.robots import stick
from compare.robots.file import robot_of
from compare.setup import Setup

MODULES = (kinematics, mass, gravity, acceleration)
RNG = np.random.default_rng(8)


def read(source):
    """A robot of a file or text, and MuJoCo's engine."""
    found = reading.read(source)
    return robot_of(found, "a file"), parts.engines(reading.engine(found))


@pytest.mark.parametrize(
    "source", [random_tree(3), random_tree(11), PATHS["quadruped"]], ids=["tree 3", "tree 11", "quadruped"]
)
def test_every_quantity_agrees_and_every_figure_is_drawn(source, tmp_path):
    one, engines = read(source)
    setup = Setup(one, engines, states=10, exact_states=1, size="small")
    for module in MODULES:
        result = module.rows(setup)
        assert [str(check) for check in result.checks if not check.passed] == []
        captions = [figure()[2] for figure in module.figures(result, one)]
        texts = [*result.notes, *captions, module.claim(one), module.tolerance(one)]
        assert all(text.endswith(".") and "nan" not in text for text in texts)
        assert "each entry its own" in module.tolerance(one) or "each joint's own" in module.tolerance(one)


BODY = '<inertial pos="0.1 0 0" mass="1" diaginertia="1e-3 1e-3 1e-3"/></body></worldbody></mujoco>'
EXTREME = {
    "springs without gravity": CART.replace("0 0 -9.81", "0 0 0"),
    "weightless by its flag": STONE.replace("<worldbody>", '<option><flag gravity="disable"/></option><worldbody>'),
    "far from the origin": STONE.replace('pos="0.1 0.2 1"', 'pos="1000 2000 10"'),
    "nothing acts at rest": f'<mujoco><option gravity="0 0 0"/><worldbody><body><joint axis="0 0 1"/>{BODY}',
    "slides alone": f'<mujoco><worldbody><body><joint type="slide" axis="1 0 0"/><joint type="slide" axis="0 1 1"/>{BODY}',
    "no exact gradient": f'<mujoco><worldbody><body><joint type="ball" stiffness="3"/>{BODY}',
}


@pytest.mark.parametrize("name", EXTREME)
def test_robots_whose_scales_are_zero_or_large_agree(name):
    setup = setup_between(EXTREME[name], states=5)
    for module in MODULES:
        result = module.rows(setup)
        assert [str(check) for check in result.checks if not check.passed] == []
        assert all(figure()[2].endswith(".") for figure in module.figures(result, setup.robot))
    assert figures_sketch.draw_sketch(setup.robot)[2].endswith(".")


def test_the_units_of_mixed_joints_are_named():
    setup = setup_between(CART, states=3)
    units = {row["quantity"]: row["unit"] for module in MODULES for row in module.rows(setup).rows}
    assert units["holding torque"] == units["bias"] == "N m or N" and units["qdd"] == "rad/s2 or m/s2"
    assert units["T_b"] == "m/rad or m/m" and units["Mbar"] == "kg m2 or kg m or kg"
    assert units["dp_rail/dt + D qd at TMT's qdd, no gravity"] == "N"


def test_a_free_robot_is_compared_with_its_momenta():
    setup = setup_between(STONE, states=3)
    found = {
        row["quantity"]
        for row in acceleration.rows(setup).rows
        if "/dt" in row["quantity"] and "momentum" in row["quantity"]
    }
    assert found == {
        f"d{which} momentum/dt at {engine}'s qdd, no gravity"
        for which in ("linear", "angular")
        for engine in ("TMT", "MuJoCo")
    }
    assert "the linear momentum and the angular momentum" in acceleration.claim(setup.robot)
    assert "the momentum along the first joint (rail)" in acceleration.claim(robot(CART))


def test_rotors_that_do_not_turn_with_a_ball_leave_its_momentum_out():
    setup = setup_between(STONE, states=2)
    tree = dataclasses.replace(setup.robot.tree, armature=(0.0, 0.0, 0.0, 0.1, 0.2, 0.0, 0.0))
    setup = dataclasses.replace(setup, robot=dataclasses.replace(setup.robot, tree=tree))
    result = acceleration.rows(setup)
    assert not any("angular" in row["quantity"] for row in result.rows)
    assert "The rotors of root x differ between its axes: the angular momentum is left out." in result.notes


@pytest.mark.parametrize("text", [CART, STONE], ids=["cart", "stone"])
def test_the_gradient_of_the_potential_energy_is_the_holding_torque(text):
    tree = robot(text).tree
    q = np.array([tree.coordinates.move(list(tree.zero), list(u)) for u in RNG.normal(size=(4, tree.coordinates.nv))])
    exact = gravity.has_exact_gradient(tree)
    held = tmt.gravity_balance(q, tree) + tmt.spring_torque(q, tree)
    found = gravity.gradient(lambda states: tmt.potential_energy(states, tree), q, tree)
    assert np.abs(found - held)[:, exact].max() < 1e-12
    assert exact.all() == (text == STONE) and exact.sum() >= 3  # the cart's ball has a spring
    if text == CART:
        assert np.abs(found - held)[:, ~exact].max() > 1e-3
        notes = gravity.rows(setup_between(CART, states=2)).notes
        assert notes[:-1] == ["The gradient of V is left out for balls with a spring: there is no exact rule for it."]


def test_few_states_have_a_gradient_where_there_are_many_joints(monkeypatch):
    monkeypatch.setattr(gravity, "MOST_ENERGIES", 40)
    rows = {
        row["quantity"]: row
        for row in gravity.rows(setup_between(STONE, states=9)).rows
        if row["scene"] == "random states"
    }
    assert rows["holding torque"]["states"] == 9 and rows["MuJoCo: torque - dV/dq"]["states"] == 40 // 14


def test_mbar_is_definite_in_units_of_its_diagonal():
    for least, passes in ((1.01, True), (0.99, False), (-1.0, False)):
        result, small = Result("mass"), 64 * 2.0**-52 * least
        M = np.diag([1e-9, 1.0]) + (1 - small) / (1 + small) * np.array([[0.0, 1.0], [1.0, 0.0]]) * np.sqrt(1e-9)
        mass.check_definiteness(result, "TMT", M[None], in_units=True)
        (check,) = result.checks
        assert (
            check.passed is passes
            and check.quantity == "TMT: least eigenvalue of Mbar in units of its diagonal over the largest"
        )
    result = Result("mass")
    mass.check_definiteness(result, "TMT", np.diag([1.0, -1.0])[None], in_units=True)
    assert not result.checks[0].passed


def test_mbar_is_symmetric_within_the_scale_of_each_entry():
    for share, passes in ((0.99, True), (1.01, False)):
        M, scale, result = np.ones((1, 2, 2)), np.array([[[9.0, 1e-3], [1e-3, 9.0]]]), Result("mass")
        M[0, 0, 1] += share * 64 * 2.0**-42
        mass.check_symmetry(result, M, scale * 2.0**10 * 1e3)
        assert result.checks[0].passed is passes


# figures


def test_without_exact_states_the_figure_of_distances_speaks_of_the_engines_alone():
    setup = setup_between(STONE, states=4, exact_states=0)
    setup.named.exact_states = 0
    for module in MODULES:
        result = module.rows(setup)
        (first, *_) = [figure() for figure in module.figures(result, setup.robot)]
        assert "Against" not in first[2] and "eps apart" in first[2] and "to exact" not in str(result.checks)
        assert {line.get_label() for line in first[1].axes[0].lines} == {"TMT to MuJoCo", "tolerance, 64 eps"}


def test_the_sketch_counts_the_joints_of_a_large_robot_and_names_those_of_a_small_one():
    one, _ = read(PATHS["quadruped"])
    _, fig, caption = figures_sketch.draw_sketch(one)
    assert (
        "12 hinges (an arrow along its axis), 3 slides (a dashed line along its direction) and 1 ball (a dot" in caption
    )
    assert "a free body is three slides and a ball" in caption and "centres of mass of 13 bodies." in caption
    assert not any(text.get_text() for text in fig.axes[0].texts)
    _, fig, caption = figures_sketch.draw_sketch(robot(CART))
    assert "rail along (" in caption and "wrist at (" in caption
    assert {"rail", "swing", "reach", "wrist"} <= {text.get_text() for text in fig.axes[0].texts}
    circles = [line for line in fig.axes[0].lines if line.get_fillstyle() == "none"]
    assert len(circles) == 1


def test_the_slides_of_a_free_joint_are_drawn_where_its_ball_is():
    one, _ = read(PATHS["quadruped"])
    q = one.posture("stand") + np.eye(len(one.posture("stand")))[0] * 0.3
    places = figures_sketch.axes(one, q, 0.1)
    assert np.allclose(places[:6, 0], q[:3]) and np.allclose(places[:3, 1], 0.1 * np.eye(3))
    assert stick.free_parts(one.tree) == [True] * 4 + [False] * 12
    lines = figures_sketch.chains(one, q)
    assert all(np.linalg.norm(line[1] - line[0]) < 0.6 for line in lines)  # none from the world to the trunk
    assert stick.free_parts(robot(CART).tree) == [False] * 4


def test_the_figure_of_holding_torques_shows_the_six_joints_that_need_most():
    one, _ = read(PATHS["quadruped"])
    torque = np.zeros(18)
    torque[[2, 5, 7, 9, 12, 15, 16]] = [300.0, 1.0, 2.0, 3.0, 4.0, 5.0, 0.5]
    postures = {name: {"tmt": torque, "mujoco": torque} for name in one.poses}
    _, fig, caption = figures.draw_holding_torques(Result("gravity", curves={"postures": postures}), one)
    assert sorted({bar.get_height() for bar in fig.axes[0].patches}) == [1.0, 2.0, 3.0, 4.0, 5.0, 300.0]
    assert "at the 6 of 18 joints that need most" in caption and "N m or N apart" in caption
    labels = [text.get_text() for text in fig.legends[0].get_texts()]
    names = one.coordinates.speeds
    assert set(labels) == {"MuJoCo"} | {f"{names[k]}, TMT" for k in (2, 5, 7, 9, 12, 15)}


def test_what_needs_no_torque_is_judged_by_each_joints_own_scale():
    one, _ = read(PATHS["quadruped"])
    scale = gravity.scales(one.tree, True, one.poses["stand"][None]).holding[0]
    for share, said in ((0.99, "at: stand."), (1.01, "some at every posture.")):
        torque = np.zeros(18)
        torque[17] = share * 64 * 2.0**-52 * scale[17]
        assert figures.needless({"stand": {"tmt": torque, "mujoco": torque}}, one).endswith(said)


def test_a_wrong_rate_of_mujocos_jacobian_is_named_and_decides_nothing():
    """mj_jacDot of MuJoCo 4.0 leaves out what a ball does to a slide after it: found by central differences."""
    text = f'<mujoco><worldbody><body><joint type="ball"/><joint type="slide" axis="1 0 0"/>{BODY}'
    one, engines = read(text)
    setup = Setup(one, engines, states=10, exact_states=1, size="small")
    result, sample = kinematics.rows(setup), setup.random
    assert [str(check) for check in result.checks if not check.passed] == []
    dynamics = setup.compared()["mujoco"]
    scale = scales(one.tree, True, sample.q, sample.qd).v_conv
    by_rates, _ = dynamics.convective_terms(sample.q, sample.qd)
    by_accelerations, _ = convective_accelerations(dynamics, sample.q, sample.qd)
    says = [kinematics.wrong_rates(setup, sample, found, scale) for found in (by_rates, by_accelerations)]
    is_wrong = np.abs(by_rates - by_accelerations).max() > 1e-3
    assert bool(says[0]) == is_wrong == any("mj_jacDot is wrong" in note for note in result.notes) and not says[1]
    assert "mj_jacDot is wrong" in kinematics.wrong_rates(setup, sample, by_accelerations + 0.1, scale)


def test_accelerations_of_bodies_are_the_convective_terms_too():
    one, engines = read(random_tree(3))
    sample = Setup(one, engines, states=5, exact_states=0, size="small").random
    dynamics = engines["mujoco"].of(one.case())
    ours = tmt.convective_terms(sample.q, sample.qd, one.tree)
    of_scale = scales(one.tree, True, sample.q, sample.qd)
    weight = dynamics.model.opt.gravity.copy()
    for found, known, scale in zip(
        convective_accelerations(dynamics, sample.q, sample.qd), ours, (of_scale.v_conv, of_scale.w_conv)
    ):
        assert (np.abs(found - known) <= 64 * 2.3e-16 * scale).all()
    assert np.array_equal(dynamics.model.opt.gravity, weight)


def test_the_sketch_says_where_it_draws_a_free_body():
    one, _ = read(PATHS["free_body"])
    x, y, z = one.poses["qpos0"][:3]
    assert f"at ({x:.3g}, {y:.3g}, {z:.3g}) m" in figures_sketch.draw_sketch(one)[2]
