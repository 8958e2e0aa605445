"""The whole of stability with few methods, scenes and steps: every path, every figure; and models it was not made for."""

import dataclasses

import pytest
from small_runs import on_the_moon

from compare.engines.mujoco import load
from compare.experiment import Setup, engines
from compare.experiments import stability
from compare.robots.arm import ARM

SPARE = {"up": {"up": ARM.postures["upright"]}, "down": {"down": ARM.postures["hanging"]}}  # one posture each


def verdicts(notes):
    """What is said of each claim: {"1": "reproduced"}."""
    heads = [note.split(":")[0] for note in notes if note.startswith("Claim ")]
    return dict(head.removeprefix("Claim ").split(", ") for head in heads)


@pytest.mark.slow
def test_a_small_run_fills_every_table(small):
    small = small("stability")
    assert set(small.tables) == {
        "departure", "stability_modes", "stability_growth", "stability_torques", "stability_finer_steps",
        "stability_bent", "stability_energy", "stability_newton",
    }  # fmt: skip
    assert verdicts(small.notes) == {"1": "reproduced", "2": "reproduced", "3": "bounded"}
    assert any("silent" in check.quantity for check in small.checks)


@pytest.mark.slow
def test_on_the_moon_many_checks_fail_and_nothing_raises(shared):
    """Gravity 1.62: the engines hold other models, and the arm that is stated is not the one that runs."""
    result, _ = shared(on_the_moon, "stability")
    assert sum(not check.passed for check in result.checks) > 100
    assert verdicts(result.notes)["1"] == "not reproduced" and any("0.08 s" in note for note in result.notes)
    assert not any("silent" in check.quantity for check in result.checks)  # nothing failed, so nothing has to be caught


def lacking(name) -> tuple[list, list]:
    """The arm without claims and with one posture, in a quick run: what is left out, and the names of the figures."""
    robot = dataclasses.replace(ARM, claims=None, kinds={}, scenes=(), postures=SPARE[name])
    result = stability.rows(Setup.quick(robot, engines(load(ARM.mjcf, ARM.tree))))
    assert result.checks and all(check.passed for check in result.checks)
    names = [figure()[0] for figure in stability.figures(result, robot)]
    return [note for note in result.notes if "left out" in note or "no claims" in note], names


def test_what_a_robot_lacks_is_left_out_with_a_reason(shared):
    notes, figures = shared(lacking, "up")
    assert [sum(kind in note for note in notes) for kind in ("a centre", "marginal", "a saddle")] == [1, 1, 0]
    assert len(notes) == 3 and figures == ["stability_regions", "stability_departure"]
    notes, figures = shared(lacking, "down")
    assert [sum(kind in note for note in notes) for kind in ("a centre", "marginal", "a saddle")] == [0, 1, 1]
    assert figures == ["stability_limits", "stability_regions", "stability_silent"]
