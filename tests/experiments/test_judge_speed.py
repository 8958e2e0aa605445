"""What is concluded from errors, orders and times, every rule with a row just inside and one just outside; what is timed."""

from types import SimpleNamespace

import numpy as np
import pytest

import tmt
from compare.core.text import say
from compare.engines import GRID, Method, Motion, Setting
from compare.engines.outside.file import EngineError, TooLong
from compare.experiments import speed
from compare.experiments.speed import conclusions, evaluations, runs
from compare.experiments.speed.runs import RunRow, SceneRuns, SpeedResult
from compare.robots.arm import ARM
from compare.truth.reference import reference

SCHEMES = {"RK4": "rk4", "implicit": "implicit", "Euler": "semi_implicit_euler"}
COMPARED = "smallest error of MuJoCo's RK4, compared with tmt's rk4"
STOPPED = "smallest error of mujoco's RK4, where smaller steps gain nothing"


def run_of(engine, method, error, steps=64, seconds=1e-3, **more) -> RunRow:
    """A run: diverged where the error is None."""
    errors = dict.fromkeys(("error", "worst_error", "early_error", "energy_error"), error)
    about = {
        "scene": "bent, free",
        "engine": engine,
        "method": method,
        "scheme": SCHEMES.get(method, method),
        "order": 4,
    }
    numbers = {"dt": 5.0 / steps, "evaluations": 4 * steps, "seconds": seconds}
    numbers |= dict.fromkeys(("steps", "timed_steps"), steps)
    return RunRow(**about | errors | numbers | {"ended": None if error else "diverged"} | more)


def series(engine, method, errors) -> list[RunRow]:
    """A run for each error, from coarse to fine."""
    return [run_of(engine, method, error, 64 << k) for k, error in enumerate(errors)]


def scene_of(found, floor, is_read=False) -> SceneRuns:
    case = SimpleNamespace(name="bent, free", robot=SimpleNamespace(is_read=is_read))
    return SceneRuns(case, None, floor, found)


def judged(check, found, floor) -> dict[str, bool]:
    result = SpeedResult("speed")
    check(result, scene_of(found, floor))
    return {check.quantity: check.passed for check in result.checks}


@pytest.mark.parametrize("ours, theirs, verdict", [
    (1e-3, 1e-3 + 63e-10, True), (1e-3, 1e-3 + 65e-10, False), (1e-3, 1e-3 - 65e-10, False), (None, 1e-3, False),
    (0.0999, 0.2, False), (0.1001, 0.2, None), (None, None, None),
])  # fmt: skip
def test_the_same_scheme_makes_the_same_error(ours, theirs, verdict):
    found = [run_of("tmt", "rk4", ours), run_of("mujoco", "RK4", theirs), run_of("tmt", "rk4", 1.0, 128)]
    expected = {} if verdict is None else {"the same error as tmt's rk4": verdict}
    assert judged(conclusions.check_same_schemes, found, 1e-10) == expected


@pytest.mark.parametrize("theirs, ours, left, found", [
    # errors that have stopped are of the size of rounding
    ([1e-6, 1e-14, 2e-14], [1e-6, 1e-14], 1e-14 / 63, {STOPPED: True, COMPARED: True}),
    ([1e-6, 1e-14, 2e-14], [1e-6, 1e-14], 1e-14 / 65, {STOPPED: False, COMPARED: True}),
    # MuJoCo comes as near as tmt
    ([2e-9 + 63e-14], [1e-9], 1e-14, {COMPARED: True}), ([2e-9 + 65e-14], [1e-9], 1e-14, {COMPARED: False}),
    ([None], [1e-9], 1e-14, {COMPARED: False}), ([63e-14], [None], 1e-14, {COMPARED: True}),
    ([65e-14], [None], 1e-14, {COMPARED: False}),
    # where tmt has a step as coarse, and one of them ends
    ([1e-3, 1e-5], [], 1e-16, {}), ([None, None], [None, None, 1e-9], 1e-16, {}),
    # where MuJoCo's steps end before its errors stop, tmt's are no finer
    ([1e-6, 1.99e-7], [1e-6, 1e-7, 1e-8], 1e-20, {COMPARED: True}),
    ([1e-6, 2.01e-7], [1e-6, 1e-7, 1e-8], 1e-20, {COMPARED: False}),
    ([1e-6, 1.99e-7, 1e-6], [1e-6, 1e-7, 1e-8], 1e-20, {STOPPED: False, COMPARED: False}),
])  # fmt: skip
def test_smallest_errors(theirs, ours, left, found):
    measured = series("mujoco", "RK4", theirs) + series("tmt", "rk4", ours)
    assert judged(conclusions.check_smallest_errors, measured, left) == found


def falling(*orders) -> list[float]:
    return [*(1e-4 / 2.0 ** np.cumsum([0.0, *orders]))]


@pytest.mark.parametrize("errors, measured, floor, is_read", [
    ([0.29, 2.9e-2, 2.9e-2 / 16], [4.0], 1e-16, False),
    ([3.1e-2, 2.9e-2 / 16], [], 1e-16, False),  # one error only is below 3e-2 rad
    ([0.29, 16 * 2.1e-12, 2.1e-12], [4.0], 1e-16, False), ([0.29, 16 * 1.9e-12, 1.9e-12], [], 1e-16, False),
    ([2.9e-2, 2.8e-2, 2.8e-2 / 16], [4.0], 1e-16, False),  # the finest two count
    # of a file
    (falling(4.298, 4.149), [4.149], 1e-16, True), (falling(4.302, 4.151), [], 1e-16, True),  # where it has settled
    (falling(4.0, 4.0), [4.0], 1.29e-8, True), (falling(4.0, 4.0), [], 1.31e-8, True),  # 30 times as far as rounding
    (falling(4.0), [], 1e-16, True),  # seen once
])  # fmt: skip
def test_an_order_is_measured_where_errors_fall_regularly(errors, measured, floor, is_read):
    result, scene = SpeedResult("speed"), scene_of(series("tmt", "rk4", errors), floor, is_read)
    assert conclusions.check_orders(result, [scene], ["mujoco"]) == []
    table = conclusions.check_orders(result, [scene], ["tmt"])
    assert [row.measured_order for row in table] == pytest.approx(measured)
    assert [check.passed for check in result.checks] == [True] * len(measured)


@pytest.mark.parametrize("of_mujoco, of_tmt, failed, higher", [
    (5.0, 5.0, [], ["RK4", "rk4"]), (4.0, 4.0, [], []),
    (5.0, 4.0, ["bent, free, mujoco RK4"], []), (4.0, 5.0, ["bent, free, mujoco RK4"], ["rk4"]),
    (3.0, 3.0, ["bent, free, mujoco RK4", "bent, free, tmt rk4"], []),
])  # fmt: skip
def test_a_higher_order_is_said_and_fails_only_where_tmts_same_scheme_has_another(
    of_mujoco, of_tmt, failed, higher
):
    """As semi-implicit Euler from a state without forces."""
    found = series("mujoco", "RK4", falling(of_mujoco)) + series("tmt", "rk4", falling(of_tmt))
    result = SpeedResult("speed")
    conclusions.check_orders(result, [scene_of(found, 1e-16)], ["mujoco", "tmt"])
    assert [check.scene for check in result.checks if not check.passed] == failed
    said = " ".join(say(note) for note in result.notes)
    assert [row.method for note in result.notes for row in note.values["rows"]] == higher
    assert ("with order 5.00 (stated: 4)" in said) == bool(higher)


@pytest.mark.parametrize("finer, judged", [((0.05, 0.37), []), ((0.05, 1.0, 1.0, 1.0), [False, True])])
def test_errors_that_rest_at_coarse_steps_are_no_order_where_tmts_same_scheme_goes_on_to_fall(finer, judged):
    """Of a file with a stiff mode: coarse steps have the same error, as fine ones do in tmt, which are more."""
    coarse = falling(0.02, 0.05)
    finest = coarse[-1] / 2.0 ** np.cumsum(finer)
    found = series("mujoco", "RK4", coarse) + series("tmt", "rk4", [*coarse, *finest])
    for row in found:
        row.order = 1
    result = SpeedResult("speed")
    conclusions.check_orders(result, [scene_of(found, 1e-16, True)], ["mujoco", "tmt"])
    assert [check.passed for check in result.checks] == judged


def result_of(rows) -> SpeedResult:
    result = SpeedResult("speed", rows=rows, floors={"bent, free": 1e-16}, regular="bent, free")
    result.tables["what_should_i_use"] = conclusions.what_to_use(result)
    return result


def many_runs() -> list[RunRow]:
    """MuJoCo's RK4 20 times slower than tmt's; of its integrators Euler is never as near; dopri8 needs fewest steps."""
    found = [run_of("scipy", "DOP853", 1e-9, 500, 1e-4, dt=None, tolerance=1e-7)]
    found.append(run_of("mujoco", "implicit", None, 64, 1e-9))
    for k in range(5):
        steps, error, seconds = 64 << k, 2e-2 / 16**k, 1e-3 * 2**k
        found.append(run_of("mujoco", "RK4", error, steps, 20 * seconds, timed_steps=min(steps, 512)))
        found.append(run_of("tmt", "rk4", error, steps, seconds))
        found.append(run_of("mujoco", "Euler", 0.5 / 2**k, steps, 4 * seconds))
        found.append(run_of("tmt", "dopri8", error**2, steps, 2 * seconds))
    return found


def test_the_cheapest_setting_of_each_engine_for_an_error():
    table = result_of(many_runs()).tables["what_should_i_use"]
    of_targets = {target: [row for row in table if row.target == target] for target in (1e-3, 1e-6, 1e-9)}
    coarse, middle, fine = of_targets.values()
    assert [(row.engine, row.method, row.steps, row.ms) for row in coarse] == [
        ("scipy", "DOP853", 500, pytest.approx(0.1)), ("tmt", "dopri8", 64, pytest.approx(2.0)),
        ("mujoco", "RK4", 256, pytest.approx(80.0)),
    ]  # fmt: skip
    assert [row.over_cheapest for row in coarse] == pytest.approx([1.0, 20.0, 800.0])
    assert [row.over_same_scheme for row in coarse] == [None, 1.0, pytest.approx(20.0)]
    assert [row.energy_error for row in coarse] == pytest.approx([1e-9, 4e-4, 2e-2 / 256])
    assert [row.extrapolated for row in middle] == [False, False, True]  # 1024 steps, of which 512 are timed
    assert (fine[-1].engine, fine[-1].method, fine[-1].ms) == ("mujoco", None, None)  # no setting reaches it


@pytest.mark.parametrize(
    "error, target, reaches", [(1e-6, 1e-6, True), (1.01e-6, 1e-6, False), (None, 1.0, False)]
)
def test_a_run_reaches_an_error_that_is_not_smaller_than_its_own(error, target, reaches):
    rows = [
        run_of("tmt", "rk4", error),
        run_of("tmt", "dopri8", 1e-9, seconds=None),
    ]  # the latter is not timed
    assert (conclusions.cheapest(rows, target) is rows[0]) is reaches
    assert conclusions.cheapest(rows, target, engine="mujoco") is None


class Slow:
    """An engine whose runs take so long, s, or that refuses methods by their names."""

    def __init__(self, seconds=(), refused=None):
        self.seconds, self.refused, self.asked = seconds, refused or {}, []

    def of(self, case):
        return self

    def prepare(self, q, v, tau, setting, method):
        self.asked.append((method, setting.steps))
        if method in self.refused:
            raise self.refused[method]
        states = (
            np.tile(q, (GRID + 1, 1)),
            np.tile(v + 1.0, (GRID + 1, 1)),
        )  # it stays, and has an energy of motion
        motion = Motion(np.linspace(0.0, 5.0, GRID + 1), *states, seconds=self.seconds[setting.steps])
        return lambda: None, lambda _: motion


HELD = next(case for case in ARM.cases if case.name == "zero, free")
KNOWN = reference(HELD)


def measured(engine, *methods, budget=np.inf):
    of_each = [Setting(5.0, steps) for steps in (64, 128, 256)]
    settings = {Method("drake", name, 4, name): of_each for name in methods}
    return runs.measure(HELD, {"drake": engine}, settings, KNOWN, budget)


@pytest.mark.parametrize("budget, steps", [(0.11, [64, 128]), (0.13, [64, 128, 256])])
def test_after_a_run_beyond_the_budget_there_is_no_finer_one(budget, steps):
    rows = measured(Slow({64: 0.06, 128: 0.12, 256: 0.24}), "RK4", budget=budget)
    assert [row.steps for row in rows] == steps and rows[0].seconds == 0.06
    stays = KNOWN.error(np.tile(HELD.q, (GRID + 1, 1)))
    assert rows[0].worst_error == pytest.approx(stays.max()) and rows[0].error == pytest.approx(stays[-1])
    assert rows[0].early_error == pytest.approx(stays[:13].max())  # up to 12 / 64 of 5 s
    assert rows[0].energy_error == pytest.approx(tmt.mass_matrix(HELD.tree, HELD.q).sum() / 2.0)


def test_a_method_that_an_engine_refuses_is_a_row_and_an_engine_without_an_answer_is_not_asked_again():
    seconds = dict.fromkeys((64, 128, 256), 1e-3)
    some = Slow(seconds, {"RK2": EngineError("it lacks a number.")})
    rows = measured(some, "RK2", "RK4")
    assert [(row.method, row.why_not) for row in rows] == [("RK2", "it lacks a number"), *[("RK4", None)] * 3]
    none = Slow(seconds, {"RK2": TooLong("no answer within 1 s")})
    rows = measured(none, "RK2", "RK4")
    assert [(row.method, row.why_not) for row in rows] == [
        (name, "no answer within 1 s") for name in ("RK2", "RK4")
    ]
    assert none.asked == [("RK2", 64)]


def test_compilation_is_the_sum_of_the_methods_of_an_engine():
    rows = [run_of("mjx", "RK4", 1e-3, compile_seconds=4.0), run_of("mjx", "RK4", 1e-4, compile_seconds=1e-5)]
    of_each = ("mjx", "Euler", 2.0), ("mujoco", "RK4", 9e-3)
    rows += [run_of(engine, method, 1e-3, compile_seconds=seconds) for engine, method, seconds in of_each]
    assert speed.compilation(rows) == {"MJX": 6.0}


def test_operations_per_nanosecond_are_those_of_a_state_over_its_time(monkeypatch):
    row = evaluations.EvaluationRow(evaluations.FORWARD, evaluations.ONE_BY_ONE, 10_000, operations=133)
    monkeypatch.setattr(evaluations.timing, "in_turns", lambda calls, rounds: [[2e-3, 1e-3]])
    (found,) = evaluations.costs([(row, lambda count: None)], 2)
    assert found.ns_per_state == pytest.approx(25.0)  # four calls of 10,000 states in a millisecond
    assert found.operations_per_ns == pytest.approx(133 / 25.0)


def test_the_time_of_an_engine_in_a_process_of_its_own_is_that_which_it_has_measured_there():
    found = [run_of("drake", "RK3", 1.0, seconds=1e-3)]
    runs.take_times(HELD, found, {"drake": Slow({64: 9.0})})
    assert found[0].seconds == 1e-3


def test_a_row_gets_the_least_of_its_times(monkeypatch):
    found = [run_of("tmt", "rk4", 1.0), run_of("mujoco", "RK4", 1.0, 1024)]
    monkeypatch.setattr(
        runs, "prepared", lambda case, row, engines: (None, row.steps / 512 if row.steps > 512 else 1.0)
    )
    monkeypatch.setattr(runs.timing, "in_turns", lambda calls, rounds: [[3e-3, 2e-3, 5e-3], [0.2]])
    runs.take_times(HELD, found, {})
    assert [(row.seconds, row.timed_steps, row.extrapolated) for row in found] == [
        (2e-3, 64, False),
        (0.4, 512, True),
    ]
