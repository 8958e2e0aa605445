"""MuJoCo's minimal calls in compiled loops."""

import numpy as np
import pytest

from compare.engines.mujoco import calls
from compare.engines.mujoco.calls import MinimalCalls
from compare.robots.arm import ARM


def test_the_loops_do_the_work(mujoco):
    if reason := MinimalCalls.unavailable():
        pytest.skip(reason)
    state = np.array([0.5, 0.3, 1.0]), np.array([1.0, -2.0, 3.0]), np.zeros(3)
    dynamics = mujoco.of(ARM.case())
    minimal = MinimalCalls(dynamics)
    ways = minimal.loops(*state)
    assert {quantity for quantity, _ in ways.values()} == {"forward_dynamics", "mass_matrix_and_bias", "rk4_step"}
    for name, (_, loop) in ways.items():
        minimal.force[:] = minimal.solution[:] = np.nan
        loop(3)
        if "equal work" in name:
            assert np.array_equal(minimal.force, dynamics.bias(*state[:2])[dynamics.dofs])
        if name == "MuJoCo, equal work":
            assert np.allclose(minimal.solution, -dynamics.acceleration(*state), rtol=1e-12)
    assert dynamics.model.opt.timestep == mujoco.model.opt.timestep  # nothing of the engine has changed


def test_without_the_library_it_says_so(monkeypatch, tmp_path):
    monkeypatch.setattr(calls.mujoco, "__file__", str(tmp_path / "mujoco" / "__init__.py"))
    assert MinimalCalls.unavailable() == "MuJoCo's library was not found beside its package"
