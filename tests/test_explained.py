"""A failing check is explained only if it is gone when the cause is mended: a second, independent error stands."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from in_process import Lines
from sections import BAD, section
from test_own_reference import IDLE, examined
from test_own_reference import folder as folder

from compare.engines.mujoco.dynamics import MujocoDynamics
from compare.experiments.setup import Setup, engines
from compare.run.examine import Run
from compare.run.explained import explained, lifted_less_work
from compare.run.reference import compared_with

NAMES = ["parameters", "published", "mass", "gravity", "acceleration"]

SLIP = """
from own_equations_beside import *


def wrong_mass(q):  # of the lower link: 2.5 kg for 2 kg
    c = np.cos(q[1])
    return mass_matrix(q) + 0.5 * np.array([[1.25 + c, 0.25 + c / 2], [0.25 + c / 2, 0.25]])


def heavy(q, v):
    s, weight = np.sin(q[1]), 0.25 * G * np.sin(q[0] + q[1])
    turning = 0.25 * s * np.array([-2 * v[0] * v[1] - v[1] ** 2, v[0] ** 2])
    return bias(q, v) + turning + [0.5 * G * np.sin(q[0]) + weight, weight]


def follows(q, v, tau, damping=0.3):
    return np.linalg.solve(wrong_mass(q), tau - heavy(q, v) - np.array([damping, 0.0]) * v)


def height(q, v, factor=1.0, lifted=1.0):
    above = -G * (3.0 * np.cos(q[0]) + 1.25 * np.cos(q[0] + q[1]))
    return factor * v @ wrong_mass(q) @ v / 2 + lifted * above


def of(**more):
    return changed(**({"mass_matrix": wrong_mass, "bias": heavy} | more))


alone = of(acceleration=follows, gravity=lambda q: heavy(q, np.zeros(2)), energy=height)
other_acceleration = of(acceleration=acceleration)
other_gravity = of(gravity=gravity)
other_kinetic = of(energy=lambda q, v: height(q, v, factor=1.1))
other_potential = of(energy=lambda q, v: height(q, v, lifted=1.1))
rarely = of(acceleration=lambda q, v, tau: follows(q, v, tau) + (abs(q[0] - 1.12) < 0.01))  # at the last of the states
other_rubbing = of(acceleration=lambda q, v, tau: follows(q, v, tau, damping=0.4))
"""


def standing(sections):
    """The failing checks that no cause explains."""
    checks = ((check, section.explained) for section in sections for check in section.result.checks)
    return [check for check, explained in checks if check.failed and check not in explained]


@pytest.mark.parametrize("name, stands", [
    ("alone", set()), ("other_acceleration", {"acceleration"}), ("other_gravity", {"gravity"}),
    ("other_kinetic", {"energy"}), ("other_potential", {"energy"}), ("other_rubbing", set()), ("rarely", {"acceleration"}),
])  # fmt: skip
def test_what_is_the_users_own_must_follow_from_the_m_and_h_that_the_cause_explains(folder, name, stands):
    (folder / "own_equations_beside.py").write_text((folder / "mine.py").read_text())
    (folder / "slip.py").write_text(SLIP)
    found = examined(folder, f"slip.py:{name}", ["mass", "gravity", "acceleration"])
    assert "mass" in found.causes[0].text and found.failed
    left = standing(found.sections)
    if stands == {"energy"}:
        assert {check.quantity.split()[0].strip(",") for check in left} >= {"energy"}
        assert len(left) < len(found.failed)
    else:
        assert {check.experiment for check in left} == stands


def setup_of_heavy(tmp_path):
    """The arm, whose forearm weighs 1.51 kg for 1.5 in MuJoCo's file."""
    file = tmp_path / "heavy.xml"
    file.write_text(Path("mjcf/arm.xml").read_text().replace('mass="1.5"', 'mass="1.51"'))
    _, robot, mujoco, reading = compared_with("arm", str(file))
    size = {"states": 30, "exact_states": 1, "finer": (1,), "size": "quick"}
    return Setup(robot, engines(mujoco), reading=reading, **size)


@pytest.mark.parametrize("wrong, stands", [(0.0, {"parameters"}), (1e-9, set(NAMES) - {"mass"})])
def test_a_wrong_number_of_a_file_explains_no_error_of_an_engine(tmp_path, monkeypatch, wrong, stands):
    """The forearm weighs 1.51 kg for 1.5; and MuJoCo's bias is off by 1e-9 N m."""
    bias = MujocoDynamics.bias
    monkeypatch.setattr(MujocoDynamics, "bias", lambda *a: bias(*a) + wrong)
    sections, causes, _ = Run(NAMES, setup_of_heavy(tmp_path), tmp_path, Lines(), IDLE).examined()
    assert causes[0].text.startswith("mass of forearm")
    assert {check.experiment for check in standing(sections)} == stands
    assert sections[2].name == "mass" and sections[2].explained


def test_what_no_cause_explains(tmp_path, monkeypatch):
    """A stated robot's own numbers, a file with another tree, what is no number, and the potential energy of balls."""
    setup = setup_of_heavy(tmp_path)
    printed = section("published", ("TMT, torque", *BAD[1:]), ("MuJoCo, torque", *BAD[1:]))
    assert [check.quantity for check in explained(setup, printed)] == ["MuJoCo, torque"]
    other = replace(setup.robot, tree=replace(setup.robot.tree, parent=(-1, 0, 0)))
    assert explained(replace(setup, robot=other), printed) == []
    monkeypatch.setattr("compare.run.explained.what_follows", lambda setup: {"equations": True})
    own = SimpleNamespace(robot=SimpleNamespace(own=("mass_matrix",)))
    assert [check.value for check in explained(own, section("mass", ("M", None, *BAD[2:]), BAD))] == [2.0]
    balls = SimpleNamespace(coordinates=SimpleNamespace(has_balls=True))
    assert np.isnan(lifted_less_work(balls, np.zeros((2, 4)))).all()
