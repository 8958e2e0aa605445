"""The verdict and the answers from plain checks and rows: what fails, what broke off, what comes first, whose number is whose."""

import pytest
from sections import BAD, GOOD, section

from compare.experiment import say_outcome
from compare.judge.check import About
from compare.judge.units import renamed
from compare.report.questions import answers
from compare.report.verdict import failures, outcome, passed, standing, verdict
from compare.robots.arm import ARM

LIMIT = ("limit, observed / predicted - 1", 0.009, 0.001, "at most", False, About.PREDICTION)
OWN_STEP = ("stable at its own step", 0.002, 0.00111, "at most", False, About.STEP)


def counts(*sections):
    """How many checks fail: of the models, of what broke off, of the step, of predictions."""
    return [len(found) for found in failures(sections)]


@pytest.mark.parametrize("place", [0, 59, 60, 199])
def test_one_failing_check_among_many_fails_the_verdict(place):
    checks = [GOOD] * 200
    assert passed([section("mass", *checks)]) and outcome(section("mass", *checks)).startswith("It holds")
    checks[place] = BAD
    sections = [section("gravity", GOOD), section("mass", *checks)]
    assert not passed(sections) and counts(*sections) == [1, 0, 0, 0]
    assert "1 of 201 checks" in verdict(sections, 2) and "1 of 200 checks" in outcome(sections[-1])


def test_the_verdict_names_the_check_that_uses_most_of_its_rounding_tolerance():
    sections = [
        section("mass", ("Mbar", 0.25, 1.0, "at most", True), ("printed", 0.9, 1.0, "at most", False)),
        section("gravity", ("torque", 0.5, 1.0, "at most", True)),
    ]
    text = verdict(sections, 10)
    assert all(part in text for part in ("mass, gravity", "2 of 10", "all 3", "0.5 kg m2", " 50 %", "torque"))
    assert "Mbar" not in text and "0.9" not in text


def test_what_does_not_agree_is_named_with_its_first_cause_and_nothing_else():
    sections = [section("parameters", GOOD), section("mass", GOOD, BAD), section("gravity", GOOD)]
    for more, counted in (([], "1 of 4"), ([section("diagnosis", BAD)], "2 of 5")):  # which only says why others fail
        first = verdict([*sections, *more], 10).partition(":")[0]
        assert " mass " in first and not any(name in first for name in ("gravity", "parameters", "diagnosis"))
        assert counted in verdict([*sections, *more], 10)
    causes = [{"text": f"number {k}"} for k in range(3)]
    text = verdict([section("parameters", BAD), section("mass", GOOD, BAD, BAD)], 2, causes)
    assert "number 0, and 2 more" in text and "number 2" not in text and " 2 further" in text


def test_each_kind_of_failing_check_fails_the_verdict_and_only_the_models_disagree():
    differs = "do not agree"  # the sentence that decides: none of the others may have it
    said = set()
    for k, about in enumerate((About.MODELS, About.PROGRAM, About.STEP, About.PREDICTION)):
        of = section("mass", GOOD, ("what", 2.0, 1.0, "at most", False, about))
        assert not passed([of]) and standing(of)[0] is False
        assert counts(of) == [int(k == one) for one in range(4)]
        assert (differs in verdict([of], 1)) == (about == About.MODELS)
        assert differs in verdict([of, section("gravity", BAD)], 2)
        assert outcome(of) != outcome(section("mass", GOOD))
        said.add(standing(of)[1])
    assert len(said) == 4 and standing(section("mass", GOOD))[0] is True and standing(section("mass"))[0] is None
    diverged = section("trajectory", ("open loop", None, 1.0, "at most", True))
    assert counts(diverged) == [1, 0, 0, 0]
    assert passed([section("stability", (*OWN_STEP[:2], 0.002, *OWN_STEP[3:]))])  # just stable


def test_an_unstable_step_and_an_unconfirmed_prediction_are_named():
    text = verdict([section("mass", GOOD), section("stability", GOOD, LIMIT)], 2)
    assert "all 2 checks" in text and "limit, observed / predicted - 1, zero: 0.009" in text
    unstable = section("stability", GOOD, OWN_STEP, OWN_STEP, (*OWN_STEP[:2], 0.001, *OWN_STEP[3:]))
    text = verdict([section("mass", GOOD), unstable], 2, robot="arm7")
    assert "all 2 checks" in text and all(part in text for part in ("arm7", " 2 ms", " 2 more", " 1 ms."))


class Lines(list):
    """A terminal that keeps what is said."""

    def say(self, text, style=""):
        self.append(text)


def test_the_terminal_says_what_comes_closest_and_names_the_first_that_fail():
    said = Lines()
    say_outcome(said, section("mass", ("a", 0.25, 1.0, "at most", True), ("b", 0.5, 1.0, "at most", True)), 1.25, [])
    assert len(said) == 1 and said[0].split()[:4] == ["mass", "ok", "2", "checks"] and " 50 %" in said[0]
    said.clear()
    say_outcome(said, section("mass", *[BAD] * 7, GOOD), 1.0, [{"text": "mass of forearm: stated 1"}])
    assert said[0].split() == ["mass", "7", "FAILED", "8", "checks", "1.0", "s"]
    assert said[1] == "  CAUSE mass of forearm: stated 1" and " 3 more" in said[-1]
    assert [line.startswith("  FAIL mass: Mbar, zero: 2 kg m2") for line in said[2:]] == [True] * 4 + [False]


# the answers to the questions of the assignment


def answer_of(*sections) -> dict:
    """The answers by their part."""
    return {part: answer for part, _, _, answer in answers(sections, ARM)}


def apart(scene, difference, quantity="Mbar"):
    return {"quantity": quantity, "scene": scene, "unit": "kg m2", "largest_difference": difference}


def test_answers_give_each_number_to_its_engine():
    row = {"published": 1.0, "tmt": 2.0, "mujoco": 3.0, "unit": "N m"}
    items = [row | {"item": item} for item in ("c", "f1", "f2", "f3", "f4", "g", "h")]
    found = answer_of(section("published", rows=items))["c"]
    assert found.index("(1)") < found.index("TMT (2)") < found.index("MuJoCo (3)")


@pytest.mark.parametrize("rows, number, scene", [
    ([apart("zero", 1e-16), apart("bent", 4e-16), apart("bent", 9e-16, "other")], "4.0e-16", "bent"),
    ([apart("zero", 1e-16), apart("bent", None)], "diverged", ""),
    ([], "no result", ""),
])  # fmt: skip
def test_the_largest_difference_is_the_answer_unless_a_run_diverged(rows, number, scene):
    found = answer_of(section("mass", rows=rows))["e"].split(";")[0]
    assert number in found and scene in found


LINE = {"scene": "bent", "target_rad": 1e-6, "mujoco": "mujoco RK4, 9 steps", "mujoco_ms": 7.0, "tmt": "rk4",
        "tmt_ms": 2.0}  # fmt: skip


def test_what_to_use_gives_each_engine_its_own_time_in_the_scene_of_the_caption():
    lines = [LINE | {"target_rad": 1e-3, "mujoco_ms": 5.0}, LINE | {"tmt": None}, LINE | {"mujoco_dt_s": 0.5},
             LINE | {"scene": "zero", "mujoco_ms": 8.0, "mujoco_dt_s": 0.25}]  # fmt: skip
    rows = [{"scene": "bent", "dt_s": 0.5, "steps": 9}, {"scene": "zero", "dt_s": 0.5, "steps": 8}]
    ran = section("speed", rows=rows, what_should_i_use=renamed(lines, "rad or m"))
    for regular, numbers in (
        (None, ("4.5 s", "bent", "MuJoCo RK4, 9 steps (dt 0.5 s), 7 ms", "rk4, 2 ms")),
        ("zero", ("4 s", "zero", "MuJoCo RK4, 9 steps (dt 0.25 s), 8 ms", "rk4, 2 ms")),
    ):
        ran.result.curves["regular"] = regular
        found = answers([ran], ARM)[-1][-1]
        assert all(number in found for number in ("1e-06 rad or m", *numbers))
