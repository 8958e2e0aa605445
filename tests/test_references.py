"""What a file is compared with, and what is said of that first: on the terminal, in the report, in results.json."""

import json
import os
from pathlib import Path

import pytest
from models import PATHS
from sections import GOOD, section

from compare.engines.mujoco import ModelError
from compare.process.streams import in_one_line
from compare.reference import Reference, compared_with
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


@pytest.mark.parametrize("text", [
    XML.replace('name="gamma"', 'name="wrist"'), XML.replace("<worldbody>", f"<worldbody>{BALL}"),
])  # fmt: skip
def test_one_other_joint_makes_another_robot(tmp_path, text):
    path = tmp_path / "other.xml"
    path.write_text(text)
    assert compared_with(None, str(path))[0].kind == "model"
    with pytest.raises(ModelError, match="hinges alpha, beta, gamma and no others are expected"):
        compared_with("arm", str(path))


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
