"""Which checks a run makes: a committed list, so that none is dropped unseen. `python tests/test_checks.py` remakes it."""

import importlib
import re
from pathlib import Path

import pytest

from compare.__main__ import EXPERIMENTS
from compare.agreement import Setup
from compare.engine import INTEGRATORS
from compare.engine_file import load

LISTED = Path(__file__).with_name("checks_of_a_small_run.txt")
MEASURED = re.compile(r"\d+\.\d+(e[-+]?\d+)?|\d+e[-+]?\d+")
DEPENDS = "smallest error of"  # on where rounding takes over on a machine


def named(result) -> set[str]:
    """Experiment, scene and quantity of each check of a result, without measured numbers."""
    lines = {MEASURED.sub("#", f"{c.experiment} | {c.scene} | {c.quantity} | {c.rule}") for c in result.checks}
    return {line for line in lines if DEPENDS not in line}


@pytest.mark.parametrize("experiment", EXPERIMENTS)
def test_every_check_that_is_listed_is_made_and_no_other(experiment, small):
    missing = {"discrete"} - set(INTEGRATORS)  # older than MuJoCo 3.13
    lines = LISTED.read_text(encoding="utf-8").splitlines()
    listed = {line for line in lines if line.startswith(f"{experiment} |")}
    listed = {line for line in listed if not any(name in line for name in missing)}
    assert named(small(experiment)) == listed


if __name__ == "__main__":
    engine = load()
    found = [named(importlib.import_module(f"compare.{name}").rows(Setup.small(engine))) for name in EXPERIMENTS]
    LISTED.write_text("".join(f"{line}\n" for lines in found for line in sorted(lines)), encoding="utf-8")
