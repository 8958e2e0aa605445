"""What acts in accelerations besides Mbar and h, and what explains single steps that are not those of their scheme."""

from dataclasses import replace

import numpy as np
import pytest

import tmt
from compare.diagnosis.forces import causes_of_forces
from compare.diagnosis.steps import Altered, Steps, diagnose_steps, stepped_once, tolerance_of_step
from tmt.methods import method_named

Q, QD, TAU = np.random.default_rng(0).uniform(-3.0, 3.0, (3, 24, 3))
H = tmt.bias(Q, QD)
TOLERANCE = 1e-12
DAMPED = replace(tmt.ARM, damping=(0.5, 0.2, 0.1))


def causes(acting, tree=tmt.ARM):
    """Of what acts besides tau - D qd - h."""
    return causes_of_forces(tree, Q, QD, TAU, H, acting, np.full_like(QD, TOLERANCE))


FORCES = {  # what acts besides: rank, place, and what explains it
    "torque of the other sign": (2 * TAU, 1, "torque in the acceleration", "of the other sign"),
    "no bias": (-H, 1, "bias in the acceleration", "left out"),
    "damping": (0.1 * QD * [0, 1, 0], 2, "damping of beta", 0.1),
    "stiffness": (2.0 * Q * [0, 0, 1], 2, "stiffness of gamma", 2.0),
    "friction": (0.3 * np.sign(QD) * [1, 0, 0], 2, "friction of alpha", 0.3),
    "a constant force": (-0.4 * np.ones_like(QD) * [0, -1, 0], 2, "constant force at beta", 0.4),
    "damping of all": (0.7 * QD, 2, "damping of every joint", 0.7),
    "damping of two": (QD * [0.1, 0.2, 0.0], 3, "damping of alpha and damping of beta", "0.1 and 0.2"),
}


def is_named(cause, rank, place, explains):
    found = cause.explains if isinstance(explains, str) else pytest.approx(cause.explains)
    return (cause.rank, cause.place) == (rank, place) and found == explains


@pytest.mark.parametrize("force, rank, place, explains", FORCES.values(), ids=FORCES)
def test_what_acts_besides_is_named(force, rank, place, explains):
    (cause,) = causes(force)
    assert is_named(cause, rank, place, explains)


def test_neither_a_damper_nor_friction_below_zero_is_named():
    assert causes(-0.1 * QD * [0, 1, 0]) == causes(-0.3 * np.sign(QD) * [1, 0, 0]) == []


@pytest.mark.parametrize("share, found", [(0.99, True), (1.01, False)])
def test_a_cause_leaves_no_more_than_the_tolerance(share, found):
    acting = 0.1 * QD * [0, 1, 0]
    acting[3, 0] += share * TOLERANCE
    assert any(cause.place == "damping of beta" for cause in causes(acting)) is found


# single steps

DT = 0.01
START, SPEED = np.random.default_rng(2).uniform(-3.0, 3.0, (2, 6, 3))
TORQUE = np.random.default_rng(1).uniform(-5.0, 5.0, SPEED.shape)


def steps(method, dt=DT):
    method = method_named(method) if isinstance(method, str) else method
    after = stepped_once(method, DAMPED, Steps(START, SPEED, TORQUE, DT, START, SPEED), dt)
    return Steps(START, SPEED, TORQUE, DT, after[:, :3], after[:, 3:])


WRONG = {  # the method and the step, and the scheme that is named: rank, place, what explains
    "scheme": ("rk4", DT, "semi_implicit_euler", 1, "scheme", "rk4"),
    "dt": ("rk4", 0.02, "rk4", 2, "dt", 0.02),
    "sign": (Altered(True, of_bias=-1.0), DT, "implicit", 2,
             "derivative of the bias in the implicit step", "enters with the wrong sign"),
    "damping": (Altered(False, of_damping=0.0), DT, "semi_implicit_euler", 2, "damping in the implicit step", "explicit"),
}  # fmt: skip
TWO = ("explicit_euler", 0.005, "semi_implicit_euler", 3, "scheme and dt", "explicit_euler and 0.005")


@pytest.mark.parametrize(
    "method, dt, said, rank, place, explains",
    [*(pytest.param(*wrong, id=name) for name, wrong in WRONG.items()), pytest.param(*TWO, marks=pytest.mark.slow)],
)
def test_what_is_wrong_with_a_step_is_named(method, dt, said, rank, place, explains):
    ratio, (cause,) = diagnose_steps(DAMPED, steps(method, dt), said)
    assert ratio > 1e3 and cause.left_over < 1e-6 and is_named(cause, rank, place, explains)


def test_a_step_differs_beyond_its_tolerance_and_noise_has_no_culprit():
    right = steps("semi_implicit_euler")
    for share, differs in ((0.99, False), (1.01, True)):
        moved = right.after_qd.copy()
        moved[4, 1] += share * tolerance_of_step(DAMPED, right)[4, 4]
        ratio, named = diagnose_steps(DAMPED, right._replace(after_qd=moved), "semi_implicit_euler")
        assert (ratio > 1.0) is differs and named == ()
