"""What turns two sets of values into a verdict: rules, which state is judged, by which tolerance; timing; words of sentences."""

import time

import numpy as np
import pytest

from compare.core import timing
from compare.core.check import Result, largest_known
from compare.core.words import milliseconds, scene_of
from compare.judge.agree import agree, closest
from compare.robots.arm import ARM
from compare.robots.states import Sample
from tmt.exact.many import Pairs

EPS = 2.0**-52


def sample(states=4, exact=2):
    """States at which nothing is computed: the values come from the test."""
    q = np.arange(3.0 * states).reshape(states, 3)
    return Sample(ARM.tree, "some states", q, q + 100.0, q + 200.0, exact)


def agreed(ours, theirs, scale, exact=None):
    """The checks and the row of one quantity, (states, ...)."""
    result, states = Result("mass"), sample(len(ours), exact=0 if exact is None else 2)
    exact = np.zeros((0, 1)) if exact is None else np.array(exact)[:, None]
    agree(result, states, "Mbar", "kg m2", ours, theirs, scale, Pairs(exact, 0.0 * exact))
    return result.checks, result.rows[0]


@pytest.mark.parametrize("rule, inside, outside", [
    ("at most", (1.0, -9.0), 1.0 + 1e-15), ("at least", (1.0, 9.0), 1.0 - 1e-15),
    ("equal", (1.0, 1.0), 1.0 - 1e-15), ("equal", (1.0, 1.0), 1.0 + 1e-15),
])  # fmt: skip
def test_a_check_passes_within_its_tolerance_only(rule, inside, outside):
    for passes, values in ((True, inside), (False, (outside,)), (False, (None, np.nan, np.inf, -np.inf))):
        for value in values:
            check = Result("mass").check("zero", "Mbar", value, 1.0, "kg m2", rounding=True, rule=rule)
            assert check.passed is check.record()["passed"] is passes
            assert check.record()["rule"] == rule and check.over_tolerance == check.value
            assert (check.value is None) == (value is None or not np.isfinite(value))


@pytest.mark.parametrize("tolerance, rule", [(np.inf, "at most"), (1.0, "below")])
def test_a_check_has_a_rule_and_a_finite_tolerance(tolerance, rule):
    with pytest.raises(ValueError, match="Mbar"):
        Result("mass").check("zero", "Mbar", 0.0, tolerance, "kg m2", rule=rule)


def test_the_used_share_of_a_tolerance_is_known_for_rounding_only():
    result = Result("mass")
    assert result.check("", "", 0.5, 2.0, "", rounding=True).over_tolerance == 0.25
    assert result.check("", "", 0.5, 2.0, "").over_tolerance is None
    assert result.check("", "", 0.0, 0.0, "", rounding=True).over_tolerance is None


@pytest.mark.parametrize("eps, passes", [(64, True), (65, False)])
@pytest.mark.parametrize("sign, place", [(1.0, 0), (-1.0, 3)])
def test_a_difference_is_allowed_64_eps_of_its_own_states_scale(eps, passes, sign, place):
    theirs, scale = np.zeros((4, 1)), np.array([4.0, 1.0, 2.0, 8.0])
    theirs[place] = sign * eps * EPS * scale[place]
    (check,), row = agreed(np.zeros((4, 1)), theirs, scale)
    assert check.passed is row.passed is passes
    assert (check.value, check.rule) == (abs(theirs[place, 0]), "at most")
    assert check.tolerance == 64 * EPS * scale[place]
    assert (row.difference_over_bar, row.bar, row.scale) == (eps / 64, check.tolerance, scale[place])
    for name, values in (("worst_q", sample().q), ("worst_qd", sample().qd), ("worst_tau", sample().tau)):
        assert getattr(row, name) == " ".join(map(repr, values[place].tolist()))


@pytest.mark.parametrize("eps, passes", [(63, True), (65, False)])
@pytest.mark.parametrize("value", [1.0, -3.0, 1e-3])
def test_values_of_the_other_sign_differ_by_twice_their_size(eps, passes, value):
    """Of the same sign they agree to 63 eps, and not to 65; of the other sign never."""
    ours, theirs = np.full((2, 1), value), np.full((2, 1), value)
    theirs[1] += eps * EPS * abs(value)
    assert agreed(ours, theirs, abs(value))[1].passed is passes
    theirs[1] = -value
    (check,), row = agreed(ours, theirs, abs(value))
    assert not check.passed and check.value == row.worst_difference == 2.0 * abs(value)


@pytest.mark.parametrize("eps, passes", [(63, True), (65, False)])
@pytest.mark.parametrize("entry", [(0, 0, 0), (2, 0, 1)])
def test_each_entry_has_its_own_tolerance_if_the_scale_has(eps, passes, entry):
    """A small entry that is off fails beside a large one that is off by more, and passes where it may be."""
    scale, theirs = np.full((3, 2, 2), 100.0), np.full((3, 2, 2), 50 * EPS)
    scale[entry], theirs[entry] = 1e-3, eps * EPS * 1e-3
    (check,), row = agreed(np.zeros((3, 2, 2)), theirs, scale)
    assert check.passed is passes and check.value == theirs[entry] and check.tolerance == 64 * EPS * 1e-3
    assert (row.scale, row.difference) == (1e-3, eps)
    assert row.largest_difference == max(theirs[entry], 50 * EPS)


@pytest.mark.parametrize("bad", [np.nan, -np.inf])
@pytest.mark.parametrize("scale", [1.0, np.ones((3, 1))], ids=["one scale", "a scale of each entry"])
def test_a_value_that_is_no_number_fails_wherever_it_is(bad, scale):
    (check,), row = agreed([[0.0], [0.0], [bad]], [[0.0], [1e-20], [0.0]], scale)
    assert not check.passed and check.value is None and row.largest_difference is None and row.passed is False


@pytest.mark.parametrize("eps, passes", [(63, True), (65, False)])
@pytest.mark.parametrize("engine, other", [("TMT", "MuJoCo"), ("MuJoCo", "TMT")])
def test_the_distance_of_each_engine_from_the_exact_value_is_checked(eps, passes, engine, other):
    off, right = [[0.0], [eps * EPS]], [[0.0], [0.0]]
    checks, row = agreed(*((off, right) if engine == "TMT" else (right, off)), 1.0, exact=[0.0, 0.0])
    by_name = {check.quantity: check for check in checks}
    assert list(by_name) == ["Mbar", "Mbar, TMT to exact", "Mbar, MuJoCo to exact"]
    assert by_name[f"Mbar, {engine} to exact"].passed is passes
    assert by_name[f"Mbar, {other} to exact"].value == 0.0
    columns = row.record()
    assert columns[f"{engine.lower()}_from_exact_eps"] == eps
    assert columns[f"{other.lower()}_from_exact_eps"] == 0.0
    in_order = agreed([[1.0], [5.0]], [[1.0], [5.0]], 1.0, exact=[1.0, 5.0])[0]
    assert all(check.value == 0.0 for check in in_order)
    checks, row = agreed(off, right, 1.0)  # without an exact state nothing is compared with one
    assert [check.quantity for check in checks] == ["Mbar"]
    assert row.from_exact is None and row.exact_states == 0


@pytest.mark.parametrize("difference, tolerance, place", [
    ([1.0, 3.0, -2.0], [1.0, 6.0, 1.0], 2),  # the largest share, of whatever sign, not the largest difference
    ([1.0, np.nan, 9.0], 1.0, 1),  # no number comes before all
    ([5.0, 0.0, 1e-300], [1.0, 0.0, 0.0], 2),  # so does a difference where none is allowed
    ([0.5, 0.0], [1.0, 0.0], 0),
])  # fmt: skip
def test_the_difference_closest_to_its_tolerance(difference, tolerance, place):
    assert closest(np.array(difference), np.array(tolerance)) == (place,)


@pytest.mark.parametrize("values, largest", [
    ([1.0, 3.0, 2.0], 3.0), ([1.0, None], 1.0), ([None], None), ([], None), ([-2.0, -1.0], -1.0),
    ([1.0, np.nan], np.inf), ([np.nan, 1.0, None], np.inf),
])  # fmt: skip
def test_the_largest_of_values_of_which_some_are_not_known_or_no_numbers(values, largest):
    assert largest_known(values) == largest


def test_what_is_compared_is_called_in_turns_and_the_first_call_is_not_counted(monkeypatch):
    now, order = [0.0], []
    monkeypatch.setattr(time, "perf_counter", lambda: now[0])
    # a long call is made less often, until two agree; a very long one once
    left = {"a": [3.9e-3, 0.014, 6e-3, 2e-3], "b": [0.3], "c": [0.013, 0.018], "d": [0.2, 0.1, 0.11]}

    def call(name):
        now[0] += left[name].pop(0)

    found = timing.fastest({name: lambda name=name: call(name) for name in left}, 3)
    assert found == {"a": pytest.approx(2e-3), "b": pytest.approx(0.3), "c": pytest.approx(0.013),
                     "d": pytest.approx(0.1)}  # fmt: skip
    assert not any(left.values())
    times = timing.in_turns([lambda: order.append("d"), lambda: order.append("e")], 3)
    assert order == ["d", "e"] * 4 and [len(t) for t in times] == [3, 3]


def test_a_check_belongs_to_the_scene_of_the_longest_name():
    names = ["bent", "bent, free", "bent, freely", "free"]
    assert scene_of("bent, free, RK4, dt = 5/64 s", names) == scene_of("bent, free", names) == "bent, free"
    assert scene_of("bent, RK4", names) == "bent" and scene_of("bending, RK4", names) is None


def test_a_time_near_another_has_as_many_digits_as_tell_them_apart():
    limit, step = 2.0149e-3, 2.0e-3
    assert milliseconds(limit) == milliseconds(step) == "2 ms"
    assert (milliseconds(limit, step), milliseconds(step, limit)) == ("2.015 ms", "2 ms")
    assert milliseconds(2.2049e-3, step) == "2.2 ms"
