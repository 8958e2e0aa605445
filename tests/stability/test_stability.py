"""What is known of postures of the arm and of a step of each method, the same in runs."""

import dataclasses

import numpy as np
import pytest

import tmt
from compare.engines.mujoco.engine import METHODS as OF_MUJOCO
from compare.engines.tmt import Tmt
from compare.experiments.stability import limits
from compare.robots.arm import ARM
from compare.stability.equilibrium import equilibrium

METHODS = Tmt().methods
BENT, BALL = equilibrium(ARM, "bent"), equilibrium(ARM, "ball catch")


@pytest.mark.parametrize("name, kind, rates", [
    ("zero", "marginal", [0.0, 0.0]), ("hanging", "centre", [10.995j, 4.975j, 4.867j]),
    ("upright", "saddle", [10.995, 4.975, 4.867]), ("ball catch", "saddle", [7.513, 5.300]),
    ("bent", "centre", [9.101j, 5.039j, 4.314j]),
])  # fmt: skip
def test_what_each_posture_is(name, kind, rates):
    at = equilibrium(ARM, name)
    assert at.kind == kind and all(np.abs(at.rates - rate).min() < 5e-4 for rate in rates)
    assert np.abs(at.rates.sum()) < 1e-9  # undamped: they come in opposite pairs


def test_known_limits_of_undamped_modes_and_of_methods_that_are_stable_but_on_a_saddle():
    for name, limit in {"semi_implicit_euler": 2.0, "implicit": 2.0, "rk4": 2.0 * np.sqrt(2.0)}.items():
        kind, dt = BENT.limit(name)
        assert kind == "finite" and dt * np.abs(BENT.rates).max() == pytest.approx(limit, rel=1e-6)
    for name in ("implicit_midpoint", "gauss_legendre_4"):
        assert BENT.limit(name) == ("never_fails", None) and BALL.limit(name) == ("always_fails", None)


def test_predicted_and_observed_limits_agree(engines):
    ours = [METHODS[scheme] for scheme in ("semi_implicit_euler", "implicit_midpoint")]
    rows = limits.limit_rows(BENT, engines, (*ours, OF_MUJOCO["RK4"]))
    kinds = ["finite", "never_fails", "finite"]
    assert [found.kind for found in rows] == [found.row.limit for found in rows] == kinds
    for row, *_ in (rows[0], rows[2]):
        assert row.observed_dt == pytest.approx(row.predicted_dt, rel=limits.LIMIT_TOLERANCE)
    # a forearm of another mass has another one
    heavy = equilibrium(dataclasses.replace(ARM, tree=dataclasses.replace(tmt.ARM, mass=(1.9, 1.65))), "bent")
    assert abs(rows[2].row.observed_dt / heavy.limit("rk4")[1] - 1.0) > 2.0 * limits.LIMIT_TOLERANCE
    # growth beyond the limit is slow with little damping: 100-fold in 2000 steps comes 6 % later
    damped = equilibrium(ARM, "bent", 0.5)
    ((row, kind, _),) = limits.limit_rows(damped, engines, (METHODS["explicit_euler"],))
    assert kind == "finite" and row.observed_dt == pytest.approx(row.predicted_dt, rel=5e-4)


@pytest.mark.slow
def test_a_small_run_fills_every_table(small):
    small = small("stability")
    assert set(small.tables) == {"departure", "stability_claims"}
    notes = {note.kind: note.values.get("reproduced") for note in small.notes}
    assert [notes[f"claim_{k}"] for k in (1, 2, 3)] == [True, "yes", "bounded"]
