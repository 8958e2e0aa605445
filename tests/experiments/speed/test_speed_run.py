"""Speed against accuracy, from runs to the table: every method, smaller models, wrong models, engines that are not there."""

import dataclasses

import numpy as np
import pandas as pd
import pytest
from edited import XML, setup_of

from compare import experiment
from compare.engines import Method, Setting
from compare.engines.mujoco import load
from compare.experiments import speed
from compare.experiments.speed import accuracy, runs, settings
from compare.robots.arm import ARM
from tmt.methods import METHODS


def test_every_method_follows_the_scene(engines, bent, known_reference):
    """Each method's finest useful setting is near the reference, and costs evaluations."""
    for method in settings.methods(engines, "full"):
        steps = None if method.adaptive else 2**13 if method.order == 1 else 1024
        setting = Setting(5.0, steps, 1e-7 if method.adaptive else None)
        row = runs.row_of_run(bent, bent, engines, method, setting, known_reference)
        tolerance = {1: 0.6, 2: 0.03}.get(method.order, 1e-4)
        assert 0.0 < row["worst_error_rad"] < tolerance, method
        assert row["error_rad"] <= row["worst_error_rad"] and not row["diverged"]
        assert row["energy_error_J"] > 0.0 and row["dt_s"] == (5.0 / steps if steps else None)
        if method.engine == "tmt" and method.order:
            stages = len(getattr(METHODS[method.name], "b", "1"))
            assert row["evaluations"] % stages == 0 and row["evaluations"] >= stages * steps
        assert (row["evaluations"] is None) == (method.engine == "heyoka")


def test_a_run_that_diverges_has_no_error(engines, bent, known_reference):
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


def test_rounding_leaves_eps_times_the_growth(bent, engines):
    def floor(case):
        return runs.floor(case, engines["tmt"].of(case))

    slow = bent.changed(posture=(), gravity=False, duration=1.0, dt=1 / 64)
    assert 1.0 <= floor(slow) / np.finfo(float).eps < 3.0  # nothing grows, at rest
    assert floor(bent) > 10 * floor(slow)
    fast = bent.changed(speed=(1e7, 1e7, 1e7))
    with pytest.raises(ValueError, match="scene 'bent, free': RK4 with 16384 steps does not reach its end"):
        floor(fast)


def test_where_the_reference_is_not_known_nothing_is_judged(engines, bent, known_reference):
    for apart, left in ((1e-30, runs.floor(bent, engines["tmt"].of(bent))), (1e-6, 1e-6)):
        known = {"bent, free": known_reference._replace(apart=apart)}
        assert runs.rows_of_scene(bent, engines, known, "small", "same schemes")[1] == left


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
    # by a time or by a reason
    assert {"MuJoCo", "heyoka", "Pinocchio"} <= {name.split(",")[0] for name in costs.implementation}
    errors = accuracy.true_error(result.rows, dict.fromkeys(("zero, free", "bent, free"), 64))
    assert errors["zero, free"] == pytest.approx((1.6, 1.6), abs=0.1)
    assert errors["bent, free"] == pytest.approx((0.27, 0.27), abs=0.01)


def test_a_run_without_timings_has_the_checks_only(engines):
    result = speed.rows(experiment.Setup.small(ARM, engines), timed=False)
    assert len(result.checks) > 10 and all(check.passed for check in result.checks)
    assert all(row["seconds"] is None for row in result.rows) and list(speed.figures(result, ARM)) == []


@pytest.mark.parametrize(
    "old, new", [("0 0 -9.81", "0 0 -1.62"), ('mass="1.5"', 'mass="1.50001"')], ids=["moon", "mass"]
)
def test_a_wrong_model_is_far_from_the_reference(old, new):
    assert XML.count(old) == 1
    checks = speed.rows(setup_of(XML.replace(old, new)), timed=False).checks
    failed = {check.quantity for check in checks if not check.passed}
    assert {"smallest error of MuJoCo's RK4, beside that of tmt's rk4", "the same error as tmt's rk4"} <= failed


class Elsewhere:
    """An engine that cannot take part."""

    name = "own"
    methods = {name: Method("own", name, 4, "rk4") for name in ("RK4", "Heun")}  # noqa: RUF012

    def unavailable(self):
        return "own.py is not there"

    def of(self, case):
        raise AssertionError("nothing is asked of it")


def with_and_without():
    """Of small runs of one scene by two engines, with one that cannot take part and without: results, counts of figures."""
    robot = dataclasses.replace(ARM, scenes=tuple(scene for scene in ARM.scenes if scene.name == "bent, free"))
    every = experiment.engines(load(ARM.mjcf, ARM.tree))
    two = {name: every[name] for name in ("mujoco", "tmt")}
    results = [speed.rows(experiment.Setup.small(robot, some)) for some in (two | {"own": Elsewhere()}, two)]
    counts = [len(list(speed.figures(result, robot))) for result in results]
    for result in results:
        result.curves = {}  # which need not be sent
    return results, counts


@pytest.mark.slow
def test_an_engine_that_cannot_take_part_says_why_in_its_cells_and_is_nowhere_else(shared):
    (with_it, without), figures = shared(with_and_without)
    absent = {"scene": "bent, free", "engine": "own", "method": "RK4, Heun", "why_not": "own.py is not there"}
    assert with_it.rows[-1] == dict.fromkeys(speed.COLUMNS) | absent and len(with_it.rows) == len(without.rows) + 1
    values = [[(c.scene, c.quantity, c.value) for c in result.checks] for result in (with_it, without)]
    assert values[0] == values[1]
    for name, table in with_it.tables.items():
        assert "own" not in {row.get("engine") for row in table} and len(table) == len(without.tables[name])
    assert ["own.py" in note for note in with_it.notes] == [False] * (len(with_it.notes) - 1) + [True]
    assert figures[0] == figures[1] > 0


def test_who_is_not_there_has_a_row_with_the_reason_but_in_a_quick_run(engines):
    rows = settings.unavailable(experiment.Setup.small(ARM, engines | {"own": Elsewhere()}), ["bent, free"])
    assert {"scene": "bent, free", "engine": "own", "method": "RK4, Heun", "why_not": "own.py is not there"} in rows
    quick = experiment.Setup.quick(ARM, engines | {"own": Elsewhere()})
    assert settings.unavailable(quick, ["bent, free"]) == []


def test_a_robot_without_such_scenes_is_left_out_with_the_reason():
    assert speed.skipped(ARM) is None and "bare" in speed.skipped(dataclasses.replace(ARM, scenes=(), name="bare"))
