"""SciPy's solvers where the slope is not finite: they would try ever smaller steps without end."""

import numpy as np
import pytest

from compare.engines import Setting
from compare.engines.scipy import Scipy, ScipyDynamics
from compare.robots.arm import ARM

END = 10.3  # rad: beyond there is no slope


class Bursting(ScipyDynamics):
    """A hinge that turns evenly, as far as END."""

    def rate(self):
        return lambda y, tau: np.array([y[1], 0.0 if y[0] < END else np.nan])


@pytest.mark.parametrize("method", Scipy.methods)
def test_a_run_goes_as_far_as_its_slope_is_finite(method):
    dynamics = Bursting(ARM.case(locked=("alpha", "beta")))
    q, v, tau = np.zeros(1), np.ones(1), np.zeros(1)
    run, read = dynamics.prepare(q, v, tau, Setting(32.0, None, 1e-3), method)
    for motion in (dynamics.run(q, v, tau, 0.5, 64, method, 1e-3), read(run())):
        reached = int(np.isfinite(motion.q[:, 0]).sum())
        assert 2 <= reached <= 21 and np.isnan(motion.q[reached:]).all() and np.isnan(motion.v[reached:]).all()
        assert np.allclose(motion.q[:reached, 0], motion.t[:reached])
        assert motion.ended == f"at t = {motion.t[reached - 1]:g} s: its slope is not finite" and motion.evaluations > 1
