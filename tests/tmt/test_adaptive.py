"""Runs of the adaptive method: their error and cost beside SciPy's DOP853, what it refuses, its limits, and interruptions."""

import signal
import threading
import time
from dataclasses import replace

import numpy as np
import pytest
from helpers.trees import one_body, random_state, small_tree, wrist
from scipy.integrate import solve_ivp

import tmt
from tmt import simulation
from tmt.compiled import runner
from tmt.exact.motion import trajectory

BENT, Z = np.array([0.5, 0.3, 1.0]), np.zeros(3)
ADAPTIVE = "dopri8_adaptive"
STAGES = 12


def of_scipy(tree, q, qd, tau, duration, tolerance):
    """The state at the end by SciPy's DOP853 of speeds and accelerations, and its evaluations."""
    nq = len(q)
    tmt.prepare(tree, "acceleration")

    def rates(_, x):
        p, v = x[:nq], x[nq:]
        return [
            *tree.coordinates.component_rates(p.tolist(), v.tolist()),
            *tmt.acceleration(tree, p / length(p), v, tau),
        ]

    def length(p):
        norms = np.ones(nq)
        for ball in tree.coordinates.balls:
            norms[ball.q] = np.linalg.norm(p[ball.q])
        return norms

    found = solve_ivp(rates, (0.0, duration), [*q, *qd], "DOP853", rtol=tolerance, atol=tolerance)
    return found.y[:, -1], found.nfev


@pytest.mark.parametrize("tree", [tmt.ARM, small_tree()], ids=["arm", "kinds"])
@pytest.mark.parametrize("tolerance", [1e-5, 1e-8, 1e-11])
def test_its_error_and_evaluations_are_those_of_dop853(tree, tolerance):
    """Within a factor of 20 and of 1.3: the norm of an error is another, and so is the first step."""
    q, qd, tau = random_state(np.random.default_rng(4), tree)
    truth = trajectory(tree, q, qd, tau, 1.0, 1).high[-1]
    motion = tmt.simulate(tree, q, qd, tau, 1.0, 1, ADAPTIVE, tolerance)
    theirs, evaluations = of_scipy(tree, q, qd, tau, 1.0, tolerance)
    errors = [np.abs(x - truth).max() for x in (np.concatenate([motion.q[-1], motion.qd[-1]]), theirs)]
    assert errors[1] / 20.0 <= errors[0] <= 20.0 * errors[1]
    assert evaluations / 1.3 <= motion.evaluations <= 1.3 * evaluations
    assert motion.evaluations % STAGES == 0


def test_a_step_whose_error_is_no_number_is_refused():
    """Springs of 1e4 N m/rad: the stages of a first step of dt / 8 overflow. SciPy's answer is that of its smaller steps."""
    stiff = replace(tmt.ARM, stiffness=(1e4,) * 3)
    motion = tmt.simulate(stiff, BENT, Z, Z, 0.5, 1, ADAPTIVE)
    expected, evaluations = of_scipy(stiff, BENT, Z, Z, 0.5, 1e-9)
    assert motion.ended is None and np.abs(motion.q[-1] - expected[:3]).max() < 1e-5
    assert motion.evaluations < 2.0 * evaluations


def test_its_evaluations_have_a_limit(monkeypatch):
    """That of a run: one that needs just as many goes on, one that needs one step more ends; the others do not."""
    starts = np.array([BENT, Z, -BENT])
    free = tmt.simulate(tmt.ARM, starts, Z, Z, 0.1, 20, ADAPTIVE, tolerance=1e-12)
    alone = [
        tmt.simulate(tmt.ARM, start, Z, Z, 0.1, 20, ADAPTIVE, tolerance=1e-12).evaluations for start in starts
    ]
    assert free.evaluations == sum(alone)
    for limit, ends in ((max(alone) + 1, 0), (max(alone), 1), (min(alone), 3)):
        monkeypatch.setattr(runner, "MOST_EVALUATIONS", limit)
        motion = tmt.simulate(tmt.ARM, starts, Z, Z, 0.1, 20, ADAPTIVE, tolerance=1e-12)
        why = [reason for reason in motion.ended if reason]
        assert len(why) == ends and all("evaluations" in reason for reason in why)
        assert motion.evaluations <= 3 * limit + STAGES * 3


LONG = {  # runs of minutes
    "adaptive": (BENT, 1e6, 1, {"method": ADAPTIVE}),
    "rk4": (BENT, 1e-9, 2 * 10**9, {"every": 10**9}),
    "side by side": (np.tile(BENT, (64, 1)), 1e-9, 10**9, {"every": 10**9}),
    "implicit stages": (BENT, 1e-6, 10**9, {"method": "implicit_midpoint", "every": 10**9}),
    "may be singular": (BENT, 1e-6, 10**9, {"model": wrist(), "every": 10**9}),
}


@pytest.mark.parametrize("q, dt, steps, more", LONG.values(), ids=LONG)
def test_ctrl_c_interrupts_a_run(q, dt, steps, more, monkeypatch):
    monkeypatch.setattr(runner, "MOST_EVALUATIONS", 10**12)
    model, more = more.get("model", tmt.ARM), {name: x for name, x in more.items() if name != "model"}
    tmt.simulate(model, q, Z, Z, 1e-3, 2, **more | {"every": 1})  # is compiled
    main = threading.main_thread().ident
    timer = threading.Timer(0.1, signal.pthread_kill, (main, signal.SIGINT))
    begun = time.perf_counter()
    timer.start()
    with pytest.raises(KeyboardInterrupt):
        tmt.simulate(model, q, Z, Z, dt, steps, **more)
    assert time.perf_counter() - begun < 20.0
    assert tmt.simulate(model, q, Z, Z, 1e-3, 2, **more | {"every": 1}).evaluations > 0


@pytest.mark.parametrize("method", ["rk4", ADAPTIVE])
def test_where_mbar_may_be_singular_blocks_of_steps_and_runs_have_the_bits_of_a_whole_run(
    method, monkeypatch
):
    tree, q, qd = wrist(), [0.5, 0.8, 1.0], [0.3, 0.0, -0.2]
    whole = tmt.simulate(tree, q, qd, Z, 1e-3, 60, method)
    monkeypatch.setattr(simulation, "STATES", 7)
    few = tmt.simulate(tree, q, qd, Z, 1e-3, 60, method, every=20)
    assert np.array_equal(few.q, whole.q[::20]) and np.array_equal(few.qd, whole.qd[::20])
    assert few.ended is whole.ended is None and few.evaluations == whole.evaluations
    starts = np.array([[0.5, 0.0, 1.0], q, q, [0.5, 0.0, 1.0]])
    many = tmt.simulate(tree, starts, qd, Z, 1e-3, 60, method)
    assert [k for k in range(4) if many.ended[k]] == [0, 3] and "'a', 'c'" in many.ended[0]
    assert np.array_equal(many.q[2], whole.q) and np.isnan(many.q[3, 1:]).all()
    late = tmt.simulate(tree, q, [1.0, 0.0, 0.0], [1e3] * 3, 0.01, 40, "rk4")
    assert late.ended.startswith("at t = 0.02 s")  # from the start, not from that of a block


def test_a_motion_of_one_unit_takes_the_steps_that_its_error_wants():
    """A slide under a constant force has no error at all, and grows its steps sixfold from an eighth of dt."""
    slide = one_body([(0, 0, 1)], ["slide"], com=(0, 0, 0.1))
    motion = tmt.simulate(slide, [0.0], [1.0], [2.0], 1.0, 1, ADAPTIVE)
    fallen = [1.0 + (2.0 - 9.81) / 2.0, 1.0 + 2.0 - 9.81]
    assert np.abs(np.concatenate([motion.q[-1], motion.qd[-1]]) - fallen).max() < 1e-14
    assert motion.evaluations == 3 * STAGES  # 1 / 8 s, then the rest in pieces of at most 6 / 8 s


def test_errors_are_relative_to_the_larger_end_of_a_step():
    """A spring that pulls a slide from 0 to 2000 m: SciPy takes the larger of both too."""
    tree = one_body([(1, 0, 0)], ["slide"], stiffness=[100.0], rest=[1000.0], gravity=(0.0, 0.0, 0.0))
    motion = tmt.simulate(tree, [0.0], [0.0], [0.0], 0.3, 1, ADAPTIVE, 1e-10)
    _, evaluations = of_scipy(tree, np.zeros(1), np.zeros(1), np.zeros(1), 0.3, 1e-10)
    assert abs(motion.q[-1, 0] - 1000.0 * (1.0 - np.cos(3.0))) < 1e-5
    assert evaluations / 1.3 <= motion.evaluations <= 1.3 * evaluations
