"""Runs that errors are measured against: their digits, what is too stiff for a series."""

from dataclasses import replace

import numpy as np
import pytest
from helpers.servo_models import spring

import tmt
from compare.experiments.speed.runs import floor
from compare.experiments.speed.settings import scenes_of
from compare.robots.arm import ARM
from compare.truth import reference
from tmt.exact import motion as reference_run

BENT = next(case for case in scenes_of(ARM) if case.name == "bent, free")
SHORT = BENT.changed(name="short", duration=0.02, dt=0.005)


def test_a_scene_is_known_to_1e_30_times_the_growth_and_errors_are_taken_from_both_halves(engines):
    known, eps = reference.reference(BENT), np.finfo(float).eps
    growth = floor(BENT, engines["tmt"].of(BENT)) / eps
    assert known.apart <= reference.LOST * growth and known.why is None
    assert np.array_equal(known.high[0], np.concatenate(BENT.start)) and not known.low[0].any()
    assert known.t.tolist() == (np.arange(65) * 5 / 64).tolist() and known.steps < 1000
    finer = tmt.simulate(BENT.tree, *BENT.start, BENT.tau, 5.0 / 2**13, 2**13, "dopri8").q[::128]
    assert known.error(finer).max() < 64 * growth * eps
    high, low = known.high[:, :3], known.low[:, :3]
    assert 1e-18 < np.abs(known.low).max() < 1e-14
    assert np.array_equal(known.error(high), np.abs(low).max(axis=1))
    assert known.error(high + low).max() <= 1e-15
    assert known.error(high + [0.0, 0.0, 1e-3]) == pytest.approx(1e-3)


def test_a_run_in_doubles_is_made_finer_while_that_helps():
    known, doubles = reference.reference(BENT), reference.in_doubles(BENT)
    assert doubles.steps >= 16 * reference.first_steps(BENT)
    assert known.error(doubles.high[:, :3]).max() < doubles.apart < 1e-12


def test_the_accuracy_of_a_run_in_doubles_is_that_of_its_speeds_too():
    """Which differ more than its positions from those of the run with half the steps."""
    fast = BENT.changed(name="fast", speed=(500.0, 300.0, 800.0), duration=1.0, dt=1 / 64)
    doubles, runs = reference.in_doubles(fast), []
    for steps in (doubles.steps // 2, doubles.steps):
        motion = tmt.simulate(fast.tree, *fast.start, fast.tau, 1.0 / steps, steps, "dopri8")
        runs.append([values[:: steps // 64] for values in (motion.q, motion.qd)])
    of_q, of_speeds = (np.abs(coarse - fine).max() for coarse, fine in zip(*runs))
    assert of_speeds > 3.0 * of_q and doubles.apart == of_speeds


def test_a_changed_scene_has_another_motion_and_an_equal_one_is_not_computed_again():
    before = reference.in_pairs.cache_info()
    first, again = (reference.reference(SHORT) for _ in range(2))
    assert first.high is again.high and reference.in_pairs.cache_info().hits > before.hits
    changes = {"damping": 0.1}, {"gravity": False}, {"torque": (0, 0, 1)}, {}
    assert len({reference.reference(SHORT.changed(**change)).high[-1].tobytes() for change in changes}) == 4
    swing = reference.reference(SHORT.changed(name="swing", locked=("alpha", "beta")))
    assert swing.high.shape == swing.low.shape == (65, 2)


def test_a_motion_is_computed_once_and_kept_with_all_that_it_follows_from(monkeypatch, tmp_path):
    monkeypatch.setenv("TMT_CACHE", str(tmp_path))
    computed = []
    monkeypatch.setattr(reference, "truth", lambda *of: computed.append(of) or reference_run.truth(*of))
    heavier = replace(SHORT.tree, mass=tuple(mass * (1.0 + 1e-15) for mass in SHORT.tree.mass))
    start = tuple(map(tuple, (*SHORT.start, SHORT.tau)))

    def path(tree, dt=0.005):
        reference.in_pairs.cache_clear()  # as in another process
        return reference.in_pairs(tree, *start, dt, 64, 1)

    first, apart = path(SHORT.tree)
    again, apart_again = path(SHORT.tree)
    assert len(computed) == 1 and apart == apart_again and first.steps == again.steps
    assert np.array_equal(first.high, again.high) and np.array_equal(first.low, again.low)
    others = path(heavier), path(SHORT.tree, 0.0050001)
    assert len(computed) == 3 and not any(np.array_equal(first.low, other.low) for other, _ in others)
    for file in tmp_path.iterdir():  # damaged
        file.write_bytes(file.read_bytes()[:-1])
    assert np.array_equal(path(SHORT.tree)[0].low, first.low) and len(computed) == 4


def test_a_run_ends_where_it_would_take_too_many_steps(monkeypatch):
    case = spring(4).cases[-1]
    work = reference_run.BESIDE + len(reference_run.equations(case.tree, case.tau, "composite").code)
    run = lambda: reference_run.trajectory(case.tree, *case.start, case.tau, 1.0, 5)  # noqa: E731
    steps = run().steps
    monkeypatch.setattr(reference_run, "MOST_OPERATIONS", steps * work)
    assert run().steps == steps > 3
    monkeypatch.setattr(reference_run, "MOST_OPERATIONS", (steps - 1) * work)
    with pytest.raises(reference_run.TooManySteps, match=rf"\b{steps - 1}\b"):
        run()
