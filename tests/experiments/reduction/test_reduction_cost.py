"""What is added to the model in MuJoCo is there, in the size of the robot, and only what touches something changes the motion."""

import dataclasses

import numpy as np
import pytest

import tmt
from compare.case import Scene
from compare.engines.mujoco import ModelError, additions, engine, parse, read
from compare.experiments.reduction import cost
from compare.robots.arm import ARM
from compare.robots.file import robot_of


def test_additions_are_there_and_only_a_touched_floor_changes_the_motion(mujoco):
    engines = additions.with_additions(mujoco, *cost.sizes(ARM.tree))
    case = ARM.case("falls", posture="bent")
    models = {name: engine.of(case) for name, engine in engines.items()}
    sizes = {name: (d.model.ngeom, d.model.nsensor, d.model.nu) for name, d in models.items()}
    assert sizes[additions.MINIMAL] == (0, 0, 0) and sizes["two capsules"] == (2, 0, 0)
    assert sizes["6 sensors"] == (0, 6, 0) and sizes["a motor"] == (0, 0, 1) and sizes[additions.ON_FLOOR] == (3, 0, 0)
    assert not models[additions.MINIMAL].enabled("contact") and models["contact stage"].enabled("contact")
    start = *case.start, case.tau, 5 / 1024, 400
    paths = {name: dynamics.run(*start, "RK4").q for name, dynamics in models.items()}
    changed = {name for name, path in paths.items() if not np.array_equal(path, paths[additions.MINIMAL])}
    assert changed == {additions.ON_FLOOR}
    many, pushed = additions.contacts(models[additions.ON_FLOOR], *start, "Euler")
    assert many > 0.1 and pushed
    assert additions.contacts(models[additions.CAPSULES], *start, "Euler") == (0.0, False)
    damped = engines[additions.ON_FLOOR].of(ARM.case("damped", damping=0.5, gravity=False)).model
    assert damped.dof_damping.tolist() == [0.5] * 3 and damped.ngeom == 3 and not damped.opt.gravity.any()
    with pytest.raises(ModelError, match="beta"):
        engines[additions.ON_FLOOR].of(ARM.case("locked", locked=("beta",)))


def test_bodies_whose_centre_of_mass_is_at_their_base_have_a_size():
    reading = read('<mujoco><worldbody><body><freejoint/><geom size="0.1"/></body></worldbody></mujoco>')
    radius, near, far = cost.sizes(reading.tree)
    assert radius == pytest.approx(np.sqrt(0.4) * 0.1 / 15, rel=1e-5) and near < 0.0
    engines = additions.with_additions(engine(reading), radius, near, far)
    assert far is None and additions.ON_FLOOR in engines  # a body that falls reaches any floor
    assert additions.OFF_FLOOR not in engines
    text = ARM.mjcf.read_text(encoding="utf-8").replace('pos="0.15 0 0" mass', 'pos="0 0 0" mass')
    tree = dataclasses.replace(tmt.ARM, com=((0, 0, -0.15), (0, 0, 0)))
    assert additions.with_additions(parse(text, tree), *cost.sizes(tree))["two capsules"].model.ngeom == 2


def test_what_is_added_takes_nothing_from_the_default_classes_of_the_file():
    """A motor that were a servo would push, and geoms that may not touch would never do."""
    reading = read(
        '<mujoco><default><position kp="80"/><geom contype="0" conaffinity="0" margin="9"/></default><worldbody><body>'
        '<joint name="j" axis="0 1 0"/><inertial pos="0.2 0 0" mass="1" diaginertia=".01 .01 .01"/></body></worldbody></mujoco>'
    )
    robot = robot_of(reading, "robot.xml")
    engines = additions.with_additions(engine(reading), *cost.sizes(robot.tree))
    case = robot.case("let go")
    paths = {name: e.of(case).run(*case.start, case.tau, 1 / 256, 256, "Euler").q for name, e in engines.items()}
    changed = {name for name, path in paths.items() if not np.array_equal(path, paths[additions.MINIMAL])}
    assert changed == {additions.ON_FLOOR}


def test_the_fall_is_the_regular_scene_else_a_free_one_else_a_posture():
    others = Scene("weightless", gravity=False), Scene("held", torque="hold"), Scene("locked", locked=("beta",))
    assert cost.fall_case(ARM).name == "bent, free"
    assert cost.fall_case(dataclasses.replace(ARM, scenes=(*others, Scene("free")))).name == "free"
    fall = cost.fall_case(dataclasses.replace(ARM, scenes=others))
    assert fall.scene.posture == "zero" and fall.is_free and fall.duration == 5.0  # time enough to come to rest
