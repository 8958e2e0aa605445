"""Which causes a diagnosis names for values of Mbar and h that differ, and where it names none."""

from dataclasses import replace

import numpy as np
import pytest
from diagnosed import diagnosis, states, tolerance, values

import tmt
from compare.diagnosis import OF_NO_BODY, diagnose, packed

ARM = tmt.ARM
HEAVY = replace(ARM, mass=(1.9, 1.52))
Q, QD = states()


@pytest.mark.parametrize("share, differs", [(0.999, False), (1.001, True)])
def test_a_difference_is_one_beyond_its_tolerance(share, differs):
    given, allowed = values(), tolerance(ARM, Q, QD)
    given[5, 7] += share * allowed[5, 7]
    allowed[5, 7] = abs(given[5, 7] - values()[5, 7]) / share  # rounded as the sum is
    assert diagnose(ARM, ARM.hinge_names, Q, QD, given, allowed).differs is differs


def added(column, force, factor=1.0):
    """The arm's values with something added to one of M00, M10, M11, M20, M21, M22, h0, h1, h2."""
    given = values()
    given[:, column] = factor * given[:, column] + force
    return given


def given_inertia(change):
    """The arm's values with another moment of inertia yy of the forearm, whether a body can have it or not."""
    turns, w_conv = tmt.jacobians(Q)[1][:, 1], tmt.convective_terms(Q, QD)[1][:, 1]
    omega = np.einsum("sci,si->sc", turns, QD)
    inertia = np.diag([0.0, change, 0.0])
    moment = w_conv @ inertia + np.cross(omega, omega @ inertia)
    M = tmt.mass_matrix(Q) + np.einsum("sci,cd,sdj->sij", turns, inertia, turns)
    return packed(M, tmt.bias(Q, QD) + np.einsum("sci,sc->si", turns, moment), 3, len(Q))


CAUSES = {  # the given values, or the tree whose values these are: rank, place and what explains it; whether it is the only one
    "a number": (HEAVY, 2, "mass of forearm", 1.52, True),
    "two masses exchanged": (
        replace(ARM, mass=ARM.mass[::-1]), 2, "masses of upper arm and forearm", "exchanged", True,
    ),
    "a moment of inertia that no body has": (given_inertia(0.171), 2, "inertia yy of forearm", 0.19, True),
    "damping in h": (added(7, 0.1 * QD[:, 1]), 2, "damping of beta in h", 0.1, True),
    "a factor of both": (added(slice(None), 0.0, 1.25), 2, "all of M and h", 1.25, False),
    "a factor of a row": (added(7, 0.0, 1.25), 2, "h[beta]", 1.25, False),
    "a row in another": (added(6, -tmt.gravity_balance(Q)[:, 1]), 2, "h[beta] at rest in h[alpha]", -1.0, False),
    "no bias": (added(slice(6, None), 0.0, 0.0), 1, "bias", "left out", False),
    "an armature": (added(5, 0.1), 2, "armature of gamma", 0.1, False),
    "two numbers": (
        replace(HEAVY, gravity=(0.0, 0.0, -9.8)), 3, "mass of forearm and gravity z", "1.52 and -9.8", False,
    ),
}  # fmt: skip


@pytest.mark.parametrize("given, rank, place, explains, alone", CAUSES.values(), ids=CAUSES)
def test_a_cause_is_named_with_its_value_and_its_rank(given, rank, place, explains, alone):
    causes = diagnosis(given).causes
    assert {cause.rank for cause in causes} == {rank} and {cause.tied for cause in causes} == {len(causes) - 1}
    assert len(causes) == 1 or not alone
    (cause,) = (cause for cause in causes if cause.place == place)
    assert cause.explains == (explains if isinstance(explains, str) else pytest.approx(explains, rel=1e-9))
    assert cause.left_over < 1e-11 and (OF_NO_BODY in cause.text) is (explains == 0.19)


def test_ties_are_all_listed():
    """The inertia of the upper arm about the axis of beta is the armature of beta."""
    inertia = np.array(ARM.inertia)
    inertia[0, 0, 0] += 0.001
    causes = diagnosis(replace(ARM, inertia=inertia.tolist())).causes
    assert {cause.place for cause in causes} >= {"inertia xx of upper arm", "armature of beta"}
    assert len({round(cause.explains - float(cause.stated), 12) for cause in causes[:2]}) == 1


def test_what_explains_as_well_as_the_sense_of_a_joint_is_listed():
    offset = ((0.0, 0.0, 0.0), (0.0, 0.12, 0.2), (0.4, 0.0, 0.0))
    axis = ((0.0, 0.0, 1.0), (0.0, 1.0, 0.0), (0.0, 1.0, 0.0))
    right = replace(ARM, hinge_names=("yaw", "shoulder", "elbow"), axis=axis, offset=offset)
    wrong = replace(right, offset=((0.0, 0.0, 0.0), (0.0, -0.12, 0.2), (0.4, 0.0, 0.0)))
    causes = {cause.place: cause for cause in diagnosis(wrong, right).causes}
    assert causes["offset y of shoulder"].explains == pytest.approx(-0.12)
    assert list(map(str, causes["sense of yaw"].joints.joints)) == ["-yaw", "shoulder", "elbow"]


def test_angles_to_the_world_are_an_option_of_parallel_hinges():
    """The turn of the last hinge, whose axis is opposite, enters with the other sign."""
    axis = ((0.0, 1.0, 0.0), (0.0, 1.0, 0.0), (0.0, -1.0, 0.0))
    row = replace(ARM, axis=axis, offset=((0.0, 0.0, 0.0), (0.2, 0.0, -0.1), (0.0, 0.0, -0.3)))
    turns = np.array([[1.0, 0.0, 0.0], [-1.0, 1.0, 0.0], [0.0, 1.0, 1.0]])  # joint angles from angles
    M, h = tmt.mass_matrix(Q @ turns.T, row), tmt.bias(Q @ turns.T, QD @ turns.T, row)
    given = packed(turns.T @ M @ turns, h @ turns, 3, len(Q))
    found = diagnose(row, row.hinge_names, Q, QD, given, 10.0 * tolerance(row, Q, QD))
    assert "angles" in {cause.place for cause in found.causes}


def test_a_factor_beside_a_number_is_not_offered():
    """M[alpha][alpha] + a and times b: both together make any number of it and of what it is added to."""
    assert diagnosis(added(0, 0.1529, 0.8125)).causes == ()


def test_what_nothing_explains_names_the_entries():
    given = added(1, np.sin(3.0 * Q[:, 0]))
    given[:, 8] += np.cos(5.0 * Q[:, 1]) * QD[:, 2] ** 3
    found = diagnosis(given, seconds=1.0)
    assert found.differs and found.causes == () and 0.0 < found.left <= 1.0
    assert found.entries == ("M[alpha][beta]", "h[gamma]")


def test_only_what_is_given_is_compared():
    found = diagnosis(packed(tmt.mass_matrix(Q, HEAVY), None, 3, len(Q)))
    assert "mass of forearm" in {cause.place for cause in found.causes} and found.compared == 6


def test_without_time_options_are_still_sought():
    found = diagnosis(HEAVY, seconds=0.0)
    assert found.differs and found.causes == () and found.searched
    found = diagnosis(replace(ARM, gravity=(0.0, 0.0, 9.81)), seconds=0.0)
    assert "sign of gravity" in {cause.place for cause in found.causes}


@pytest.mark.parametrize("count, too_few", [(3, 3), (4, 0)])
def test_of_fewer_than_four_positions_no_cause_is_told(count, too_few):
    q, qd = states(count=count)
    found = diagnose(ARM, ARM.hinge_names, q, qd, values(HEAVY, q, qd), tolerance(ARM, q, qd))
    assert found.differs and found.too_few == too_few and bool(found.causes) is (not too_few)
