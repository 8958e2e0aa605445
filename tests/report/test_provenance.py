"""Where a report comes from: the program's own version, and what each task took itself."""

import tomllib
from pathlib import Path

import pytest

from compare.process.clock import Clock
from compare.report.provenance import durations, provenance
from compare.report.tables import origins
from compare.robots.arm import ARM
from compare.version import OURS, installed, of_checkout

ROOT = Path(__file__).resolve().parents[2]


def test_the_version_is_that_of_the_checkout_that_runs():
    stated = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]["version"]
    assert provenance("c", ARM.mjcf, "arm.xml", 1)[OURS] == stated == of_checkout(ROOT)


@pytest.mark.parametrize("text, version", [
    ('[project]\nname = "arm-tmt-mujoco"\nversion = "3.2.1"', "3.2.1"), ('[project]\nname = "other"\nversion = "1"', None),
    ('[project]\nname = "arm-tmt-mujoco"', None), ("[tool.x]", None), ("[", None), (None, None),
])  # fmt: skip
def test_another_project_around_the_package_says_nothing(tmp_path, text, version):
    if text is not None:
        (tmp_path / "pyproject.toml").write_text(text)
    assert of_checkout(tmp_path) == version


def test_what_is_not_installed_has_no_version():
    assert installed("numpy")[0].isdigit() and installed("no-such-package") is None


def test_what_each_task_took_itself_is_written():
    clock = Clock()
    clock.taken, clock.ended = [("a", 0.251), ("b", 1.0), ("a", 0.25)], {"start": 0.5, "a": 1.501, "b": 9.0}
    found = durations(clock)
    assert found == {"seconds_of": {"a": 0.5, "b": 1.0}, "ended_after_s": {"start": 0.5, "a": 1.5, "b": 9.0}}
    table = origins(found)
    assert table["what"].tolist()[0].startswith("seconds of the processor")
    assert table["value"].tolist() == ["a 0.5, b 1.0", "start 0.5, a 1.5, b 9.0"]
