"""The slips that are made in positions, angular velocities, tensors and axes; see kinematics.py."""

from collections.abc import Iterator
from itertools import product

import numpy as np
from numpy import ndarray

from .hypothesis import Hypothesis, slip
from .kinematics import SAME, Changed, Kinematics, Segment
from .model import MOST_SPEEDS, Equations
from .places import EVERY_BODY, XYZ

BLOCK = 48  # slips that are evaluated together
WAYS = "", "", ", with the right accelerations"  # how it is said


def slips_of_kinematics(equations: Equations) -> Iterator[Hypothesis]:
    """The values with each slip of one body, and with those that all bodies can have, in each of the ways."""
    kinematics, names = Kinematics(equations), equations.tree.body_names
    total: dict[
        tuple[str, int | None, str], list[ndarray]
    ] = {}  # by the place, its body (None: all), what it is
    bodies: dict[tuple[str, int | None, str], int] = {}
    slips = list(all_slips(kinematics))
    for start in range(0, len(slips), BLOCK):
        block = slips[start : start + BLOCK]
        for item, added in zip(block, kinematics.effects(block)):
            for body in (item.body, None) if item.of_body else (None,):
                key = item.place, body, item.explains
                total[key] = [a + b for a, b in zip(total[key], added)] if key in total else added
                bodies[key] = bodies.get(key, 0) + 1
    for (place, body, explains), ways in total.items():
        count, of_bodies = bodies[place, body, explains], "{}" in place
        if of_bodies and body is None and count < 2:
            continue
        owner = (EVERY_BODY if body is None else names[body]) if of_bodies else ""
        size, said = max(np.abs(way).max() for way in ways), list[ndarray]()
        for values, how in zip(ways, WAYS[-len(ways) :]):
            if size > 0.0 and all(np.abs(values - other).max() > SAME * size for other in said):
                said.append(values)
                yield slip(place, "", explains + how, equations.right + values, owner, count if owner else 1)


def all_slips(mechanism: Kinematics) -> Iterator[Changed]:
    for b in (b for b, joint in enumerate(mechanism.tree.body_joint) if joint >= 0):
        yield from slips_of_rotation(mechanism, b)
        yield from slips_of_tensor(mechanism, b)
        if mechanism.nv <= MOST_SPEEDS:
            yield from slips_of_position(mechanism, b)
    if mechanism.nv <= MOST_SPEEDS:
        yield from slips_of_axes(mechanism)


def own_speeds(mechanism: Kinematics, b: int) -> list[int]:
    """The speeds of the joints between a body and the one before it."""
    path, carriers = mechanism.tree.path(mechanism.tree.body_joint[b]), set(mechanism.tree.body_joint)
    count = next((k for k, joint in enumerate(path[1:], 1) if joint in carriers), len(path))
    return mechanism.speeds_of(path[:count])


def slips_of_rotation(mechanism: Kinematics, b: int) -> Iterator[Changed]:
    tree, B = mechanism.tree, mechanism.B[b]
    place, own = "angular velocity of {}", own_speeds(mechanism, b)
    moving = [v for v in range(mechanism.nv) if B[v].any()]
    others = [v for v in moving if v not in own]

    def only(v: int, change: ndarray) -> ndarray:
        dB = np.zeros_like(B)
        dB[v] = change
        return dB

    if others:
        dB = np.zeros_like(B)
        dB[others] = -B[others]
        yield Changed(place, "relative to the body before, not to the world", b, B=dB)
        joint = tree.coordinates.joints[tree.body_joint[b]]
        if joint.kind == "hinge":
            axis = np.array(tree.axis[joint.qd.start])
            along = (dB @ axis)[..., None] * axis
            if np.abs(along - dB).max() > SAME and np.abs(along).max() > SAME:
                yield Changed("spin of {} about its own axis", "relative to the body before", b, B=along)
    if mechanism.nv > MOST_SPEEDS:
        return
    speeds = mechanism.equations.speeds
    for v in moving if len(moving) > 1 else ():
        yield Changed(place, f"speed of {speeds[v]} left out", b, B=only(v, -B[v]))
        yield Changed(place, f"speed of {speeds[v]} with the other sign", b, B=only(v, -2.0 * B[v]))
    for v, k in product(moving, range(3)):
        if np.abs(B[v][:, k]).max() <= SAME:
            continue
        element, said = np.zeros_like(B[v]), f"{place}, {XYZ[k]} in its own axes"
        element[:, k] = B[v][:, k]
        if np.abs(B[v]).max(axis=0).max() > SAME and np.abs(np.delete(B[v], k, axis=1)).max() > SAME:
            yield Changed(said, f"{speeds[v]}' left out", b, B=only(v, -element))
            yield Changed(said, f"{speeds[v]}' with the other sign", b, B=only(v, -2.0 * element))
        for i in hinges_that_turn(mechanism, b):
            other = np.zeros_like(element)
            other[:, k] = mechanism.angular(b, i, "complement")[v][:, k] - B[v][:, k]
            if np.abs(other).max() > SAME:
                what = f"sine and cosine of {tree.joint_names[i]} exchanged at {speeds[v]}'"
                yield Changed(said, what, b, B=only(v, other))
    others = [v for v, i in enumerate(mechanism.joint_of) if v not in moving and tree.kind[i] != "slide"]
    if others:
        dB = np.zeros_like(B)
        for v in others:
            dB[v] = mechanism.in_body(b, mechanism.motion().axes[v])
        yield Changed(place, "with the speeds of all joints, also of those that do not move it", b, B=dB)


def hinges_that_turn(mechanism: Kinematics, b: int) -> list[int]:
    return [i for i in mechanism.turning(mechanism.tree.body_joint[b]) if mechanism.tree.kind[i] == "hinge"]


def slips_of_tensor(mechanism: Kinematics, b: int) -> Iterator[Changed]:
    R, I = mechanism.motion().turns[mechanism.tree.body_joint[b]], np.array(mechanism.tree.inertia[b])
    place, back = "inertia of {}", np.swapaxes(R, 1, 2)
    yield Changed(place, "not turned to the inertial frame", b, inertia=back @ I @ R)
    yield Changed(place, "turned back, R' I R for R I R'", b, inertia=back @ back @ I @ R @ R)
    yield Changed(place, "in world axes, R I R', for one in its own axes", b, inertia=R @ I @ back)


def slips_of_position(mechanism: Kinematics, b: int) -> Iterator[Changed]:
    tree, J, speeds = mechanism.tree, mechanism.J[b], mechanism.equations.speeds
    place = "velocity of the CoM of {}"
    moving = [v for v in range(mechanism.nv) if J[v].any()]
    for v in moving if len(moving) > 1 else ():
        dJ = np.zeros_like(J)
        dJ[v] = -J[v]
        yield Changed(place, f"speed of {speeds[v]} left out", b, dJ)
    path = tree.path(tree.body_joint[b])
    for i, following in zip(path[1:], path):
        if tree.kind[i] == "hinge" and np.any(tree.offset[following]):
            v, dJ = tree.coordinates.joints[i].qd.start, np.zeros_like(J)
            origins = mechanism.motion().origins
            dJ[v] = np.cross(mechanism.motion().axes[v], origins[i] - origins[following])
            yield Changed(place, f"lever of {speeds[v]} from {tree.joint_names[following]}", b, dJ)
    for s, part in enumerate(mechanism.segments(b)):
        place = "CoM of {}" if part.of_com else f"{part.name} in the position of {{}}"
        for where, dJ in wrong_segments(mechanism, b, s, part):
            yield Changed(place, where, b, dJ)
            if not part.of_com:
                yield Changed(part.name, where, b, dJ, of_body=False)  # of all that it carries


def wrong_segments(mechanism: Kinematics, b: int, s: int, part: Segment) -> Iterator[tuple[str, ndarray]]:
    tree, J = mechanism.tree, part.jacobian
    if not part.of_com:
        yield "left out", -J
    for k in range(3) if np.abs(J).max() > SAME else ():
        if np.abs(J[:, :, k]).max() > SAME:
            dJ = np.zeros_like(J)
            dJ[:, :, k] = -2.0 * J[:, :, k]
            yield f"{XYZ[k]} with the other sign", dJ
        first, second = np.delete(range(3), k)
        dJ = np.zeros_like(J)
        dJ[:, :, [first, second]] = J[:, :, [second, first]] - J[:, :, [first, second]]
        yield f"{XYZ[first]} and {XYZ[second]} exchanged", dJ
    for i in (i for i in part.hinges if tree.kind[i] == "hinge"):
        name = tree.joint_names[i]
        yield f"not turned by {name}", mechanism.segments(b, i, "zero")[s].jacobian - J
        for other, said in (("opposite", "sign of {}"), ("complement", "sine and cosine of {} exchanged"),
                            ("zero", "not turned by {}")):  # fmt: skip
            change = mechanism.segments(b, i, other)[s].jacobian - J
            for k in range(3):
                dJ = np.zeros_like(J)
                dJ[:, :, k] = change[:, :, k]
                if np.abs(dJ).max() > SAME:
                    yield f"{said.format(name)} in {XYZ[k]}", dJ


def slips_of_axes(mechanism: Kinematics) -> Iterator[Changed]:
    """The axis of a hinge: that of the next joint, or not turned by one of those before."""
    tree, motion = mechanism.tree, mechanism.motion()
    for i, joint in enumerate(tree.coordinates.joints):
        if joint.kind != "hinge":
            continue
        v, name = joint.qd.start, tree.joint_names[i]
        wrong = {}
        following = [k for k, parent in enumerate(tree.parent) if parent == i and tree.kind[k] == "hinge"]
        for k in following[:1]:
            wrong[f"that of {tree.joint_names[k]}"] = motion.axes[tree.coordinates.joints[k].qd.start]
        before = [k for k in mechanism.turning(tree.parent[i]) if tree.kind[k] == "hinge"]
        for k in before:
            wrong[f"not turned by {tree.joint_names[k]}"] = mechanism.motion(k, "zero").axes[v]
        if len(before) > 1:
            wrong["not turned to the inertial frame"] = 0.0 * motion.axes[v] + np.array(tree.axis[v])
        for b, (said, axis) in product(range(len(tree.mass)), wrong.items()):
            change = axis - motion.axes[v]
            if not tree.moves(b)[i] or np.abs(change).max() <= SAME:
                continue
            com = motion.origins[tree.body_joint[b]]
            com = com + motion.turns[tree.body_joint[b]] @ np.array(tree.com[b])
            dJ, dB = np.zeros((2, *mechanism.J[b].shape), complex)
            dJ[v], dB[v] = np.cross(change, com - motion.origins[i]), mechanism.in_body(b, change)
            yield Changed(f"axis of {name}", said, b, dJ, dB, of_body=False)
