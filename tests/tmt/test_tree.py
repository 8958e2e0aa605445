"""Tree and arm: what is accepted, what is refused."""

import dataclasses

import numpy as np
import pytest
from trees import random_tree

import tmt
from tmt.arm import points


def test_arm_lies_as_the_assignment_says():
    shoulder, elbow, hand = (np.array(list(p), dtype=float) for p in points([0.0, 0.0, 0.0]))
    assert np.array_equal(shoulder, [0, 0, 0])
    assert np.array_equal(elbow, [0, 0, -0.3])
    assert np.array_equal(hand, [0.375, 0, -0.3])


def test_tree_converts_arrays_and_scales_axes():
    tree = dataclasses.replace(tmt.ARM, axis=np.array([[0, 2, 0], [3, 0, 0], [0, 1, 0]]), mass=[1, 2])
    assert tree.axis == tmt.ARM.axis
    assert tree.mass == (1.0, 2.0)
    assert tmt.Tree(**vars(tree)) == tree and tree.never_singular
    assert hash(tree) != hash(tmt.ARM)


def test_tree_knows_which_hinges_move_a_body():
    assert tmt.ARM.moves(0) == [True, True, False]
    assert tmt.ARM.moves(1) == [True, True, True]


@pytest.mark.parametrize(
    "changes, says",
    [
        ({"mass": (1.9,)}, r"mass has shape \(1,\); \(2,\) is expected"),
        ({"mass": (1.9, np.nan)}, "finite"),
        ({"mass": (1.9, -1.0)}, "at least 0 kg"),
        ({"mass": "heavy"}, "numbers of shape"),
        ({"axis": ((0, 1, 0), (0, 0, 0), (0, 1, 0))}, r"axis\[1\] is zero"),
        ({"parent": (-1, 2, 1)}, r"parent\[1\] is 2"),
        ({"parent": (-1, 0.5, 1)}, r"parent\[1\] is 0.5"),
        ({"body_hinge": (1, 3)}, r"body_hinge\[1\] is 3; a whole number from -1 to 2"),
        ({"damping": (0, -1, 0)}, "damping"),
        ({"inertia": (np.diag([1, 1, 3]), np.eye(3))}, "none larger than the other two"),
        ({"inertia": ([[1, 0.1, 0], [0, 1, 0], [0, 0, 1]], np.eye(3))}, "not symmetric"),
        ({"body_hinge": (1, 1)}, "hinge 'gamma' moves nothing that has mass"),
        ({"mass": (1.9, 0), "inertia": (np.eye(3), np.zeros((3, 3)))}, "hinge 'gamma' moves nothing"),
        ({"hinge_names": 3}, "different names are expected"),
        ({"hinge_names": ("a", "b", "a")}, "different names are expected"),
        ({"gravity": (0, 0)}, "gravity has shape"),
        ({"hinge_names": {"a", "b", "c"}}, "different names are expected"),
        ({"hinge_names": ("a", "b", "c\nd")}, "different names are expected"),
        ({"colour": 3}, "no field 'colour'; its fields are hinge_names, parent"),
        ({"mass": ("1.9", "1.5")}, "numbers of shape"),
        ({"mass": np.ma.array([1.9, 1.5], mask=[False, True])}, "numbers of shape"),
        ({"mass": (1e-320, 1e-320), "inertia": np.zeros((2, 3, 3))}, "doubles cannot hold that"),
        ({"com": ((0, 0, 1e200), (0, 0, 1e200))}, "doubles cannot hold that"),
    ],
)
def test_tree_refuses_what_cannot_be(changes, says):
    with pytest.raises(ValueError, match=says):
        dataclasses.replace(tmt.ARM, **changes)


def test_tree_needs_a_hinge_and_a_body():
    with pytest.raises(ValueError, match="at least one joint"):
        tmt.Tree(
            (), (), np.zeros((0, 3)), np.zeros((0, 3)), (), (), (), (), np.zeros((0, 3)), np.zeros((0, 3, 3)), [0] * 3
        )


@pytest.mark.parametrize("size", [5e-324, 1e-310, 1e-200, 1.0, 1e200, 1.7e308])
def test_an_axis_of_any_length_is_a_direction(size):
    tree = dataclasses.replace(tmt.ARM, axis=((0, 1, 0), (size, size, 0), (0, 0, -size)))
    assert np.allclose(tree.axis[1], (0.5**0.5, 0.5**0.5, 0.0), rtol=0, atol=2e-16) and tree.axis[2] == (0.0, 0.0, -1.0)


def chain(axes, com=(0.3, 0.1, 0.2), inertia=None, offsets=None):
    """One body, a point where it has no inertia, that hangs on hinges in a row."""
    n, inertia = len(axes), np.zeros((3, 3)) if inertia is None else inertia
    return tmt.Tree(
        hinge_names=[f"h{i}" for i in range(n)], parent=range(-1, n - 1), offset=np.zeros((n, 3)) if offsets is None else offsets,
        axis=axes, damping=np.zeros(n), body_names=["body"], body_hinge=[n - 1], mass=[2.0], com=[com], inertia=[inertia],
        gravity=(0, 0, -9.81),
    )  # fmt: skip


X, Y, Z = np.eye(3)


@pytest.mark.parametrize(
    "model, says",
    [
        (lambda: chain([Z], (0, 0, 0.3)), "hinge 'h0' turns without moving any mass; Mbar is singular at every q"),
        (lambda: chain([Z], (0, 0, 0)), "hinge 'h0' turns without moving any mass"),
        (lambda: chain([X, Z], (0, 0, 0.3)), "hinge 'h1' turns without"),
        (lambda: chain([Z, Z, Z], inertia=np.eye(3)), "hinges 'h0', 'h1', 'h2' turn together without moving any mass"),
        (lambda: chain([Z, -Z]), "hinges 'h0', 'h1' turn together"),
        (lambda: chain([Z, Z], offsets=[(0, 0, 0), (0, 0, 1)]), "hinges 'h0', 'h1' turn together"),
        (lambda: chain([X, Y, Z, X], inertia=np.eye(3)), "turn together"),
        (lambda: chain([X, Y, Z]), "turn together"),  # a point about a point has two ways to move
    ],
)
def test_a_model_that_is_singular_everywhere_is_refused(model, says):
    with pytest.raises(ValueError, match=says):
        model()


@pytest.mark.parametrize(
    "model", [lambda: chain([X, Y, Z], inertia=np.eye(3)), lambda: chain([Z, Z], offsets=[(0, 0, 0), (0.1, 0, 0)])]
)
def test_a_model_that_is_singular_somewhere_is_a_model(model):
    assert not model().never_singular


def test_what_is_singular_is_what_rounding_hides():
    """A point on the axis but for r, 1 m along it: of all the inertia that it could have, r^2 is left."""
    rounding = 64 * np.finfo(float).eps
    chain([Z], (np.sqrt(1.02 * rounding), 0, 1))
    with pytest.raises(ValueError, match="singular"):
        chain([Z], (np.sqrt(0.98 * rounding), 0, 1))


def test_a_body_with_inertia_for_every_hinge_is_never_singular(rng):
    assert tmt.ARM.never_singular
    assert chain([X, X + 2e-3 * Y], inertia=np.eye(3)).never_singular
    assert not chain([X, X + 5e-4 * Y], inertia=np.eye(3)).never_singular  # unknown: too nearly parallel
    assert chain([X], inertia=1.2e-6 * np.eye(3), com=(1 / np.sqrt(2), 0, 0)).never_singular
    assert not chain([X], inertia=0.8e-6 * np.eye(3), com=(1 / np.sqrt(2), 1e-3, 0)).never_singular
    trees = [tree for tree in (random_tree(rng, bodies=2) for _ in range(30)) if tree.never_singular]
    assert 5 < len(trees) < 25
    for tree in trees:
        assert np.linalg.cond(tmt.mass_matrix(rng.uniform(-3, 3, (50, len(tree.parent))), tree)).max() < 1e9
