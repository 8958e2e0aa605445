"""Tree and arm: what is accepted, what is refused."""

import dataclasses

import numpy as np
import pytest

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
    ],
)
def test_tree_refuses_what_cannot_be(changes, says):
    with pytest.raises(ValueError, match=says):
        dataclasses.replace(tmt.ARM, **changes)


def test_tree_needs_a_hinge_and_a_body():
    with pytest.raises(ValueError, match="at least one hinge"):
        tmt.Tree(
            (), (), np.zeros((0, 3)), np.zeros((0, 3)), (), (), (), (), np.zeros((0, 3)), np.zeros((0, 3, 3)), [0] * 3
        )
