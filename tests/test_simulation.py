"""What simulate gives back: motions, and why a run ended."""

import copy
import dataclasses
import pickle
import warnings
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context

import numpy as np
import pytest

import tmt
from compare.judge.rounding import band
from tmt.methods import METHODS, one_step
from tmt.simulation import FORMS, singular_in

BENT = np.radians([30.0, 20.0, 60.0])
REST = np.zeros(3)


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


def test_an_adaptive_method_ends_where_it_cannot_go_on():
    _, q, _ = tmt.simulate(BENT, [1e200, 0.0, 0.0], REST, 0.1, 3, "dopri8_adaptive")
    assert np.isfinite(q[0]).all() and np.isnan(q[1:]).all()
    _, q, _ = tmt.simulate(BENT, REST, REST, 0.1, 3, "dopri8_adaptive", tolerance=1e-300)
    assert np.isnan(q[1:]).all()


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


@pytest.mark.parametrize("form", [*FORMS])
@pytest.mark.parametrize("name", ["overflow", "diverged", "turned"])
def test_every_form_says_the_same_of_an_end(name, form):
    method, start, more, says = ENDS[name]
    motion = tmt.simulate(*start, **({"dt": 0.1, "steps": 200, "method": method} | more), form=form)
    assert motion.form == form and says in motion.ended


@pytest.mark.parametrize("method, start, more, says", ENDS.values(), ids=ENDS)
def test_a_run_says_why_it_ended(method, start, more, says):
    # the loops take the library's sine far out, so that there a hinge turns where here numbers overflow
    arguments = {"dt": 0.1, "steps": 200, "method": method, "form": "straight_line"} | more
    dt = arguments["dt"]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        motion = tmt.simulate(*start, **arguments)
    last = int(np.isfinite(motion.q).all(axis=1).sum()) - 1
    assert motion.ended.startswith(f"at t = {last * dt:g} s: ") and says in motion.ended and "\n" not in motion.ended
    assert 0 <= last < 200 and np.isnan(motion.q[last + 1 :]).all() and np.isnan(motion.qd[last + 1 :]).all()


def test_in_a_batch_each_run_says_why_it_ended():
    qd = np.zeros((2, 20, 3))
    qd[1, 3], qd[0, 4] = 1e8, np.nextafter(np.inf, 0)
    single = tmt.simulate(BENT, qd, REST, 0.01, 30, form="straight_line")
    assert single.ended.shape == (2, 20)
    assert {place for place in np.ndindex(2, 20) if single.ended[place]} == {(1, 3), (0, 4)}
    for form in FORMS:
        other = tmt.simulate(BENT, qd, REST, 0.01, 30, form=form)
        assert other.form == form and np.array_equal(other.ended != None, single.ended != None)  # noqa: E711
        if form.startswith("straight"):
            assert np.array_equal(other.ended, single.ended)


def test_a_motion_is_three_arrays_and_more():
    motion = tmt.simulate(BENT, REST, REST, 0.1, 5)
    t, q, qd = motion
    assert len(motion) == 3 and motion[0] is motion.t is t and q is motion.q and qd is motion.qd
    assert isinstance(motion, tuple) and motion.ended is None and motion.evaluations == 20
    batch = tmt.simulate([[BENT, BENT]], [[REST, [1e200] * 3]], REST, 0.1, 5)
    assert len(batch) == 3 and batch.evaluations == 4 * (5 + 1)
    assert batch.ended.shape == (1, 2) and batch.ended[0, 0] is None and "turns by 2^49 rad" in batch.ended[0, 1]


COPIES = {
    "copied": copy.copy,
    "deeply": copy.deepcopy,
    **{
        f"protocol {k}": lambda motion, k=k: pickle.loads(pickle.dumps(motion, k)) for k in (2, pickle.HIGHEST_PROTOCOL)
    },
}


@pytest.mark.parametrize("copied", COPIES.values(), ids=COPIES)
def test_a_copy_of_a_motion_is_whole(copied):
    for motion in (
        tmt.simulate(BENT, REST, REST, 0.1, 5),
        tmt.simulate(BENT, [1e200] * 3, REST, 0.1, 5),
        tmt.simulate([BENT, BENT], [REST, [1e200] * 3], REST, 0.1, 5),
    ):
        again = copied(motion)
        assert type(again) is tmt.Motion and again.evaluations == motion.evaluations
        assert np.array_equal(again.ended, motion.ended) and type(again.ended) is type(motion.ended)
        assert all(np.array_equal(a, b, equal_nan=True) for a, b in zip(again, motion, strict=True))


def test_a_motion_goes_from_process_to_process():
    with ProcessPoolExecutor(1, get_context("spawn")) as pool:
        motion = pool.submit(tmt.simulate, [BENT, BENT], [REST, [1e200] * 3], REST, 0.1, 5).result()
    assert motion.evaluations == 24 and motion.ended[0] is None and "turns by 2^49 rad" in motion.ended[1]


@pytest.mark.parametrize("name", METHODS)
def test_evaluations_are_counted(name):
    """Those of a method that solves its stages, one by one: see test_methods."""
    stepping, steps = METHODS[name], 7
    one = tmt.simulate(BENT, REST, REST, 0.1, steps, name).evaluations
    assert type(one) is int and tmt.simulate([BENT, BENT], REST, REST, 0.1, steps, name).evaluations == 2 * one
    if stepping.adaptive:
        assert one >= steps * stepping.stages and one % stepping.stages == 0
    elif stepping.solves_stages:
        assert one > steps * stepping.stages and (one - steps) % stepping.stages == 0
    else:
        assert one == steps * stepping.stages


def test_the_last_state_of_a_run_is_looked_at():
    """The rates change most at the start, and the last state is the one at which Mbar is singular."""
    q, qd = np.array([[0.5, 1.0, 1.0], [0.5, 0.5, 1.0], [0.5, 0.0, 1.0]]), np.zeros((3, 3))
    qd[1:] = 1.0
    place, why = singular_in(wrist(), q, qd)
    assert place == 2 and why.startswith("Mbar is singular: hinges 'a', 'c' turn")
    assert singular_in(wrist(), q[:2], qd[:2]) is None


# the true motion as a method


def test_taylor_is_the_true_motion_of_each_run(rng):
    starts, tau = rng.uniform(-1, 1, (2, 3)), rng.uniform(-1, 1, (2, 3))
    motion = tmt.simulate(starts, REST, tau, 0.1, 5, "taylor")
    assert motion.q.shape == (2, 6, 3) and motion.ended.tolist() == [None, None] and motion.evaluations >= 2
    for run in range(2):
        near = tmt.simulate(starts[run], REST, tau[run], 0.1 / 256, 5 * 256, "dopri8")
        assert np.abs(near.q[::256] - motion.q[run]).max() < 1e-13 and np.array_equal(near.t[::256], motion.t)
    assert np.array_equal(motion.q[:, 0], starts)
    single = tmt.simulate(starts[1], REST, tau[1], 0.1, 5, "taylor")
    assert np.array_equal(single.q, motion.q[1]) and single.ended is None


def test_taylor_takes_a_tolerance():
    exact, coarse = (tmt.simulate(BENT, REST, REST, 0.1, 5, "taylor", tolerance=t) for t in (None, 1e-10))
    assert coarse.evaluations < exact.evaluations and 0.0 < np.abs(coarse.q - exact.q).max() < 1e-7


def test_taylor_ends_with_a_reason():
    motion = tmt.simulate(BENT, [1e200, -1e200, 0.0], REST, 0.1, 5, "taylor")
    assert motion.ended.startswith("at t = 0 s numbers overflow") and np.isnan(motion.q[1:]).all()
    assert np.array_equal(motion.q[0], BENT)
    stiff = dataclasses.replace(tmt.ARM, damping=(1e6, 0.0, 0.0))
    assert "a series takes steps of" in tmt.simulate(BENT, REST, REST, 0.1, 5, "taylor", stiff).ended
