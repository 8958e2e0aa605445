"""Reduction of scenes: what each of them needs."""

from edited import setup_of_file
from models import PATHS

import tmt
from compare.truth.smallest import needed


def test_a_held_posture_with_springs_needs_nothing():
    held = next(case for case in setup_of_file(PATHS["gripper"]).robot.cases if case.is_held)
    assert held.tree.has_springs and needed(held).stays == held.joints
    weight = tmt.gravity_balance(held.posture, held.unlocked_tree)  # without what the springs need
    assert needed(held.changed(torque=tuple(weight))).stays == ()
