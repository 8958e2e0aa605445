"""Speed against accuracy: the reference, the clock, the errors, and what is concluded from them."""

import dataclasses

import mpmath
import numpy as np
import pandas as pd
import pytest

import tmt
from compare import advice, clock, competitors, engine_calls, reference, speed
from compare.agreement import Result
from compare.scenes import SCENES
from tmt import reference_run
from tmt.methods import METHODS

BENT = next(scene for scene in SCENES if scene.name == "bent, free")


@pytest.fixture(scope="module")
def known():
    return reference.references()


def test_decimal_sine_and_cosine():
    with reference_run.localcontext() as context, mpmath.workdps(60):
        context.prec = reference_run.DIGITS
        for x in ("0", "0.7853981633974483", "-1.6", "3.2", "-100.25", "4.712388980384689857693965"):
            values = reference_run.sincos(reference_run.Decimal(x))
            for value, exact in zip(values, (mpmath.sin(mpmath.mpf(x)), mpmath.cos(mpmath.mpf(x)))):
                assert abs(mpmath.mpf(str(value)) - exact) < mpmath.mpf(10) ** -33


def test_the_committed_reference_is_of_the_stated_numbers():
    rows = reference.read(reference.TABLE)
    scenes = [scene for scene in SCENES if scene.name in reference.STEPS]
    assert len(scenes) == 4 and {reference.key(scene) for scene in scenes} == set(rows)
    assert all(float(of_scene[0]["halving_difference"]) < 1e-20 for of_scene in rows.values())


def test_the_reference_is_what_its_command_computes(known):
    path = reference_run.trajectory(BENT.model, *BENT.start, BENT.tau, BENT.duration / 8, 8, 64)
    high = path.astype(float)
    assert np.abs(known["bent, free"].high[:9] - high).max() <= 2e-16 * np.abs(high).max()
    other = np.array([[reference.Decimal(h) + reference.Decimal(v) for h, v in zip(*pair)]
                      for pair in zip(known["bent, free"].high[:9].tolist(), known["bent, free"].low[:9].tolist())])  # fmt: skip
    assert 0 < np.abs(path - other).max() < 1e-22


def test_a_changed_model_gets_a_reference_of_its_own(tmp_path, monkeypatch):
    monkeypatch.setenv("TMT_CACHE", str(tmp_path))
    changed = dataclasses.replace(BENT, damping=0.1, duration=0.5, dt=0.5 / 64)
    monkeypatch.setattr(reference, "SCENES", (changed,))
    monkeypatch.setattr(reference, "STEPS", {changed.name: 128})
    told = []
    first = reference.references(tell=told.append)[changed.name]
    assert told[-1] == "runs with many digits: 2 of 2" and first.halving < 1e-20
    assert (
        first.error(tmt.simulate(*changed.start, changed.tau, 0.5 / 64, 64, "dopri8", changed.model)[1]).max() < 1e-13
    )
    (kept,) = tmp_path.glob("reference_*.csv")
    again = reference.references(tell=told.append)[changed.name]
    assert len(told) == 2 and np.array_equal(first.high, again.high)
    kept.write_text(kept.read_text()[:1000])
    assert reference.read(kept) == {}  # damaged: as if it were not there


def test_competitors_are_timed_in_turns():
    order = []
    times = clock.in_turns([lambda: order.append("a"), lambda: order.append("b")], 3)
    assert order == ["a", "b"] * 4 and [len(t) for t in times] == [3, 3]


def test_every_method_follows_the_scene(engine, known):
    """Each competitor's finest useful setting is near the reference, and costs evaluations."""
    settings = {1: competitors.Setting(steps=2**14), None: competitors.Setting(tolerance=1e-7)}
    for competitor in competitors.competitors(engine):
        setting = settings.get(competitor.order, competitors.Setting(steps=1024))
        row = speed.judged(BENT, BENT, competitor, setting, known["bent, free"])
        bar = {1: 0.3, 2: 0.03, None: 1e-4}.get(competitor.order, 1e-4)
        assert 0.0 < row["worst_error_rad"] < bar, competitor
        assert row["error_rad"] <= row["worst_error_rad"] and not row["diverged"]
        assert row["energy_error_J"] > 0.0
        if competitor.engine == "tmt" and competitor.order:
            stages = len(getattr(METHODS[competitor.method], "b", "1"))
            assert row["evaluations"] % stages == 0 and row["evaluations"] >= stages * setting.steps
        assert (row["evaluations"] is None) == (competitor.engine == "heyoka")


def test_the_table_and_its_checks(engine, setup):
    result = speed.rows(dataclasses.replace(setup, steps=(64,)))
    assert [str(check) for check in result.checks if not check.passed] == []
    table = pd.DataFrame(result.rows)
    assert list(table.columns) == speed.COLUMNS
    assert set(table.engine) == {"mujoco", "tmt"} and table.diverged.any()
    assert table[table.diverged][["error_rad", "worst_error_rad", "energy_error_J"]].isna().all(axis=None)
    assert (table.seconds > 0.0).all()
    evaluations = pd.DataFrame(result.tables["evaluations"])
    assert list(evaluations.columns) == ["quantity", "implementation", "states", "threads", "ns_per_state"]
    assert set(evaluations.quantity) == {"mass_matrix_and_bias", "forward_dynamics", "rk4_step"}
    assert len([check for check in result.checks if "twin" in check.quantity]) >= 3


def runs(order, engine="tmt", method="rk4"):
    return [
        {"scene": "s", "engine": engine, "method": method, "dt_s": 0.1 / 2**k, "tolerance": None, "steps": 2**k,
         "evaluations": 4 * 2**k, "seconds": 1e-3 * 2**k * (20 if engine == "mujoco" else 1), "diverged": False,
         "early": 1e-2 * 2.0 ** (-order * k), "worst_error_rad": 1e-2 * 2.0 ** (-order * k)}
        for k in range(5)
    ]  # fmt: skip


@pytest.mark.parametrize("measured, passes", [(4.0, True), (3.9, True), (3.0, False), (5.0, False)])
def test_a_wrong_order_is_seen(measured, passes):
    result = Result("speed", rows=runs(measured))
    (row,) = advice.orders(result, ["s"], [("tmt", "rk4", 4)])
    assert row["measured_order"] == pytest.approx(measured)
    assert [check.passed for check in result.checks] == [passes, True]
    advice.orders(result, ["s"], [("tmt", "dopri8", 8)])
    assert not result.checks[-1].passed  # a method that no scene shows


def test_a_wrong_twin_is_seen():
    result = Result("speed", rows=runs(4.0) + runs(4.0, "mujoco", "RK4"))
    speed.twins(result, {"s": 1e-16})
    assert len(result.checks) == 5 and all(check.passed for check in result.checks)
    for row in result.rows[:5]:
        row["worst_error_rad"] *= 1.01
    speed.twins(result, {"s": 1e-16})
    assert not any(check.passed for check in result.checks[5:])


def test_the_advice_is_the_cheapest_that_reaches():
    rows = runs(4.0) + runs(4.0, "mujoco", "RK4") + runs(8.0, "tmt", "dopri8")
    table = {line["target_rad"]: line for line in advice.advice(rows, ["s"], {"s": 1e-16})}
    line = table[1e-6]
    assert line["mujoco"] == "mujoco RK4, 16 steps" and line["tmt"] == line["of_all"] == "tmt dopri8, 4 steps"
    assert line["ratio"] == pytest.approx(80.0) == pytest.approx(line["kernel_part"] * line["method_part"])
    assert line["why_not"] is None
    assert table[1e-9]["mujoco"] is None and "its steps end before" in table[1e-9]["why_not"]
    left = advice.advice(rows, ["s"], {"s": 1e-9})[3]
    assert "its steps end before" in left["why_not"]


def test_mujocos_calls_in_compiled_loops_do_the_work(engine):
    state = np.array([0.5, 0.3, 1.0]), np.array([1.0, -2.0, 3.0]), np.zeros(3)
    ways = engine_calls.loops(engine, *state)
    assert {quantity for quantity, _ in ways.values()} == {"forward_dynamics", "mass_matrix_and_bias", "rk4_step"}
    for _, loop in ways.values():
        loop(3)
    (equal,) = (loop for name, (_, loop) in ways.items() if name == "MuJoCo, equal work")
    *_, bias, acceleration = equal.__defaults__[0]
    assert np.array_equal(bias, engine.bias(*state[:2])[engine.dofs])
    assert np.allclose(acceleration, -engine.acceleration(*state), rtol=1e-12)
