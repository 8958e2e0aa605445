"""Speed against accuracy: who takes part, with which steps; runs and what they are measured against."""

import dataclasses
from itertools import pairwise

import numpy as np
import pytest
from helpers.edited import XML, setup_of, setup_of_file, untimed_speed
from models import PATHS

import tmt
from compare.core.text import say
from compare.engines import RECORDS
from compare.engines.heyoka import Heyoka
from compare.engines.outside import Outside
from compare.experiments import speed
from compare.experiments.setup import Setup
from compare.experiments.speed import runs, settings
from compare.judge.rounding import growth
from compare.robots.arm import ARM
from compare.robots.case import Scene
from compare.truth import reference

OWN = Scene("my swing", (0, 0, 120), duration=2.0, dt=1 / 50, tags=("own",))
MINE = dataclasses.replace(ARM, scenes=(*ARM.scenes, OWN))
BENT = next(case for case in ARM.cases if case.name == "bent, free")  # in which errors fall regularly
GRIPPER, HUMANOID, ARM7 = (setup_of_file(PATHS[name]) for name in ("gripper", "humanoid29_free", "arm7"))
SLIDE = """<mujoco><worldbody><body><joint name="rail" type="slide" axis="0 0 1" stiffness="40"/>
<inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/></body></worldbody></mujoco>"""
FREE, STEP = settings.scenes_of(GRIPPER.robot)


@pytest.fixture(scope="module")
def of_bent():
    """The arm's scene with its reference in pairs of doubles, without runs."""
    return runs.SceneRuns(BENT, reference.reference(BENT), 0.0)


def test_scenes_are_those_with_the_tag_and_a_users_own():
    names = [case.name for case in settings.scenes_of(MINE)]
    assert names == ["zero, free", "ball catch, free", "bent, free", "bent, damped", "my swing"]
    alone = dataclasses.replace(ARM, scenes=(OWN,))
    mine = settings.scenes_of(MINE)[-1]
    assert settings.coarsest_steps(mine) == 128  # of 100 steps: a multiple of the grid
    assert (settings.regular_of(MINE).name, settings.regular_of(alone).name) == ("bent, free", "my swing")
    sizes = {"full": names, "quick": ["bent, free", "my swing"], "small": ["zero, free", "bent, free"]}
    for size, expected in sizes.items():
        assert [case.name for case in settings.followed(MINE, size)] == expected
    of_file = [case.name for case in settings.followed(GRIPPER.robot, "full")]
    assert of_file == ["open, let go", "open, step of the servos"]  # none that is held
    assert speed.skipped(ARM) is None
    assert speed.skipped(dataclasses.replace(ARM, scenes=())).kind == "no_scene"


def test_a_step_response_is_followed_from_coarse_steps_on_by_the_schemes_that_it_has():
    stiff = ARM7.robot.cases[-1]
    assert settings.coarsest_steps(stiff) == 64 < stiff.steps and settings.coarsest_steps(FREE) == FREE.steps
    of_both = (settings.methods(GRIPPER.engines, "full", case) for case in (STEP, FREE))
    of_step, of_free = ({(m.engine, m.name): m.scheme for m in methods} for methods in of_both)
    schemes = [of["mujoco", "implicitfast"] for of in (of_step, of_free)]
    assert schemes == ["implicitfast", "semi_implicit_euler"]
    assert ("tmt", "implicitfast") in of_step and ("tmt", "implicitfast") not in of_free


def test_what_takes_too_long_is_left_out(engines):
    assert Heyoka().too_long(HUMANOID.robot.tree) and Heyoka().too_long(ARM.tree) is None
    slow = settings.left_out(engines, "full", HUMANOID.robot)
    taken = {(m.engine, m.name) for m in settings.methods(engines, "full", HUMANOID.robot.cases[0])}
    assert slow and not taken & set(slow)
    slow = [settings.left_out(engines, size, ARM7.robot) for size in ("quick", "full")]
    assert [("tmt", "implicit_midpoint") in of_size for of_size in slow] == [True, False]


def test_rounding_leaves_eps_times_the_growth(engines):
    slow = BENT.changed(posture=(), gravity=False, duration=1.0, dt=1 / 64)
    at_rest, left = (runs.floor(case, engines["tmt"].of(case)) for case in (slow, BENT))
    assert 1.0 <= at_rest / np.finfo(float).eps < 3.0 and left > 10 * at_rest
    fast = BENT.changed(speed=(1e7, 1e7, 1e7))
    with pytest.raises(ValueError, match="scene 'bent, free'"):
        runs.floor(fast, engines["tmt"].of(fast))
    dt = FREE.duration / 1024
    motion = GRIPPER.engines["tmt"].of(FREE).run(*FREE.start, FREE.tau, dt, 1024, "rk4")
    given = tmt.METHODS["rk4"], FREE.tree, motion.q, motion.v, FREE.tau, dt, 16
    assert np.abs(growth(*given) - growth(*given, stride=given[-1])).max() < 0.1


def test_beyond_the_digits_of_the_reference_nothing_is_judged(engines, of_bent, monkeypatch):
    ours, known = GRIPPER.engines["tmt"], reference.in_doubles(FREE)._replace(why="too stiff", apart=1e-11)
    dopri8 = ours.methods["dopri8"]
    monkeypatch.setattr(runs, "methods", lambda *_: [dopri8])
    scene = runs.SceneRuns(FREE, known, 1e-11)
    *_, row = runs.rows_of(scene, GRIPPER.engines, "small", compiled=True)
    assert row.worst_error == row.error == row.early_error == 1e-11 and row.ended is None
    monkeypatch.setattr(runs, "methods", lambda *_: [])
    monkeypatch.setattr(runs, "reference", lambda case: of_bent.reference._replace(apart=1e-6))
    assert runs.scene_runs(BENT, engines, "small").floor == 1e-6


def test_a_scene_that_diverges_is_not_judged_and_the_others_are(engines, of_bent, monkeypatch):
    monkeypatch.setattr(runs, "reference", lambda case: of_bent.reference)
    without = runs.scene_runs(BENT.changed(speed=(1e7, 1e7, 1e7)), engines, "small")
    assert isinstance(without, reference.NoReference) and "bent, free" in str(without)
    setup, said = Setup.small(ARM, engines), str(without)
    (check,) = speed.rows(setup, [without]).checks
    assert not check.judged and check.note == said
    result = speed.rows(setup, [runs.scene_runs(BENT, engines, "small"), without])
    assert [check.note for check in result.checks if not check.judged] == [said] and len(result.checks) > 10
    assert result.tables["what_should_i_use"] and all(check.passed for check in result.checks if check.judged)


def test_a_run_without_timings_has_the_checks_only_and_sees_a_wrong_model(engines):
    result = untimed_speed(Setup.small(ARM, engines))
    assert len(result.checks) > 10 and all(check.passed for check in result.checks)
    assert all(row.seconds is None for row in result.rows) and list(speed.figures(result, ARM)) == []
    checks = untimed_speed(setup_of(XML.replace('mass="1.5"', 'mass="1.50001"'))).checks
    failed = {check.quantity.partition(",")[0] for check in checks if not check.passed}
    assert {"smallest error of MuJoCo's RK4", "the same error as tmt's rk4"} <= failed


def test_whether_servos_are_off_is_known(engines):
    setups = Setup.quick(GRIPPER.robot, GRIPPER.engines), Setup.quick(ARM, engines)
    assert [untimed_speed(setup).servos_off for setup in setups] == [True, False]


FILE_READERS = [name for name, record in RECORDS.items() if record.reads_file]


def test_engines_that_read_the_file_take_part_in_the_regular_scene_of_a_full_run(engines, monkeypatch):
    monkeypatch.setattr(Outside, "unavailable", lambda engine: None)
    there = [name for name in FILE_READERS if engines[name].methods]

    def readers(size, case):
        methods = settings.methods(engines, size, case)
        return list(dict.fromkeys(method.engine for method in methods if method.engine in FILE_READERS))

    assert readers("full", BENT) == there and {"drake", "mjx", "warp", "newton"} <= {*there}
    assert readers("full", ARM.cases[0]) == readers("small", BENT) == readers("quick", BENT) == []


@pytest.mark.parametrize("engine, method, size, expected", [
    ("mujoco", "RK4", "full", (2**15, 2**15)), ("mujoco", "Euler", "full", (2**15, 2**15)),
    ("tmt", "rk4", "full", (2**17, 2**18)), ("tmt", "rk4", "small", (7, 2**18)), ("scipy", "RK45", "quick", (2, None)),
])  # fmt: skip
def test_a_budget_is_that_of_the_finest_run(engines, engine, method, size, expected):
    method = engines[engine].methods[method]
    found, (least, most) = settings.budget(method, ARM, size), expected
    settings_found = settings.settings_of(method, BENT, size)
    assert found.why_not == "" and len(settings_found) <= found.settings
    if size == "full":
        assert least <= settings_found[-1].steps <= most and settings_found[0].steps == 64
        assert all(fine.steps == 2 * coarse.steps for coarse, fine in pairwise(settings_found))
    else:
        assert len(settings_found) == least


def test_no_unit_of_a_cart_is_rad():
    setup = setup_of_file(SLIDE)
    result = untimed_speed(setup)
    assert {row.unit for row in result.rows} == {result.unit} == {"m"}
    assert not any("rad" in name for row in result.rows for name in row.record())
    assert "rad" not in say(result.notes[-1])
