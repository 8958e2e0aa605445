"""Which causes a diagnosis names for values of Mbar and h that differ: numbers, conventions, terms; and where it names none."""

from dataclasses import replace

import faults
import numpy as np
import pytest
from helpers.trees import one_body

import tmt
from compare.diagnosis import Values, diagnose
from compare.diagnosis.fit import Fitted
from compare.diagnosis.hypothesis import OF_ZERO, number
from compare.diagnosis.layout import packed


def states(tree=tmt.ARM, seed=0, count=16):
    """Positions and rates."""
    return np.random.default_rng(seed).uniform(-3.0, 3.0, (2, count, len(tree.axis)))


def as_values(entries, q, qd, tree=tmt.ARM):
    """The lower triangle of Mbar and h, (states, entries), as values with their tolerances."""
    i, j = np.tril_indices(q.shape[1])
    M = np.empty((*q.shape, q.shape[1]))
    M[:, i, j] = M[:, j, i] = entries[:, : len(i)]
    return Values.of(tree, q, qd, M, entries[:, len(i) :])


def values(tree=tmt.ARM, q=None, qd=None):
    """Mbar and h of a tree, (states, entries), at the arm's states where none are given."""
    q, qd = states() if q is None else (q, qd)
    return packed(tmt.mass_matrix(tree, q), tmt.bias(tree, q, qd))


def diagnosis(given, tree=tmt.ARM, seed=0, count=16, **more):
    """Of values, (states, entries), or of those of another Tree."""
    q, qd = states(tree, seed, count)
    given = values(given, q, qd) if isinstance(given, tmt.Tree) else given
    return diagnose(tree, as_values(given, q, qd, tree), **more)


ARM = tmt.ARM
DAMPED = replace(ARM, damping=(0.1, 0.2, 0.4))
HEAVY = replace(ARM, mass=(1.9, 1.52))
Q, QD = states()


@pytest.mark.parametrize("share, differs", [(0.999, False), (1.001, True)])
def test_a_difference_is_one_beyond_its_tolerance(share, differs):
    given = as_values(values(), Q, QD)
    allowed, right = given.tolerances[1], given.bias[5, 1]
    given.bias[5, 1] += share * allowed[5, 1]
    allowed[5, 1] = abs(given.bias[5, 1] - right) / share  # rounded as the sum is
    assert diagnose(ARM, given).differs is differs


def added(column, force, factor=1.0):
    """The arm's values with something added to one of M00, M10, M11, M20, M21, M22, h0, h1, h2."""
    given = values()
    given[:, column] = factor * given[:, column] + force
    return given


CAUSES = {  # the given values, or the tree whose values these are: rank, place and what explains it; whether it is the only one
    "a number": (HEAVY, 2, "mass of forearm", 1.52, True),
    "two masses exchanged": (replace(ARM, mass=ARM.mass[::-1]), 2, "masses of upper arm and forearm", "exchanged", True),
    "damping in h": (added(7, 0.1 * QD[:, 1]), 2, "damping of beta in h", 0.1, True),
    "a factor of both": (added(slice(None), 0.0, 2.0), 2, "all of M and h", 2.0, False),
    "a factor of a row": (added(7, 0.0, 1.25), 2, "h[beta]", 1.25, False),
    "a row in another": (added(6, -tmt.gravity_balance(tmt.ARM, Q)[:, 1]), 2, "gravity of h[beta] in h[alpha]", -1.0, False),
    "damping D qd in h": (added(slice(6, None), QD * DAMPED.damping), 1, "damping D qd", "in h", True),
    "-D qd in h": (added(slice(6, None), -QD * DAMPED.damping), 1, "damping D qd", "in h, of the other sign", True),
    "off-diagonal entries halved": (
        added([1, 3, 4], 0.0, 0.5), 1, "entries of M off the diagonal", "halved", True),
    "no bias": (added(slice(6, None), 0.0, 0.0), 1, "bias", "left out", False),
    "an armature": (added(5, 0.1), 2, "armature of gamma", 0.1, False),
    "two numbers": (
        replace(HEAVY, gravity=(0.0, 0.0, -9.8)), 3, "mass of forearm and gravity z", "1.52 and -9.8", False),
}  # fmt: skip


@pytest.mark.parametrize("given, rank, place, explains, alone", CAUSES.values(), ids=CAUSES)
def test_a_cause_is_named_with_its_value_and_its_rank(given, rank, place, explains, alone):
    causes = diagnosis(given, DAMPED if "D qd" in place else ARM).causes
    assert {cause.tied for cause in causes} == {len(causes) - 1}
    assert len(causes) == 1 or not alone
    (cause,) = (cause for cause in causes if cause.place == place)
    assert cause.rank == rank
    assert cause.explains == (explains if isinstance(explains, str) else pytest.approx(explains, rel=1e-9))
    assert cause.left_over < 1e-11


def test_what_nothing_explains_names_the_entries():
    given = added(1, np.sin(3.0 * Q[:, 0]))
    given[:, 8] += np.cos(5.0 * Q[:, 1]) * QD[:, 2] ** 3
    found = diagnosis(given, seconds=1.0)
    assert found.differs and found.causes == () and found.closest is None
    assert found.entries == ("M[alpha][beta]", "h[gamma]")


def test_a_robot_of_slides_alone_has_no_sine_that_is_wrong():
    """A number that nobody writes: causes that are likelier are sought, among them sines."""
    slides = replace(ARM, kind=("slide",) * 3)
    M = tmt.mass_matrix(slides, Q) + np.diag([0.1234567891, 0.0, 0.0])
    found = diagnose(slides, Values.of(slides, Q, QD, M, None))
    assert "armature of alpha" in {cause.place for cause in found.causes}


def test_a_number_that_is_zero_is_said_as_zero():
    """A double root is found to half the digits: M has the square of the length."""
    wheel = one_body([(0.0, 0.0, 1.0)], com=(0.3, 0.0, 0.0), mass=[2.0], inertia=0.1 * np.eye(3))
    q, qd = Q[:, :1], QD[:, :1]
    causes = diagnose(wheel, Values.of(wheel, q, qd, np.full((len(q), 1, 1), 0.1), 0.0 * q)).causes
    assert {cause.explains for cause in causes if cause.place == "CoM x of body"} == {0.0}


@pytest.mark.parametrize("changes, explains", [
    ((0.1, 0.2), True), ((0.1, 1e-13), False), ((1e-13, 0.2), False), ((-3.0, 0.2), False),
])  # fmt: skip
def test_each_of_two_numbers_has_a_part_in_what_they_explain(changes, explains):
    masses = [number(name, 2.0, "kg", least=0.0) for name in ("mass of a", "mass of b")]
    assert Fitted(tuple(masses), changes, 0.5, 0.0).explains is explains
    assert Fitted(tuple(masses[:1]), (1e-13,), 0.5, 0.0).explains


def test_rotors_divided_by_their_gears_are_one_cause():
    """The numbers have many digits, their ratios to the right ones few."""
    right, gears = np.array([0.777, 2.3, 0.583]), np.array([62.6, 107.8, 53.7])
    geared = replace(ARM, armature=right)
    cause, *_ = diagnosis(replace(ARM, armature=right / gears), geared).causes
    assert (cause.place, cause.kind) == ("armature of alpha, beta and gamma", "several")
    assert [float(x) for x in cause.explains.split(", ")] == pytest.approx((right / gears).tolist(), rel=1e-5)


def test_a_search_ends_by_the_clock_on_the_wall_and_says_so(monkeypatch):
    now = iter(np.arange(0.0, 1e6))
    monkeypatch.setattr("time.monotonic", lambda: next(now))  # each time it is asked a second has gone
    wrong = values()
    wrong[:, 0] += np.sin(5.0 * Q[:, 1])
    found = diagnosis(wrong, seconds=20.0)
    assert not found.causes and found.seconds == 20.0 and "not all kinds were tried" in found.sentence()
    assert next(now) < 40.0  # it is asked in every loop, and ends at once


def test_without_time_options_are_still_sought():
    found = diagnosis(HEAVY, seconds=0.0)
    assert found.differs and found.causes == ()
    found = diagnosis(replace(ARM, gravity=(0.0, 0.0, 9.81)), seconds=0.0)
    assert "sign of gravity" in {cause.place for cause in found.causes}


@pytest.mark.parametrize("count, too_few", [(3, 3), (4, 0)])
def test_of_fewer_than_four_positions_no_cause_is_told(count, too_few):
    found = diagnosis(HEAVY, count=count)
    assert found.differs and found.too_few == too_few and bool(found.causes) is (not too_few)


# two rods in a plane: M is 1.7 + cos(knee), 0.35 + cos(knee) / 2, 0.35
TREE = tmt.Tree(
    joint_names=("hip", "knee"), parent=(-1, 0), offset=((0.0, 0.0, 0.0), (0.0, 0.0, -1.0)), axis=((0.0, 1.0, 0.0),) * 2,
    damping=(0.0, 0.0), body_names=("upper", "lower"), body_joint=(0, 1), mass=(1.0, 1.0), com=((0.0, 0.0, -0.5),) * 2,
    inertia=(np.diag([0.1, 0.1, 0.01]).tolist(),) * 2, gravity=(0.0, 0.0, -9.81),
)  # fmt: skip
RODS, SPEEDS = states(TREE)
HIP, KNEE = RODS.T
M00, M10, M11, H0, H1 = range(5)


def told(changes, bias=lambda q, qd: tmt.bias(TREE, q, qd)):
    """What is found of Mbar and of a function of q and qd, with something added to some entries."""
    M = tmt.mass_matrix(TREE, RODS)

    def all_entries(qd):
        given = packed(M, bias(RODS, qd))
        for entry, change in changes.items():
            given[:, entry] += change
        return given

    return diagnosis(all_entries(SPEEDS), TREE, bias=lambda qd: all_entries(qd)[:, H0:])


LOWER = 4.905 * (np.sin(HIP - KNEE) - np.sin(HIP + KNEE))


@pytest.mark.parametrize("added, factor, places", [
    (-2.0, -1.0, {"(offset of knee)^2 in v^2 of lower in M[hip][hip]"}),
    (np.cos(KNEE), 2.0, {"2 (offset of knee) * (CoM of lower) in v^2 of lower in M[hip][hip]"}),
    (-0.1, 0.0, {"rotational inertia of lower in M[hip][hip]", "rotational inertia of upper in M[hip][hip]"}),
])  # fmt: skip
def test_a_slip_in_one_part_of_M_comes_before_unusual_factors_of_other_terms(added, factor, places):
    causes = told({M00: added}).causes
    assert places <= {cause.place for cause in causes}
    assert all(cause.explains == pytest.approx(factor, abs=1e-9) for cause in causes if cause.unit == "times")


@pytest.mark.parametrize("added, place, explains", [
    ({M10: 0.5 * np.sin(KNEE) - 0.5 * np.cos(KNEE)}, "M[hip][knee]", "0.5 sin(knee) instead of 0.5 cos(knee)"),
    ({M11: 0.35 * np.cos(HIP) - 0.35}, "M[knee][knee]", "0.35 cos(hip) instead of 0.35"),
    ({M00: 0.3 * (np.sin(HIP) - np.cos(HIP)) * np.cos(KNEE) ** 2}, "M[hip][hip]",
     "0.3 sin(hip) cos(knee)^2 instead of 0.3 cos(hip) cos(knee)^2"),
    ({H1: 0.3 * np.sin(HIP)}, "h[knee], gravity", "0.3 sin(hip) added"),
    ({M10: np.cos(KNEE) * (np.cos(KNEE) - 1.0) / 2.0}, "M[hip][knee]", "0.5 cos(knee)^2 instead of 0.5 cos(knee)"),
    ({H0: LOWER}, "h[hip], gravity", "4.905 sin(hip - knee) instead of 4.905 sin(hip + knee)"),
])  # fmt: skip
def test_another_function_of_an_angle_is_named_with_its_coefficient(added, place, explains):
    assert (place, explains) in [(cause.place, cause.explains) for cause in told(added).causes]


@pytest.mark.parametrize("size, is_near", [(0.02, True), (0.05, False)])
def test_the_nearest_cause_is_told_if_it_leaves_less_than_a_twentieth(size, is_near):
    """Beside 0.4 in one entry, of which root 1/2 times the size is left."""
    closest = told({M00: 0.4 + size * np.sin(3.0 * KNEE)}).closest
    assert 0.02 < closest.left_over < 0.05 if is_near else closest is None


@pytest.mark.parametrize("factor, is_cause", [(0.45, False), (0.5, True)])
def test_all_of_M_and_h_times_any_number_is_no_cause(factor, is_cause):
    found = diagnosis(values() * factor)
    assert ("all of M and h" in {cause.place for cause in found.causes}) is is_cause
    assert is_cause or "all of M" not in found.sentence()


def test_a_coefficient_that_nothing_explains_is_told_with_both_numbers():
    more = lambda q, qd: 0.2 * np.exp(q[:, :1]) * qd[:, :1] * qd[:, 1:] * [0, 1]  # noqa: E731
    found = told({}, lambda q, qd: tmt.bias(TREE, q, qd) + more(q, qd))
    (detail,) = found.details
    assert not found.causes and detail.name == "h[knee], coefficient of hip' knee'"
    assert (detail.right, abs(detail.yours)) == (0.0, pytest.approx(0.2 * np.exp(HIP).max()))
    assert f"{detail.yours:g}" in found.sentence()


@pytest.mark.parametrize("size", [1e-12, np.inf])
def test_neither_noise_nor_numbers_at_random_have_a_culprit(size):
    noise, right = np.random.default_rng(1).normal(size=(len(RODS), 5)), values(TREE, RODS, SPEEDS)
    found = diagnosis(right * (1.0 + size * noise) if size < 1.0 else noise, TREE)
    assert found.differs and found.causes == ()
    assert size < 1.0 or len(found.entries) == 5


@pytest.mark.parametrize("change, read, meant", [
    (90.0 - np.pi / 2.0 - 28.0 * np.pi, 90.0, np.pi / 2.0), (1.5707963 * (np.pi / 180.0 - 1.0), np.pi**2 / 360.0, np.pi / 2.0),
])  # fmt: skip
def test_a_zero_that_is_read_in_another_unit_is_its_angle(change, read, meant):
    cause = number("zero of knee", 0.0, "rad", kind=OF_ZERO).explained(change)
    assert (cause.kind, cause.explains, cause.stated) == ("number", pytest.approx(read), pytest.approx(meant))


@pytest.mark.slow
def test_no_fault_is_explained_by_something_else():
    """Of a sample of those of `python -m tests.faults`."""
    outcomes = [faults.outcome(fault)[0] for fault in faults.all_faults()[::23]]
    assert "wrong" not in outcomes and sum(of in ("named", "tied") for of in outcomes) >= 0.75 * len(outcomes)
