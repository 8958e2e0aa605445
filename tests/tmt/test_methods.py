"""Methods of integration: their tableaus, their orders, their steps."""

import mpmath
import numpy as np
import pytest
from scipy.integrate import DOP853

import tmt
from tmt.compiled import runner
from tmt.methods import METHODS, RungeKutta, amplification, dop853, one_step
from tmt.methods.implicit import ImplicitRungeKutta

BENT = np.radians([30.0, 20.0, 60.0])
REST = np.zeros(3)
FIXED = [name for name, stepping in METHODS.items() if not stepping.adaptive]
ORDERS = {name: METHODS[name].order for name in FIXED} | {"rk4_mean_speed": 4}  # of hinges; with balls see test_joints
IMPLICIT = [name for name, stepping in METHODS.items() if stepping.solves_stages]


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


def test_the_coefficients_of_dop853_are_those_of_scipy():
    assert len(dop853.A) == DOP853.n_stages
    assert all(np.array_equal(row, DOP853.A[i, :i]) for i, row in enumerate(dop853.A))
    assert np.array_equal(dop853.B, DOP853.B) and np.array_equal(dop853.C, DOP853.C)
    # SciPy's have a weight for the slope at the end of the step, zero
    assert np.array_equal([*dop853.ERROR_5, 0.0], DOP853.E5) and np.array_equal([*dop853.ERROR_3, 0.0], DOP853.E3)


@pytest.mark.parametrize("name", FIXED)
def test_order(name):
    """One step against two halves: what they differ by falls with dt to the power of order + 1."""
    implicit = name in IMPLICIT  # those take long in many digits, and doubles will do at larger steps
    number, large = (float, 0.04) if implicit else (mpmath.mpf, mpmath.mpf("0.01"))
    rest, start = [number(0)] * 3, [number(float(a)) for a in BENT]

    def after(steps, duration):
        state = start, rest
        for _ in range(steps):
            state = one_step(METHODS[name], tmt.ARM, *state, rest, duration / steps)
        return np.concatenate(state)

    with mpmath.workdps(50):
        coarse, fine = (max(abs(after(1, dt) - after(2, dt))) for dt in (large, large / 2))
        assert float(mpmath.log(coarse / fine, 2)) - 1 == pytest.approx(ORDERS[name], abs=0.3 if implicit else 0.15)


def test_an_adaptive_method_keeps_to_its_tolerance():
    _, *exact = tmt.simulate(BENT, REST, REST, 1 / 4096, 4096, "dopri8")
    errors = []
    for tolerance in (1e-4, 1e-6, 1e-8, 1e-10, 1e-12):
        _, *path = tmt.simulate(BENT, REST, REST, 0.25, 4, "dopri8_adaptive", tolerance=tolerance)
        errors.append(max(np.abs(a[-1] - b[-1]).max() for a, b in zip(path, exact)))
        assert 0.0 < errors[-1] < 100 * tolerance
    assert errors[0] > 1e6 * errors[-1]


@pytest.mark.parametrize("name", [name for name in FIXED if name != "gauss_legendre_4"])
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


@pytest.mark.parametrize("name", IMPLICIT)
@pytest.mark.parametrize("dt", [1.0, 10.0])
def test_newton_finds_the_stages_of_a_held_arm_at_large_steps(name, dt):
    q, qd = (path[-1] for path in tmt.simulate(BENT + 0.1, REST, tmt.gravity_balance(BENT), dt, 500, name)[1:])
    assert np.isfinite([q, qd]).all() and np.abs(q - BENT).max() < 2.0


@pytest.mark.parametrize("name", IMPLICIT)
def test_every_evaluation_of_an_implicit_method_is_counted(name):
    counted, stepping, state = 0, METHODS[name], (BENT.tolist(), [1.0, 2.0, 3.0])

    def slope(q, qd):
        nonlocal counted
        counted += all(isinstance(x, float) for x in (*q, *qd))  # else for the Jacobian, which belongs to an evaluation
        return stepping.slope(tmt.ARM, q, qd, [0.0] * 3, 0.1)

    for _ in range(4):
        state = stepping.step(slope, *state, 0.1)
    path = np.full((2, 1, 5, 3), np.nan)
    path[:, 0, 0] = BENT, [1.0, 2.0, 3.0]
    evaluations = runner(tmt.ARM, name)(*path, np.zeros((1, 3)), 0.1)
    assert np.allclose(path[:, 0, -1], state, rtol=0, atol=1e-12)
    # over any scalar the stages are found once more, for the sake of their derivatives; compiled code counts the
    # linear equations that it starts from, which are made of dual numbers: as many in each step
    assert evaluations == counted
