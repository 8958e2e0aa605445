"""The answers to the assignment's questions: which number is whose, what broke off, what is far from the truth."""

import pytest
from sections import section

from compare.judge.units import renamed
from compare.report.questions import answers
from compare.report.verdict import Section
from compare.robots.arm import ARM

LINE = {"scene": "bent", "target_rad": 1e-6, "mujoco": "mujoco RK4, 9 steps", "mujoco_ms": 7.0, "tmt": "rk4",
        "tmt_ms": 2.0}  # fmt: skip


def answer_of(*sections) -> dict:
    """The answers by their part."""
    return {part: answer for part, _, _, answer in answers(sections, ARM)}


def apart(scene, difference, quantity="Mbar"):
    return {"quantity": quantity, "scene": scene, "unit": "kg m2", "largest_difference": difference}


def test_answers_give_each_number_to_its_engine():
    row = {"published": 1.0, "tmt": 2.0, "mujoco": 3.0, "unit": "N m"}
    items = [row | {"item": item} for item in ("c", "f1", "f2", "f3", "f4", "g", "h")]
    found = answer_of(section("published", rows=items))["c"]
    assert [found.index(number) for number in ("(1)", "(2)", "(3)")] == sorted(found.index(f"({k})") for k in (1, 2, 3))
    assert found.index("TMT (2)") < found.index("MuJoCo (3)")


@pytest.mark.parametrize("rows, number, scene", [
    ([apart("zero", 1e-16), apart("bent", 4e-16), apart("bent", 9e-16, "other")], "4.0e-16", "bent"),
    ([apart("zero", 1e-16), apart("bent", None)], "diverged", ""),
    ([], "no result", ""),
])  # fmt: skip
def test_the_largest_difference_is_the_answer_unless_a_run_diverged(rows, number, scene):
    found = answer_of(section("mass", rows=rows))["e"].split(";")[0]
    assert number in found and scene in found


@pytest.mark.slow
def test_the_answer_on_motion_names_the_true_errors_of_held_and_of_free_scenes(small):
    answer = answer_of(Section("trajectory", "", "", "", small("trajectory")))["i"]
    for scene in ("ball catch, held: ", "bent, held: ", "zero, free: 1.6 and 1.6", "bent, free: 0.27 and 0.27"):
        assert scene in answer


@pytest.mark.parametrize("steps, has_count", [((64, 64), True), ((64, 20), False)])
def test_the_answer_on_motion_says_of_how_many_steps_the_errors_are(steps, has_count):
    of = section("trajectory")
    runs = {(name, "rk4", count * finer): {} for name, count in zip("ab", steps) for finer in (16, 1)}
    of.result.curves = {"errors": {"a": (1.0, 2.0), "b": (None, 3.0)}, "runs": runs}
    answer = answer_of(of)["i"]
    assert ("64" in answer) == has_count and "a: 1 and 2; b: diverged and 3" in answer


@pytest.mark.parametrize("unit", ["rad", "m", "rad or m"])
@pytest.mark.parametrize("regular, numbers", [
    (None, ("4.5 s", "bent", "MuJoCo RK4, 9 steps (dt 0.5 s), 7 ms", "rk4, 2 ms")),
    ("zero", ("4 s", "zero", "MuJoCo RK4, 9 steps (dt 0.25 s), 8 ms", "rk4, 2 ms")),  # the scene of the caption
])  # fmt: skip
def test_what_to_use_gives_each_engine_its_own_time(unit, regular, numbers):
    other = LINE | {"scene": "zero", "mujoco_ms": 8.0, "mujoco_dt_s": 0.25}
    lines = [LINE | {"target_rad": 1e-3, "mujoco_ms": 5.0}, LINE | {"tmt": None}, LINE | {"mujoco_dt_s": 0.5}, other]
    rows = [{"scene": "bent", "dt_s": 0.5, "steps": 9}, {"scene": "zero", "dt_s": 0.5, "steps": 8}]
    ran = section("speed", rows=rows, what_should_i_use=renamed(lines, unit))
    ran.result.curves["regular"] = regular
    found = answers([ran], ARM)[-1][-1]
    assert all(number in found for number in (f"1e-06 {unit}", *numbers))
