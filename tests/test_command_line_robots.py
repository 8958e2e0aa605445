"""python -m compare with a robot's file: what it is compared with, exit status, error lines."""

import json

import pandas as pd
import pytest
from models import PATHS

from compare import __main__ as entry
from compare.__main__ import main
from compare.robots.arm import ARM

XML = ARM.mjcf.read_text(encoding="utf-8")
BODY = '<mujoco><worldbody><body name="a"><joint name="j" axis="0 1 0"/>{}</body></worldbody></mujoco>'
MESH = '<mujoco><asset><mesh name="m" file="none.stl"/></asset><worldbody><body><joint/><geom type="mesh" mesh="m"/></body></worldbody></mujoco>'  # noqa: E501


def test_a_heavier_arm_differs_from_the_stated_numbers_and_not_from_its_own(tmp_path, capsys):
    path = tmp_path / "heavy.xml"
    path.write_text(XML.replace('mass="1.5"', 'mass="1.6"'))
    for asked, status, reference, name, said in (
        ([], 1, "arm; {} compared with the stated numbers", "arm", "The two models do not agree in parameters"),
        (["--reference", "model"], 0, "model; {} compared with tmt's equations for the model as compiled", str(path),
         "TMT and MuJoCo agree in parameters"),
    ):  # fmt: skip
        assert main(["parameters", "--quick", "--mjcf", str(path), *asked, "--out", str(tmp_path / "out")]) == status
        first, *lines = capsys.readouterr().out.splitlines()
        assert first == f"reference: {reference.format(path)}"
        assert any(line.startswith(said) for line in lines)
        results = json.loads((tmp_path / "out" / "results.json").read_text(encoding="utf-8"))
        assert results["reference"] == {"kind": first.split()[1][:-1], "name": name}
        assert (tmp_path / "out" / "report.md").read_text(encoding="utf-8").startswith(f"{first}\n")
        assert (tmp_path / "out" / "tables" / "inventory.csv").exists() == bool(asked)


def test_a_robot_is_compared_and_what_is_off_is_said(tmp_path, capsys):
    path = str(PATHS["gripper"])
    assert main(["parameters", "--quick", "--mjcf", path, "--out", str(tmp_path)]) == 0
    first, second, *_ = capsys.readouterr().out.splitlines()
    assert first == f"reference: model; {path} compared with tmt's equations for the model as compiled"
    assert second == "open tree: 1 equalities off: mimic"
    inventory = pd.read_csv(tmp_path / "tables" / "inventory.csv")
    assert list(inventory.columns) == ["feature", "count", "names", "treatment", "reason"]
    rows = inventory.set_index("feature")
    assert rows.loc["equality", ["count", "names", "treatment"]].tolist() == [1, "mimic", "open_tree"]
    assert rows.loc["actuator", ["count", "names", "treatment"]].tolist() == [
        3,
        "shoulder;wrist;fingers",
        "switched_off",
    ]
    text = (tmp_path / "report.md").read_text(encoding="utf-8")
    assert text.startswith(f"{first}\n\n{second}\n\n# TMT and MuJoCo compared on gripper.xml\n")


@pytest.mark.parametrize("arguments, says", [
    (["mass", "--reference", "arm"], "joint3 (hinge), joint5 (hinge), joint6 (hinge), joint7 (hinge) are not in the arm"),
    (["published"], "published cannot serve arm7: no printed numbers of the robot are known"),
])  # fmt: skip
def test_what_is_of_the_arm_alone_gets_status_2(tmp_path, capsys, arguments, says):
    refused(capsys, [*arguments, "--mjcf", str(PATHS["arm7"]), "--out", str(tmp_path / "out")], says)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("text, says", [
    ("<mujoco><worldbody>", "MuJoCo cannot compile"), ("", "is empty; an MJCF file is expected"),
    ("no XML", "is not MJCF"), (MESH, "none.stl"),
    ('<mujoco><worldbody><body><geom size="1"/></body></worldbody></mujoco>', "it has no joint; at least one is expected"),
    (BODY.format(""), "mass and inertia of moving bodies must be larger"),
    (BODY.format('<inertial pos="0 0 0" mass="inf" diaginertia="1 1 1"/>'), "finite numbers are expected"),
])  # fmt: skip
def test_a_file_that_cannot_be_compared_gets_one_line_and_status_2(tmp_path, capsys, monkeypatch, text, says):
    (tmp_path / "bad.xml").write_text(text)
    monkeypatch.chdir(tmp_path)
    for experiment in ("all", "gravity"):
        refused(capsys, [experiment, "--quick", "--mjcf", "bad.xml"], says)
    assert [path.name for path in tmp_path.iterdir()] == ["bad.xml"]


def test_a_wrong_scene_of_a_robot_gets_status_2(tmp_path, capsys):
    scenes = tmp_path / "my.toml"
    for text, says in (
        (
            'posture = "raised"',
            "posture is 'raised'; spread, qpos0, middle or 17 numbers, one per joint (track, swing,",
        ),
        ("q = [1.0]", "q is [1.0]; 17 numbers, one per joint (track, swing, joint 2, base x, "),
        ("speed = [1.0]", "speed is [1.0]; 15 numbers, one per joint (track, swing, joint 2, base x, "),
    ):
        scenes.write_text(f'[[scene]]\nname = "mine"\n{text}\n')
        refused(capsys, ["trajectory", "--mjcf", str(PATHS["mixed"]), "--scenes", str(scenes)], says)


def test_in_all_what_cannot_serve_the_robot_is_skipped_with_the_reason(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(entry, "EXPERIMENTS", dict.fromkeys(("parameters", "published"), ""))
    assert main(["all", "--quick", "--mjcf", str(PATHS["loop"]), "--out", str(tmp_path)]) == 0
    results = json.loads((tmp_path / "results.json").read_text(encoding="utf-8"))
    reason = "no printed numbers of the robot are known"
    assert results["skipped"] == [{"experiment": "published", "reason": reason}]
    assert f"published     skipped: {reason}" in capsys.readouterr().out.splitlines()


SERVO = """<mujoco model="tail"><option timestep="0.002"/><worldbody><body><joint name="swing" axis="0 1 0" damping="0.01"/>
  <geom type="sphere" size="0.1" pos="0 0 -0.5" mass="2"/></body></worldbody>
  <actuator><position joint="swing" kp="50" kv="800"/></actuator></mujoco>"""


def test_a_robot_that_is_not_stable_at_its_own_step_agrees_and_fails(tmp_path, capsys):
    path = tmp_path / "tail.xml"
    path.write_text(SERVO)
    asked = ["--dt", "0.001", "--integrator", "Euler"]
    assert main(["stability", "--quick", "--mjcf", str(path), *asked, "--out", str(tmp_path / "out")]) == 1
    lines = capsys.readouterr().out.splitlines()
    at = next(k for k, line in enumerate(lines) if line.startswith("TMT and MuJoCo agree in stability"))
    assert "tail is not stable at its own step of 2 ms at qpos0: the limit is 1." in lines[at]
    assert lines[at + 1].startswith("Not stable at its own 2 ms under Euler, MuJoCo's default (limit 1.")
    assert lines[at + 2].startswith("Asked: 1 ms under Euler: stable (limit 1.")
    results = json.loads((tmp_path / "out" / "results.json").read_text(encoding="utf-8"))
    assert not results["passed"] and results["causes"] == []
    failed = [check for check in results["checks"] if not check["passed"]]
    assert [(check["quantity"], check["scene"], check["note"]) for check in failed] == [
        ("stable at its own step", "qpos0", "under Euler, swing")
    ]
    text = (tmp_path / "out" / "report.md").read_text(encoding="utf-8")
    assert text.index(lines[at + 1]) < text.index("## Stability") and f"\n- {lines[at + 1]}\n" in text
    assert lines[at + 1] in (tmp_path / "out" / "index.html").read_text(encoding="utf-8").replace("&#x27;", "'")


@pytest.mark.parametrize("arguments, says", [
    (["--dt", "0.1"], "arm is compared by its stated numbers, which have no actuator"),
    (["--integrator", "Euler", "--mjcf", str(PATHS["free_body"])], "free_body has no actuator"),
    (["--integrator", "euler", "--mjcf", str(PATHS["arm7"])], "'euler' is no integrator of MuJoCo; did you mean Euler?"),
    (["--integrator", "heun", "--mjcf", str(PATHS["arm7"])], "'heun' is no integrator of MuJoCo; Euler, implicitfast,"),
])  # fmt: skip
def test_a_step_that_cannot_be_answered_for_gets_status_2(tmp_path, capsys, arguments, says):
    refused(capsys, ["stability", *arguments, "--out", str(tmp_path / "out")], says)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("arguments, says", [
    (["mass", "--dt", "0.1"], "--dt and --integrator are for stability; mass answers for no other step"),
    (["all", "--integrator", "Euler"], "--dt and --integrator are for stability; all"),
    (["stability", "--dt", "0"], "argument --dt: '0' is no step; seconds above 0 and at most 5 are expected"),
    (["stability", "--dt", "nan"], "'nan' is no step"), (["stability", "--dt", "5.1"], "'5.1' is no step"),
    (["stability", "--dt", "2ms"], "'2ms' is no step"), (["stability", "--integrator", ""], "argument --integrator: it is empty"),
])  # fmt: skip
def test_a_step_that_is_none_or_elsewhere_gets_status_2(capsys, arguments, says):
    with pytest.raises(SystemExit) as ended:
        main(arguments)
    out, err = capsys.readouterr()
    assert ended.value.code == 2 and out == "" and len(err.splitlines()) == 1 and says in err


def refused(capsys, arguments, says):
    """Status 2, one line that says why, and nothing else."""
    assert main(arguments) == 2
    out, err = capsys.readouterr()
    assert out == "" and len(err.splitlines()) == 1 and says in err, err
