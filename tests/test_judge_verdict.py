"""The verdict from plain checks: what fails, what broke off, what is named first, what the answers say of which engine."""

import json

import pandas as pd
import pytest

from compare import page, parameters, report, verdict
from compare.__main__ import tell
from compare.agreement import Result, Setup
from compare.engine_file import ARM_XML, parse
from compare.verdict import Section

XML = ARM_XML.read_text(encoding="utf-8")


def section(name="mass", *checks, rows=(), **tables):
    """A section of plain checks (quantity, value, tolerance, rule, rounding)."""
    result = Result(name, rows=list(rows), tables=tables)
    for quantity, value, tolerance, rule, rounding in checks:
        result.check("zero", quantity, value, tolerance, "kg m2", rounding=rounding, rule=rule)
    return Section(name, name.capitalize(), "They agree.", "64 eps.", result)


GOOD, BAD = ("Mbar", 0.5, 1.0, "at most", True), ("Mbar", 2.0, 1.0, "at most", True)


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


class Lines(list):
    """A terminal that keeps what is said."""

    def say(self, text, style=""):
        self.append(text)


def test_the_terminal_says_what_comes_closest_and_names_the_first_that_fail():
    said = Lines()
    tell(said, section("mass", ("a", 0.25, 1.0, "at most", True), ("b", 0.5, 1.0, "at most", True)), 1.25, [])
    assert said == ["mass          ok           2 checks  uses 0.5 of a tolerance      1.2 s"]
    said.clear()
    tell(
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
    broken.result.check("", verdict.ENDS, None, 0.0, "", "ValueError: no (speed.py:1)", rule="equal")
    assert not verdict.passed([section("mass", GOOD), broken])
    text = verdict.verdict([section("mass", GOOD), broken], 2)
    assert text == (
        "Not everything could be compared; the other 1 checks pass. Broken off: speed, ValueError: no (speed.py:1)."
    )
    both = verdict.verdict([section("mass", GOOD, BAD), broken], 2)
    assert both.startswith("The two models do not agree: 1 of 3 checks fail.") and "Broken off: speed" in both
    assert verdict.outcome(broken) == "It is not decided: runs to its end does not hold (ValueError: no (speed.py:1))."


def test_a_report_of_sections_without_rows_is_written_and_says_so(tmp_path):
    broken = [section(name) for name in ("published", "kinematics", "mass", "acceleration", "trajectory", "speed")]
    (tmp_path / "figures").mkdir()
    report.write(tmp_path, broken, {"command": "c"}, "words")
    answers = verdict.answers(broken)
    assert (answers["answer"].iloc[1:] == "no result: the experiment broke off").sum() >= 6
    assert list((tmp_path / "tables").iterdir()) == []
    assert "no result" in (tmp_path / "report.md").read_text(encoding="utf-8")


def test_the_verdict_names_the_first_cause_and_counts_the_others():
    causes = [{"text": f"number {k}"} for k in range(3)]
    wrong = [section("parameters", BAD), section("mass", GOOD, BAD, BAD)]
    assert verdict.verdict(wrong, 2, causes) == (
        "The two models do not agree: 3 of 4 checks fail. Cause: number 0, and 2 more. "
        "2 further checks fail as a consequence."
    )


CAUSE = {"rank": 2, "place": "mass", "stated": 1.0, "found": 2.0, "text": "mass of forearm: stated 1", "size": 9.0}


def test_results_say_what_was_found(tmp_path):
    (tmp_path / "figures").mkdir()
    sections = [section("mass", GOOD, BAD, rows=[{"a": 1.25, "engine": "TMT", "ok": True}], extra=[{"b": 1 / 3}])]
    text = verdict.verdict(sections, 1, [CAUSE])
    assert text == (
        "The two models do not agree: 1 of 2 checks fail. Cause: mass of forearm: stated 1. "
        "1 checks fail as a consequence."
    )
    second = CAUSE | {"text": "com x of forearm: stated 3"}
    report.write(tmp_path, sections, {"command": "c"}, text, [CAUSE, second])
    results = json.loads((tmp_path / "results.json").read_text(encoding="utf-8"))
    assert set(results) == {"passed", "checks", "causes", "skipped", "provenance"}
    assert results["passed"] is False and results["skipped"] == []
    assert [check["passed"] for check in results["checks"]] == [True, False]
    assert set(results["checks"][0]) == {
        "experiment", "scene", "quantity", "rule", "value", "tolerance", "unit", "passed", "note",
    }  # fmt: skip
    fields = ("rank", "place", "stated", "found", "text")
    assert results["causes"] == [{name: cause[name] for name in fields} for cause in (CAUSE, second)]
    table = pd.read_csv(tmp_path / "tables" / "mass.csv")
    assert table.to_dict("records") == [{"a": 1.25, "engine": "tmt", "ok": True}]
    assert pd.read_csv(tmp_path / "tables" / "extra.csv")["b"][0] == pytest.approx(1 / 3, rel=1e-15)
    for name in ("report.md", "index.html"):
        text = (tmp_path / name).read_text(encoding="utf-8")
        assert "mass of forearm: stated 1" in text and "com x of forearm: stated 3" in text
        assert "Checks that fail" in text and "must" not in text
    assert len(page.failing(sections[0])) == 1


def test_answers_give_each_number_to_its_engine():
    row = {"item": "c", "published": 1.0, "tmt": 2.0, "mujoco": 3.0, "unit": "N m"}
    items = [row | {"item": item} for item in ("c", "f1", "f2", "f3", "f4", "g", "h")]
    answers = verdict.answers([section("published", rows=items)]).set_index("part")["answer"]
    assert answers["c"] == "c: printed (1), TMT (2), MuJoCo (3) N m"
    apart = [
        {"quantity": "Mbar", "scene": "zero", "unit": "kg m2", "largest_difference": 1e-16},
        {"quantity": "Mbar", "scene": "bent", "unit": "kg m2", "largest_difference": 4e-16},
        {"quantity": "other", "scene": "bent", "unit": "kg m2", "largest_difference": 9e-16},
    ]
    answers = verdict.answers([section("mass", rows=apart)]).set_index("part")["answer"]
    assert answers["e"].startswith("Mbar: at most 4.0e-16 kg m2 apart (bent); not run")


def test_a_row_without_a_number_is_a_run_that_diverged():
    rows = [{"quantity": "Mbar", "scene": "zero", "unit": "kg m2", "largest_difference": d} for d in (1e-16, None)]
    answers = verdict.answers([section("mass", rows=rows)]).set_index("part")["answer"]
    assert answers["e"] == "diverged; not run"


def test_each_section_says_what_became_of_its_own_claim(tmp_path):
    (tmp_path / "figures").mkdir()
    report.write(tmp_path, [section("mass", GOOD), section("gravity", BAD)], {"command": "c"}, "words")
    for name in ("report.md", "index.html"):
        first, second = (tmp_path / name).read_text(encoding="utf-8").split("Gravity")[-2:]
        assert "It holds: all 1 checks pass." in first and "It does not hold: 1 of 1 checks fail." in second


def test_a_run_that_diverged_is_a_disagreement_and_what_cannot_be_locked_is_none():
    diverged = section("trajectory", ("open loop", None, 1.0, "at most", True))
    assert verdict.verdict([diverged], 1).startswith("The two models do not agree: 1 of 1 checks fail.")
    tied = section("reduction", (verdict.LOCKABLE, 0.0, 1.0, "equal", False))
    assert verdict.verdict([tied], 1).startswith("Not everything could be compared")


def test_the_answer_on_motion_names_the_true_errors_of_held_and_of_free_scenes(small):
    answer = verdict.answers([Section("trajectory", "", "", "", small("trajectory"))]).set_index("part")["answer"]["i"]
    for scene in ("ball catch, held: ", "bent, held: ", "zero, free: 1.6 and 1.6", "bent, free: 0.27 and 0.27"):
        assert scene in answer


def test_what_to_use_gives_each_engine_its_own_time():
    line = {
        "scene": "bent",
        "target_rad": 1e-6,
        "mujoco": "RK4, 9 steps",
        "mujoco_ms": 7.0,
        "tmt": "rk4",
        "tmt_ms": 2.0,
    }
    lines = [line | {"target_rad": 1e-3, "mujoco_ms": 5.0}, line | {"tmt": None}, line]
    answers = verdict.answers([section("speed", what_should_i_use=lines)])["answer"].tolist()
    assert answers[-1].startswith(
        "What should I use? For 1e-06 rad over five seconds (bent): RK4, 9 steps (7 ms), or rk4 (2 ms)"
    )


def test_the_page_is_red_if_a_check_fails_and_tables_are_whole(tmp_path):
    (tmp_path / "figures").mkdir()
    rows = [{"a": 0.123456789012345678, "b": k} for k in range(3)]
    for checks, colour in (((GOOD,), "#009E73"), ((GOOD, BAD), "#D55E00")):
        html = page.page(tmp_path, [section("mass", *checks, rows=rows)], {"command": "c"}, "words")
        assert colour in html and html.count("<td>0.123</td>") == 3
        assert ("Checks that fail" in html) == (len(checks) == 2)
    report.write(tmp_path, [section("mass", GOOD, rows=rows)], {"command": "c"}, "words")
    lines = (tmp_path / "tables" / "mass.csv").read_text(encoding="utf-8").split()
    assert lines == ["a,b", *(f"{row['a']!r},{row['b']}" for row in rows)]


# where a model differs, the number is named


def causes(old, new):
    assert XML.count(old) == 1
    result = parameters.rows(Setup(parse(XML.replace(old, new)), states=20))
    failed = [check for check in result.checks if not check.passed]
    assert bool(failed) == bool(result.curves["causes"])
    return [(cause["rank"], cause["text"]) for cause in result.curves["causes"]]


ALPHA, BETA, GAMMA = (f'<joint name="{name}" type="hinge" axis="' for name in ("alpha", "beta", "gamma"))
NAMED = {
    "armature of the first": (f"{ALPHA}0", f'{ALPHA}0'.replace("type", 'armature="0.1" type'),
                              [(2, "armature of alpha: stated 0 kg m2, compiled 0.1 kg m2")]),
    "anchor along its own axis": (BETA, BETA.replace("type", 'pos="0.01 0 0" type'),
                                  [(2, "anchor x of beta: stated 0 m, compiled 0.01 m"),
                                   (2, "com x of upper arm: stated 0 m, compiled -0.01 m")]),
    "two numbers": (XML, XML.replace('mass="1.5"', 'mass="1.501"').replace("-9.81", "-9.8"),
                    [(2, "gravity z: stated -9.81 m/s2, compiled -9.8 m/s2"),
                     (2, "mass of forearm: stated 1.5 kg, compiled 1.501 kg")]),
    "last digits": ('mass="1.5"', 'mass="1.50000000001"', [(2, "mass of forearm: stated 1.5 kg, compiled 1.50000000001 kg")]),
    "forearm on the world": (XML, XML.replace('<body name="fore', '</body><body name="fore')
                             .replace("</body>\n    </body>", "</body>"),
                             [(1, "parent of gamma: stated beta, compiled the world")]),
    "nothing": ("</mujoco>", "</mujoco>", []),
    "com": ('pos="0.15 0 0"', 'pos="0.151 0 0"', [(2, "com x of forearm: stated 0.15 m, compiled 0.151 m")]),
    "ref": (GAMMA, GAMMA.replace("type", 'ref="0.5" type'), [(1, "ref of gamma: stated 0 rad, compiled 0.5 rad")]),
    "sign": (f"{BETA}1", f"{BETA}-1", [(1, "axis x of beta: stated 1, compiled -1 (the opposite sign)")]),
    "gravity flag": ("<flag ", '<flag gravity="disable" ', [(1, "flag gravity: stated enable, compiled disable")]),
    "gravity": ("-9.81", "-1.62", [(2, "gravity z: stated -9.81 m/s2, compiled -1.62 m/s2")]),
    "frictionloss": (BETA, BETA.replace("type", 'frictionloss="0.2" type'),
                     [(2, "frictionloss of beta: stated 0 N m, compiled 0.2 N m")]),
    "gravcomp": ('<body name="forearm"', '<body name="forearm" gravcomp="1"', [(2, "gravcomp of forearm: stated 0, compiled 1")]),
    "limit": (GAMMA, GAMMA.replace("type", 'limited="true" range="-1 1" type'), [(2, "limited of gamma: stated 0, compiled 1")]),
    "damping": (GAMMA, GAMMA.replace("type", 'damping="0.1" type'),
                [(2, "damping of gamma: stated 0 N m s/rad, compiled 0.1 N m s/rad")]),
    "density": ("<option ", '<option density="1.2" ', [(1, "density: stated 0 kg/m3, compiled 1.2 kg/m3")]),
    "order": (f'{ALPHA}0 1 0"/>\n      {BETA}1 0 0"/>', f'{BETA}1 0 0"/>\n      {ALPHA}0 1 0"/>',
              [(1, "order of alpha: stated 0, compiled 1"), (1, "order of beta: stated 1, compiled 0")]),
    "table": ("</worldbody>", '<body pos="1 0 0"><inertial pos="0 0 0" mass="2" diaginertia="1 1 1"/></body></worldbody>',
              [(2, "other mass: stated 0 kg, compiled 2 kg")]),
}  # fmt: skip


@pytest.mark.parametrize("old, new, named", NAMED.values(), ids=NAMED)
def test_the_number_that_differs_is_named(old, new, named):
    assert causes(old, new) == named


def test_a_servo_is_named_by_its_force():
    servo = '<actuator><position joint="beta" kp="3"/></actuator></mujoco>'
    ((rank, text),) = causes("</mujoco>", servo)
    assert rank == 2 and text.startswith("forces of actuators: none stated, up to ")


def test_a_force_that_no_number_explains_is_named_beside_a_number():
    both = XML.replace('mass="1.5"', 'mass="1.501"')
    both = both.replace("</mujoco>", '<actuator><position joint="beta" kp="3"/></actuator></mujoco>')
    found = parameters.rows(Setup(parse(both), states=20)).curves["causes"]
    assert {cause["place"] for cause in found} == {"forces of actuators", "mass of forearm"}


def test_geoms_that_can_touch_are_named_though_they_do_not():
    """Two spheres that meet nowhere at the states that are compared; excluded, or without the contact stage, they cannot."""
    sphere = '<geom size="0.001" pos="0.2 0.2 0.2"/>'
    text = XML.replace("</worldbody>", f"{sphere}</worldbody>").replace(
        '<inertial pos="0.15', f'{sphere}<inertial pos="0.15'
    )
    for flags, places in (("", ["contact pairs"]), ('contact="disable"', []), ('constraint="disable"', [])):
        edited = text.replace('contact="disable" constraint="disable"', flags)
        assert [c["place"] for c in parameters.rows(Setup(parse(edited), states=20)).curves["causes"]] == places
    apart = text.replace('contact="disable" constraint="disable"', "").replace(
        "</mujoco>", '<contact><exclude body1="world" body2="forearm"/></contact></mujoco>')  # fmt: skip
    assert parameters.rows(Setup(parse(apart), states=20)).curves["causes"] == []


def test_causes_come_by_rank_then_by_size():
    """Not in the order in which numbers are read: mass, CoM, air."""
    edits = (
        ('mass="1.9"', 'mass="1.9000001"'),
        ('pos="0.15 0 0"', 'pos="0.151 0 0"'),
        ("<option ", '<option density="1.2" '),
    )
    text = XML
    for old, new in edits:
        text = text.replace(old, new)
    found = parameters.rows(Setup(parse(text), states=20)).curves["causes"]
    assert [cause["place"] for cause in found] == ["density", "com x of forearm", "mass of upper arm"]


def test_touching_is_named_by_its_force():
    """Two bodies welded by a constraint that the file has switched on."""
    weld = '<equality><joint joint1="gamma" polycoef="0.3 0 0 0 0"/></equality></mujoco>'
    text = XML.replace("</mujoco>", weld).replace('constraint="disable" ', "")
    found = parameters.rows(Setup(parse(text), states=20)).curves["causes"]
    assert [cause["place"] for cause in found] == ["forces of constraints and contacts"]


@pytest.mark.parametrize("off, fails", [(60, False), (70, True)])
def test_a_parameter_is_compared_within_64_eps(off, fails):
    mass = 1.5 * (1.0 + off * 2.220446049250313e-16)
    assert bool(causes('mass="1.5"', f'mass="{mass!r}"')) is fails
