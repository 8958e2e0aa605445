"""What is said of plain checks and rows: the verdict, the answers, the one number of each experiment, and what is drawn."""

import re
from dataclasses import replace
from types import SimpleNamespace

import pytest
from helpers.sections import BAD, GOOD, section
from matplotlib.colors import to_hex

from compare.core.cause import Cause
from compare.core.check import About, Result
from compare.core.finding import Finding
from compare.core.text import block
from compare.experiments import functions
from compare.experiments.parameters.numbers import NumberRow
from compare.experiments.published import PrintedRow
from compare.experiments.speed import conclusions
from compare.experiments.speed.runs import RunRow, SpeedResult
from compare.experiments.stability.tables import LimitRow
from compare.experiments.trajectory.runs import TrajectoryResult
from compare.judge.agree import AgreementRow
from compare.report.questions import answers
from compare.report.style import BLUE, ORANGE
from compare.report.verdict import Report, failures, headline, passed, standing, verdict
from compare.robots.arm import ARM
from compare.run.command import first_screen
from compare.run.examine import lines_of, section_with

CAUSE = {"rank": 2, "experiment": "parameters", "text": "mass of forearm: stated 1"}
OWN_STEP = ("stable at its own step", 0.002, 0.00111, "at most", False, About.STEP)


def line_of(section) -> str:
    about = {
        "checks": len(section.result.checks),
        "failed": len(section.failed),
        "failing": failures([section]),
    }
    return block("run", "outcome", name=section.name, seconds=1.0, **about)


def counts(*sections):
    """How many checks fail: of the models, of what broke off, of the step, of predictions."""
    return [len(found) for found in failures(sections).values()]


@pytest.mark.parametrize("place", [0, 199])
def test_one_failing_check_among_many_fails_the_verdict(place):
    checks = [GOOD] * 200
    assert passed([section("mass", *checks)]) and not passed([section("mass")]) and not passed([])
    checks[place] = BAD
    sections = [section("gravity", GOOD), section("mass", *checks)]
    assert not passed(sections) and counts(*sections) == [1, 0, 0, 0, 0, 0]
    assert "1 of 201 checks" in verdict(sections, 2) and standing(sections[-1]) == (False, "1 of 200 fail")


def test_the_verdict_names_the_check_that_uses_most_of_its_rounding_tolerance():
    mass = section("mass", ("Mbar", 0.25, 1.0, "at most", True), ("printed", 0.9, 1.0, "at most", False))
    text = verdict([mass, section("gravity", ("torque", 0.5, 1.0, "at most", True))], 10)
    assert all(part in text for part in ("mass, gravity", "2 of 10", "all 3", "0.5 kg m2", " 50 %", "torque"))
    assert "Mbar" not in text and "0.9" not in text
    equal = section("mass", ("Mbar", 0.0, 1.0, "at most", True))
    assert "Mbar" not in verdict([equal], 10)  # no difference is the largest


def test_what_does_not_agree_is_named_and_nothing_else():
    """Causes stand beneath it, in a table or in lines."""
    sections = [section("mass", GOOD, BAD), section("gravity", GOOD), section("diagnosis", BAD)]
    text = verdict(sections, 10, [replace(CAUSE, text=f"number {k}") for k in range(3)])
    assert all(part in text for part in ("3 of 10 experiments", " mass.", "2 of 4"))
    assert not any(part in text for part in ("gravity", "diagnosis", "number", "First failing"))
    assert "First failing check: mass: Mbar" in verdict(sections, 10)
    assert "Largest share" not in text and "Largest share" in verdict(sections[1:2], 10)


CAUSE = Cause(rank=2, place="", stated=1.0, explains=2.0, text="mass of forearm: stated 1")


def test_each_kind_of_failing_check_fails_the_verdict_and_only_the_models_disagree():
    differs = "differ"  # the sentence that decides: none of the others may have it
    said = set()
    for k, about in enumerate((About.MODELS, About.PROGRAM, About.STEP, About.PREDICTION, About.ENGINE)):
        of = section("mass", GOOD, ("what", 2.0, 1.0, "at most", False, about))
        assert not passed([of]) and standing(of)[0] is False
        assert counts(of) == [int(k == one) for one in range(6)]
        assert (differs in verdict([of], 1)) == (about == About.MODELS)
        assert "1 of 2 checks" in verdict([of], 1)
        assert differs in verdict([of, section("gravity", BAD)], 2)
        said.add(standing(of)[1])
    assert len(said) == 4
    assert (standing(section("mass", GOOD))[0], standing(section("mass"))[0]) == (True, None)
    assert counts(section("trajectory", ("open loop", None, 1.0, "at most", True)))[0] == 1  # it diverged
    assert passed([section("stability", (*OWN_STEP[:2], 0.002, *OWN_STEP[3:]))])  # just stable


@pytest.mark.parametrize("limit, said", [(0.00111, "limit: 1.11 ms"), (0.0, "no step is")])
def test_a_step_that_is_not_stable_is_said_once_with_its_limit_if_there_is_one(limit, said):
    of = section("stability")
    of.result.check("home", *OWN_STEP[:2], limit, "s", "with Euler", about=About.STEP)
    text = verdict([of], 1)
    assert said in text and "2 ms" in text and ("limit:" in text) is bool(limit)


def test_what_was_not_judged_is_neither_passed_nor_failed_and_nothing_is_said_to_agree():
    some, none = section("mass", GOOD), section("gravity")
    for result in (some.result, none.result):
        result.not_judged("held", "qdd", "the tolerance exceeds every value")
        (check,) = [check for check in result.checks if not check.judged]
        assert (check.judged, check.passed, check.failed) == (False, False, False)
        assert not check.record()["judged"]
    for one, passed_checks in ((some, "1 check"), (none, None)):
        text = verdict([one, section("kinematics")], 2)
        assert not passed([one]) and standing(one)[0] is None and "agree" not in text and "differ" not in text
        assert "the tolerance exceeds every value" in text
        assert (passed_checks or "Nothing was compared") in text
        assert line_of(one).split()[1:3] == ["not", "judged"]
    failing = section("mass", GOOD, BAD)
    failing.result.not_judged("held", "qdd", "why")
    assert standing(failing) == (False, "1 of 2 fail") and "1 of 2 checks" in verdict([failing], 1)


@pytest.mark.parametrize("checks, word, count", [
    ([GOOD, GOOD], "ok", "2 checks"), ([BAD] * 7 + [GOOD], "differs", "7 of 8 checks fail"),
    ([GOOD, OWN_STEP], "fails", "1 of 2 checks fails"),
])  # fmt: skip
def test_an_experiment_of_several_has_a_line(checks, word, count):
    line = line_of(section("mass", *checks))
    assert (
        line.split()[:2] == ["mass", word] and count in line and line.endswith(" 1.0 s") and len(line) <= 80
    )


def test_what_explains_the_same_as_a_cause_has_a_line_beneath_it():
    cause = replace(CAUSE, text="a: missing; or b: missing (no state can distinguish them)")
    assert lines_of(cause) == ["  CAUSE a: missing", "     or b: missing (no state can distinguish them)"]


def answer_of(*sections) -> dict:
    return {part: answer for part, _, _, answer in answers(sections, ARM).values}


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
])  # fmt: skip
def test_the_largest_difference_is_the_answer_unless_a_run_diverged(rows, number, scene):
    found = answer_of(section("mass", rows=rows))["e"].split(";")[0]
    assert number in found and scene in found


OFF = NumberRow(of="forearm", quantity="com", component="x", stated=2.0, compiled=2.5, difference=0.5, unit="m")  # fmt: skip
SAME = replace(OFF, compiled=2.0, difference=0.0)
STEP = LimitRow(scene="s", engine="tmt", method="rk4", damping=0.0, mode=9.0, limit="finite", predicted_dt=0.1,
                observed_dt=0.1001, passed=True)  # fmt: skip
PRINTED = PrintedRow(item="c", posture="zero", quantity="qdd", component="alpha", unit="rad/s2", published=1.0, exact=1.0,
                     tmt=1.1, mujoco=0.9, tolerance=0.11)  # fmt: skip
AGREED = AgreementRow(engine="TMT", scene="zero", quantity="Mbar", unit="kg m2", states=1, largest_difference=2e-16,
                      worst_difference=2e-16, bar=2e-15, difference_over_bar=0.1, scale=1.0, difference=2.0, from_exact=1.0,
                      mujoco_from_exact=4.0, exact_states=1, worst_state="", worst_q="", worst_qd="", worst_tau="",
                      worst_entry="", worst_value=0.0, mujoco_value=0.0, passed=True)  # fmt: skip


@pytest.mark.parametrize("name, rows, numbers, named", [
    ("parameters", [SAME, OFF], "1 2", "none is different"), ("published", [replace(PRINTED, mujoco=0.8)], "0 1", ""),
    ("gravity", [AGREED, replace(AGREED, quantity="other", worst_difference=1.0, difference_over_bar=0.05)], "2e-16 10", "Mbar"),
    ("trajectory", [SimpleNamespace(scene="a", difference_over_band=share) for share in (0.04, 12.0)], "1 12", ""),
    ("stability", [STEP, replace(STEP, observed_dt=0.0995)], "2 0.5", ""),
])  # fmt: skip
def test_the_headline_is_computed_and_comes_out_either_way(name, rows, numbers, named):
    kind = {"trajectory": TrajectoryResult}.get(name, Result)
    of = section(name, GOOD, rows=rows, kind=kind)
    of.result.centres = ("s",)  # postures whose limits of the step are told
    said = headline(section_with(name, of.result, ARM))
    found = re.findall(r"(?<![\w.])\d+(?:\.\d+)?(?:e[+-]\d+)?", said.replace(" m2", ""))
    assert found == numbers.split() and named in said, said


def test_first_screen_of_several_experiments_has_the_answers_alone():
    result = Result("stability", notes=[Finding("stability", "examined")])
    result.top = [result.finding(kind) for kind in ("limits_at", "answer", "rest", "remedies")]
    several, alone = (
        section_with("stability", result, ARM).result,
        section_with("stability", result, ARM, True).result,
    )
    assert [text.kind for text in several.top] == ["answer", "remedies"] and alone.top == result.top
    assert [text.kind for text in several.notes] == ["limits_at", "rest", "examined"]


@pytest.mark.parametrize("below, is_said", [(5, False), (6, True)])
def test_a_cause_far_above_the_verdict_is_said_again_beside_it(below, is_said):
    cause = Cause(rank=1, place="mass", stated=1.0, explains=2.0, text="mass: 2 instead of 1")
    sections = [section("mass", BAD), *[section("gravity", GOOD)] * below]
    report = Report(sections, ARM, {}, "They differ.", [cause])
    assert first_screen(report, 0, False) == ["They differ.", *["  CAUSE mass: 2 instead of 1"] * is_said]


def timed(engine, method, seconds, error, **more):
    about = {"scene": "s", "engine": engine, "method": method, "seconds": seconds, "worst_error": error}
    return RunRow(**about | more)


def marks(experiment, result, robot=ARM):
    """What is marked in the first panel of the picture of an experiment: (mark, colour, x) of every point."""
    ((_, figure, _),) = (call() for call in functions(experiment).overview({experiment: result}, robot))
    lines = [line for line in figure.axes[0].get_lines() if line.get_marker() not in (None, "None", "")]
    points = [(line, float(x)) for line in lines for x in line.get_xdata()]
    return {(line.get_marker(), to_hex(line.get_color()), x) for line, x in points}


def test_a_curve_has_what_nothing_of_the_same_engine_beats_and_its_cheapest_is_named():
    rows = [
        timed("tmt", "rk4", 1e-3, 1e-3), timed("tmt", "rk4", 2e-3, 1e-2), timed("tmt", "dopri8", 4e-3, 1e-6),
        timed("tmt", "dopri8", 5e-3, 1e-9), timed("mujoco", "RK4", 1e-2, 1.1e-6),
        timed("tmt", "rk4", 1e-9, None, ended="diverged"), timed("tmt", "rk4", 1e-9, 2.0),
        timed("heyoka", "Taylor", None, None, why_not="absent"),
    ]  # fmt: skip
    of_tmt = [row for row in rows if row.engine == "tmt"]
    assert conclusions.front(of_tmt) == [rows[0], rows[2], rows[3]]
    result = SpeedResult("speed", rows=rows, regular="s", floors={"s": 1e-15})
    result.tables["what_should_i_use"] = conclusions.what_to_use(result)
    assert {("o", to_hex(BLUE), 1e-6), ("s", to_hex(ORANGE), 1.1e-6)} <= marks("speed", result)
