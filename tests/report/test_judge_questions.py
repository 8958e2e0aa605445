"""The answers to the assignment's questions: which number is whose, what broke off, what is far from the truth."""

from dataclasses import replace

import pytest
from sections import section

from compare.judge.units import renamed
from compare.report.questions import answers
from compare.report.tables import questions
from compare.report.verdict import Section
from compare.robots.arm import ARM


def answer_of(sections) -> dict:
    """The answers by their part."""
    return {part: answer for part, _, _, answer in answers(sections, ARM)}


def test_answers_give_each_number_to_its_engine():
    row = {"item": "c", "published": 1.0, "tmt": 2.0, "mujoco": 3.0, "unit": "N m"}
    items = [row | {"item": item} for item in ("c", "f1", "f2", "f3", "f4", "g", "h")]
    found = answer_of([section("published", rows=items)])
    assert found["c"] == "c: printed (1), TMT (2), MuJoCo (3) N m"
    apart = [
        {"quantity": "Mbar", "scene": "zero", "unit": "kg m2", "largest_difference": 1e-16},
        {"quantity": "Mbar", "scene": "bent", "unit": "kg m2", "largest_difference": 4e-16},
        {"quantity": "other", "scene": "bent", "unit": "kg m2", "largest_difference": 9e-16},
    ]
    found = answer_of([section("mass", rows=apart)])
    assert found["e"].startswith("Mbar: at most 4.0e-16 kg m2 apart (bent); not run")


def test_a_row_without_a_number_is_a_run_that_diverged():
    rows = [{"quantity": "Mbar", "scene": "zero", "unit": "kg m2", "largest_difference": d} for d in (1e-16, None)]
    found = answer_of([section("mass", rows=rows)])
    assert found["e"] == "diverged; not run"


def test_the_answer_on_motion_names_the_true_errors_of_held_and_of_free_scenes(small):
    answer = answer_of([Section("trajectory", "", "", "", small("trajectory"))])["i"]
    for scene in ("ball catch, held: ", "bent, held: ", "zero, free: 1.6 and 1.6", "bent, free: 0.27 and 0.27"):
        assert scene in answer


@pytest.mark.parametrize(
    "steps, words",
    [((64, 64), "with its 64 steps the runs"), ((64, 20), "with the coarsest steps of each scene the runs")],
)
def test_the_answer_on_motion_says_of_how_many_steps_the_errors_are(steps, words):
    of_trajectory = section("trajectory")
    runs = {(name, "rk4", count * finer): {} for name, count in zip("ab", steps) for finer in (16, 1)}
    of_trajectory.result.curves = {"errors": {"a": (1.0, 2.0), "b": (None, 3.0)}, "runs": runs}
    answer = answer_of([of_trajectory])["i"]
    assert (
        f"{words} of TMT and MuJoCo are at most so many rad from the true motion: a: 1 and 2; b: diverged and 3"
        in answer
    )


@pytest.mark.parametrize("unit", ["rad", "m", "rad or m"])
def test_what_to_use_gives_each_engine_its_own_time(unit):
    line = {
        "scene": "bent",
        "target_rad": 1e-6,
        "mujoco": "mujoco RK4, 9 steps",
        "mujoco_ms": 7.0,
        "tmt": "rk4",
        "tmt_ms": 2.0,
    }
    other = line | {"scene": "zero", "mujoco_ms": 8.0, "mujoco_dt_s": 0.25}
    lines = [line | {"target_rad": 1e-3, "mujoco_ms": 5.0}, line | {"tmt": None}, line | {"mujoco_dt_s": 0.5}, other]
    rows = [{"scene": "bent", "dt_s": 0.5, "steps": 9}, {"scene": "zero", "dt_s": 0.5, "steps": 8}]
    for regular, over, theirs in (
        (None, "4.5 s (bent)", "MuJoCo RK4, 9 steps (dt 0.5 s), 7 ms"),
        ("zero", "4 s (zero)", "MuJoCo RK4, 9 steps (dt 0.25 s), 8 ms"),  # the scene of the caption, where it is named
    ):
        ran = section("speed", rows=rows, what_should_i_use=renamed(lines, unit))
        ran.result.curves["regular"] = regular
        found = [answer for *_, answer in answers([ran], ARM)]
        assert found[-1].startswith(f"What should I use? For 1e-06 {unit} over {over}: {theirs}, or rk4, 2 ms; more")


def test_where_no_question_is_of_an_assignment_there_is_no_column_for_its_parts():
    line = {"scene": "bent", "target_rad": 1e-6, "mujoco": "RK4", "mujoco_ms": 7.0, "tmt": "rk4", "tmt_ms": 2.0}
    ran = [section("speed", rows=[{"scene": "bent", "dt_s": 0.5, "steps": 9}], what_should_i_use=[line])]
    for robot, columns in (
        (ARM, ["part", "asked", "answered in", "answer"]),
        (replace(ARM, questions=()), ["asked", "answered in", "answer"]),
    ):
        assert list(questions(ran, robot).columns) == columns
