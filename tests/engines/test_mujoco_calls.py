"""MuJoCo's minimal calls in compiled loops, its batches and derivatives of steps, compared with its own calls."""

import numpy as np
import pytest
from files import case_of
from models import PATHS
from trees import random_states

from compare.engines.mujoco import calls, engine, read
from compare.engines.mujoco.calls import TINY_STEP, MinimalCalls
from compare.engines.mujoco.linear import transition
from compare.robots.arm import ARM


@pytest.mark.skipif(MinimalCalls.unavailable() is not None, reason="MuJoCo's library is elsewhere")
def test_a_loop_repeats_its_calls_at_the_current_state(mujoco, rng):
    dynamics, nothing = mujoco.of(ARM.case()), np.zeros(3)
    minimal = MinimalCalls(dynamics)
    loops = {name: way[1] for name, way in minimal.loops(*rng.uniform(-2.0, 2.0, (3, 3))).items()}
    equal_work = loops["MuJoCo, equal work"]
    for q, v in rng.uniform(-2.0, 2.0, (2, 2, 3)):
        minimal.place(q, v, nothing)
        minimal.force[:] = np.nan
        equal_work(0)
        assert np.isnan(minimal.force).all()
        equal_work(1)
        M, full = dynamics.mass_matrix(q), np.zeros((3, 3))
        calls.mujoco.mj_fullM(minimal.model, minimal.data, full)
        assert np.array_equal(full, M) and np.array_equal(minimal.force, dynamics.bias(q, v))
    assert np.allclose(M @ minimal.solution, minimal.force, rtol=1e-12)
    minimal.data.time = 0.0
    loops["MuJoCo, mj_step"](7)
    assert minimal.data.time == pytest.approx(7 * TINY_STEP, rel=1e-12)
    minimal.place(q, v, nothing)
    minimal.model.opt.timestep = 0.01
    loops["MuJoCo, mj_step"](1)
    run = dynamics.run(q, v, nothing, 0.01, 1, "RK4")
    assert np.array_equal(minimal.data.qpos, run.q[1]) and np.array_equal(minimal.data.qvel, run.v[1])
    loops["MuJoCo, mj_forward"](1)
    assert np.allclose(minimal.data.qacc, dynamics.acceleration(run.q[1], run.v[1], nothing), rtol=1e-12)


def test_a_step_is_differenced_in_movements(rng):
    reading = read(PATHS["mixed"])  # with quaternions
    dynamics, (q, _, tau) = engine(reading).of(case_of(reading.tree)), random_states(rng, reading.tree, 1)
    for integrator in ("Euler", "implicit"):
        model, data = dynamics.own_copy(1e-3, integrator, q[0], 0.0, tau[0])
        A = np.zeros((2 * model.nv + model.na,) * 2)
        calls.mujoco.mjd_transitionFD(model, data, 1e-6, True, A, None, None, None)
        order = np.concatenate([dynamics.dofs, model.nv + dynamics.dofs])
        found = transition(dynamics, q[0], tau[0], 1e-3, integrator)
        assert np.allclose(A[np.ix_(order, order)], found, atol=1e-6)
    found = transition(dynamics, q[0], tau[0], 1e-9, "RK4")
    assert np.allclose(found, np.eye(2 * len(dynamics.dofs)), atol=1e-5)
