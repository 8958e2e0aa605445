"""The verdict from plain checks: what fails, what broke off, what is named first, also on the terminal."""

import pytest
from sections import BAD, GOOD, section

from compare.experiment import largest_share_in_words, say_outcome
from compare.judge.check import About
from compare.report.verdict import ENDS, failures, outcome, passed, standing, verdict

LIMIT = ("limit, observed / predicted - 1", 0.009, 0.001, "at most", False, About.PREDICTION)
OWN_STEP = ("stable at its own step", 0.002, 0.00111, "at most", False, About.STEP)


def broken(name="speed"):
    of = section(name)
    of.result.check("", ENDS, None, 0.0, "", "ValueError: no (speed.py:1)", rule="equal", about=About.PROGRAM)
    return of


def counts(*sections):
    """How many checks fail: of the models, of what broke off, of the step, of predictions."""
    return [len(found) for found in failures(sections)]


@pytest.mark.parametrize("place", [0, 59, 60, 199])
def test_one_failing_check_among_many_fails_the_verdict(place):
    checks = [GOOD] * 200
    assert passed([section("mass", *checks)])
    agrees = verdict([section("mass", *checks)], 1), outcome(section("mass", *checks))
    checks[place] = BAD
    for before in ([], [section("gravity", GOOD)]):
        sections = [*before, section("mass", *checks)]
        assert not passed(sections) and counts(*sections) == [1, 0, 0, 0]
        assert f"1 of {200 + len(before)} checks" in verdict(sections, len(sections))
    assert "1 of 200 checks" in outcome(sections[-1]) and "1 of" not in "".join(agrees)


def test_the_verdict_names_the_check_that_uses_most_of_its_rounding_tolerance():
    sections = [
        section("mass", ("Mbar", 0.25, 1.0, "at most", True), ("printed", 0.9, 1.0, "at most", False)),
        section("gravity", ("torque", 0.5, 1.0, "at most", True)),
    ]
    text = verdict(sections, 10)
    assert all(part in text for part in ("mass, gravity", "2 of 10", "all 3", "0.5 kg m2", " 50 %", "torque"))
    assert "Mbar" not in text and "0.9" not in text


def test_what_does_not_agree_is_named_and_nothing_else():
    sections = [section("parameters", GOOD), section("mass", GOOD, BAD), section("gravity", GOOD)]
    for more, counted in (([], "1 of 4"), ([section("diagnosis", BAD)], "2 of 5")):  # which only says why others fail
        first = verdict([*sections, *more], 10).partition(":")[0]
        assert " mass " in first and "gravity" not in first and "parameters" not in first and "diagnosis" not in first
        assert counted in verdict([*sections, *more], 10)


def test_the_verdict_names_the_first_cause_and_counts_what_follows():
    causes = [{"text": f"number {k}"} for k in range(3)]
    text = verdict([section("parameters", BAD), section("mass", GOOD, BAD, BAD)], 2, causes)
    assert "number 0, and 2 more" in text and "number 2" not in text and " 2 further" in text
    assert " 1 checks fail as" in verdict([section("mass", GOOD, BAD)], 1, causes[:1])


def test_each_kind_of_failing_check_fails_the_verdict_and_only_the_models_disagree():
    models = [verdict([section("mass", *checks)], 1).partition(" ")[0] for checks in ((GOOD,), (GOOD, BAD))]
    assert models == ["The", "The"]
    differs = "do not agree"  # the sentence that decides: none of the others may have it
    for k, about in enumerate((About.MODELS, About.PROGRAM, About.STEP, About.PREDICTION)):
        of = section("mass", GOOD, ("what", 2.0, 1.0, "at most", False, about))
        assert not passed([of]) and standing(of)[0] is False
        assert counts(of) == [int(k == one) for one in range(4)]
        assert (differs in verdict([of], 1)) == (about == About.MODELS)
        assert differs in verdict([of, section("gravity", BAD)], 2)
        assert outcome(of) != outcome(section("mass", GOOD))
    diverged = section("trajectory", ("open loop", None, 1.0, "at most", True))
    assert counts(diverged) == [1, 0, 0, 0]
    assert passed([section("stability", OWN_STEP[:2] + (0.002,) + OWN_STEP[3:])])  # just stable


def test_what_broke_off_an_unstable_step_and_an_unconfirmed_prediction_are_named():
    text = verdict([section("mass", GOOD), broken()], 10)
    assert "2 of 10" in text and "speed, ValueError: no (speed.py:1)" in text
    assert "speed" in verdict([section("mass", GOOD, BAD), broken()], 2)
    assert "Nothing was compared" in verdict([broken("reduction")], 1)
    text = verdict([section("mass", GOOD), section("stability", GOOD, LIMIT)], 2)
    assert "all 2 checks" in text and "limit, observed / predicted - 1, zero: 0.009" in text
    worst = OWN_STEP[:2] + (0.001,) + OWN_STEP[3:]
    unstable = section("stability", GOOD, OWN_STEP, OWN_STEP, worst)
    text = verdict([section("mass", GOOD), unstable], 2, compared="TMT and MuJoCo", robot="arm7")
    assert "all 2 checks" in text and all(part in text for part in ("arm7", " 2 ms", " 2 more", " 1 ms."))


@pytest.mark.parametrize("share, percent", [
    (1.0, " 100 %"), (0.996, " 100 %"), (0.104, " 10 %"), (0.0123, " 1.2 %"), (0.00102, " 0.1 %"), (0.00099, "below 0.1 %"),
])  # fmt: skip
def test_the_share_of_a_tolerance_fits_its_column(share, percent):
    said = largest_share_in_words(share)
    assert percent in said and len(said) <= 26 and ("below" in said) == (share < 1e-3)


class Lines(list):
    """A terminal that keeps what is said."""

    def say(self, text, style=""):
        self.append(text)


def test_the_terminal_says_what_comes_closest_and_names_the_first_that_fail():
    said = Lines()
    say_outcome(said, section("mass", ("a", 0.25, 1.0, "at most", True), ("b", 0.5, 1.0, "at most", True)), 1.25, [])
    assert len(said) == 1 and said[0].split()[:4] == ["mass", "ok", "2", "checks"] and " 50 %" in said[0]
    said.clear()
    good, causes = ("b", 0.5, 1.0, "at most", True), [{"text": "mass of forearm: stated 1"}]
    say_outcome(said, section("mass", *[BAD] * 7, good), 1.0, causes)
    assert said[0].split() == ["mass", "7", "FAILED", "8", "checks", "1.0", "s"]
    assert said[1] == "  CAUSE mass of forearm: stated 1" and " 3 more" in said[-1]
    assert [line.startswith("  FAIL mass: Mbar, zero: 2 kg m2") for line in said[2:]] == [True] * 4 + [False]
    said.clear()
    say_outcome(said, section("stability", GOOD, OWN_STEP, OWN_STEP), 1.0, [])
    assert said[0].split()[:3] == ["stability", "2", "FAILED"] and said[1].startswith("  FAIL stability: ")
