"""MuJoCo's minimal calls in compiled loops, and its batches: the same numbers as its own calls."""

import numpy as np
import pytest

from compare.engines.mujoco import batch, calls
from compare.engines.mujoco.batch import BatchedCalls
from compare.engines.mujoco.calls import MinimalCalls
from compare.robots.arm import ARM


@pytest.mark.skipif(MinimalCalls.unavailable() is not None, reason="MuJoCo's library is not beside its package")
def test_a_loop_does_all_of_it_at_the_state_that_is_there_as_often_as_it_is_told(mujoco, rng):
    """Nothing is left of what was found at the state before."""
    dynamics, nothing = mujoco.of(ARM.case()), np.zeros(3)
    minimal = MinimalCalls(dynamics)
    loops = {name: way[1] for name, way in minimal.loops(*rng.uniform(-2.0, 2.0, (3, 3))).items()}
    for name, (q, v) in zip(("MuJoCo, equal work, no solve", "MuJoCo, equal work"), rng.uniform(-2.0, 2.0, (2, 2, 3))):
        minimal.place(q, v, nothing)
        minimal.force[:] = np.nan
        loops[name](0)
        assert np.isnan(minimal.force).all()
        loops[name](1)
        M, full = dynamics.mass_matrix(q), np.zeros((3, 3))
        calls.mujoco.mj_fullM(minimal.model, minimal.data, full)
        assert np.array_equal(full, M) and np.array_equal(minimal.force, dynamics.bias(q, v))
    assert np.allclose(M @ minimal.solution, minimal.force, rtol=1e-12)
    minimal.data.time = 0.0
    loops["MuJoCo, mj_step"](7)
    assert minimal.data.time == pytest.approx(7 * calls.TINY_STEP, rel=1e-12)
    minimal.place(q, v, nothing)
    minimal.model.opt.timestep = 0.01
    loops["MuJoCo, mj_step"](1)
    run = dynamics.run(q, v, nothing, 0.01, 1, "RK4")
    assert np.array_equal(minimal.data.qpos, run.q[1]) and np.array_equal(minimal.data.qvel, run.v[1])
    loops["MuJoCo, mj_forward"](1)
    assert np.allclose(minimal.data.qacc, dynamics.acceleration(run.q[1], run.v[1], nothing), rtol=1e-12)


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
