"""Speed against accuracy, from runs to the table: every method, smaller models, references of few digits, wrong models."""

import numpy as np
import pandas as pd
import pytest
from edited import XML, setup_of
from models import PATHS

import tmt
from compare import experiment
from compare.engines import Setting
from compare.engines.mujoco import engine, read
from compare.experiments import speed
from compare.experiments.speed import accuracy, floors, runs, settings
from compare.judge.rounding import growth
from compare.robots.arm import ARM
from compare.robots.file import robot_of
from compare.setup import engines as engines_of
from compare.truth import reference


@pytest.fixture(scope="module")
def gripper():
    """The robot, its engines, and the scene that is followed."""
    robot = robot_of(read(PATHS["gripper"]), "gripper.xml")
    return robot, engines_of(engine(read(PATHS["gripper"]))), settings.regular_of(robot)


def test_every_method_follows_the_scene(engines, bent, known_reference):
    """Each method with a fine setting is near the reference, and costs evaluations; one that diverges has no error."""
    for method in settings.methods(engines, "full"):
        steps = None if method.adaptive else 2**13 if method.order == 1 else 1024
        setting = Setting(5.0, steps, 1e-5 if method.adaptive else None)
        row = runs.row_of_run(bent, bent, engines, method, setting, known_reference)
        tolerance = {1: 0.6, 2: 0.03, None: 1e-3}.get(method.order, 1e-4)
        assert 0.0 < row["error_rad"] <= row["worst_error_rad"] < tolerance and not row["diverged"], method
        assert row["energy_error_J"] > 0.0 and row["dt_s"] == (5.0 / steps if steps else None)
        assert (row["evaluations"] is None) == (method.engine == "heyoka")
    method = engines["tmt"].methods["explicit_euler"]
    row = runs.row_of_run(bent, bent, engines, method, Setting(5.0, 64), known_reference)
    assert row["diverged"] and row["error_rad"] is row["worst_error_rad"] is row["energy_error_J"] is None


def test_the_smaller_model_has_the_error_of_the_whole_one(engines, known_reference):
    zero = next(case for case in ARM.cases if case.name == "zero, free")
    known = runs.references([zero])["zero, free"]
    smaller = runs.reduced(zero)
    assert smaller.locked == {"beta": 0.0}
    method, setting = engines["tmt"].methods["rk4"], Setting(5.0, 1024)
    whole, small = (runs.row_of_run(case, zero, engines, method, setting, known) for case in (zero, smaller))
    assert small["worst_error_rad"] == pytest.approx(whole["worst_error_rad"], rel=1e-3)
    assert small["energy_error_J"] == pytest.approx(whole["energy_error_J"], rel=1e-3)
    assert (whole["whole"], small["whole"], small["scene"]) == (None, "zero, free", "zero, free, beta locked")


def test_rounding_leaves_eps_times_the_growth(bent, engines, gripper):
    def floor(case):
        return runs.floor(case, engines["tmt"].of(case))

    slow = bent.changed(posture=(), gravity=False, duration=1.0, dt=1 / 64)
    assert 1.0 <= floor(slow) / np.finfo(float).eps < 3.0  # nothing grows, at rest
    assert floor(bent) > 10 * floor(slow)
    with pytest.raises(ValueError, match="scene 'bent, free'"):
        floor(bent.changed(speed=(1e7, 1e7, 1e7)))
    _, known, case = gripper
    dt = case.duration / 1024
    motion = known["tmt"].of(case).run(*case.start, case.tau, dt, 1024, "rk4")
    given = tmt.METHODS["rk4"], case.tree, motion.q, motion.v, case.tau, dt, 16
    assert np.abs(growth(*given) - floors.sampled_growth(*given)).max() < 0.1


def test_beyond_the_digits_of_the_reference_nothing_is_judged(engines, bent, known_reference, monkeypatch):
    monkeypatch.setattr(runs, "methods", lambda *_: [])
    known = {"bent, free": known_reference._replace(apart=1e-6)}
    assert runs.rows_of_scene(bent, engines, known, "small", "same schemes") == ([], 1e-6)


def test_errors_below_what_is_known_have_its_size(gripper):
    _, known, case = gripper
    truth, method = reference.in_doubles(case)._replace(why="too stiff"), known["tmt"].methods["dopri8"]
    row = runs.row_of_run(case, case, known, method, settings.halvings(method, case)[1], truth, 1e-11)
    assert row["worst_error_rad"] == row["error_rad"] == 1e-11 and not row["diverged"]


def test_a_reference_in_doubles_says_its_digits(gripper):
    case = gripper[2]
    known = reference.in_doubles(case)
    assert known.apart < 1e-13 and known.low.max() == 0.0 and known.steps > case.steps
    finer = tmt.simulate(*case.start, case.tau, case.duration / 2**14, 2**14, "rk4", case.tree)
    assert known.error(finer.q[::256], range(4)).max() < 10 * max(known.apart, 1e-15)
    assert known.error(known.high[:, 2:3] + 1e-3, [2]) == pytest.approx(1e-3)


def test_a_step_response_has_the_same_error_in_both(gripper):
    robot, known, _ = gripper
    step = settings.scenes_of(robot)[-1]
    truth, setting = reference.references([step])[step.name], Setting(step.duration, 128)
    ours, theirs = (
        runs.row_of_run(step, step, known, known[name].methods_in(step)["implicitfast"], setting, truth)
        for name in ("tmt", "mujoco")
    )
    assert ours["worst_error_rad"] == pytest.approx(theirs["worst_error_rad"], abs=1e-12)
    assert 1e-7 < ours["worst_error_rad"] < 1e-2 and not ours["diverged"]


@pytest.mark.slow
def test_a_small_run_takes_every_path(engines, small):
    result = small("speed")
    table = pd.DataFrame(result.rows)
    assert list(table.columns) == speed.COLUMNS
    everyone = {(m.engine, m.name) for m in settings.methods(engines, "full")}
    ran = table[table.why_not.isna()]
    assert {(row.engine, row.method) for row in ran.itertuples()} == everyone
    diverged = ran[ran.diverged.astype(bool)]
    assert len(diverged) and diverged[["error_rad", "worst_error_rad", "energy_error_J"]].isna().all(axis=None)
    assert (ran.seconds > 0.0).all() and set(ran.scene) == {"zero, free", "zero, free, beta locked", "bent, free"}
    costs = pd.DataFrame(result.tables["evaluations"])
    timed = costs[costs.why_not.isna()]
    assert {"mass_matrix_and_bias", "forward_dynamics", "rk4_step"} <= set(timed.quantity)
    assert (timed.ns_per_state > 0.0).all() and costs[costs.why_not.notna()].ns_per_state.isna().all()
    counted = timed[timed.operations.notna()].set_index("implementation")
    assert {"compiled", "compiled, side by side"} < set(counted.index)
    assert np.allclose(counted.operations_per_ns, counted.operations / counted.ns_per_state)
    errors = accuracy.true_error(result.rows, dict.fromkeys(("zero, free", "bent, free"), 64))
    assert errors["zero, free"] == pytest.approx((1.6, 1.6), abs=0.1)
    assert errors["bent, free"] == pytest.approx((0.27, 0.27), abs=0.01)


def test_a_run_without_timings_has_the_checks_only(engines):
    result = speed.rows(experiment.Setup.small(ARM, engines), timed=False)
    assert len(result.checks) > 10 and all(check.passed for check in result.checks)
    assert all(row["seconds"] is None for row in result.rows) and list(speed.figures(result, ARM)) == []


def test_a_wrong_model_is_far_from_the_reference():
    checks = speed.rows(setup_of(XML.replace('mass="1.5"', 'mass="1.50001"')), timed=False).checks
    failed = {check.quantity for check in checks if not check.passed}
    assert {"smallest error of MuJoCo's RK4, beside that of tmt's rk4", "the same error as tmt's rk4"} <= failed
