"""MuJoCo's batches: the same numbers as its own calls, state by state."""

import numpy as np
import pytest

from compare.engines.mujoco import batch
from compare.engines.mujoco.batch import BatchedCalls
from compare.robots.arm import ARM


@pytest.mark.skipif(BatchedCalls.unavailable() is not None, reason="this MuJoCo has no batches")
@pytest.mark.parametrize("threads", [1, 2])
def test_a_batch_has_the_accelerations_of_mj_forward(mujoco, rng, threads):
    dynamics = mujoco.of(ARM.case())
    q, v, tau = rng.uniform(-2.0, 2.0, (3, 7, 3))
    calls, expected = BatchedCalls(dynamics, q, v, tau, threads), dynamics.acceleration(q, v, tau)
    assert np.array_equal(calls.forward(), expected) and np.abs(expected).max() > 1.0
    calls.batch.bind("qvel")[:] = 0.0
    calls.forward_loop()(1)
    assert np.array_equal(calls.found, dynamics.acceleration(q, 0.0 * v, tau))
    calls.batch.bind("qvel")[:] = v
    assert np.array_equal(calls.forward(), expected)
    for _ in range(3):
        calls.step()
    assert np.allclose(calls.batch.bind("time"), 3 * batch.TINY_STEP, rtol=1e-12)
    assert np.allclose(calls.forward(), expected, rtol=1e-5)


def test_where_there_are_none_it_says_so(monkeypatch):
    monkeypatch.setattr(batch, "find_spec", lambda name: None)
    assert "mujoco.batch" in BatchedCalls.unavailable()
