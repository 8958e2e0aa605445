"""Integration: tableaus, orders, and what simulate gives back."""

import dataclasses
from itertools import pairwise

import numpy as np
import pytest

import tmt
from compare.band import band
from tmt.implicit import ImplicitRungeKutta
from tmt.methods import METHODS, RungeKutta, amplification, one_step

BENT = np.radians([30.0, 20.0, 60.0])
REST = np.zeros(3)


@pytest.mark.parametrize(
    "changes, says",
    [
        ({"b": (1.0, 0.5)}, "b sums to 1.5"),
        ({"c": (0.0, 0.4)}, "row 1 of A sums to 0.5"),
        ({"A": ((), (0.5, 0.5))}, "row 1 of A has 2 entries"),
        ({"A": ((),)}, "one entry for each stage"),
    ],
)
def test_a_wrong_tableau_cannot_be_built(changes, says):
    midpoint = {"order": 2, "A": ((), (0.5,)), "b": (0.0, 1.0), "c": (0.0, 0.5)}
    RungeKutta(**midpoint)
    with pytest.raises(ValueError, match=says):
        RungeKutta(**midpoint | changes)


@pytest.mark.parametrize(
    "changes, says",
    [
        ({"b": (1.0, 0.5)}, "A must be square"),
        ({"b": (0.9,)}, "b sums to 0.9"),
        ({"c": (0.4,)}, "row 0 of A sums to 0.5"),
        ({"A": ((),)}, "A must be square"),
    ],
)
def test_a_wrong_implicit_tableau_cannot_be_built(changes, says):
    midpoint = {"order": 2, "A": ((0.5,),), "b": (1.0,), "c": (0.5,)}
    ImplicitRungeKutta(**midpoint)
    with pytest.raises(ValueError, match=says):
        ImplicitRungeKutta(**midpoint | changes)


@pytest.mark.parametrize("name", METHODS)
def test_order(name):
    order = METHODS[name].order
    counts = (256, 512, 1024) if order > 1 else (8192, 16384, 32768)
    runs = [tmt.simulate(BENT, REST, REST, 1.0 / steps, steps, name) for steps in counts]
    ends = [np.concatenate([q[-1], qd[-1]]) for _, q, qd in runs]
    coarse, fine = (np.linalg.norm(a - b) for a, b in pairwise(ends))
    assert np.log2(coarse / fine) == pytest.approx(order, abs=0.15)


@pytest.mark.parametrize("name", METHODS)
def test_energy_drift_falls_with_the_order(name):
    drifts = []
    order = METHODS[name].order
    for steps in (128, 256, 512) if order > 1 else (1024, 2048, 4096):
        _, q, qd = tmt.simulate(BENT, REST, REST, 1.0 / steps, steps, name)
        energy = tmt.energy(q, qd)
        assert np.ptp(tmt.potential_energy(q)) > 0.5
        drifts.append(np.abs(energy - energy[0]).max())
    assert drifts[2] > 0.0
    assert np.log2(drifts[0] / drifts[2]) / 2 > order - 0.3


def test_shapes_and_start():
    t, q, qd = tmt.simulate(BENT, REST, REST, 5 / 64, 64)
    assert t.shape == (65,) and q.shape == qd.shape == (65, 3)
    assert t[-1] == 5.0
    assert np.array_equal(q[0], BENT) and np.array_equal(qd[0], REST)
    assert np.abs(q[-1] - BENT).max() > 0.1


def test_a_batch_of_runs_is_each_run(rng):
    starts = rng.uniform(-1, 1, (2, 3, 3))
    _, q, qd = tmt.simulate(starts, REST, REST, 0.01, 20)
    assert q.shape == (2, 3, 21, 3)
    _, single_q, single_qd = tmt.simulate(starts[1, 2], REST, REST, 0.01, 20)
    assert np.array_equal(q[1, 2], single_q) and np.array_equal(qd[1, 2], single_qd)


def test_a_diverged_run_is_nan_from_there_on():
    _, q, _ = tmt.simulate(BENT, [1e3, 1e3, 1e3], REST, 10.0, 200)
    finite = np.isfinite(q).all(axis=1)
    assert finite[0] and not finite[-1]
    assert not finite[np.argmin(finite) :].any()


def test_damping_takes_energy():
    damped = dataclasses.replace(tmt.ARM, damping=(0.5, 0.5, 0.5))
    _, q, qd = tmt.simulate(BENT, REST, REST, 1e-3, 2000, model=damped)
    energy = tmt.energy(q, qd)
    assert (np.diff(energy) <= 0.0).all() and energy[0] - energy[-1] > 0.1


def test_the_assignments_bent_posture_holds():
    tau = tmt.gravity_balance(BENT)
    _, q, qd = tmt.simulate(BENT, REST, tau, 5 / 64, 64)
    width = band(METHODS["rk4"], tmt.ARM, q, qd, tau, 5 / 64)
    assert (np.abs(q - BENT) <= width[:, :3]).all()


@pytest.mark.parametrize("name", METHODS)
def test_amplification_is_what_a_step_does_to_a_small_deviation(name, rng):
    q, qd, tau = rng.uniform(-1, 1, (3, 3))
    J = amplification(METHODS[name], tmt.ARM, q, qd, tau, 0.1)
    for column, direction in zip(J.T, 1e-5 * np.eye(6)):
        ends = [
            np.concatenate(
                [
                    path[0, 1]
                    for path in tmt.simulate([q + s * direction[:3]], [qd + s * direction[3:]], tau, 0.1, 1, name)[1:]
                ]
            )
            for s in (1, -1)
        ]
        assert np.abs((ends[0] - ends[1]) / 2e-5 - column).max() < 1e-7
    assert np.array_equal(amplification(METHODS[name], tmt.ARM, np.stack([q, -q]), qd, tau, 0.1)[0], J)


def test_where_newton_fails_the_run_is_nan_and_the_step_says_so():
    _, q, qd = tmt.simulate(BENT, REST, REST, 0.5, 20, "implicit_midpoint")
    last = np.isfinite(q).all(axis=1).sum() - 1
    assert 0 < last < 20 and np.abs(qd[last]).max() < 1e3  # finite and modest until there
    with pytest.raises(ArithmeticError, match=r"dt = 0\.5 s"):
        one_step(METHODS["implicit_midpoint"], tmt.ARM, list(q[last]), list(qd[last]), [0.0] * 3, 0.5)
