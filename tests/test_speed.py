"""Speed against accuracy: the reference, the clock, the errors, and what is concluded from them."""

import csv
import dataclasses

import mpmath
import numpy as np
import pandas as pd
import pytest

import tmt
from compare import accuracy, clock, competitors, engine_calls, reference, speed
from compare.agreement import Setup
from compare.engine_file import ARM_XML, parse
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


@pytest.mark.parametrize(
    "scene", [scene for scene in SCENES if scene.name in reference.STEPS], ids=lambda scene: scene.name
)
def test_a_record_of_the_reference_is_computed_from_the_one_before(scene):
    """With half as many steps as its command takes; the table has 32 digits. In seconds, where the whole takes minutes."""
    rows = reference.read(reference.TABLE)[reference.key(scene)]
    with reference_run.localcontext() as context:
        context.prec = reference_run.DIGITS
        exact = np.array([[reference.Decimal(row[name]) for name in reference.STATE] for row in rows])
        traced, torque = reference_run.slope(scene.model), [reference.Decimal(v) for v in scene.tau.tolist()]
        count = reference.STEPS[scene.name] // reference.RECORDS // 2
        dt = reference.Decimal(scene.duration) / reference.RECORDS / count
        for record in (0, 40):
            state = exact[record]
            for _ in range(count):
                rate = lambda state: np.array([*state[3:], *traced(state[:3], state[3:], torque)])  # noqa: E731
                state = reference_run.extrapolated(rate, state, dt)
            assert np.abs(state - exact[record + 1]).max() < 1e-21, record
    assert exact[0].astype(float).tolist() == np.concatenate(scene.start).tolist()


def test_a_changed_scene_gets_a_reference_of_its_own(tmp_path, monkeypatch):
    changed = dataclasses.replace(BENT, duration=0.02, dt=0.005)
    path = tmt.simulate(*changed.start, changed.tau, 0.005, 4, "dopri8", changed.model)[1]
    monkeypatch.setenv("TMT_CACHE", str(tmp_path))
    others = [dataclasses.replace(BENT, **{name: value}) for name, value in (
        ("damping", 0.1), ("gravity", False), ("torque", (0, 0, 1)), ("speed", (0, 1, 0)), ("posture", (1, 2, 3)))]  # fmt: skip
    assert len({reference.key(scene) for scene in (BENT, changed, *others)}) == 7
    monkeypatch.setattr(reference, "SCENES", (changed,))
    monkeypatch.setattr(reference, "STEPS", {changed.name: 8})
    monkeypatch.setattr(reference, "RECORDS", 4)
    told = []
    first = reference.references(tell=told.append)[changed.name]
    assert told[-1] == "runs with many digits: 2 of 2" and first.halving < 1e-20
    assert first.error(path).max() < 1e-13
    (kept,) = tmp_path.glob("reference_*.csv")
    again = reference.references(tell=told.append)[changed.name]
    assert len(told) == 2 and np.array_equal(first.high, again.high)
    text = kept.read_text(encoding="utf-8")
    kept.write_text(text[:1000], encoding="utf-8")
    assert reference.read(kept) == {}  # damaged: as if it were not there
    planted = text.replace(next(csv.DictReader(text.splitlines()))["beta_rad"], "0.1")
    assert planted != text
    kept.write_text(planted, encoding="utf-8")  # a run of another start: made anew
    once_more = reference.references(tell=told.append)[changed.name]
    assert len(told) == 4 and np.array_equal(first.high, once_more.high)

    def refuse(*_):
        raise RuntimeError("the folder is not the user's own")

    monkeypatch.setattr(reference, "kept", refuse)
    reference.references(tell=told.append)
    assert len(told) == 6  # nothing is read there, and nothing written


def test_the_command_remakes_the_table(tmp_path, monkeypatch, capsys):
    short = dataclasses.replace(BENT, duration=0.008, dt=0.001)
    monkeypatch.setattr(reference, "SCENES", (short,))
    monkeypatch.setattr(reference, "STEPS", {short.name: 16})
    monkeypatch.setattr(reference, "RECORDS", 8)
    monkeypatch.setattr(reference, "TABLE", tmp_path / "reference.csv")
    reference.main()
    (rows,) = reference.read(reference.TABLE).values()
    assert reference.begins(rows, short) and float(rows[0]["halving_difference"]) < 1e-28
    printed = capsys.readouterr()
    assert printed.out.startswith("bent, free: 16 steps, ") and "digits: 2 of 2" in printed.err


def test_competitors_are_timed_in_turns():
    order = []
    times = clock.in_turns([lambda: order.append("a"), lambda: order.append("b")], 3)
    assert order == ["a", "b"] * 4 and [len(t) for t in times] == [3, 3]


def test_every_method_follows_the_scene(engine, known):
    """Each competitor's finest useful setting is near the reference, and costs evaluations."""
    settings = {1: competitors.Setting(steps=2**14), None: competitors.Setting(tolerance=1e-7)}
    for competitor in competitors.competitors(engine):
        setting = settings.get(competitor.order, competitors.Setting(steps=1024))
        row = speed.follow(BENT, BENT, competitor, setting, known["bent, free"])
        bar = {1: 0.3, 2: 0.03, None: 1e-4}.get(competitor.order, 1e-4)
        assert 0.0 < row["worst_error_rad"] < bar, competitor
        assert row["error_rad"] <= row["worst_error_rad"] and not row["diverged"]
        assert row["energy_error_J"] > 0.0
        if competitor.engine == "tmt" and competitor.order:
            stages = len(getattr(METHODS[competitor.method], "b", "1"))
            assert row["evaluations"] % stages == 0 and row["evaluations"] >= stages * setting.steps
        assert (row["evaluations"] is None) == (competitor.engine == "heyoka")


def test_a_small_run_takes_every_path(engine, small):
    result = small("speed")
    table = pd.DataFrame(result.rows)
    assert list(table.columns) == speed.COLUMNS
    everyone = {(c.engine, c.method) for c in competitors.competitors(engine)}
    assert {(row["engine"], row["method"]) for row in result.rows} == everyone and table.diverged.any()
    assert table[table.diverged][["error_rad", "worst_error_rad", "energy_error_J"]].isna().all(axis=None)
    assert (table.seconds > 0.0).all() and set(table.scene) == {"zero, free", "zero, free, beta locked", "bent, free"}
    evaluations = pd.DataFrame(result.tables["evaluations"])
    assert list(evaluations.columns) == ["quantity", "implementation", "states", "threads", "ns_per_state"]
    assert set(evaluations.quantity) == {"mass_matrix_and_bias", "forward_dynamics", "rk4_step"}
    errors = accuracy.true_error(result.rows)
    assert errors["zero, free"] == pytest.approx((1.6, 1.6), abs=0.1) and errors["bent, free"][0] == pytest.approx(
        0.27, abs=0.01
    )


def test_a_run_without_timings_has_the_checks_only(engine):
    result = speed.rows(Setup.small(engine), timed=False)
    assert len(result.checks) > 10 and all(check.passed for check in result.checks)
    assert all(row["seconds"] is None for row in result.rows) and list(speed.figures(result)) == []


@pytest.mark.parametrize(
    "old, new", [("0 0 -9.81", "0 0 -1.62"), ('mass="1.5"', 'mass="1.50001"')], ids=["moon", "mass"]
)
def test_a_wrong_model_is_far_from_the_reference(old, new):
    checks = speed.rows(Setup.small(parse(ARM_XML.read_text(encoding="utf-8").replace(old, new))), timed=False).checks
    failed = {check.quantity for check in checks if not check.passed}
    assert {"smallest error of MuJoCo's RK4, beside that of tmt's rk4", "the same error as tmt's rk4"} <= failed


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
