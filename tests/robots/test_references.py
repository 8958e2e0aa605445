"""Which reference a file is compared with, how joints are matched, and the first lines of the output and of the report."""

from pathlib import Path

import numpy as np
import pytest
from helpers.edited import XML
from helpers.in_process import without_workers
from models import PATHS

import tmt
from compare.__main__ import main
from compare.robots.arm import ARM
from compare.run.reference import compared_with

ITSELF = str(ARM.mjcf)


def written(tmp_path, text, name="other.xml"):
    (tmp_path / name).write_text(text)
    return str(tmp_path / name)


@pytest.mark.parametrize("asked, path", [(None, str(PATHS["arm7"])), ("model", None)])
def test_any_other_file_is_compared_with_its_own_compiled_model(asked, path):
    reference, robot, mujoco, reading = compared_with(asked, path)
    file = path or "mjcf/arm.xml"
    assert (reference.kind, reference.name, robot.described) == ("model", file, Path(file).name)
    assert robot.is_read and mujoco.bare and reading.tree == robot.tree


RENAMED = XML.replace('"alpha"', '"Alpha"').replace(' name="beta"', "").replace('"gamma"', '"wrist"')
HINGE = '<joint name="{}" type="hinge" axis="{}"/>'
ORDER = [HINGE.format("alpha", "0 1 0"), HINGE.format("beta", "1 0 0")]
EXCHANGED = XML.replace(ORDER[0], "X").replace(ORDER[1], HINGE.format("second", "0 1 0"))
EXCHANGED = EXCHANGED.replace("X", HINGE.format("first", "1 0 0"))


@pytest.mark.parametrize("asked, text, names", [
    ("arm", RENAMED, ("Alpha", "joint 1", "wrist")),
    ("arm", EXCHANGED, ("first", "second", "gamma")),
    (ITSELF, RENAMED.replace('axis="0 1 0"', 'axis="0 -1 0"'), ("Alpha", "joint 1", "wrist")),  # which is wrong
    ("arm", XML.replace('"gamma" type="hinge" axis="0 1 0"', '"elbow" type="hinge" axis="1 0 0"'), ("alpha", "beta", "elbow")),
])  # fmt: skip
def test_joints_of_other_names_are_matched_by_order_and_type(tmp_path, asked, text, names):
    path = written(tmp_path, text)
    assert compared_with(None, path)[0].kind == "model"
    reference, robot, mujoco, _ = compared_with(asked, path)
    assert robot.joints == names and len(reference.lines) == 2
    assert reference.renamed == tuple(f"{b} as {a}" for a, b in zip(ARM.joints, names) if a != b)
    q, qd = np.array([0.3, -0.2, 0.9]), np.array([1.0, 2.0, -3.0])
    theirs = mujoco.of(robot.case()).bias(q, qd)
    assert (np.abs(theirs - tmt.bias(tmt.ARM, q, qd)).max() < 1e-12) == (text == RENAMED)
    assert robot.stated_in == (asked if asked != "arm" else "") and robot.is_stated


def test_bodies_of_a_solution_are_found_on_their_joints(tmp_path):
    path = str(PATHS["gripper"])
    reference, robot, mujoco, reading = compared_with(path, path)
    assert (reference.kind, reference.name, reference.renamed) == ("solution", path, ())
    assert mujoco.bodies == list(reading.bodies) and robot.drive is None
    of_body = '<body name="{}{}"><inertial pos="0 0 0" mass="{}" diaginertia="1 1 1"/></body>'
    a, b = of_body.format("a", 1, 1), of_body.format("b", 2, 2)
    texts = (XML.replace("</body>", f"{pair}</body>", 1) for pair in (a + b, b + a))
    first, second = (written(tmp_path, text, f"{k}.xml") for k, text in enumerate(texts))
    engines = [compared_with(first, second).mujoco, compared_with(second, first).mujoco]
    masses = [engine.model.body_mass[engine.bodies].tolist() for engine in engines]
    assert [of_bodies[-2:] for of_bodies in masses] == [[1.0, 2.0], [2.0, 1.0]]


SWINGS = """<robot name="r"><link name="base"/><joint name="j" type="revolute"><parent link="base"/><child link="rod"/>
<axis xyz="0 1 0"/><limit lower="-2" upper="2" effort="5" velocity="5"/></joint><link name="rod"><inertial><mass value="{}"/>
<origin xyz="0 0 -0.4"/><inertia ixx="0.02" iyy="0.02" izz="0.002" ixy="0" ixz="0" iyz="0"/></inertial></link></robot>"""


@pytest.mark.parametrize("mass, differs", [("2", False), ("1.5", True)])
def test_a_urdf_is_a_solution_and_where_it_differs_no_eps_is_advised(tmp_path, capsys, mass, differs):
    file, solution = (
        written(tmp_path, SWINGS.format("2"), "a.urdf"),
        written(tmp_path, SWINGS.format(mass), "b.urdf"),
    )
    asked = ["--mjcf", file, "--reference", solution, "--out", str(tmp_path / "out")]
    with without_workers():
        assert main(["derivatives", "--quick", *asked]) == differs
    out = capsys.readouterr().out
    assert "Not finished" not in out
    assert ("Use mjd_transitionFD" in out) != differs and ("differ" in out) == differs
