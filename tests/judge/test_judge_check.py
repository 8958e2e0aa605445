"""What turns two sets of values into a verdict: which state is judged, by which tolerance, of which scale."""

import mpmath
import numpy as np
import pytest

from compare.judge.check import Result, largest, worst_of_each
from compare.robots.arm import ARM
from compare.states import Sample

EPS = 2.0**-52


def sample(states=4, exact=2):
    """States at which nothing is computed: the values come from the test."""
    q = np.arange(3.0 * states).reshape(states, 3)
    return Sample(ARM.tree, "some states", q, q + 100.0, q + 200.0, exact)


def agreed(ours, theirs, scale, exact=None):
    """The checks and the row of one quantity."""
    result, of = Result("mass"), sample(len(ours))
    if exact is not None:
        of.truths = [type("Truth", (), {"value": np.array([mpmath.mpf(v)])}) for v in exact]
    result.agree(of, "Mbar", "kg m2", np.array(ours)[:, None], np.array(theirs)[:, None], scale, exact and "value")
    return result.checks, result.rows[0]


@pytest.mark.parametrize("eps, passes", [(64, True), (65, False)])
@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("place", [0, 3])
def test_a_difference_is_allowed_64_eps_of_its_own_states_scale(eps, passes, sign, place):
    theirs, scale = np.zeros(4), np.array([4.0, 1.0, 2.0, 8.0])
    theirs[place] = sign * eps * EPS * scale[place]
    (check,), row = agreed(np.zeros(4), theirs, scale)
    assert check.passed is passes and row["passed"] is passes
    assert (check.value, check.tolerance, check.rule) == (abs(theirs[place]), 64 * EPS * scale[place], "at most")
    assert row["difference_over_bar"] == eps / 64 and row["bar"] == check.tolerance
    assert row["worst_q"] == " ".join(map(repr, sample().q[place].tolist()))
    assert row["scale"] == scale[place] and check.note.startswith(f"state {place}: q = ({3.0 * place:.4f}, ")
    assert row["worst_qd"] == " ".join(map(repr, sample().qd[place].tolist()))
    assert row["worst_tau"] == " ".join(map(repr, sample().tau[place].tolist()))


def test_the_worst_is_closest_to_its_tolerance_and_the_largest_is_the_largest():
    (check,), row = agreed([0.0, 0.0], [3 * EPS, 2 * EPS], np.array([100.0, 1.0]))
    assert check.value == row["worst_difference"] == 2 * EPS
    assert row["largest_difference"] == 3 * EPS and row["difference_eps"] == 2.0


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_a_value_that_is_no_number_fails_wherever_it_is(bad):
    (check,), row = agreed([0.0, 0.0, bad], [0.0, 1e-20, 0.0], 1.0)
    assert not check.passed and check.value is None and row["largest_difference"] is None and row["passed"] is False


@pytest.mark.parametrize("eps, passes", [(63, True), (65, False)])
@pytest.mark.parametrize("engine", ["TMT", "MuJoCo"])
def test_the_distance_of_each_engine_from_the_exact_value_is_checked(eps, passes, engine):
    off = [0.0, eps * EPS]
    ours, theirs = (off, [0.0, 0.0]) if engine == "TMT" else ([0.0, 0.0], off)
    checks, row = agreed(ours, theirs, 1.0, exact=[0.0, 0.0])
    assert [check.quantity for check in checks] == ["Mbar", "Mbar, TMT to exact", "Mbar, MuJoCo to exact"]
    by_name = {check.quantity: check for check in checks}
    assert by_name[f"Mbar, {engine} to exact"].passed is passes
    other = "MuJoCo" if engine == "TMT" else "TMT"
    assert by_name[f"Mbar, {other} to exact"].value == 0.0
    found = {"TMT": row["tmt_from_exact_eps"], "MuJoCo": row["mujoco_from_exact_eps"]}
    assert found == {engine: eps, other: 0.0}
    assert row["exact_states"] == 2


def test_how_much_of_a_tolerance_is_used_is_said_of_rounding_only():
    result = Result("mass")
    assert result.check("", "", 0.5, 2.0, "", rounding=True).over_tolerance == 0.25
    assert result.check("", "", 0.5, 2.0, "").over_tolerance is None
    assert result.check("", "", 0.0, 0.0, "", rounding=True).over_tolerance is None


@pytest.mark.parametrize(
    "rule, inside, outside",
    [
        ("at most", (1.0, 0.0, -9.0), (1.0 + 1e-15, 9.0)),
        ("at least", (1.0, 9.0), (1.0 - 1e-15, 0.0, -9.0)),
        ("equal", (1.0,), (1.0 - 1e-15, 1.0 + 1e-15, 0.0)),
    ],
)
def test_a_check_passes_within_its_tolerance_only(rule, inside, outside):
    result = Result("mass")
    for passes, values in ((True, inside), (False, outside), (False, (None, np.nan, np.inf, -np.inf))):
        for value in values:
            check = result.check("zero", "Mbar", value, 1.0, "kg m2", rounding=True, rule=rule)
            assert check.passed is passes and check.record()["passed"] is passes and check.record()["rule"] == rule
            assert check.over_tolerance == check.value
            assert ("no number" in str(check)) == (check.value is None)


@pytest.mark.parametrize("tolerance, rule", [(np.inf, "at most"), (np.nan, "at most"), (1.0, "below")])
def test_a_check_has_a_rule_and_a_finite_tolerance(tolerance, rule):
    with pytest.raises(ValueError, match="is no rule with a finite tolerance"):
        Result("mass").check("zero", "Mbar", 0.0, tolerance, "kg m2", rule=rule)


@pytest.mark.parametrize("place", list(np.ndindex(3, 3)))
def test_every_component_of_a_state_is_compared(place):
    values = np.zeros((4, 3, 3))
    values[(2, *place)] = -3.0
    assert largest(values).tolist() == [0.0, 0.0, 3.0, 0.0]


@pytest.mark.parametrize("eps, passes", [(63, True), (65, False)])
@pytest.mark.parametrize("entry", [(0, 0, 0), (1, 1, 0), (2, 0, 1)])
def test_each_entry_has_its_own_tolerance_if_the_scale_has(eps, passes, entry):
    """A small entry that is off fails beside a large one that is off by more, and passes where it may be."""
    scale, result, of = np.full((3, 2, 2), 100.0), Result("mass"), sample(3)
    scale[entry] = 1e-3
    theirs = np.full((3, 2, 2), 50 * EPS)
    theirs[entry] = eps * EPS * 1e-3
    result.agree(of, "Mbar", "kg m2", np.zeros((3, 2, 2)), theirs, scale)
    (check,), (row,) = result.checks, result.rows
    assert check.passed is passes and check.value == theirs[entry] and check.tolerance == 64 * EPS * 1e-3
    assert row["scale"] == 1e-3 and row["difference_eps"] == eps and check.note.startswith(f"state {entry[0]}:")


def test_a_scale_of_each_entry_may_be_the_same_for_all_states_or_bodies():
    differences = np.arange(12.0).reshape(2, 3, 2)
    for scale in (np.array([[[1.0, 4.0]]]), np.broadcast_to([1.0, 4.0], (5, 3, 2))):
        found, of = worst_of_each(differences, scale)
        assert found.tolist() == [4.0, 10.0] and of.tolist() == [1.0, 1.0]
    assert [a.tolist() for a in worst_of_each(differences, 2.0)] == [[5.0, 11.0], [2.0, 2.0]]
    assert [a.tolist() for a in worst_of_each(differences, np.array([2.0, 3.0, 9.0]))] == [[5.0, 11.0], [2.0, 3.0]]


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_an_entry_that_is_no_number_fails_whatever_the_others_are(bad):
    result, theirs = Result("mass"), np.ones((2, 2))
    theirs[1, 0] = bad
    result.agree(sample(2), "bias", "N m or N", np.zeros((2, 2)), theirs, np.ones((2, 2)))
    assert result.checks[0].value is None and not result.checks[0].passed


def test_nothing_may_differ_where_the_scale_is_zero():
    for value, passes in ((0.0, True), (1e-300, False)):
        result = Result("gravity")
        result.agree(
            sample(1), "holding torque", "N m", np.zeros((1, 2)), np.array([[value, 0.0]]), np.array([[0.0, 1.0]])
        )
        assert result.checks[0].passed is passes


def test_without_an_exact_state_nothing_is_compared_with_one():
    result, of = Result("mass"), sample(2, exact=0)
    result.agree(of, "Mbar", "kg m2", np.zeros((2, 1)), np.zeros((2, 1)), 1.0, truth="mass_matrix")
    assert [check.quantity for check in result.checks] == ["Mbar"] and result.rows[0]["tmt_from_exact_eps"] is None
    assert result.rows[0]["exact_states"] == 0
