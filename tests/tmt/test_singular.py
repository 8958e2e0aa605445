"""Where Mbar is singular: what is refused there and what is not, with hinges, slides and balls."""

from dataclasses import replace

import numpy as np
import pytest
from helpers.trees import one_body, wrist

import tmt
from tmt.methods import METHODS, one_step

Z = np.zeros(3)
AT_ZERO = np.array([0.5, 0.0, 1.0])
DAMPED = replace(wrist(), damping=(0.1, 0.2, 0.3))
IMPLICIT = "semi_implicit_euler", "implicit", "implicitfast", "discrete"


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("q", [AT_ZERO, np.array([0.3, np.pi, 0.7])], ids=["exactly", "but for rounding"])
def test_a_step_from_a_singular_state_has_no_derivatives_and_says_why(method, q):
    """Where the method takes nothing implicitly that makes its matrix regular."""
    tree = wrist() if method in IMPLICIT else DAMPED
    with pytest.raises(ValueError, match=r"singular.*'a', 'c'"):
        tmt.step_derivatives(tree, np.array([[0.5, 0.3, 1.0], q]), Z, Z, 0.01, method)
    tmt.prepare(tree, "step_derivatives:rk4")
    with pytest.raises(ValueError, match=r"singular.*'a', 'c'"):
        tmt.step_derivatives(tree, q, Z, Z, 0.01, "rk4")


def test_of_many_states_one_that_is_singular_but_for_rounding_is_refused():
    q = np.tile([0.5, 0.3, 1.0], (1000, 1))
    assert np.isfinite(tmt.acceleration(wrist(), q, 0.0 * q, 0.0 * q)).all()
    for first, last in np.random.default_rng(2).uniform(-3.0, 3.0, (10, 2)):
        q[700] = first, np.pi, last
        with pytest.raises(ValueError, match=r"singular.*'a', 'c'"):
            tmt.acceleration(wrist(), q, 0.0 * q, 0.0 * q)


@pytest.mark.parametrize("method", IMPLICIT)
def test_damping_that_is_implicit_makes_a_step_regular(method):
    qd, tau, dt, h = np.array([0.3, -0.2, 0.5]), np.array([0.1, 0.0, 0.2]), 0.05, 1e-6
    A, B = tmt.step_derivatives(DAMPED, AT_ZERO, qd, tau, dt, method)

    def after(x):
        return np.concatenate(
            one_step(METHODS[method], DAMPED, *(part.tolist() for part in np.split(x, 3)), dt)
        )

    x = np.concatenate([AT_ZERO, qd, tau])
    columns = [(after(x + h * unit) - after(x - h * unit)) / (2.0 * h) for unit in np.eye(9)]
    assert np.abs(np.hstack([A, B]) - np.transpose(columns)).max() < 1e-8


X, Y = np.eye(3)[:2]


def rail(tilt, **more):
    """Two slides, the second tilted against the first, and a hinge: singular if they are parallel."""
    return one_body(
        [X, np.cos(tilt) * X + np.sin(tilt) * Y, Y], ["slide", "slide", "hinge"], (0.1, 0.0, 0.2), **more
    )


def test_slides_that_are_parallel_are_refused_and_by_their_names():
    with pytest.raises(ValueError, match=r"slides 'a', 'b' move together without moving any mass"):
        rail(0.0)
    with pytest.raises(ValueError, match="slides 'a', 'b'"):
        rail(1e-8)  # what is left, sin(tilt)^2 of the mass, is rounding
    assert rail(2e-3).never_singular and not rail(5e-4).never_singular
    assert rail(0.0, armature=[1.0, 0.0, 0.0]).never_singular


def swing():
    """A slide on a hinge, along the hinge's own arm, with a point mass: singular where it is on the axis."""
    return one_body(
        [Y, X],
        ["hinge", "slide"],
        inertia=np.zeros((3, 3)),
        offset=np.zeros((2, 3)),
        gravity=(0.0, 0.0, -9.81),
    )


def test_a_slide_that_takes_its_mass_to_the_axis_of_a_hinge_is_singular_there_alone():
    """Mbar = diag(m r^2, m): 64 eps n of the most that it could be, m (1 m)^2, is zero."""
    tree, least = swing(), np.sqrt(2 * 64 * np.finfo(float).eps)
    assert not tree.never_singular
    for r, is_singular in ((0.0, True), (0.98 * least, True), (1.02 * least, False), (0.3, False)):
        if is_singular:
            with pytest.raises(ValueError, match="hinge 'a' turns without moving any mass"):
                tmt.acceleration(tree, [0.2, r], [0.0, 0.0], [0.1, 0.2])
        else:
            qdd = tmt.acceleration(tree, [0.2, r], [0.0, 0.0], [0.1, 0.2])
            expected = (0.1 + 9.81 * r * np.cos(0.2)) / r**2, 0.2 + 9.81 * np.sin(0.2)
            assert np.allclose(qdd, expected, rtol=1e-9)
    motion = tmt.simulate(tree, [0.2, 0.0], [0.0, 0.0], [0.0, 0.0], 0.01, 5)
    assert motion.ended.startswith("at t = 0 s") and "hinge 'a' turns" in motion.ended


def test_slides_that_a_hinge_between_them_makes_parallel_are_singular_there():
    tree = one_body([X, np.eye(3)[2], Y], ["slide", "hinge", "slide"])
    assert not tree.never_singular and np.isfinite(tmt.acceleration(tree, Z, Z, Z)).all()
    with pytest.raises(ValueError, match="slides 'a', 'c' move together without moving any mass"):
        tmt.acceleration(tree, [0.0, np.pi / 2.0, 0.0], Z, Z)


@pytest.mark.parametrize("mass, is_known", [(0.9e-6, False), (1.1e-6, True)])
def test_a_body_holds_slides_if_its_mass_is_a_share_of_all_that_they_carry(mass, is_known):
    """A millionth: of less it is not known whether Mbar is regular, as rounding may hide it."""
    tree = tmt.Tree(
        ["a", "b", "c"], (-1, 0, 0), np.zeros((3, 3)), (X, Y, Y), Z, ["light", "heavy"], (1, 2), (mass, 1.0 - mass),
        np.zeros((2, 3)), [np.eye(3)] * 2, (0.0, 0.0, -9.81), ["slide"] * 3,
    )  # fmt: skip
    assert tree.never_singular is is_known
