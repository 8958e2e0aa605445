"""What every engine promises: another one is one more parameter."""

import numpy as np
import pytest
from helpers.crane import TREE, XML
from helpers.files import assert_the_same

import tmt
from compare.engines import GRID, Setting
from compare.engines.heyoka import Heyoka
from compare.engines.mujoco import Mujoco, parse, runs
from compare.engines.scipy import Scipy
from compare.engines.tmt import Tmt
from compare.judge.entries import Entries
from compare.judge.scale import EPS, FACTOR
from compare.robots import Robot
from compare.robots.arm import ARM
from compare.robots.case import Case, Scene
from compare.run import examine as experiment
from tmt.derivation.quantities import QUANTITIES

ENGINES = (Tmt, Mujoco, Scipy, Heyoka)
METHODS = [method for engine in (Tmt(), Mujoco, Scipy, Heyoka) for method in engine.methods.values()]
CASES = {
    "as it is": ARM.case(), "damped, weightless": ARM.case("floating", damping=0.4, gravity=False),
    "one joint locked": ARM.case("stiff", posture="bent", locked=("beta",), damping=0.1),
    # whose hinges and bodies stand in another order in the file
    "crane": Case(Robot("crane", None, TREE, {}, ()), Scene("damped", (0, 0, 0, 0), damping=0.2)),
}  # fmt: skip
DURATION = 0.5  # s
ASKED = (
    "mass_matrix", "bias", "acceleration", "com_positions", "angular_velocities", "jacobians", "convective_terms",
    "gravity_balance", "potential_energy", "energy",
)  # fmt: skip
OF_TMT = {name: QUANTITIES[name] for name in ASKED}
# every method follows the case as it is; the others, which take time to compile, are followed by one of each engine
FIRST = [next(method for method in METHODS if method.engine == engine.name) for engine in ENGINES]
FOLLOWED = [(method, "as it is") for method in METHODS] + [(method, "one joint locked") for method in FIRST]
FOLLOWED += [(method, "damped, weightless") for method in METHODS if method.scheme == "semi_implicit_euler"]


def available(engines, name):
    if reason := engines[name].unavailable():
        pytest.skip(reason)
    return engines[name]


@pytest.fixture(params=FOLLOWED, ids=lambda pair: f"{pair[0].label}, {pair[1]}")
def followed(request, engines):
    """A method, a case, and the case in the method's engine."""
    method, name = request.param
    return method, CASES[name], available(engines, method.engine).of(CASES[name])


@pytest.mark.parametrize("engine", ["tmt", "mujoco"])
@pytest.mark.parametrize("name", CASES)
def test_quantities_are_those_of_the_case_at_one_state_and_in_any_batch(engine, name, engines, rng):
    """Those of its Tree, which has them with 50 digits: tmt/test_answers.py."""
    case = CASES[name]
    dynamics = (experiment.engines(parse(XML, TREE)) if name == "crane" else engines)[engine].of(case)
    q, v, tau = state = rng.uniform(-3.0, 3.0, (3, 5, len(case.joints)))
    if engine == "mujoco":
        assert_the_same(dynamics, case.tree, rng)
    for quantity in OF_TMT:
        arguments = state[: len(OF_TMT[quantity].takes)]
        found = getattr(dynamics, quantity)(*arguments)
        right = getattr(tmt, quantity)(case.tree, *arguments)
        assert engine == "mujoco" or np.allclose(found, right, rtol=1e-12, atol=1e-12), quantity
        if not isinstance(found, tuple):
            assert np.array_equal(getattr(dynamics, quantity)(*(x[2] for x in arguments)), found[2])
            assert np.array_equal(getattr(dynamics, quantity)(*(x[None] for x in arguments)), found[None])
    if engine == "mujoco":
        scale, qdd = Entries(case.tree, q, v), dynamics.acceleration(*state)
        closing = scale.closing(scale.force(tau), qdd)
        assert (np.abs(dynamics.inverse(q, v, qdd) - tau) <= FACTOR * EPS * closing).all()


@pytest.fixture(scope="module")
def true_end():
    """Where the arm is a second after it is let go at bent, q and v, by 512 steps of order 8: with 13 digits."""
    case = ARM.case(posture="bent")
    _, q, v = tmt.simulate(case.tree, *case.start, case.tau, 1 / 512, 512, "dopri8")
    return np.concatenate([q[-1], v[-1]])


@pytest.mark.parametrize("method", METHODS, ids=lambda method: method.label)
def test_each_method_comes_to_the_same_motion_at_its_own_order_or_tolerance(method, engines, true_end):
    case, dynamics = ARM.case(posture="bent"), available(engines, method.engine).of(CASES["as it is"])
    coarse = {1: 8 * GRID, 8: GRID // 2}.get(method.order, 2 * GRID)

    def error(steps, tolerance=None):
        motion = dynamics.run(*case.start, case.tau, 1 / steps, steps, method.name, tolerance)
        return np.abs(np.concatenate([motion.q[-1], motion.v[-1]]) - true_end).max()

    if method.adaptive:
        assert error(2, 1e-7) < min(1e-4, error(2, 1e-3)) and error(2, 1e-3) < 0.5
        assert error(2) < {"heyoka": 1e-12}.get(method.engine, 1e-6)  # of itself it is exact
        return
    measured = np.log2(error(coarse) / error(2 * coarse))
    is_settling = 7.0 < measured < 9.0 < method.order + 1.1  # order 8 has hardly settled
    assert abs(measured - method.order) < 0.3 or is_settling
    with pytest.raises(ValueError, match="tolerance"):
        error(coarse, 1e-6)
    with pytest.raises(ValueError, match="tolerance"):
        dynamics.prepare(*case.start, case.tau, Setting(DURATION, GRID, 1e-6), method.name)
    for steps in (GRID + 1, 0, None):
        with pytest.raises(ValueError, match=f"{steps}.*64"):
            dynamics.prepare(*case.start, case.tau, Setting(DURATION, steps), method.name)


def test_a_batch_of_runs_is_each_run_and_so_is_a_prepared_one(followed, rng):
    method, case, dynamics = followed
    q, v, tau = rng.uniform(-1.0, 1.0, (3, 2, len(case.joints)))
    steps, tolerance = (None, 1e-6) if method.adaptive else (2 * GRID, None)
    count, every = steps or GRID, 2 if steps else 1
    how = DURATION / count, count, method.name, tolerance
    both, runs = dynamics.run(q, v, tau, *how), [dynamics.run(*start, *how) for start in zip(q, v, tau)]
    assert np.array_equal(both.q[:, 0], q) and np.array_equal(both.v[:, 0], v) and np.isfinite(both.q).all()
    assert np.array_equal(both.q, [one.q for one in runs]) and np.array_equal(both.v, [one.v for one in runs])
    assert all(one.ended is None and one.steps == steps for one in runs) and not both.ended.any()
    assert both.evaluations == (sum(one.evaluations for one in runs) if both.evaluations else None)
    run, read = dynamics.prepare(q[0], v[0], tau[0], Setting(DURATION, steps, tolerance), method.name)
    for _ in range(2):  # again and again
        found = read(run())
        assert np.allclose(found.t, DURATION / GRID * np.arange(GRID + 1))
        assert np.array_equal(found.q, runs[0].q[::every]) and np.array_equal(found.v, runs[0].v[::every])
        assert found.ended is None and found.evaluations == runs[0].evaluations
        if steps or method.engine == "scipy":
            assert found.steps == steps
        else:
            assert found.steps > 5
            assert method.engine == "heyoka" or found.evaluations / found.steps in (11, 12)
        if not method.adaptive:
            stages = {"rk4": 4, "dopri8": 12}.get(method.scheme, 1) * steps
            newton = method.engine == "tmt" and tmt.METHODS[method.name].solves_stages
            assert found.evaluations == stages or (newton and found.evaluations > stages)


def test_a_run_that_diverges_is_nan_from_there_on_and_says_why_and_when(followed, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    method, case, dynamics = followed
    q, tau, fast = np.zeros((3, len(case.joints)))
    fast += 1e200
    setting = Setting(DURATION, None, 1e-6) if method.adaptive else Setting(DURATION, GRID)
    run, read = dynamics.prepare(q, fast, tau, setting, method.name)
    both = dynamics.run(q, np.stack([q, fast]), tau, DURATION / GRID, GRID, method.name, setting.tolerance)
    assert both.ended[0] is None and np.isfinite(both.q[0]).all()
    alone, again = read(run()), read(run())
    for q, v in ((alone.q, alone.v), (again.q, again.v), (both.q[1], both.v[1])):
        finite = np.isfinite(np.hstack([q, v])).all(axis=1)
        last = int(np.argmin(finite)) - 1
        assert last >= 0 and finite[: last + 1].all() and np.isnan(np.hstack([q, v])[last + 1 :]).all()
        assert both.ended[1].startswith(f"at t = {both.t[last]:g} s: ")
    assert alone.ended == again.ended == both.ended[1]
    assert list(tmp_path.iterdir()) == []  # no log of MuJoCo's


def test_what_cannot_take_part_says_so(monkeypatch, tmp_path, rng):
    monkeypatch.setattr("mujoco.__file__", str(tmp_path / "mujoco" / "__init__.py"))
    monkeypatch.setattr("compare.engines.find_spec", lambda name: None)
    assert Heyoka().unavailable() and runs.library() is None
