"""What acts in accelerations besides Mbar and h."""

from dataclasses import replace

import numpy as np
import pytest

import tmt
from compare.diagnosis.forces import causes_of_forces

ARM = tmt.ARM
Q, QD, TAU = np.random.default_rng(0).uniform(-3.0, 3.0, (3, 24, 3))
M, H = tmt.mass_matrix(Q), tmt.bias(Q, QD)
TOLERANCE = 1e-12


def causes(qdd, tree=ARM):
    acting = TAU - np.array(tree.damping) * QD - H - np.einsum("sij,sj->si", M, qdd)
    return causes_of_forces(tree, Q, QD, TAU, H, acting, np.full_like(QD, TOLERANCE))


def acceleration(force):
    return np.linalg.solve(M, force[..., None])[..., 0]


OPTIONS = {
    "torque in the acceleration: of the other sign": -TAU - H,
    "torque in the acceleration: left out": -H,
    "bias in the acceleration: of the other sign": TAU + H,
    "bias in the acceleration: left out": TAU,
}


@pytest.mark.parametrize("text, force", OPTIONS.items(), ids=OPTIONS)
def test_options(text, force):
    (cause,) = causes(acceleration(force))
    assert (cause.rank, cause.text) == (1, text)


def test_damping_left_out_of_a_damped_tree():
    (cause,) = causes(acceleration(TAU - H), replace(ARM, damping=(0.1, 0.2, 0.3)))
    assert cause.text == "damping in the acceleration: left out"


NUMBERS = {
    "damping of beta": (-0.1 * QD * [0, 1, 0], 0.1),
    "stiffness of gamma": (-2.0 * Q * [0, 0, 1], 2.0),
    "friction of alpha": (-0.3 * np.sign(QD) * [1, 0, 0], 0.3),
    "constant force at beta": (0.4 * np.ones_like(QD) * [0, -1, 0], 0.4),
    "damping of every joint": (-0.7 * QD, 0.7),
}


@pytest.mark.parametrize("place, more", NUMBERS.items(), ids=NUMBERS)
def test_one_number(place, more):
    force, value = more
    (cause,) = causes(acceleration(TAU - H + force))
    assert (cause.rank, cause.place) == (2, place) and abs(cause.explains) == pytest.approx(value)


@pytest.mark.parametrize("force", [0.1 * QD * [0, 1, 0], 2.0 * Q * [0, 0, 1], 0.3 * np.sign(QD) * [1, 0, 0]])
def test_no_damping_stiffness_or_friction_below_zero(force):
    assert causes(acceleration(TAU - H + force)) == []


def test_two_numbers():
    (cause,) = causes(acceleration(TAU - H - QD * [0.1, 0.2, 0.0]))
    assert cause.rank == 3 and cause.place == "damping of alpha and damping of beta"


def test_nothing_explains_what_is_random():
    assert causes(acceleration(TAU - H + np.random.default_rng(1).normal(size=TAU.shape))) == []


@pytest.mark.parametrize("share, found", [(0.99, True), (1.01, False)])
def test_a_cause_leaves_no_more_than_the_tolerance(share, found):
    acting = 0.1 * QD * [0, 1, 0]
    acting[3, 0] += share * TOLERANCE
    causes = causes_of_forces(ARM, Q, QD, TAU, H, acting, np.full_like(QD, TOLERANCE))
    assert any(cause.place == "damping of beta" for cause in causes) is found
