"""What turns two sets of values into a verdict: which state is judged, by which tolerance, of which scale."""

import dataclasses

import mpmath
import numpy as np
import pytest

import tmt
from compare import agreement
from compare.agreement import Result, Sample, Setup

EPS = 2.0**-52


def sample(states=4, exact=2):
    """States at which nothing is computed: the values come from the test."""
    q = np.arange(3.0 * states).reshape(states, 3)
    return Sample("some states", q, q + 100.0, q + 200.0, exact)


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
    assert result.check("", "", 0.5, 2.0, "", rounding=True).over_bar == 0.25
    assert result.check("", "", 0.5, 2.0, "").over_bar is None
    assert result.check("", "", 0.0, 0.0, "", rounding=True).over_bar is None


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
            assert check.over_bar == check.value
            assert ("no number" in str(check)) == (check.value is None)


@pytest.mark.parametrize("tolerance, rule", [(np.inf, "at most"), (np.nan, "at most"), (1.0, "below")])
def test_a_check_has_a_rule_and_a_finite_tolerance(tolerance, rule):
    with pytest.raises(ValueError, match="is no rule with a finite tolerance"):
        Result("mass").check("zero", "Mbar", 0.0, tolerance, "kg m2", rule=rule)


@pytest.mark.parametrize("place", list(np.ndindex(3, 3)))
def test_every_component_of_a_state_is_compared(place):
    values = np.zeros((4, 3, 3))
    values[(2, *place)] = -3.0
    assert agreement.largest(values).tolist() == [0.0, 0.0, 3.0, 0.0]


# scales, from the stated numbers written out


Q = np.random.default_rng(3).uniform(-3, 3, (20, 3))
QD = np.random.default_rng(4).uniform(-5, 5, (20, 3))


def test_reaches_and_the_scale_of_gravity():
    assert np.allclose(agreement.reaches(), [0.15, 0.3 + 0.15], rtol=1e-15)
    assert agreement.gravity_scale() == pytest.approx(9.81 * (1.9 * 0.15 + 1.5 * 0.45), rel=1e-15)
    doubled = dataclasses.replace(tmt.ARM, gravity=(0.0, 3.0, -4.0))
    assert agreement.gravity_scale(doubled) == pytest.approx(5.0 * (1.9 * 0.15 + 1.5 * 0.45), rel=1e-15)


def test_the_scale_of_the_bias_is_the_sum_of_its_absolute_terms():
    """State by state and body by body, without the sums of the code under test."""
    for q, qd, scale in zip(Q, QD, agreement.bias_scale(Q, QD)):
        T, B = tmt.jacobians(q)
        v, w = tmt.convective_terms(q, qd)
        terms = np.zeros(3)
        for b in range(2):
            inertia, omega = np.array(tmt.ARM.inertia[b]), B[b] @ qd
            moment = np.abs(inertia @ w[b]) + np.abs(np.cross(omega, inertia @ omega))
            terms += np.abs(T[b]).T @ (tmt.ARM.mass[b] * np.abs(v[b])) + np.abs(B[b]).T @ moment
        assert scale == pytest.approx(terms.max() + 9.4176, rel=1e-12)
    at_rest = agreement.bias_scale(Q, 0.0 * QD)
    assert np.allclose(at_rest, 9.4176, rtol=1e-14)


def test_the_scales_of_mass_and_acceleration():
    M = tmt.mass_matrix(Q)
    assert np.array_equal(agreement.mass_scale(Q), [abs(m).max() for m in M])
    assert np.allclose(agreement.condition(Q), [np.linalg.norm(m, 2) * np.linalg.norm(np.linalg.inv(m), 2) for m in M])
    inverse, norm = (np.array([np.linalg.norm(f(m), 2) for m in M]) for f in (np.linalg.inv, lambda m: m))
    force = np.linspace(1.0, 20.0, 20)
    assert np.allclose(agreement.acceleration_scale(Q, force), (inverse * norm + 1.0) * inverse * force)
    assert np.allclose(agreement.acceleration_scale(Q, force, 2.0), inverse * (norm * 2.0 + force))


def test_the_states_are_spread_and_the_same_in_every_run(engine):
    first, again = (Setup(engine, states=500).random for _ in range(2))
    assert np.array_equal(first.q, again.q) and np.array_equal(first.tau, again.tau)
    assert np.abs(first.q).max() <= np.pi and np.ptp(first.q, axis=0).min() > 6.0
    assert np.ptp(first.qd, axis=0).min() > 19.0 and np.ptp(first.tau, axis=0).min() > 19.0
    assert not np.array_equal(first.qd, first.tau)
    named = Setup(engine).named
    assert named.exact_states == len(named.q) == 5 and np.abs(named.qd).min() > 0.0


def test_sizes_of_a_run(engine):
    full, quick, small = Setup(engine), Setup.quick(engine), Setup.small(engine)
    assert [s.of("f", "q", "s") for s in (full, quick, small)] == ["f", "q", "s"]
    assert (full.states, full.exact_states, full.steps) == (10_000, 200, (64, 1024, 8192))
    assert full.is_quick is small.is_quick is False and quick.is_quick is True
