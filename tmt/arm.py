"""The assignment's arm: its numbers, and the Tree that they make.

Inertial frame at the shoulder: x north (where the person looks), y west, z up. With all angles zero the
upper arm points along -z and the forearm along +x. The same numbers stand in mjcf/arm.xml on purpose:
the two models share nothing, and a test ties them.
"""

from collections.abc import Sequence

from tmt.derivation.method import joint_frames
from tmt.derivation.vectors import Vector
from tmt.model.tree import Tree

G = 9.81  # m/s2, along -z
D = 0.3  # m, upper arm, shoulder to elbow
E = 0.375  # m, forearm and hand, elbow to finger tips
M1 = 1.9  # kg, upper arm
M2 = 1.5  # kg, forearm and hand
COM1 = 0.15  # m, shoulder to CoM of the upper arm: d/2
COM2 = 0.15  # m, elbow to CoM of the forearm: 0.4 e, written out because 0.4 * 0.375 rounds to another double
I1 = (0.015, 0.0, 0.0), (0.0, 0.014, 0.0), (0.0, 0.0, 0.002)  # kg m2, about the CoM, in body axes
I2 = (0.001, 0.0, 0.0), (0.0, 0.019, 0.0), (0.0, 0.0, 0.019)  # kg m2
ARM = Tree(
    joint_names=("alpha", "beta", "gamma"),  # shoulder, shoulder, elbow
    parent=(-1, 0, 1),
    offset=((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, -D)),
    axis=((0.0, 1.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)),  # y, x, y
    damping=(0.0, 0.0, 0.0),
    body_names=("upper arm", "forearm"),
    body_joint=(1, 2),
    mass=(M1, M2),
    com=((0.0, 0.0, -COM1), (COM2, 0.0, 0.0)),
    inertia=(I1, I2),
    gravity=(0.0, 0.0, -G),
)


def points(q: Sequence[float]) -> list[Vector]:
    """Shoulder, elbow and finger tips in the world, Vectors in m, at joint angles q (3 scalars, rad)."""
    frames = joint_frames(ARM, q)
    elbow, rotation = frames[2].origin, frames[2].rotation
    return [frames[0].origin, elbow, elbow + rotation @ Vector(E, 0.0, 0.0)]
