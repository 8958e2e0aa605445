"""What a file is compared with, and what is said of that first: on the terminal, in the report, in results.json."""

import json
import os
from pathlib import Path

import numpy as np
import pytest
from models import PATHS
from sections import GOOD, section

import tmt
from compare.engines.mujoco import ModelError
from compare.process.streams import in_one_line
from compare.reference import JointsDiffer, Reference, compared_with
from compare.report.files import write
from compare.report.verdict import Report, verdict
from compare.robots.arm import ARM

BALL = '<body><joint type="ball"/><inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/></body>'
XML = ARM.mjcf.read_text(encoding="utf-8")


def test_the_arm_is_compared_with_the_stated_numbers():
    reference, robot, mujoco, reading = compared_with(None, None)
    assert reference.lines == ("reference: arm; mjcf/arm.xml compared with the stated numbers",)
    assert (reference.kind, reference.name, robot, reading) == ("arm", "arm", ARM, None)
    assert not mujoco.bare


def test_so_is_a_file_with_exactly_its_hinges_in_any_order(tmp_path):
    path = tmp_path / "turned.xml"
    path.write_text(XML.replace('"alpha"', '"x"').replace('"beta"', '"alpha"').replace('"x"', '"beta"'))
    reference, robot, *_ = compared_with(None, str(path))
    assert reference.lines == (f"reference: arm; {path} compared with the stated numbers",)
    assert (reference.name, robot) == ("arm", ARM)


@pytest.mark.parametrize("asked, path", [(None, PATHS["arm7"]), ("model", None), ("model", ARM.mjcf)])
def test_any_other_and_whoever_asks_for_it_with_tmts_equations(asked, path):
    reference, robot, mujoco, reading = compared_with(asked, path and str(path))
    file = str(path or "mjcf/arm.xml")
    assert reference.lines == (f"reference: model; {file} compared with tmt's equations for the model as compiled",)
    assert (reference.kind, reference.name, robot.described) == ("model", file, Path(file).name)
    assert robot.is_read and mujoco.bare and reading.tree == robot.tree


def written(tmp_path, text, name="other.xml"):
    (tmp_path / name).write_text(text)
    return str(tmp_path / name)


RENAMED = XML.replace('"alpha"', '"Alpha"').replace(' name="beta"', "").replace('"gamma"', '"wrist"')
ORDER = [f'<joint name="{name}" type="hinge" axis="{axis}"/>' for name, axis in (("alpha", "0 1 0"), ("beta", "1 0 0"))]
EXCHANGED = RENAMED.replace('<joint name="Alpha" type="hinge" axis="0 1 0"/>', "X").replace(
    '<joint type="hinge" axis="1 0 0"/>', '<joint name="second" type="hinge" axis="0 1 0"/>'
).replace("X", '<joint name="first" type="hinge" axis="1 0 0"/>')  # fmt: skip


@pytest.mark.parametrize("text, names", [
    (RENAMED, ("Alpha", "joint 1", "wrist")),
    (EXCHANGED, ("second", "first", "wrist")),
    (RENAMED.replace('axis="0 1 0"', 'axis="0 -1 0"'), ("Alpha", "joint 1", "wrist")),  # which is wrong, and matched
    (XML.replace('"gamma" type="hinge" axis="0 1 0"', '"elbow" type="hinge" axis="1 0 0"'), ("alpha", "beta", "elbow")),
])  # fmt: skip
@pytest.mark.parametrize("asked", ["arm", str(ARM.mjcf)])
def test_joints_of_other_names_are_matched_by_place_axis_and_type(tmp_path, text, names, asked):
    path = written(tmp_path, text)
    assert compared_with(None, path)[0].kind == "model"
    reference, robot, mujoco, _ = compared_with(asked, path)
    assert robot.joints == names and reference.lines[1].startswith("joints matched: ")
    assert reference.renamed == tuple(f"{b} as {a}" for a, b in zip(ARM.joints, names) if a != b)
    right = text in (RENAMED, EXCHANGED)
    q, qd = np.array([0.3, -0.2, 0.9]), np.array([1.0, 2.0, -3.0])
    theirs = mujoco.of(robot.case()).bias(q, qd)
    assert (np.abs(theirs - tmt.bias(q, qd)).max() < 1e-12) == (right and text != EXCHANGED)
    assert robot.stated_in == (asked if asked != "arm" else "") and robot.is_stated


@pytest.mark.parametrize("text, says", [
    (XML.replace(ORDER[1], ""), r"joint beta \(hinge\) of .* is missing"),
    (XML.replace("<worldbody>", f"<worldbody>{BALL}"), r"joint joint 0 \(ball\) is not in"),
    (XML.replace('"gamma" type="hinge"', '"gamma" type="slide"'), r"joint gamma is a slide, that of .* a hinge"),
    (RENAMED.replace('"wrist" type="hinge"', '"wrist" type="slide"'), r"gamma .* missing; joint wrist \(slide\) is not in"),
])  # fmt: skip
@pytest.mark.parametrize("asked", ["arm", str(ARM.mjcf)])
def test_joints_without_a_counterpart_are_named(tmp_path, text, says, asked):
    with pytest.raises(JointsDiffer, match=f"^.*other.xml cannot be compared with .*: .*{says}"):
        compared_with(asked, written(tmp_path, text))


def test_bodies_of_a_solution_are_found_on_their_joints(tmp_path):
    reference, robot, mujoco, reading = compared_with(str(PATHS["gripper"]), str(PATHS["gripper"]))
    assert (reference.kind, reference.name, reference.renamed) == ("solution", str(PATHS["gripper"]), ())
    assert mujoco.bodies == list(reading.bodies) and not robot.drive.actuators
    hand = '<body><inertial pos="0.3 0 0" mass="1" diaginertia="1 1 1"/></body></body>'
    with pytest.raises(ModelError, match="body by body: joint gamma moves 2 bodies with mass, and 1 in the solution"):
        compared_with(str(ARM.mjcf), written(tmp_path, XML.replace("</body>", hand, 1)))


def test_an_empty_file_is_said_to_be_one(tmp_path):
    with pytest.raises(ModelError, match=r"other\.xml is empty; an MJCF file is expected"):
        compared_with(None, written(tmp_path, "\n"))


def test_equalities_that_are_off_and_warnings_follow():
    reference, *_ = compared_with(None, str(PATHS["gripper"]))
    assert reference.lines[1:] == ("open tree: 1 equalities off: mimic",)
    more = Reference("model", "a.xml", ("mimic", "pin"), ("no texture", "old"))
    assert more.lines[1:] == (
        "open tree: 2 equalities off: mimic, pin", "MuJoCo warns: no texture", "MuJoCo warns: old",
    )  # fmt: skip


@pytest.mark.parametrize("name, said", [
    ("two\nlines \x1b[31m.xml", "two\\nlines \\x1b[31m.xml"), (os.fsdecode(b"K\xc3\xa4fer \xff.xml"), "Käfer \\xff.xml"),
    ("<b>*a*`b`[c](d) & |.xml", "<b>*a*`b`[c](d) & |.xml"), ("long" * 60 + ".xml", "long" * 60 + ".xml"),
])  # fmt: skip
def test_a_file_of_any_name_stays_in_one_line(tmp_path, monkeypatch, name, said):
    assert in_one_line(name) == said
    monkeypatch.chdir(tmp_path)
    Path(name).write_bytes(PATHS["loop"].read_bytes())
    reference, robot, mujoco, _ = compared_with(None, name)
    assert reference.lines[0] == f"reference: model; {said} compared with tmt's equations for the model as compiled"
    assert robot.mjcf == Path(name) and mujoco.source == Path(name)

    (tmp_path / "out" / "figures").mkdir(parents=True)
    sections = [section("mass", GOOD)]
    words = verdict(sections, 1, compared=reference.compared)
    assert words.startswith("TMT and MuJoCo agree: all 1 checks pass.")
    write(tmp_path / "out", Report(sections, robot, {"command": "c"}, words, reference=reference))
    results = json.loads((tmp_path / "out" / "results.json").read_text(encoding="utf-8"))
    assert results["reference"] == {"kind": "model", "name": said}
    text = (tmp_path / "out" / "report.md").read_text(encoding="utf-8")
    first, _, second, *_ = text.splitlines()
    assert unescaped(first) == reference.lines[0] and second.startswith("open tree: ")
    page = (tmp_path / "out" / "index.html").read_text(encoding="utf-8")
    assert "<b>" not in page and page.index("<h1>") < page.index("reference: model; ")
    assert page.count(said.replace("&", "&amp;").replace("<", "&lt;").replace(">", "&gt;")) >= 3
    assert f"compared on {said}" in unescaped(text)


def unescaped(text):
    """Markdown without the signs that keep others from being markup."""
    for sign in "`*<[":
        text = text.replace(f"\\{sign}", sign)
    return text.replace("\\\\", "\\")


def test_a_report_says_what_a_robot_of_a_file_consists_of_and_what_is_switched_off(tmp_path):
    (tmp_path / "figures").mkdir()
    for name, joints, off in (
        ("mixed", "on four hinges, two slides, one ball and one free joint", "limit (2), clamp (1), actuator (2)."),
        ("gripper", "four rigid bodies on two hinges and two slides", "contact (5), limit (4), clamp (3), actuator (3), "
         "equality (1), tendon (1)."),
        ("free_body", "one rigid body on one free joint", "Nothing of the file is switched off."),
    ):  # fmt: skip
        reference, robot, *_ = compared_with(None, str(PATHS[name]))
        (tmp_path / "tables").rmdir() if (tmp_path / "tables").exists() else None
        write(tmp_path, Report([section("mass", GOOD)], robot, {"command": "c"}, "words", reference=reference))
        text = (tmp_path / "report.md").read_text(encoding="utf-8")
        assert joints in text and off in text and "modelled twice" not in text
        assert f"# TMT and MuJoCo compared on {PATHS[name].name}" in text
