"""The verdict from plain checks: what fails, what broke off, what is named first, what the answers say of which engine."""

import pytest
from sections import BAD, GOOD, section

from compare.experiment import largest_share_in_words, say_outcome
from compare.judge.check import About
from compare.report import verdict


@pytest.mark.parametrize("place", [0, 59, 60, 199])
def test_one_failing_check_among_many_fails_the_verdict(place):
    checks = [GOOD] * 200
    assert verdict.passed([section("mass", *checks)])
    checks[place] = BAD
    for sections in ([section("mass", *checks)], [section("gravity", GOOD), section("mass", *checks)]):
        assert not verdict.passed(sections)
        assert verdict.verdict(sections, len(sections)).startswith("The two models do not agree: 1 of 20")
    assert verdict.outcome(section("mass", *checks)) == "It does not hold: 1 of 200 checks fail."


def test_the_verdict_names_the_check_that_uses_most_of_its_rounding_tolerance():
    sections = [
        section("mass", ("Mbar", 0.25, 1.0, "at most", True), ("printed", 0.9, 1.0, "at most", False)),
        section("gravity", ("torque", 0.5, 1.0, "at most", True)),
    ]
    text = verdict.verdict(sections, 10)
    assert text.startswith("The two models agree in mass, gravity (2 of 10 experiments): all 3 checks pass.")
    assert "is 0.5 kg m2, 50 % of it (gravity: torque, zero)" in text


def test_what_does_not_agree_is_named_and_nothing_else():
    sections = [section("parameters", GOOD), section("mass", GOOD, BAD), section("gravity", GOOD)]
    assert verdict.verdict(sections, 10).startswith(
        "The two models do not agree in mass (3 of 10 experiments ran): 1 of 4 checks fail."
    )
    sought = section("diagnosis", BAD)
    assert verdict.verdict([*sections, sought], 10).startswith(
        "The two models do not agree in mass (4 of 10 experiments ran): 2 of 5 checks fail."
    )
    assert verdict.verdict([sought], 10).startswith(
        "The two models do not agree (1 of 10 experiments ran): 1 of 1 checks fail."
    )
    broken = section("speed")
    broken.result.check("", verdict.ENDS, None, 0.0, "", "ValueError: no", rule="equal", about=About.PROGRAM)
    assert verdict.verdict([section("mass", GOOD), broken], 10) == (
        "Not everything could be compared (2 of 10 experiments); all 1 checks that compare them pass. "
        "Broken off: speed, ValueError: no."
    )


@pytest.mark.parametrize("share, said", [
    (1.0, "at most 100 % of tolerance"), (0.996, "at most 100 % of tolerance"), (0.104, "at most 10 % of tolerance"),
    (0.0123, "at most 1.2 % of tolerance"), (0.00102, "at most 0.1 % of tolerance"), (0.00099, "below 0.1 % of tolerance"),
])  # fmt: skip
def test_the_share_of_a_tolerance_fits_its_column(share, said):
    assert largest_share_in_words(share) == said and len(said) <= 26


class Lines(list):
    """A terminal that keeps what is said."""

    def say(self, text, style=""):
        self.append(text)


def test_the_terminal_says_what_comes_closest_and_names_the_first_that_fail():
    said = Lines()
    say_outcome(said, section("mass", ("a", 0.25, 1.0, "at most", True), ("b", 0.5, 1.0, "at most", True)), 1.25, [])
    assert said == ["mass          ok           2 checks  at most 50 % of tolerance    1.2 s"]
    said.clear()
    say_outcome(
        said,
        section("mass", *[BAD] * 7, ("b", 0.5, 1.0, "at most", True)),
        1.0,
        [{"text": "mass of forearm: stated 1"}],
    )
    assert said[0].split() == ["mass", "7", "FAILED", "8", "checks", "1.0", "s"]
    assert said[1] == "  CAUSE mass of forearm: stated 1" and said[-1] == "  and 3 more: in the report"
    assert said[2:-1] == ["  FAIL mass: Mbar, zero: 2 kg m2, must be at most 1 kg m2"] * 4


def test_what_broke_off_fails_and_is_no_disagreement():
    broken = section("speed")
    broken.result.check(
        "", verdict.ENDS, None, 0.0, "", "ValueError: no (speed.py:1)", rule="equal", about=About.PROGRAM
    )
    assert not verdict.passed([section("mass", GOOD), broken])
    text = verdict.verdict([section("mass", GOOD), broken], 2)
    assert text == (
        "Not everything could be compared; all 1 checks that compare them pass. "
        "Broken off: speed, ValueError: no (speed.py:1)."
    )
    both = verdict.verdict([section("mass", GOOD, BAD), broken], 2)
    assert (
        both.startswith("The two models do not agree: 1 of 2 checks that compare them fail.")
        and "Broken off: speed" in both
    )
    assert verdict.outcome(broken) == "It is not decided: runs to its end does not hold (ValueError: no (speed.py:1))."


def test_the_verdict_names_the_first_cause_and_counts_the_others():
    causes = [{"text": f"number {k}"} for k in range(3)]
    wrong = [section("parameters", BAD), section("mass", GOOD, BAD, BAD)]
    assert verdict.verdict(wrong, 2, causes) == (
        "The two models do not agree: 3 of 4 checks fail. Cause: number 0, and 2 more. "
        "2 further checks fail as a consequence."
    )


def test_a_run_that_diverged_is_a_disagreement_and_what_cannot_be_locked_is_none():
    diverged = section("trajectory", ("open loop", None, 1.0, "at most", True))
    assert verdict.verdict([diverged], 1).startswith("The two models do not agree: 1 of 1 checks fail.")
    tied = section("reduction", ("models whose hinges can be locked", 0.0, 1.0, "equal", False, About.PROGRAM))
    assert verdict.verdict([tied], 1).startswith("Nothing was compared. Broken off: reduction")


LIMIT = ("limit, observed / predicted - 1", 0.009, 0.001, "at most", False, About.PREDICTION)


def test_a_prediction_that_no_run_confirms_is_no_disagreement():
    sections = [section("mass", GOOD), section("stability", GOOD, LIMIT)]
    assert not verdict.passed(sections)
    assert verdict.failures(sections).differing == [] and len(verdict.failures(sections).unconfirmed) == 1
    found = verdict.verdict(sections, 2)
    assert found.startswith(
        "The two models agree: all 2 checks that compare them pass. One prediction is not confirmed"
    )
    assert "stability: limit, observed / predicted - 1, zero: 0.009" in found
    assert verdict.standing(sections[1]) == (False, "1 not confirmed")
    assert "1 checks pass; but one prediction" in verdict.outcome(sections[1])
    assert verdict.verdict([*sections, section("gravity", BAD)], 3).startswith("The two models do not agree")


def test_each_failing_check_counts_once_and_fails_the_verdict():
    kinds = [
        ("what", 2.0, 1.0, "at most", False, about)
        for about in (About.MODELS, About.PREDICTION, About.STEP, About.PROGRAM)
    ]
    for kind in kinds:
        assert not verdict.passed([section("mass", GOOD, kind)])
    assert [len(found) for found in verdict.failures([section("mass", GOOD, *kinds)])] == [1, 1, 1, 1]


OWN_STEP = ("stable at its own step", 0.002, 0.00111, "at most", False, About.STEP)


def test_a_step_of_the_robot_that_is_not_stable_is_no_disagreement():
    stable = section("stability", GOOD, ("stable at its own step", 0.002, 0.002, "at most", False, About.STEP))
    assert verdict.passed([stable]) and "all 2 checks pass" in verdict.verdict([stable], 1)
    worst = ("stable at its own step", 0.002, 0.001, "at most", False, About.STEP)
    unstable = section("stability", GOOD, OWN_STEP, OWN_STEP, worst)
    sections = [section("mass", GOOD), unstable]
    assert not verdict.passed(sections)
    assert verdict.failures(sections).differing == [] and len(verdict.failures(sections).unstable) == 3
    found = verdict.verdict(sections, 2, compared="TMT and MuJoCo", robot="arm7")
    assert found == (
        "TMT and MuJoCo agree: all 2 checks that compare them pass. But arm7 is not stable at its own step of 2 ms at zero and 2 "
        "more postures: the limit is 1 ms."
    )
    assert verdict.outcome(unstable).startswith("1 checks pass; but the robot is not stable at its own step")
    said = Lines()
    say_outcome(said, unstable, 1.0, [])
    assert said[0].split()[:3] == ["stability", "3", "FAILED"] and said[1].startswith(
        "  FAIL stability: stable at its own step"
    )


def test_a_disagreement_stays_one_beside_a_step_that_is_not_stable():
    text = verdict.verdict([section("mass", GOOD, BAD), section("stability", OWN_STEP)], 2, robot="arm7")
    assert text.startswith("The two models do not agree: 1 of 2 checks that compare them fail. First: mass: Mbar, zero")
