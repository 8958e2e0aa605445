"""What acts in accelerations besides Mbar and h."""

import numpy as np
import pytest

import tmt
from compare.diagnosis import Values
from compare.diagnosis.forces import LeftOver
from compare.judge.entries import Entries
from compare.judge.scale import EPS, FACTOR

Q, QD, TAU = np.random.default_rng(0).uniform(-3.0, 3.0, (3, 24, 3))
VALUES = Values.of(tmt.ARM, Q, QD, tmt.mass_matrix(Q), tmt.bias(Q, QD))
H, QDD = VALUES.bias, tmt.acceleration(Q, QD, TAU)
TOLERANCE = 1e-12


def causes(acting):
    """Of what acts besides tau - D qd - h."""
    left_over = LeftOver(tmt.ARM, VALUES, TAU, QDD)
    left_over.force, left_over.tolerance = acting, np.full_like(QD, TOLERANCE)
    return left_over.causes


FORCES = {  # what acts besides: rank, place, and what explains it
    "torque of the other sign": (2 * TAU, 1, "torque in the acceleration", "of the other sign"),
    "no bias": (-H, 1, "bias in the acceleration", "left out"),
    "damping": (0.1 * QD * [0, 1, 0], 2, "damping of beta", 0.1),
    "stiffness": (2.0 * Q * [0, 0, 1], 2, "stiffness of gamma", 2.0),
    "friction": (0.3 * np.sign(QD) * [1, 0, 0], 2, "friction of alpha", 0.3),
    "a constant force": (-0.4 * np.ones_like(QD) * [0, -1, 0], 2, "constant force at beta", 0.4),
    "damping of all": (0.7 * QD, 2, "damping added to every joint", 0.7),
    "damping of two": (QD * [0.1, 0.2, 0.0], 3, "damping of alpha and damping of beta", "0.1 and 0.2"),
}


@pytest.mark.parametrize("force, rank, place, explains", FORCES.values(), ids=FORCES)
def test_what_acts_besides_is_named(force, rank, place, explains):
    (cause,) = causes(force)
    assert (cause.rank, cause.place) == (rank, place)
    assert cause.explains == (explains if isinstance(explains, str) else pytest.approx(explains))


def test_neither_a_damper_nor_friction_below_zero_is_named():
    assert causes(-0.1 * QD * [0, 1, 0]) == causes(-0.3 * np.sign(QD) * [1, 0, 0]) == ()


@pytest.mark.parametrize("share, found", [(0.99, True), (1.01, False)])
def test_a_cause_leaves_no_more_than_the_tolerance(share, found):
    acting = 0.1 * QD * [0, 1, 0]
    acting[3, 0] += share * TOLERANCE
    assert any(cause.place == "damping of beta" for cause in causes(acting)) is found


@pytest.mark.parametrize("share, differs", [(0.95, False), (1.05, True)])
def test_accelerations_are_off_by_four_times_the_scale_of_a_force(share, differs):
    """They are rounded before Mbar is multiplied by them."""
    off, scale = np.zeros_like(QD), Entries(tmt.ARM, Q, QD)
    off[5, 1] = share * 4.0 * FACTOR * EPS * scale.residual(scale.force(TAU), QDD)[5, 1]
    wrong = QDD + np.linalg.solve(VALUES.mass_matrix, off[..., None])[..., 0]
    assert LeftOver(tmt.ARM, VALUES, TAU, QDD).ratio <= 1.0
    assert (LeftOver(tmt.ARM, VALUES, TAU, wrong).ratio > 1.0) == differs
