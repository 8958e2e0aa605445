"""Tree and arm: what is accepted, what is refused."""

import dataclasses

import numpy as np
import pytest
from helpers.trees import one_body, random_tree, wrist

import tmt
from tmt.model.tree import stated


def test_tree_converts_arrays_and_scales_axes():
    tree = dataclasses.replace(tmt.ARM, axis=np.array([[0, 2, 0], [3, 0, 0], [0, 1, 0]]), mass=[1, 2])
    assert tree.axis == tmt.ARM.axis and tree.mass == (1.0, 2.0)
    assert tmt.Tree(**vars(tree)) == tree and tree.never_singular and hash(tree) != hash(tmt.ARM)


X, Y, Z = np.eye(3)
POINT = np.zeros((3, 3))
REFUSED = [  # changes of the arm, and a word of what is said
    ({"mass": (1.9, np.nan)}, "finite"), ({"mass": (1.9, -1.0)}, "at least 0"),
    ({"mass": ("1.9", "1.5")}, "numbers"), ({"axis": (Y, 0 * X, Y)}, r"axis\[1\]"),
    ({"parent": (-1, 2, 1)}, r"parent\[1\]"), ({"body_joint": (1, 1)}, "'gamma'"),
    ({"damping": (0, -1, 0)}, "damping"), ({"inertia": (np.diag([1, 1, 2 + 1e-9]), np.eye(3))}, "larger"),
    ({"inertia": ([[1, 1e-9, 0], [0, 1, 0], [0, 0, 1]], np.eye(3))}, "symmetric"),
    ({"mass": (1.9, 0), "inertia": (np.eye(3), np.zeros((3, 3)))}, "'gamma'"),
    ({"mass": (1e-320, 1e-320), "inertia": np.zeros((2, 3, 3))}, "doubles"),
    ({"joint_names": ("a", "b", "a")}, "names"),
    ({"position_gain": np.zeros((2, 3))}, "position_gain"),
]  # fmt: skip
OF_KINDS = [  # changes of a slide on a ball
    ({"kind": ("hinge", "screw")}, "kind"),
    *(({"axis": [*axes, Y]}, "right-handed") for axes in ((X, X, Z), (X, Z, Y))),
    ({"reference": [1.0, 0.0]}, "ball"), ({"rest": [1.0, 1.0, 0.0, 0.0, 0.0]}, "quaternion"),
    ({"stiffness": [0.0, -1.0]}, "at least 0"),
    *(({"position_gain": np.outer(*np.eye(4)[pair])}, "ball") for pair in ([0, 3], [3, 0])),
]  # fmt: skip
SLIDE_ON_A_BALL = one_body((X, Y, Z, Y), ("ball", "slide"), (0, 0, 1), offset=((0, 0, 0), (0, 0, 1)))


WRONG = [*((tmt.ARM, *row) for row in REFUSED), *((SLIDE_ON_A_BALL, *row) for row in OF_KINDS)]


@pytest.mark.parametrize("tree, changes, word", WRONG)
def test_what_cannot_be_is_refused_in_one_line(tree, changes, word):
    with pytest.raises(ValueError, match=word) as error:
        dataclasses.replace(tree, **changes)
    assert "\n" not in str(error.value)


def chain(axes, com=(0.3, 0.1, 0.2), inertia=POINT, **more):
    """One body, a point by default, that hangs on hinges in a row."""
    return one_body(axes, (), com, inertia, mass=[2.0], **more)


@pytest.mark.parametrize("given, says", [
    (([Z], (0, 0, 0.3)), "'a'"), (([X, Z], (0, 0, 0.3)), "'b'"),
    (([Z, Z, Z], (0.3, 0.1, 0.2), np.eye(3)), "'a', 'b', 'c'"), (([Z, -Z],), "'a', 'b'"),
    (([X, Y, Z],), "singular|together"),  # a point about a point has two ways to move
])  # fmt: skip
def test_a_model_that_is_singular_everywhere_is_refused(given, says):
    with pytest.raises(ValueError, match=says):
        chain(*given)


def test_what_is_singular_is_what_rounding_hides():
    """A point on the axis except for r, 1 m along it: of all the inertia that it could have, r^2 is left."""
    rounding = 64 * np.finfo(float).eps
    chain([Z], (np.sqrt(1.02 * rounding), 0, 1))
    with pytest.raises(ValueError, match="singular"):
        chain([Z], (np.sqrt(0.98 * rounding), 0, 1))


def test_a_body_with_inertia_for_every_hinge_is_never_singular(rng):
    assert not wrist().never_singular and not chain([Z, Z], offset=[(0, 0, 0), (0.1, 0, 0)]).never_singular
    assert chain([X, X + 2e-3 * Y], inertia=np.eye(3)).never_singular
    assert not chain([X, X + 5e-4 * Y], inertia=np.eye(3)).never_singular  # unknown: too nearly parallel
    assert chain([X], inertia=1.2e-6 * np.eye(3), com=(1 / np.sqrt(2), 0, 0)).never_singular
    assert not chain([X], inertia=0.8e-6 * np.eye(3), com=(1 / np.sqrt(2), 1e-3, 0)).never_singular
    trees = [tree for tree in (random_tree(rng, bodies=2) for _ in range(30)) if tree.never_singular]
    assert 5 < len(trees) < 25
    for tree in trees:
        assert np.linalg.cond(tmt.mass_matrix(tree, rng.uniform(-3, 3, (50, len(tree.parent))))).max() < 1e9


def test_a_tree_is_shown_in_one_short_line_and_stated_by_all_its_numbers(rng):
    assert repr(tmt.ARM) == "Tree(3 joints: alpha, beta, gamma; 2 bodies)"
    assert repr(chain([X], inertia=np.eye(3))) == "Tree(1 joint: a; 1 body)"
    large = repr(random_tree(rng, bodies=20))
    assert large.endswith(", ...; 20 bodies)") and len(large) < 100
    assert stated(tmt.ARM) != stated(dataclasses.replace(tmt.ARM, mass=(1.9, 1.5 + 1e-15)))
