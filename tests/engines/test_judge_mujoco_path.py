"""What is read of a run of MuJoCo."""

import numpy as np

from compare.robots.arm import ARM


def test_a_run_is_no_number_from_the_step_at_which_its_clock_stands(mujoco):
    dynamics = mujoco.of(ARM.case())
    states = np.ones((1, 4, 7))
    states[0, :, 0] = [0.1, 0.2, 0.2, 0.3]
    start = np.zeros((1, 7))
    q, _, ended = dynamics.path(start, states.copy(), 0.1)
    assert np.isfinite(q[0]).all(axis=1).tolist() == [True, True, True, False, False]
    assert ended[0] == "at t = 0.2 s: MuJoCo's clock stands"
    states[0, 1, 5] = np.inf
    _, v, ended = dynamics.path(start, states, 0.1)
    assert np.isfinite(v[0]).all(axis=1).tolist() == [True, True, False, False, False]
    assert ended[0] == "at t = 0.1 s: a number is not finite"
