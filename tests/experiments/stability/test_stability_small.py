"""The whole of stability with few methods, scenes and steps: every path, every figure; and models it was not made for."""

import dataclasses

from small_runs import on_the_moon

from compare.engines.mujoco import load
from compare.experiment import Setup, engines
from compare.experiments import stability
from compare.robots.arm import ARM


def test_a_small_run_fills_every_table(small):
    small = small("stability")
    assert set(small.tables) == {
        "departure", "stability_modes", "stability_growth", "stability_torques", "stability_finer_steps",
        "stability_bent", "stability_energy", "stability_newton",
    }  # fmt: skip
    text = " ".join(small.notes)
    for words in ("Claim 1, reproduced", "Claim 2, reproduced", "Claim 3, bounded", "loses definiteness"):
        assert words in text
    assert "left out" not in text


def test_on_the_moon_no_sentence_speaks_of_the_stated_arm(beside):
    """Gravity 1.62: many checks fail, nothing raises, and the sentences say what happened there."""
    result, captions = beside.result(on_the_moon, "stability")
    assert sum(not check.passed for check in result.checks) > 100
    text = " ".join(result.notes + captions)
    for words in (
        "it never starts again",
        "stays definite",
        "Claim 1, not reproduced",
        "MuJoCo: 27 leave, after 0.08 s",
    ):
        assert words in text
    for words in (
        "loses definiteness",
        "the cause is rounding",
        "There is no limit",
        "silent failure",
        "edge is sharp",
    ):
        assert words.lower() not in text.lower().replace("no failure is silent", "")
    assert not any("silent" in check.quantity for check in result.checks)  # nothing failed, so nothing has to be caught


SPARE = {"up": {"up": ARM.postures["upright"]}, "down": {"down": ARM.postures["hanging"]}}  # one posture each


def lacking(name) -> tuple[list, list]:
    """The arm without claims and with one posture, in a quick run: what is left out, and the names of the figures."""
    robot = dataclasses.replace(ARM, claims=None, kinds={}, scenes=(), postures=SPARE[name])
    result = stability.rows(Setup.quick(robot, engines(load(ARM.mjcf, ARM.tree))))
    assert result.checks and all(check.passed for check in result.checks)
    names = [figure()[0] for figure in stability.figures(result, robot)]
    return [note for note in result.notes if "left out" in note or "no claims" in note], names


def test_what_a_robot_lacks_is_left_out_with_a_reason(beside):
    notes, figures = beside.result(lacking, "up")
    assert [note.split(":")[0] for note in notes] == [
        "None of the arm's named postures is a centre",
        "None of the arm's named postures is marginal",
        "Nothing is claimed of the arm",
    ]
    assert figures == ["stability_regions", "stability_departure"]
    notes, figures = beside.result(lacking, "down")
    assert "None of the arm's named postures is a saddle: departures from one are left out." in notes
    assert figures == ["stability_limits", "stability_regions", "stability_silent"]
