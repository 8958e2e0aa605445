"""What no body can have is not offered, nor two numbers that fit anything; all that explains as well as a joint's sense is."""

from dataclasses import replace

import numpy as np
import pytest
from diagnosed import diagnosis, states, tolerance, values

import tmt
from compare.diagnosis import diagnose, packed
from compare.diagnosis.possible import is_inertia

ARM = tmt.ARM


@pytest.mark.parametrize("moments, seen, of_body, possible", [
    ((1.0, 1.0, 1.0), [0, 1, 2], True, True), ((1.0, 1.0, 2.0), [0, 1, 2], True, True),
    ((1.0, 1.0, 2.01), [0, 1, 2], True, False),
    ((1.0, 1.0, 2.01), [0, 1, 2], False, True), ((1.0, 1.0, -0.01), [0, 1, 2], False, False),
    ((1.0, 9.0, 1.0), [1], True, True), ((1.0, -0.1, 1.0), [1], True, False), ((1.0, -0.1, 1.0), [0, 2], True, True),
])  # fmt: skip
def test_the_inertia_of_a_rigid_body(moments, seen, of_body, possible):
    assert is_inertia(np.diag(moments), seen, of_body) is possible


def given_inertia(place, change):
    """The arm's values with a number of the forearm's inertia changed, whether a body can have it or not."""
    q, qd = states()
    turns, w_conv = tmt.jacobians(q)[1][:, 1], tmt.convective_terms(q, qd)[1][:, 1]
    omega = np.einsum("sci,si->sc", turns, qd)
    inertia = np.zeros((3, 3))
    inertia[place] = change
    moment = w_conv @ inertia + np.cross(omega, omega @ inertia)
    M = tmt.mass_matrix(q) + np.einsum("sci,cd,sdj->sij", turns, inertia, turns)
    return packed(M, tmt.bias(q, qd) + np.einsum("sci,sc->si", turns, moment), 3, len(q))


def test_a_slip_in_a_moment_of_inertia_is_named_with_what_it_is_not():
    (possible,) = diagnosis(given_inertia((1, 1), 0.001)).causes
    assert possible.text == "inertia yy of forearm: 0.02 kg m2 in place of 0.019 would explain it"
    (other,) = diagnosis(given_inertia((1, 1), 0.171)).causes
    assert other.explains == pytest.approx(0.19) and other.text.startswith("inertia yy of forearm: 0.19 kg m2")
    assert "no rigid body" in other.text
    assert not any("inertia yy" in cause.place for cause in diagnosis(given_inertia((1, 1), -0.03)).causes)


@pytest.mark.parametrize("change, is_offered", [(0.1, True), (-0.1, False)])
def test_no_armature_and_no_damping_below_zero(change, is_offered):
    q, qd = states()
    M, h = tmt.mass_matrix(q), tmt.bias(q, qd)
    M[:, 2, 2] += change / 3.0
    found = diagnosis(packed(M, h, 3, len(q)))
    assert any(cause.place == "armature of gamma" for cause in found.causes) is is_offered
    h[:, 2] += change * qd[:, 2]
    found = diagnosis(packed(tmt.mass_matrix(q), h, 3, len(q)))
    assert any(cause.place == "damping of gamma in h" for cause in found.causes) is is_offered


def test_a_factor_beside_a_number_is_not_offered():
    """M[gamma][gamma] + a and times b: both together make any number of it and of what it is added to."""
    q, qd = states()
    given = values(ARM, q, qd)
    given[:, 0] = 0.8125 * given[:, 0] + 0.1529
    assert diagnosis(given).causes == ()


OFFSET = replace(
    ARM,
    hinge_names=("yaw", "shoulder", "elbow"),
    axis=((0.0, 0.0, 1.0), (0.0, 1.0, 0.0), (0.0, 1.0, 0.0)),
    offset=((0.0, 0.0, 0.0), (0.0, 0.12, 0.2), (0.4, 0.0, 0.0)),
)


def test_what_explains_as_well_as_a_joints_sense_is_listed():
    q, qd = states(OFFSET)
    wrong = replace(OFFSET, offset=((0.0, 0.0, 0.0), (0.0, -0.12, 0.2), (0.4, 0.0, 0.0)))
    found = diagnose(OFFSET, OFFSET.hinge_names, q, qd, values(wrong, q, qd), tolerance(OFFSET, q, qd))
    texts = [cause.text for cause in found.causes]
    assert "sense of yaw: - (state it as joints=['-yaw', 'shoulder', 'elbow'])" in texts
    assert "offset y of shoulder: -0.12 m in place of 0.12 would explain it" in texts
    assert "State joints only if yours are defined so" in found.sentence
    assert all(cause.tied == len(texts) - 1 for cause in found.causes)


def test_two_masses_exchanged_are_one_slip():
    (cause,) = diagnosis(replace(ARM, mass=ARM.mass[::-1])).causes
    assert cause.text == "masses of upper arm and forearm: exchanged"
