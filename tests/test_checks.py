"""Which checks a run makes: a committed list, so that none is dropped unseen. `python -m tests.test_checks` remakes it."""

import re
from pathlib import Path

import pytest

from compare.engines.mujoco import parse
from compare.experiments import EXPERIMENTS
from compare.robots.arm import ARM
from compare.run.examine import Setup, engines, module

LISTED = Path(__file__).with_name("checks_of_a_small_run.txt")
MEASURED = re.compile(r"\d+\.\d+(e[-+]?\d+)?|\d+e[-+]?\d+")
NAMES = [name for name in EXPERIMENTS if name != "engines"]  # which depends on what is installed
DEPENDS = "smallest error of"  # on where rounding takes over on a machine


def named(result) -> set[str]:
    """Experiment, scene and quantity of each check of a result, without measured numbers."""
    lines = [f"{c.experiment} | {c.scene} | {c.quantity} | {c.rule}" for c in result.checks]
    return {MEASURED.sub("#", line) for line in lines if DEPENDS not in line}


@pytest.mark.parametrize("experiment", NAMES)
def test_every_check_that_is_listed_is_made_and_no_other(experiment, small, mujoco):
    missing = {"discrete"} - set(mujoco.methods)  # older than MuJoCo 3.13
    lines = LISTED.read_text(encoding="utf-8").splitlines()
    of_it = {line for line in lines if line.startswith(f"{experiment} |")}
    assert named(small(experiment)) == {line for line in of_it if not any(name in line for name in missing)}


if __name__ == "__main__":
    of_arm = Setup.small(ARM, engines(parse(ARM.mjcf, ARM.tree)))
    found = [named(module(name).rows(of_arm)) for name in NAMES]
    LISTED.write_text("".join(f"{line}\n" for lines in found for line in sorted(lines)), encoding="utf-8")
