"""Engines that read the robot's file: each installed one against closed forms and exact values, and seeded errors."""

from pathlib import Path

import numpy as np
import pytest
from helpers.files import assert_exact
from models import PATHS

import tmt
from compare.engines import RECORDS, Setting
from compare.engines.outside import Outside
from compare.engines.outside.file import EngineError
from compare.judge.scale import FACTOR
from compare.run.reference import compared_with

ROOT = Path(__file__).parents[2]
ENGINES = [name for name, record in RECORDS.items() if record.reads_file and not Outside(name).unavailable()]
pytestmark = pytest.mark.parametrize("engine", ENGINES)
ROBOTS = [ROOT / "mjcf/arm.xml", *(PATHS[name] for name in ("arm7", "quadruped", "pendulum_ball"))]
BODY = '<inertial pos="{}" mass="{}" diaginertia="{}"/>'
PENDULUM = f"""<mujoco model="m"><option gravity="0 0 -9.81"/><worldbody><body name="upper">
<joint name="hip" axis="0 1 0" damping="0.1"/>
{BODY.format("0 0 -0.5", 2, "0.25 0.2 0.1")}</body></worldbody></mujoco>"""
TWO_LINKS = f"""<mujoco model="m"><option gravity="1 2 -9.81"/><worldbody><body name="upper">
<joint name="hip" axis="0 1 0" armature="0.01"/>
{BODY.format("0 0 -0.5", 1, "0.1 0.1 0.01")}<body name="lower" pos="0 0 -1"><joint name="knee" axis="0 1 0"/>
{BODY.format("0 0 -0.5", 1, "0.1 0.1 0.01")}</body></body></worldbody></mujoco>"""


def dynamics(engine, text_or_path, folder=None):
    """The dynamics of a file, or of MJCF text, in an outside engine, and its robot."""
    path = text_or_path
    if isinstance(path, str):
        path = folder / "robot.xml"
        path.write_text(text_or_path)
    robot = compared_with("model", str(path)).robot
    return Outside(engine).of(robot.case()), robot


def near(values, expected, engine, scale=1.0):
    return np.abs(np.subtract(values, expected)).max() <= FACTOR * RECORDS[engine].eps * scale


def test_an_arm_of_two_links_under_an_oblique_gravity(engine, tmp_path):
    of, _ = dynamics(engine, TWO_LINKS, tmp_path)
    (a, b), (x, y) = q, v = np.array([0.4, -0.9]), np.array([1.1, -0.7])
    c, s = np.cos(b), np.sin(b)
    M = [[1.7 + c + 0.01, 0.35 + 0.5 * c], [0.35 + 0.5 * c, 0.35]]
    weight = [[1.5 * (9.81 * np.sin(a) + np.cos(a)) + 0.5 * (9.81 * np.sin(a + b) + np.cos(a + b))],
              [0.5 * (9.81 * np.sin(a + b) + np.cos(a + b))]]  # fmt: skip
    h = np.add(np.ravel(weight), [-0.5 * s * (2 * x * y + y * y), 0.5 * s * x * x])
    assert near(of.mass_matrix(q[None]), M, engine, 3.0) and near(of.bias(q[None], v[None]), h, engine, 30.0)


def dynamics_or_skip(engine, model, folder=None):
    of, robot = dynamics(engine, model, folder)
    try:
        of.reading  # noqa: B018
    except EngineError as error:
        pytest.skip(f"{engine}: {error}")
    return of, robot


@pytest.mark.parametrize("robot", ROBOTS, ids=lambda path: path.stem)
def test_a_robot_against_the_exact_values(engine, robot):
    of, robot = dynamics_or_skip(engine, robot)
    assert_exact(engine, of, robot)


@pytest.mark.parametrize("damping", ["0", "0.4"])
def test_each_integrator_falls_as_its_order_says(engine, damping, tmp_path):
    """A pendulum swings for a second: the error against a run with steps a hundred times as fine."""
    of, robot = dynamics(engine, PENDULUM.replace('damping="0.1"', f'damping="{damping}"'), tmp_path)
    start, engine = (np.array([1.0]), np.array([0.5]), np.array([0.25])), Outside(engine)
    exact = tmt.simulate(robot.tree, *start, 1e-4, 10_000, "dopri8").q[[5_000, -1]]
    floor = 1e-5 if engine.record.precision == "float32" else 1e-11
    for method in engine.methods.values():
        errors, settings = [], [Setting(1.0, n) for n in (128, 256)]
        for setting in [Setting(1.0, tolerance=10.0**-k) for k in (3, 10)] if method.adaptive else settings:
            run, read = of.prepare(*start, setting, method.name)
            motion = read(run())
            assert motion.ended is None and motion.q.shape == (65, 1)
            errors.append(abs(motion.q[[32, -1]] - exact).max())
        # after rejected steps Drake's RK5 errs more than its tolerance: see reports/engines/discrepancies.md
        least = 1e-8 if method.adaptive else floor
        assert errors[1] <= max(least, errors[0] / 1.9 ** (method.order or 1)), method
