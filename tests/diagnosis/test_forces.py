"""What acts in accelerations besides Mbar and h; conditions on Mbar and h that need no reference."""

from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from models import PATHS

import compare
import tmt
from compare.diagnosis import Values
from compare.diagnosis.consistency import conditions
from compare.diagnosis.forces import LeftOver
from compare.engines.mujoco import reading
from compare.judge.entries import Entries
from compare.judge.scale import EPS, FACTOR
from compare.robots.coordinates import Coordinates

Q, QD, TAU = np.random.default_rng(0).uniform(-3.0, 3.0, (3, 24, 3))
VALUES = Values.of(tmt.ARM, Q, QD, tmt.mass_matrix(tmt.ARM, Q), tmt.bias(tmt.ARM, Q, QD))
H, QDD = VALUES.bias, tmt.acceleration(tmt.ARM, Q, QD, TAU)
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


@pytest.mark.parametrize("share, differs", [(0.95, False), (1.05, True)])
def test_accelerations_are_off_by_four_times_the_scale_of_a_force(share, differs):
    """They are rounded before Mbar is multiplied by them."""
    off, scale = np.zeros_like(QD), Entries(tmt.ARM, Q, QD)
    off[5, 1] = share * 4.0 * FACTOR * EPS * scale.residual(scale.force(TAU), QDD)[5, 1]
    wrong = QDD + np.linalg.solve(VALUES.mass_matrix, off[..., None])[..., 0]
    assert LeftOver(tmt.ARM, VALUES, TAU, QDD).ratio <= 1.0
    assert (LeftOver(tmt.ARM, VALUES, TAU, wrong).ratio > 1.0) == differs


ARM = tmt.ARM
SKEW = 1e-6 * np.outer(*np.eye(3)[:2])
READ = [reading.read(PATHS[name]).tree for name in ("gripper", "free_body")]
SYMMETRIC, DEFINITE, EVEN, QUADRATIC = range(4)  # in the order in which they are asked


OF_ARM = partial(tmt.mass_matrix, ARM), partial(tmt.bias, ARM)


def asked(mass_matrix=OF_ARM[0], bias=OF_ARM[1], tree=ARM):
    coordinates, rng = Coordinates(tree.joint_names, tree.kind), np.random.default_rng(0)
    q = coordinates.move(np.tile(tree.zero, (12, 1)), rng.uniform(-2.0, 2.0, (12, coordinates.nv)))
    return conditions(mass_matrix, bias, coordinates, q, rng.uniform(-3.0, 3.0, (12, coordinates.nv)))


@pytest.mark.parametrize("tree", [ARM, *READ])
def test_right_equations_meet_all(tree):
    found = asked(lambda q: tmt.mass_matrix(tree, q), lambda q, qd: tmt.bias(tree, q, qd), tree)
    assert all(one.is_met for one in found) and len(found) == 4
    assert all(one.value < 0.5 * one.tolerance for one in found if one.rule == "at most")


def single(quantity):
    """As it is in single precision."""
    return lambda *states: quantity(*states).astype(np.float32).astype(float)


FAULTS = {
    "not symmetric": (lambda q: tmt.mass_matrix(tmt.ARM, q) + SKEW, OF_ARM[1], [SYMMETRIC]),
    "not definite": (lambda q: tmt.mass_matrix(tmt.ARM, q) - 0.1 * np.eye(3), OF_ARM[1], [DEFINITE]),
    "damping": (OF_ARM[0], lambda q, qd: tmt.bias(tmt.ARM, q, qd) + 1e-9 * qd, [EVEN]),
    "cubic": (OF_ARM[0], lambda q, qd: tmt.bias(tmt.ARM, q, qd) + 1e-6 * qd**4, [QUADRATIC]),
    "single precision, which is not blamed": (single(OF_ARM[0]), single(OF_ARM[1]), []),
}  # fmt: skip


@pytest.mark.parametrize("mass_matrix, bias, expected", FAULTS.values(), ids=FAULTS)
def test_each_condition_is_broken_by_its_fault(mass_matrix, bias, expected):
    found = asked(mass_matrix, bias)
    assert [k for k, condition in enumerate(found) if not condition.is_met] == expected


SPRUNG = replace(ARM, stiffness=(4.0, 6.0, 0.0), rest=(0.2, -0.3, 0.0), damping=(0.5, 0.2, 0.1))
H_OUTSIDE, SPRINGS = "how you solve for the acceleration", "springs in the acceleration"
CROSS = "force at alpha of the speed of beta"
OTHERWISE = {  # how accelerations are computed from Mbar, tau, the force of damping and springs, and h: the first cause
    "h outside": (lambda M, tau, passive, h: solved(M, tau - passive) - h, H_OUTSIDE),
    "all outside": (lambda M, tau, passive, h: solved(M, tau) - h - passive, H_OUTSIDE),
    "springs at zero": (
        lambda M, tau, passive, h: solved(M, tau - h - QD * SPRUNG.damping - Q * SPRUNG.stiffness), SPRINGS),
    "one damping of the other sign": (
        lambda M, tau, passive, h: solved(M, tau - h - passive + QD * [0, 0.4, 0]), "damping of beta"),
    "one spring of the other sign": (
        lambda M, tau, passive, h: solved(M, tau - h - passive + 8.0 * (Q - 0.2) * [1, 0, 0]), "stiffness of alpha"),
    "a cubic spring": (
        lambda M, tau, passive, h: solved(M, tau - h - passive - 3.0 * Q**3 * [0, 0, 1]), "force at gamma of gamma^3"),
    "damping on another joint": (
        lambda M, tau, passive, h: solved(M, tau - h - passive - 0.2 * QD[:, 1:2] * [1, 0, 0]), CROSS),
}  # fmt: skip


def solved(M, force):
    return np.linalg.solve(M, force[..., None])[..., 0]


@pytest.mark.parametrize("accelerations, place", OTHERWISE.values(), ids=OTHERWISE)
def test_how_accelerations_were_computed_is_named(accelerations, place):
    M, h = tmt.mass_matrix(SPRUNG, Q), tmt.bias(SPRUNG, Q, QD)
    passive = QD * SPRUNG.damping + (Q - SPRUNG.rest) * SPRUNG.stiffness
    left_over = LeftOver(SPRUNG, Values.of(SPRUNG, Q, QD, M, h), TAU, accelerations(M, TAU, passive, h))
    assert left_over.causes[0].place == place
    right = LeftOver(SPRUNG, Values.of(SPRUNG, Q, QD, M, h), TAU, solved(M, TAU - passive - h))
    assert right.ratio <= 1.0 and right.causes == ()


def test_displacements_from_the_world_are_named_of_accelerations_alone():
    """A load on a spring on a cart on a spring; both heights are measured from the world, as are their springs' forces."""
    cart = '<body name="cart"><joint name="z" type="slide" axis="0 0 1" stiffness="90" damping="4" springref=".1"/>{}</body>'
    load = '<body name="load" pos="0 0 .3"><joint name="lift" type="slide" axis="0 0 1" stiffness="40" damping="3"/>{}</body>'
    inertial = '<inertial pos="0 0 0" mass="{}" diaginertia="1 1 1"/>'
    text = cart.format(inertial.format(2) + load.format(inertial.format(5)))

    def acceleration(q, qd, tau):
        between = 40.0 * (q[1] - q[0]) + 3.0 * (qd[1] - qd[0])
        of_cart = tau[0] - 90.0 * (q[0] - 0.1) - 4.0 * qd[0] + between
        return np.array([of_cart / 2.0 - 9.81, (tau[1] - between) / 5.0 - 9.81])

    with pytest.raises(AssertionError, match="lift: measured from the world, not from cart"):
        compare.assert_agrees(f"<mujoco><worldbody>{text}</worldbody></mujoco>", acceleration=acceleration)
