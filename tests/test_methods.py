"""Integration: tableaus, orders, and what simulate gives back."""

import dataclasses
import pickle
import warnings

import mpmath
import numpy as np
import pytest

import tmt
from compare.judge.rounding import band
from tmt import dop853, kernels
from tmt.implicit import ImplicitRungeKutta
from tmt.methods import METHODS, AdaptiveRungeKutta, RungeKutta, amplification, one_step
from tmt.simulation import singular_in

BENT = np.radians([30.0, 20.0, 60.0])
REST = np.zeros(3)


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


FIXED = [name for name, stepping in METHODS.items() if not isinstance(stepping, AdaptiveRungeKutta)]


@pytest.mark.parametrize("name", FIXED)
def test_order(name):
    """One step against two halves, in 50 digits: what they differ by falls with dt to the power of order + 1."""
    rest, start = [mpmath.mpf(0)] * 3, [mpmath.mpf(float(a)) for a in BENT]

    def after(steps, duration):
        state = start, rest
        for _ in range(steps):
            state = one_step(METHODS[name], tmt.ARM, *state, rest, duration / steps)
        return np.concatenate(state)

    with mpmath.workdps(50):
        coarse, fine = (max(abs(after(1, dt) - after(2, dt))) for dt in (mpmath.mpf("0.01"), mpmath.mpf("0.005")))
        assert float(mpmath.log(coarse / fine, 2)) - 1 == pytest.approx(METHODS[name].order, abs=0.15)


@pytest.mark.parametrize("name", FIXED)
def test_energy_drift_falls_with_the_order(name):
    drifts = []
    order = METHODS[name].order
    for steps in {1: (1024, 2048, 4096), 2: (128, 256, 512), 4: (128, 256, 512), 8: (32, 64, 128)}[order]:
        _, q, qd = tmt.simulate(BENT, REST, REST, 1.0 / steps, steps, name)
        energy = tmt.energy(q, qd)
        assert np.ptp(tmt.potential_energy(q)) > 0.5
        drifts.append(np.abs(energy - energy[0]).max())
    assert drifts[2] > 0.0
    assert np.log2(drifts[0] / drifts[2]) / 2 > order - 0.3


def test_an_adaptive_method_keeps_to_its_tolerance():
    _, *exact = tmt.simulate(BENT, REST, REST, 1 / 4096, 4096, "dopri8")
    errors = []
    for tolerance in (1e-4, 1e-6, 1e-8, 1e-10, 1e-12):
        _, *path = tmt.simulate(BENT, REST, REST, 0.25, 4, "dopri8_adaptive", tolerance=tolerance)
        errors.append(max(np.abs(a[-1] - b[-1]).max() for a, b in zip(path, exact)))
        assert 0.0 < errors[-1] < 100 * tolerance
    assert errors[0] > 1e6 * errors[-1]


def test_an_adaptive_method_ends_where_it_cannot_go_on():
    _, q, _ = tmt.simulate(BENT, [1e200, 0.0, 0.0], REST, 0.1, 3, "dopri8_adaptive")
    assert np.isfinite(q[0]).all() and np.isnan(q[1:]).all()
    _, q, _ = tmt.simulate(BENT, REST, REST, 0.1, 3, "dopri8_adaptive", tolerance=1e-300)
    assert np.isnan(q[1:]).all()


def test_shapes_and_start():
    t, q, qd = tmt.simulate(BENT, REST, REST, 5 / 64, 64)
    assert t.shape == (65,) and q.shape == qd.shape == (65, 3)
    assert t[-1] == 5.0
    assert np.array_equal(q[0], BENT) and np.array_equal(qd[0], REST)
    assert np.abs(q[-1] - BENT).max() > 0.1


def test_a_batch_of_runs_is_each_run(rng):
    starts = rng.uniform(-1, 1, (2, 3, 3))
    _, q, qd = tmt.simulate(starts, REST, REST, 0.01, 20)
    assert q.shape == (2, 3, 21, 3)
    _, single_q, single_qd = tmt.simulate(starts[1, 2], REST, REST, 0.01, 20)
    assert np.array_equal(q[1, 2], single_q) and np.array_equal(qd[1, 2], single_qd)


def test_a_diverged_run_is_nan_from_there_on():
    _, q, _ = tmt.simulate(BENT, [1e3, 1e3, 1e3], REST, 10.0, 200)
    finite = np.isfinite(q).all(axis=1)
    assert finite[0] and not finite[-1]
    assert not finite[np.argmin(finite) :].any()


def test_damping_takes_energy():
    damped = dataclasses.replace(tmt.ARM, damping=(0.5, 0.5, 0.5))
    _, q, qd = tmt.simulate(BENT, REST, REST, 1e-3, 2000, model=damped)
    energy = tmt.energy(q, qd)
    assert (np.diff(energy) <= 0.0).all() and energy[0] - energy[-1] > 0.1


def test_the_assignments_bent_posture_holds():
    tau = tmt.gravity_balance(BENT)
    _, q, qd = tmt.simulate(BENT, REST, tau, 5 / 64, 64)
    width = band(METHODS["rk4"], tmt.ARM, q, qd, tau, 5 / 64)
    assert (np.abs(q - BENT) <= width[:, :3]).all()


@pytest.mark.parametrize("name", FIXED)
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


IMPLICIT = [name for name, stepping in METHODS.items() if isinstance(stepping, ImplicitRungeKutta)]


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
    evaluations = kernels.stepper(tmt.ARM, name)(*path, np.zeros((1, 3)), 0.1)
    assert np.allclose(path[:, 0, -1], state, rtol=0, atol=1e-12)
    # over any scalar the stages are found once more, for the sake of their derivatives
    assert evaluations == counted - 4 * len(stepping.b)


def test_where_newton_fails_the_run_is_nan_and_says_so():
    motion = tmt.simulate(BENT, REST, REST, 0.5, 20, "implicit_midpoint")
    last = np.isfinite(motion.q).all(axis=1).sum() - 1
    assert 0 < last < 20 and np.abs(motion.qd[last]).max() < 1e3  # finite and modest until there
    assert motion.ended == f"at t = {last * 0.5:g} s: Newton's method does not find the stages of a step of 0.5 s"
    with pytest.raises(ArithmeticError, match=r"dt = 0\.5 s"):
        one_step(METHODS["implicit_midpoint"], tmt.ARM, list(motion.q[last]), list(motion.qd[last]), [0.0] * 3, 0.5)


def wrist(damping=0.0):
    """Three hinges through one point, z y z: Mbar is singular where the second is at zero."""
    return tmt.Tree(
        hinge_names=("a", "b", "c"), parent=(-1, 0, 1), offset=np.zeros((3, 3)), axis=((0, 0, 1), (0, 1, 0), (0, 0, 1)),
        damping=[damping] * 3, body_names=["hand"], body_hinge=[2], mass=[1.0], com=[(0.1, 0.0, 0.2)],
        inertia=[np.diag([0.01, 0.02, 0.025])], gravity=(0, 0, -9.81),
    )  # fmt: skip


def test_acceleration_at_a_singular_state_says_so():
    says = r"Mbar is singular at q = \(0.5, 0, 1\) rad: hinges 'a', 'c' turn together without moving any mass"
    with pytest.raises(ValueError, match=says):
        tmt.acceleration([[0.5, 0.1, 1.0], [0.5, 0.0, 1.0]], REST, REST, wrist())
    assert np.abs(tmt.acceleration([0.5, 1e-3, 1.0], REST, REST, wrist())).max() < 1e6


FAST = 2.0**49 - 1.0
ENDS = {
    "overflow": ("rk4", (BENT, REST, [1e308] * 3), {}, "diverges"),
    "diverged": ("rk4", (BENT, [1e3] * 3, REST), {"dt": 10.0}, "diverges: within a step"),
    "turned": ("rk4", ([FAST, 0, 0], [50, 0, 0], REST), {}, "turns by 2^49 rad"),
    "adaptive, turned": ("dopri8_adaptive", ([FAST, 0, 0], [50, 0, 0], REST), {}, "turns by 2^49 rad"),
    "adaptive, overflow": ("dopri8_adaptive", (BENT, REST, [1e308] * 3), {}, "diverges"),
    "too small a tolerance": (
        "dopri8_adaptive",
        (BENT, REST, REST),
        {"tolerance": 1e-300},
        "tolerance of 1e-300 would need",
    ),
    "no stages": ("gauss_legendre_4", (BENT, [20] * 3, REST), {"dt": 1.0}, "Newton's method does not find the stages"),
    "singular": ("rk4", ([0.5, 0, 1], [1, 0, 0], REST), {"model": wrist()}, "Mbar is singular: hinges 'a', 'c' turn"),
}


@pytest.mark.parametrize("method, start, more, says", ENDS.values(), ids=ENDS)
def test_a_run_says_why_it_ended(method, start, more, says):
    arguments = {"dt": 0.1, "steps": 200, "method": method} | more
    dt = arguments["dt"]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        motion = tmt.simulate(*start, **arguments)
    last = int(np.isfinite(motion.q).all(axis=1).sum()) - 1
    assert motion.ended.startswith(f"at t = {last * dt:g} s: ") and says in motion.ended and "\n" not in motion.ended
    assert 0 <= last < 200 and np.isnan(motion.q[last + 1 :]).all() and np.isnan(motion.qd[last + 1 :]).all()


def test_in_a_batch_each_run_says_why_it_ended(rng, monkeypatch):
    qd = np.zeros((2, 20, 3))
    qd[1, 3], qd[0, 4] = 1e8, np.nextafter(np.inf, 0)
    single = tmt.simulate(BENT, qd, REST, 0.01, 30)
    assert single.ended.shape == (2, 20)
    assert {place for place in np.ndindex(2, 20) if single.ended[place]} == {(1, 3), (0, 4)}
    monkeypatch.setattr(kernels, "WORTH", 1)
    lanes = tmt.simulate(BENT, qd, REST, 0.01, 30)
    assert np.array_equal(lanes.ended, single.ended)
    large = tmt.simulate(BENT, qd, REST, 0.01, 30, model=tmt.ARM)
    monkeypatch.setattr(kernels, "TRACED", 2)
    large = tmt.simulate(BENT, qd, REST, 0.01, 30)
    assert np.array_equal(large.ended != None, single.ended != None)  # noqa: E711


def test_a_motion_is_three_arrays_and_more():
    motion = tmt.simulate(BENT, REST, REST, 0.1, 5)
    t, q, qd = motion
    assert len(motion) == 3 and motion[0] is motion.t is t and motion[1:] == (motion.q, motion.qd) and q is motion.q
    assert motion.ended is None and motion.evaluations == 20
    again = pickle.loads(pickle.dumps(motion))
    assert again.evaluations == 20 and np.array_equal(again.qd, qd)
    assert tmt.simulate([BENT, BENT], REST, REST, 0.1, 5, "implicit").evaluations == 10


def test_a_method_that_is_replaced_is_used_at_once(monkeypatch):
    before, euler = (tmt.simulate(BENT, REST, REST, 0.01, 5, name).q for name in ("rk4", "semi_implicit_euler"))
    monkeypatch.setitem(METHODS, "rk4", METHODS["semi_implicit_euler"])
    assert np.array_equal(tmt.simulate(BENT, REST, REST, 0.01, 5, "rk4").q, euler)
    for made in (kernels.slope_source, kernels.lane_stepper):
        assert made(tmt.ARM, "rk4") == made(tmt.ARM, "semi_implicit_euler")
    monkeypatch.undo()
    assert np.array_equal(tmt.simulate(BENT, REST, REST, 0.01, 5).q, before) and not np.array_equal(before, euler)
    monkeypatch.setitem(METHODS, "rk4", "no method")
    with pytest.raises(ValueError, match=r"METHODS\['rk4'\] is 'no method'"):
        tmt.simulate(BENT, REST, REST, 0.01, 5)


def test_the_coefficients_of_dop853_are_those_of_scipy():
    from scipy.integrate import DOP853

    assert (
        all(np.array_equal(row, DOP853.A[i, :i]) for i, row in enumerate(dop853.A)) and len(dop853.A) == DOP853.n_stages
    )
    assert np.array_equal(dop853.B, DOP853.B) and np.array_equal(dop853.C, DOP853.C)
    assert np.array_equal(dop853.ERROR_5, DOP853.E5[:-1]) and np.array_equal(dop853.ERROR_3, DOP853.E3[:-1])


def test_the_last_state_of_a_run_is_looked_at():
    """The rates change most at the start, and the last state is the one at which Mbar is singular."""
    q, qd = np.array([[0.5, 1.0, 1.0], [0.5, 0.5, 1.0], [0.5, 0.0, 1.0]]), np.zeros((3, 3))
    qd[1:] = 1.0
    place, why = singular_in(wrist(), q, qd)
    assert place == 2 and why.startswith("Mbar is singular: hinges 'a', 'c' turn")
    assert singular_in(wrist(), q[:2], qd[:2]) is None
