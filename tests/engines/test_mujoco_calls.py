"""MuJoCo's minimal calls in compiled loops, and its batches: the same numbers as its own calls."""

import numpy as np
import pytest

from compare.engines.mujoco import batch, calls
from compare.engines.mujoco.batch import BatchedCalls
from compare.engines.mujoco.calls import MinimalCalls
from compare.robots.arm import ARM

STATE = np.array([0.5, 0.3, 1.0]), np.array([1.0, -2.0, 3.0]), np.zeros(3)


@pytest.fixture(scope="module")
def minimal(mujoco):
    """The arm by its minimal calls, and its loops, made at a state."""
    if reason := MinimalCalls.unavailable():
        pytest.skip(reason)
    found = MinimalCalls(mujoco.of(ARM.case()))
    return found, found.loops(*STATE)


@pytest.mark.parametrize("name", ["MuJoCo, equal work, no solve", "MuJoCo, equal work"])
def test_the_loops_do_all_of_it_at_the_state_that_is_there(mujoco, minimal, rng, name):
    """Nothing is left of what was found at the state before."""
    (minimal, ways), dynamics = minimal, mujoco.of(ARM.case())
    q, v = rng.uniform(-2.0, 2.0, (2, 3))
    minimal.place(q, v, np.zeros(3))
    minimal.force[:] = np.nan
    ways[name][1](0)
    assert np.isnan(minimal.force).all()  # it does as often as it is told
    ways[name][1](1)
    M, full = dynamics.mass_matrix(q), np.zeros((3, 3))
    calls.mujoco.mj_fullM(minimal.model, minimal.data, full)
    assert np.array_equal(full, M) and np.array_equal(minimal.force, dynamics.bias(q, v))
    assert name.endswith("no solve") or np.allclose(M @ minimal.solution, minimal.force, rtol=1e-12)


def test_a_loop_repeats_a_step_of_rk4_and_all_of_mj_forward(mujoco, minimal):
    (minimal, ways), dynamics = minimal, mujoco.of(ARM.case())
    minimal.data.time = 0.0
    ways["MuJoCo, mj_step"][1](7)
    assert minimal.data.time == pytest.approx(7 * calls.TINY_STEP, rel=1e-12)
    minimal.place(*STATE)
    minimal.model.opt.timestep = 0.01
    ways["MuJoCo, mj_step"][1](1)
    minimal.model.opt.timestep = calls.TINY_STEP
    run = dynamics.run(*STATE, 0.01, 1, "RK4")
    assert np.array_equal(minimal.data.qpos, run.q[1]) and np.array_equal(minimal.data.qvel, run.v[1])
    minimal.data.qacc[:] = np.nan
    ways["MuJoCo, mj_forward"][1](1)
    assert np.allclose(minimal.data.qacc, dynamics.acceleration(run.q[1], run.v[1], STATE[2]), rtol=1e-12)


@pytest.mark.skipif(BatchedCalls.unavailable() is not None, reason="this MuJoCo has no batches")
def test_a_batch_has_the_accelerations_of_mj_forward(mujoco, rng):
    dynamics = mujoco.of(ARM.case())
    q, v, tau = rng.uniform(-2.0, 2.0, (3, 7, 3))
    calls, expected = BatchedCalls(dynamics, q, v, tau, threads=2), dynamics.acceleration(q, v, tau)
    assert np.array_equal(calls.forward(), expected) and np.abs(expected).max() > 1.0
    calls.batch.bind("qvel")[:] = 0.0
    calls.forward_loop()(1)
    assert np.array_equal(calls.found, dynamics.acceleration(q, 0.0 * v, tau))
    for _ in range(3):
        calls.step()
    assert np.allclose(calls.batch.bind("time"), 3 * batch.TINY_STEP, rtol=1e-12)


def test_what_is_not_installed_is_said(monkeypatch, tmp_path):
    monkeypatch.setattr(calls.mujoco, "__file__", str(tmp_path / "mujoco" / "__init__.py"))
    monkeypatch.setattr(batch, "find_spec", lambda name: None)
    assert MinimalCalls.unavailable() and BatchedCalls.unavailable()
