"""Where a smaller file may be written, and that an earlier one is whole until the last moment."""

import os
from dataclasses import replace
from pathlib import Path

import mujoco
import numpy as np
import pytest
from helpers.edited import setup_of_file

from compare.cli.command_line import request
from compare.core.check import Result
from compare.core.errors import Refused
from compare.experiments import reduction
from compare.experiments.options import ReductionOptions
from compare.run.reference import compared_with

CORNERS = "\n".join(f"v {place}" for place in ("0.1 0 0", "-0.1 0.1 0", "-0.1 -0.1 0", "0 0 0.2"))
PYRAMID = f"{CORNERS}\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n"
MOTOR = '<mujoco><actuator><motor joint="hip"/></actuator></mujoco>'
ROBOT = """<mujoco><include file="motor.xml"/><compiler meshdir="parts"/><asset><mesh file="foot.obj"/></asset>
<worldbody><geom type="plane" size="2 2 0.1"/><body name="leg" pos="0 0 0.5"><joint name="hip" axis="0 1 0" damping="1"/>
<joint name="slide" type="slide" axis="0 1 0" damping="1"/><geom type="mesh" mesh="foot" mass="1"/></body>
<body pos="1 0 0.1"><freejoint/><geom type="mesh" mesh="foot" mass="1"/></body></worldbody></mujoco>"""
MARKED = "<!-- Written by python -m compare reduction -->\n"


@pytest.fixture
def robot(tmp_path) -> Path:
    """A file that includes another one and loads a mesh; links to all of them; a report."""
    (tmp_path / "parts").mkdir()
    (tmp_path / "parts" / "foot.obj").write_text(PYRAMID)
    (tmp_path / "motor.xml").write_text(MARKED + MOTOR)
    path = tmp_path / "robot.xml"
    path.write_text(MARKED + ROBOT)
    return path


def answer(robot: Path, write: Path | str, *options: str) -> str:
    """Why a request to write there is refused before the run; "" if it is not."""
    words = ["reduction", "--mjcf", str(robot), "--write", str(write), "--out", str(robot.parent / "report")]
    _, given = request([*words, *options])
    compared = compared_with(given.reference, str(robot))
    try:
        validated = given.validated(compared.reading, compared.robot.name)
        assert validated.write == str(Path(write).absolute())
    except Refused as error:
        assert "\n" not in str(error)
        return str(error)
    return ""


@pytest.mark.parametrize("part", ["robot.xml", "motor.xml", "parts/foot.obj"])
@pytest.mark.parametrize("kind", ["itself", "hard link", "link", "through a linked folder"])
def test_what_the_model_needs_is_never_written_to(robot, part, kind):
    needed, path = robot.parent / part, robot.parent / f"other{Path(part).suffix}"
    before = needed.read_bytes()
    if kind == "hard link":
        os.link(needed, path)
    elif kind == "link":
        path.symlink_to(needed)
    elif kind == "through a linked folder":
        (robot.parent / "linked").symlink_to(needed.parent)
        path = robot.parent / "linked" / needed.name
    refused = answer(robot, needed if kind == "itself" else path)
    assert (
        "it is a link, a folder or a device" if kind == "link" else "the model needs this file"
    ) in refused
    assert needed.read_bytes() == before


def test_the_other_model_is_needed_too(robot):
    other = robot.parent / "other.xml"
    other.write_text(robot.read_text())
    assert "needs this file" in answer(robot, other, "--reference", str(other))
    assert answer(robot, other) == ""


@pytest.mark.parametrize("name, first, accepted", [
    ("small.xml", MARKED, True), ("small.txt", MARKED, False), ("small.xml", "", False), ("small.xml", "<!-- mine -->\n", False),
    ("small.xml", f"\n{MARKED}", False), ("small.xml", MARKED.lstrip("<!- "), False),
])  # fmt: skip
def test_only_a_file_that_this_program_wrote_is_replaced(robot, name, first, accepted):
    path = robot.parent / name
    assert answer(robot, path) == ""  # a new name
    path.write_text(first + "<mujoco/>")
    assert ("first line does not say" not in answer(robot, path)) is accepted


def test_places_where_nothing_can_be_written_are_refused(robot, monkeypatch):
    folder = robot.parent
    (folder / "nowhere.xml").symlink_to(folder / "gone.xml")
    os.mkfifo(folder / "pipe.xml")
    (folder / "small_assets").touch()
    (folder / "report").mkdir()
    for name, why in (
        ("nowhere.xml", "a link"), ("pipe.xml", "a device"), ("none/small.xml", "No such file"), ("parts", "a folder"),
        ("small.xml", "small_assets beside it is no folder"), ("report/report.md", "files of the report"),
        ("report/tables/small.xml", "files of the report"), (f"{'x' * 300}.xml", "too long"),
        ("report/small.xml", ""), ("new.xml", ""),
    ):  # fmt: skip
        refused = answer(robot, folder / name)
        assert why in refused and bool(why) == bool(refused)
    monkeypatch.setattr("tempfile.TemporaryFile", refuse)  # as of a read-only mount
    assert "Read-only file system" in answer(robot, folder / "new.xml")


def refuse(*_, **__):
    raise OSError(30, "Read-only file system")


def written(robot: Path, path: Path) -> Result:
    return reduction.rows(
        replace(setup_of_file(robot), alone=True, options=ReductionOptions(write=str(path)))
    )


def told(result: Result) -> str:
    """The file that the answer names as written."""
    return result.top[0].values["written"]


def test_an_earlier_file_is_whole_until_the_checks_are_made(robot, monkeypatch, tmp_path):
    """Whether the run ends before they are, or they fail; afterwards it is the new one, with its meshes."""
    path = tmp_path / "small.xml"
    path.write_text(MARKED)

    def interrupted(*_):
        assert path.read_text() == MARKED
        raise KeyboardInterrupt

    def failed(result, *_):
        result.check("", "the written file", 1.0, 0.0, "m")

    files = {*tmp_path.iterdir()}
    with monkeypatch.context() as patch:
        patch.setattr(reduction, "add_checks", interrupted)
        with pytest.raises(KeyboardInterrupt):
            written(robot, path)
        patch.setattr(reduction, "add_checks", failed)
        assert not told(written(robot, path))
    assert path.read_text() == MARKED and {*tmp_path.iterdir()} == files
    for _ in range(2):  # onto a new one, too
        assert told(written(robot, path)) == str(path)
        assert path.read_text().startswith(MARKED)
        assert mujoco.MjModel.from_xml_path(str(path)).nmesh == 1
    assert {*tmp_path.iterdir()} == files | {tmp_path / "small_assets"}
    assert answer(robot, path) == ""


def link(depth: int) -> str:
    """A chain that tumbles, whose numbers have more than six digits, some of them of a default."""
    third, more = 0.1 * depth + 1.0 / 7.0, link(depth - 1) if depth else ""
    return f"""<body name="link {depth}" pos="{third} 0 -{third / 3}" euler="0.{depth}234567 0.1 0">
<joint axis="0.1 1 {third}" ref="{third / 9}"/><geom type="box" size="{third / 7} 0.0{depth}123457 0.02" mass="0.{depth}9876543"/>
<site name="tip {depth}" pos="0 {third} 0"/>{more}</body>"""


def test_a_motion_that_multiplies_errors_is_that_of_the_written_file_too(tmp_path):
    path, small = tmp_path / "chain.xml", tmp_path / "small.xml"
    path.write_text(
        f"""<mujoco><option timestep="0.0033333333" integrator="RK4"/><default><joint damping="0.000123456789"/></default>
<worldbody>{link(4)}</worldbody><keyframe><key qvel="7.1234567 -3 2 9 -8"/></keyframe></mujoco>"""
    )
    result = reduction.rows(
        replace(setup_of_file(path), alone=True, options=ReductionOptions(write=str(small), error=1e-9))
    )
    assert told(result) == str(small) and all(check.passed for check in result.checks)
    models = [mujoco.MjModel.from_xml_path(str(file)) for file in (path, small)]
    for field in (
        "body_pos",
        "body_quat",
        "body_mass",
        "body_inertia",
        "jnt_axis",
        "qpos0",
        "dof_damping",
        "site_pos",
    ):
        one, other = (getattr(model, field) for model in models)
        assert np.allclose(one, other, rtol=1e-15, atol=1e-16), field
    ends = []
    for model in models:
        data = mujoco.MjData(model)
        mujoco.mj_resetDataKeyframe(model, data, 0)
        mujoco.mj_step(model, data, nstep=300)
        ends.append(data.qpos.copy())
    assert np.abs(ends[1] - ends[0]).max() < 1e-9
