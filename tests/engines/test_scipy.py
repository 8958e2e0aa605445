"""SciPy's solvers: they are solve_ivp's; and where the slope is not finite, they would try ever smaller steps without end."""

import numpy as np
import pytest
from helpers.edited import setup_of_file
from models import PATHS
from scipy.integrate import solve_ivp

import tmt
from compare.engines import Setting
from compare.engines.scipy import Scipy, ScipyDynamics
from compare.robots.arm import ARM


class Bursting(ScipyDynamics):
    """A hinge that turns evenly, as far as 10.3 rad."""

    def rate(self):
        return lambda y, tau: np.array([y[1], 0.0 if y[0] < 10.3 else np.nan])


@pytest.mark.parametrize("method", Scipy.methods)
def test_a_run_ends_where_its_slope_is_not_finite(method):
    dynamics = Bursting(ARM.case(locked=("alpha", "beta")))
    q, v, tau = np.zeros(1), np.ones(1), np.zeros(1)
    run, read = dynamics.prepare(q, v, tau, Setting(32.0, None, 1e-3), method)
    for motion in (dynamics.run(q, v, tau, 0.5, 64, method, 1e-3), read(run())):
        assert motion.q[0] == 0.0 and np.isnan([motion.q[1:], motion.v[1:]]).all()
        assert motion.ended.startswith("at t = 0 s: its slope")


@pytest.mark.parametrize("method, tolerance", [*zip(Scipy.methods, [1e-3] * 4), ("DOP853", 1e-15)])
def test_a_run_is_that_of_solve_ivp_by_this_method_with_this_tolerance(method, tolerance):
    dynamics, case = ScipyDynamics(ARM.case()), ARM.case(posture="bent")
    rate, options = dynamics.rate(), {"rtol": max(tolerance, 2.3e-14), "atol": tolerance}
    options |= {"method": method, "t_eval": np.linspace(0.0, 0.05, 3)}
    known = solve_ivp(lambda t, y: rate(y, np.ones(3)), (0.0, 0.05), [*case.q, *case.v], **options)
    motion = dynamics.run(*case.start, np.ones(3), 0.025, 2, method, tolerance)
    assert np.array_equal(motion.q, known.y[:3].T) and np.array_equal(motion.v, known.y[3:].T)
    assert motion.evaluations == known.nfev


def test_balls_are_followed_and_have_quaternions_of_length_1():
    robot, speed = setup_of_file(PATHS["pendulum_ball"]).robot, (40.0, -30.0, 20.0, 10.0, 0.0, 50.0)
    case = robot.case("let go", speed=speed)
    motion = ScipyDynamics(case).run(*case.start, case.tau, 1 / 64, 8, "DOP853", 1e-11)
    true = tmt.simulate(case.tree, *case.start, case.tau, 1 / 1024, 128, method="dopri8")
    assert np.abs(case.coordinates.difference(motion.q, true.q[::16])).max() < 1e-8
    coarse = ScipyDynamics(case).run(*case.start, case.tau, 1 / 4, 8, "RK45", 1e-2).q
    assert np.abs(np.linalg.norm(coarse[:, :4], axis=1) - 1.0).max() < 1e-15
