"""Orders of methods on a body that tumbles freely, against Jacobi's elliptic functions; errors and units of what turns."""

from types import SimpleNamespace

import numpy as np
import pytest
from models import PATHS

import tmt
from compare.engines.mujoco import engine, read
from compare.engines.scipy import Scipy
from compare.experiments.speed import settings, tumbling
from compare.judge.check import Result
from compare.judge.units import renamed, said, value
from compare.robots.file import robot_of
from compare.truth import reference
from compare.truth.free_body import free_turning


@pytest.fixture(scope="module")
def stone():
    """A body that tumbles, and its exact quaternions at nine times."""
    case = tumbling.stone().case("tumbling", posture=tumbling.QUATERNION, speed=tumbling.SPEEDS)
    times = np.linspace(0.0, tumbling.TUMBLED, tumbling.READ + 1)
    return case, free_turning(times, tumbling.MOMENTS, case.v, case.q)[1].astype(float)


def test_each_method_keeps_its_order_on_a_free_body(engines, stone):
    ours, theirs, (case, exact) = engines["tmt"], engine(read(tumbling.mjcf())), stone
    assert np.abs(tmt.mass_matrix(case.q, case.tree) - theirs.of(case).mass_matrix(case.q)).max() < 1e-17
    for of, name, within in (
        (ours, "rk4", 0.1), (ours, "dopri8", 0.5), (ours, "semi_implicit_euler", 0.05), (theirs, "RK4", 0.05)
    ):  # fmt: skip
        order, coarse, fine = tumbling.order_of(case, of, of.methods[name], exact)
        assert order == pytest.approx(of.methods[name].order, abs=within) and coarse == pytest.approx(2 * fine)


def test_an_order_that_a_method_has_not_fails(engines):
    ours, result = engines["tmt"], Result("speed")
    claims = {"rk4": ours.methods["rk4"]._replace(order=5)}
    table = tumbling.orders_on_a_body(result, {"tmt": SimpleNamespace(of=ours.of, methods=claims)})
    (failed,) = (check.scene for check in result.checks if not check.passed)
    assert failed.endswith("tmt rk4") and len(table) == len(result.checks) > 2


def test_a_coarse_run_of_scipy_has_quaternions_of_length_1(stone):
    case, exact = stone
    motion = Scipy().of(case).run(*case.start, case.tau, tumbling.TUMBLED / 8, 8, "RK45", tolerance=1e-2)
    assert np.abs(np.linalg.norm(motion.q, axis=1) - 1.0).max() < 1e-15
    assert np.abs(case.coordinates.difference(motion.q, exact)).max() > 1e-6


def test_an_adaptive_method_sees_the_errors_of_a_ball(stone):
    case, stepping = stone[0], tmt.METHODS["dopri8_adaptive"]

    def slope(q, qd):
        return stepping.slope(case.tree, q, qd, case.tau.tolist(), 0.1)

    *_, fifth, fifth_of_speeds, third, third_of_speeds = stepping.attempt(
        slope, case.q.tolist(), case.v.tolist(), 0.1, case.tree.coordinates
    )
    assert min(np.abs([fifth, fifth_of_speeds]).max(axis=1)) > 1e-9
    assert min(np.abs([third, third_of_speeds]).max(axis=1)) > 1e-7


def test_a_reference_in_doubles_measures_turns_and_no_quaternions():
    case = settings.regular_of(robot_of(read(PATHS["free_body"]), "free_body.xml"))
    known = reference.in_doubles(case)
    assert known.error(-known.high[:, 3:7], [3]).max() < 1e-15  # -q is the same turn
    turned = case.coordinates.move(known.high[:, :7], [0.0, 0.0, 0.0, 0.0, 1e-3, 0.0])
    assert known.error(turned[:, 3:], [3]) == pytest.approx(1e-3)
    assert known.error(turned, range(4)) == pytest.approx(1e-3)


def test_columns_say_rad_only_of_what_is_in_rad():
    rows = [{"scene": "s", "worst_error_rad": 0.5}]
    assert renamed(rows, "rad") == rows and value(rows[0], "worst_error") == 0.5
    (other,) = renamed(rows, "rad or m")
    assert other == {"scene": "s", "worst_error": 0.5, "unit": "rad or m"} and value(other, "worst_error") == 0.5
    assert said("0.1 rad, target_rad", "rad or m") == "0.1 rad or m, target"
