"""What a diagnosis says, and where it names no culprit."""

from dataclasses import replace

import numpy as np
import pytest
from diagnosed import diagnosis, states, tolerance, values

import tmt
from compare.diagnosis import diagnose, packed

ARM = tmt.ARM
HEAVY = replace(ARM, mass=(1.9, 1.52))


def test_nothing_to_explain():
    found = diagnosis(ARM)
    assert not found.differs and found.causes == ()
    assert found.sentence == "There is nothing to explain: the equations agree."


@pytest.mark.parametrize("share, differs", [(0.999, False), (1.001, True)])
def test_a_difference_is_one_beyond_its_tolerance(share, differs):
    q, qd = states()
    given, allowed = values(ARM, q, qd), tolerance(ARM, q, qd)
    given[5, 7] += share * allowed[5, 7]
    exact = np.float64(given[5, 7]) - values(ARM, q, qd)[5, 7]
    assert abs(exact / allowed[5, 7] - share) < 0.02
    allowed[5, 7] = abs(exact) / share  # rounded as the sum is
    assert diagnose(ARM, ARM.hinge_names, q, qd, given, allowed).differs is differs


def test_one_number_is_found_with_its_value():
    (cause,) = diagnosis(HEAVY).causes
    assert (cause.rank, cause.place, cause.unit, cause.tied) == (2, "mass of forearm", "kg", 0)
    assert cause.explains == pytest.approx(1.52, rel=1e-12) and cause.left_over < 1e-11
    assert cause.text == "mass of forearm: 1.52 kg in place of 1.5 would explain it"


def test_ties_are_all_listed():
    """The inertia of the upper arm about the axis of beta is the armature of beta."""
    inertia = np.array(ARM.inertia)
    inertia[0, 0, 0] += 0.001
    found = diagnosis(replace(ARM, inertia=inertia.tolist()))
    assert {cause.place for cause in found.causes} >= {"inertia xx of upper arm", "armature of beta"}
    assert len({round(cause.explains - float(cause.stated), 12) for cause in found.causes[:2]}) == 1
    assert all(cause.tied == len(found.causes) - 1 for cause in found.causes)


def test_a_lower_rank_ends_the_search():
    found = diagnosis(replace(ARM, gravity=(0.0, 0.0, 0.0)))
    assert {cause.rank for cause in found.causes} == {1}
    assert "gravity" in {cause.place for cause in found.causes}


def test_two_numbers_are_of_rank_3():
    found = diagnosis(replace(ARM, mass=(1.9, 1.52), gravity=(0.0, 0.0, -9.8)))
    assert {cause.rank for cause in found.causes} == {3}
    cause = next(c for c in found.causes if set(c.place.split(" and ")) == {"mass of forearm", "gravity z"})
    assert cause.text.endswith("together they would explain it")


def test_what_nothing_explains_names_the_entries():
    q, qd = states()
    given = values(ARM, q, qd)
    given[:, 1] += np.sin(3.0 * q[:, 0])  # M[0][1]
    given[:, 8] += np.cos(5.0 * q[:, 1]) * qd[:, 2] ** 3  # h[2]
    found = diagnosis(given)
    assert found.differs and found.causes == ()
    assert found.entries == ("M[alpha][beta]", "h[gamma]")
    assert "M[alpha][beta] and h[gamma] differ, the others agree" in found.sentence
    assert found.sentence.startswith("No single change that is tried explains all of this, nor do two: ")
    assert 0.0 < found.left <= 1.0


@pytest.mark.parametrize("size", [1e-12, 1e-9, 1e-6, 1e-3])
@pytest.mark.parametrize("seed", [0, 1])
def test_noise_has_no_culprit(size, seed):
    given = values(ARM, *states(seed=seed))
    noisy = given * (1.0 + size * np.random.default_rng(seed).normal(size=given.shape))
    found = diagnosis(noisy, seed=seed)
    assert found.differs and found.causes == ()
    assert found.digits == pytest.approx(-np.log10(size), abs=1.5)
    assert (f"agree to {int(found.digits)} digits" in found.sentence) is (found.digits >= 2.0)


def test_rounded_constants_have_no_culprit():
    rng = np.random.default_rng(3)
    rounded = replace(
        ARM,
        mass=tuple(m * (1.0 + 1e-4 * rng.uniform(-1, 1)) for m in ARM.mass),
        com=tuple(tuple(x * (1.0 + 1e-4 * rng.uniform(-1, 1)) for x in com) for com in ARM.com),
        inertia=tuple(tuple(tuple(x * (1.0 + 1e-4 * rng.uniform(-1, 1)) for x in row) for row in body) for body in ARM.inertia),
        gravity=(0.0, 0.0, -9.8101),
    )  # fmt: skip
    found = diagnosis(rounded)
    assert found.causes == () and 3.0 <= found.digits <= 5.5


def test_equations_that_fit_nothing_have_no_culprit():
    found = diagnosis(np.random.default_rng(0).normal(size=(24, 9)))
    assert found.causes == () and "Every entry differs." in found.sentence


def test_only_what_is_given_is_compared():
    q = states()[0]
    given = packed(tmt.mass_matrix(q, HEAVY), None, 3, len(q))
    found = diagnosis(given)
    assert "mass of forearm" in {cause.place for cause in found.causes}
    assert found.compared == 6


def test_without_time_options_are_still_sought():
    found = diagnosis(HEAVY, seconds=0.0)
    assert found.differs and found.causes == () and "0 s options and conventions" in found.sentence
    found = diagnosis(replace(ARM, gravity=(0.0, 0.0, 9.81)), seconds=0.0)
    assert "sign of gravity" in {cause.place for cause in found.causes}


def test_damping_in_h_is_named():
    q, qd = states()
    given = values(ARM, q, qd)
    given[:, 7] += 0.1 * qd[:, 1]
    (cause,) = diagnosis(given).causes
    assert cause.place == "damping of beta in h" and cause.explains == pytest.approx(0.1)
