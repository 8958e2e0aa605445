"""What every engine promises: another one is one more parameter."""

import numpy as np
import pytest

import tmt
from compare.engines import GRID, Setting
from compare.engines.heyoka import Heyoka
from compare.engines.mujoco import Mujoco
from compare.engines.mujoco.calls import MinimalCalls
from compare.engines.scipy import Scipy
from compare.engines.tmt import Tmt
from compare.judge.scale import (
    EPS,
    FACTOR,
    acceleration_scale,
    bias_scale,
    condition,
    gravity_scale,
    mass_scale,
    reaches,
)
from compare.robots.arm import ARM
from tmt.exact.values import distance, exact

ENGINES = (Tmt, Mujoco, Scipy, Heyoka)
METHODS = [method for engine in (Tmt(), Mujoco, Scipy, Heyoka) for method in engine.methods.values()]
CASES = {
    "as it is": ARM.case(),
    "damped, weightless": ARM.case("floating", damping=0.4, gravity=False),
    "one joint locked": ARM.case("stiff", posture="bent", locked=("beta",), damping=0.1),
    "one joint free": ARM.case("swing", posture="bent", locked=("alpha", "beta")),
}
DURATION = 0.5  # s
# every method follows the case as it is; the others, which take time to compile, are followed by one of each engine
FOLLOWED = [
    (method, name)
    for method in METHODS
    for name in CASES
    if name == "as it is"
    or (method in [m for m in METHODS if m.engine == method.engine][:1] and name == "one joint locked")
    or (method.scheme == "semi_implicit_euler" and name == "damped, weightless")
]


@pytest.fixture(params=CASES)
def case(request):
    return CASES[request.param]


def available(engines, name):
    """The engine of that name; the test is left out where it cannot take part."""
    if reason := engines[name].unavailable():
        pytest.skip(reason)
    return engines[name]


@pytest.fixture(params=[*(engine.name for engine in ENGINES), "MuJoCo's minimal calls"])
def dynamics(request, engines, case):
    """The dynamics of a case in each engine, and by MuJoCo's minimal calls."""
    if request.param in engines:
        return available(engines, request.param).of(case)
    if reason := MinimalCalls.unavailable():
        pytest.skip(reason)
    return MinimalCalls(engines["mujoco"].of(case))


@pytest.fixture(params=FOLLOWED, ids=lambda pair: f"{pair[0].label}, {pair[1]}")
def followed(request, engines):
    """A method, a case, and the case in the method's engine."""
    method, name = request.param
    return method, CASES[name], available(engines, method.engine).of(CASES[name])


@pytest.fixture(params=METHODS, ids=lambda method: method.label)
def arm(request, engines):
    """A method, and the arm as it is in the method's engine."""
    return request.param, available(engines, request.param.engine).of(CASES["as it is"])


def test_quantities_are_those_of_50_digits(dynamics, case, rng):
    """Those that every engine has, and of the others what this one has."""
    n, tree = len(case.joints), case.tree
    q, v, tau = rng.uniform(-3.0, 3.0, (3, 5, n))
    truth = [exact(tree, *state) for state in zip(q, v, tau)]
    force, weight, reach = bias_scale(tree, q, v), gravity_scale(tree), reaches(tree).max()
    speed = np.abs(v).sum(axis=1)
    with_torque = force + np.abs(tau).max(axis=1) + max(tree.damping) * np.abs(v).max(axis=1)
    kinetic = mass_scale(tree, q) * speed**2
    scales = {  # by the method: its arguments, and the scale of each field of the truth that it gives
        "mass_matrix": ((q,), {"mass_matrix": mass_scale(tree, q)}),
        "bias": ((q, v), {"bias": force}),
        "acceleration": ((q, v, tau), {"acceleration": acceleration_scale(tree, q, with_torque)}),
        "com_positions": ((q,), {"com_positions": reach}),
        "angular_velocities": ((q, v), {"angular_velocities": speed}),
        "jacobians": ((q,), {"T": reach, "B": 1.0}),
        "convective_terms": ((q, v), {"v_conv": reach * speed**2, "w_conv": speed**2}),
        "gravity_balance": ((q,), {"gravity_balance": weight}),
        "potential_energy": ((q,), {"potential_energy": weight}),
        "energy": ((q, v), {"energy": weight + kinetic}),
    }
    known = [name for name in scales if hasattr(dynamics, name)]
    assert len(known) == len(scales) or isinstance(dynamics, MinimalCalls)
    for name in known:
        arguments, fields = scales[name]
        found = getattr(dynamics, name)(*arguments)
        for field, values in zip(fields, (found,) if len(fields) == 1 else found):
            off = distance(values, np.array([getattr(t, field) for t in truth]))
            assert (off.reshape(5, -1).max(axis=1) <= FACTOR * EPS * fields[field]).all(), field
    for name in ("mass_matrix", "bias", "acceleration"):  # a batch of any shape is each state
        arguments, function = scales[name][0], getattr(dynamics, name)
        found = function(*arguments)
        assert np.array_equal(function(*(x[2] for x in arguments)), found[2])
        assert np.array_equal(function(*(x[None] for x in arguments)), found[None])
    if hasattr(dynamics, "inverse"):
        back = dynamics.inverse(q, v, dynamics.acceleration(q, v, tau))
        assert (np.abs(back - tau).max(axis=1) <= FACTOR * EPS * condition(tree, q) * with_torque).all()
        assert not any(np.abs(force).max() for force in dynamics.other_forces(q, v).values())


def start(case, rng, *batch):
    return rng.uniform(-1.0, 1.0, (3, *batch, len(case.joints)))


def test_a_batch_of_runs_is_each_run(followed, rng):
    (method, case, dynamics), dt = followed, 0.01
    q, v, tau = start(case, rng, 2, 3)
    motion = dynamics.run(q, v, tau, dt, 5, method.name)
    assert motion.q.shape == motion.v.shape == (2, 3, 6, len(case.joints)) and motion.ended.shape == (2, 3)
    assert np.allclose(motion.t, dt * np.arange(6)) and np.isfinite([motion.q, motion.v]).all()
    assert np.array_equal(motion.q[..., 0, :], q) and np.array_equal(motion.v[..., 0, :], v)
    evaluations = 0
    for index in np.ndindex(2, 3):
        single = dynamics.run(q[index], v[index], tau[index], dt, 5, method.name)
        assert np.array_equal(single.q, motion.q[index]) and np.array_equal(single.v, motion.v[index])
        assert single.ended is None is motion.ended[index]
        evaluations += single.evaluations or 0
    assert evaluations == (motion.evaluations or 0)


@pytest.fixture(scope="module")
def true_end():
    """Where the arm is a second after it is let go at bent, q and v, by 512 steps of order 8: with 13 digits."""
    case = ARM.case(posture="bent")
    _, q, v = tmt.simulate(*case.start, case.tau, 1 / 512, 512, "dopri8", case.tree)
    return np.concatenate([q[-1], v[-1]])


def test_each_method_comes_to_the_same_motion_at_its_own_order_or_tolerance(arm, true_end):
    (method, dynamics), case = arm, ARM.case(posture="bent")
    coarse = {1: 8 * GRID, 8: GRID // 2}.get(method.order, 2 * GRID)

    def error(steps, tolerance=None):
        motion = dynamics.run(*case.start, case.tau, 1 / steps, steps, method.name, tolerance)
        return np.abs(np.concatenate([motion.q[-1], motion.v[-1]]) - true_end).max()

    if method.adaptive:
        assert error(2, 1e-7) < min(1e-4, error(2, 1e-3)) and error(2, 1e-3) < 0.5
        assert error(2) < {"heyoka": 1e-12}.get(method.engine, 1e-6)  # of itself it is exact
        return
    measured = np.log2(error(coarse) / error(2 * coarse))
    assert abs(measured - method.order) < 0.3 or 7.0 < measured < 9.0 < method.order + 1.1  # order 8 has hardly settled


def test_methods_of_one_scheme_do_the_same_and_others_do_not(engines):
    """Ten steps of each method: apart by rounding, or by more."""
    case, ends = ARM.case("thrown", posture="bent", speed=(90.0, -60.0, 120.0)), {}
    for method in METHODS:
        if engines[method.engine].unavailable() is None:
            motion = engines[method.engine].of(case).run(*case.start, case.tau, 0.01, 10, method.name)
            ends[method] = motion.q[-1]
    for one in ends:
        for other in ends:
            apart = np.abs(ends[one] - ends[other]).max()
            assert apart < 1e-13 if one.scheme == other.scheme else apart > 0.0, (one.label, other.label)
            if one.order == other.order == 1 and one.scheme != other.scheme:
                assert apart > 1e-6, (one.label, other.label)


def test_a_prepared_run_is_the_run(followed, rng):
    method, case, dynamics = followed
    q, v, tau = start(case, rng)
    steps, tolerance = (None, 1e-6) if method.adaptive else (2 * GRID, None)
    run, read = dynamics.prepare(q, v, tau, Setting(DURATION, steps, tolerance), method.name)
    count = steps or GRID
    motion = dynamics.run(q, v, tau, DURATION / count, count, method.name, tolerance)
    for _ in range(2):  # again and again
        found = read(run())
        every = count // GRID
        assert np.array_equal(found.t, motion.t[::every]) and len(found.t) == GRID + 1
        assert np.array_equal(found.q, motion.q[::every]) and np.array_equal(found.v, motion.v[::every])
        assert found.ended is None is motion.ended and found.evaluations == motion.evaluations
        assert motion.steps == steps  # None: it is not known
        if steps or method.engine == "scipy":
            assert found.steps == steps
        else:
            assert found.steps > 5 and (method.engine == "heyoka" or found.evaluations / found.steps in (11, 12))
        if method.engine == "heyoka":  # its Taylor series have none
            assert found.evaluations is None
        elif not method.adaptive:
            each = {"rk4": 4, "dopri8": 12}.get(method.scheme, 1) * steps
            newton = method.engine == "tmt" and tmt.METHODS[method.name].solves_stages
            assert found.evaluations == each or (newton and found.evaluations > each)


@pytest.mark.parametrize("engine", ENGINES)
def test_a_tolerance_is_taken_only_by_what_chooses_its_own_steps(engine, engines):
    case, dynamics = CASES["as it is"], available(engines, engine.name).of(CASES["as it is"])
    for method in (method.name for method in METHODS if method.engine == engine.name and not method.adaptive):
        with pytest.raises(ValueError, match="tolerance"):
            dynamics.run(*case.start, case.tau, 0.01, 4, method, 1e-6)
        with pytest.raises(ValueError, match="tolerance"):
            dynamics.prepare(*case.start, case.tau, Setting(DURATION, GRID, 1e-6), method)
        for steps in (GRID + 1, 0, None):
            with pytest.raises(ValueError, match=f"{steps}.*64"):
                dynamics.prepare(*case.start, case.tau, Setting(DURATION, steps), method)


def test_a_run_that_diverges_is_nan_from_there_on_and_says_why_and_when(followed, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    method, case, dynamics = followed
    q, tau, fast = np.zeros((3, len(case.joints)))
    fast += 1e200
    setting = Setting(DURATION, None, 1e-6) if method.adaptive else Setting(DURATION, GRID)
    run, read = dynamics.prepare(q, fast, tau, setting, method.name)
    both = dynamics.run(q, np.stack([q, fast]), tau, DURATION / GRID, GRID, method.name, setting.tolerance)
    assert both.ended[0] is None and np.isfinite(both.q[0]).all()
    for found, ended in ((read(run()), None), (read(run()), None), (both, both.ended[1])):
        x = np.concatenate([found.q, found.v], axis=-1)[(1,) * (ended is not None)]
        last = int(np.argmin(np.isfinite(x).all(axis=1))) - 1
        assert last >= 0 and np.isfinite(x[: last + 1]).all() and np.isnan(x[last + 1 :]).all()
        assert (ended or found.ended).startswith(f"at t = {found.t[last]:g} s: ")
        assert (ended or found.ended) == both.ended[1]
    assert list(tmp_path.iterdir()) == []  # no log of MuJoCo's
