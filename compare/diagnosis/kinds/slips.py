"""The slips that are made in positions, angular velocities, tensors and axes; see kinematics.py."""

from collections.abc import Iterator
from itertools import product

import numpy as np
from numpy import ndarray

from ..hypothesis import Hypothesis, slip
from ..layout import MOST_SPEEDS
from ..model import Equations, blocks
from .kinematics import SAME, Changed, Kinematics
from .numbers import XYZ

WAYS = "", "", ", with the right accelerations"  # how it is said
FACTORS = {"left out": -1.0, "with the other sign": -2.0}  # of what is changed, which are added
VELOCITY, ROTATION = "velocity of the CoM of {}", "angular velocity of {}"  # places
Key = tuple[str, int | None, str]  # a place, its body (None: all), what it is


def slips_of_kinematics(equations: Equations) -> Iterator[Hypothesis]:
    """The values with each slip of one body, and with those that all bodies can have, in each of the ways."""
    kinematics, names = Kinematics(equations), equations.tree.body_names
    found: dict[Key, list[list[ndarray]]] = {}
    for block in blocks(all_slips(kinematics), 48):
        for item, added in zip(block, kinematics.effects(block)):
            for body in (item.body, None) if item.of_body else (None,):
                found.setdefault((item.place, body, item.explains), []).append(added)
    for (place, body, explains), effects in found.items():
        ways, owner = [np.sum(way, axis=0) for way in zip(*effects)], ""
        if "{}" in place:
            owner = "every body" if body is None else names[body]
        size, said = max(np.abs(way).max() for way in ways), list[ndarray]()
        if size == 0.0 or (owner and body is None and len(effects) < 2):
            continue
        for values, how in zip(ways, WAYS[-len(ways) :]):
            if all(np.abs(values - other).max() > SAME * size for other in said):
                said.append(values)
                values = equations.right + values
                owners = len(effects) if owner else 1
                yield slip(equations.right, place, explains + how, values, owner=owner, owners=owners)


def all_slips(mechanism: Kinematics) -> Iterator[Changed]:
    is_small = mechanism.nv <= MOST_SPEEDS
    for b in (b for b, joint in enumerate(mechanism.tree.body_joint) if joint >= 0):
        yield from slips_of_rotation(mechanism, b)
        R, I = mechanism.motion().turns[mechanism.tree.body_joint[b]], np.array(mechanism.tree.inertia[b])
        back, axes = np.swapaxes(R, 1, 2), mechanism.equations.frame_of(b).axes
        stated = axes.T @ I @ axes  # its numbers in the file
        for explains, wrong in {
            "not turned to the inertial frame": back @ stated @ R,
            "turned back, R' I R for R I R'": back @ back @ I @ R @ R,
            "in world axes, R I R', for one in its own axes": R @ I @ back,
        }.items():
            yield Changed("inertia of {}", explains, b, inertia=wrong - I)
        if is_small:
            yield from slips_of_components(mechanism, b)
            yield from slips_of_position(mechanism, b)
    if is_small:
        yield from slips_of_axes(mechanism)


def only(columns: ndarray, rows: int | list[int], axes: slice | int = slice(None)) -> ndarray:
    """Some columns of J or B, and some components of them; 0 elsewhere."""
    alone = np.zeros_like(columns)
    alone[rows, :, axes] = columns[rows, :, axes]
    return alone


def acts(change: ndarray) -> bool:
    return bool(np.abs(change).max() > SAME)


def slips_of_rotation(mechanism: Kinematics, b: int) -> Iterator[Changed]:
    """Of whole columns of B: of joints before the body, of joints that do not move it, one of them."""
    tree, B, speeds = mechanism.tree, mechanism.B[b], mechanism.equations.speeds
    path, carriers = tree.path(tree.body_joint[b]), set(tree.body_joint)
    count = next((k for k, joint in enumerate(path[1:], 1) if joint in carriers), len(path))
    moving = [v for v in range(mechanism.nv) if B[v].any()]
    others = [v for v in moving if mechanism.joint_of[v] not in path[:count]]
    if others:
        dB, joint = only(-B, others), tree.coordinates.joints[tree.body_joint[b]]
        yield Changed(ROTATION, "relative to the body before, not to the world", b, B=dB)
        if joint.kind == "hinge":
            axis = np.array(tree.axis[joint.qd.start])
            along = (dB @ axis)[..., None] * axis
            if acts(along - dB) and acts(along):
                yield Changed("spin of {} about its own axis", "relative to the body before", b, B=along)
    single = moving if len(moving) > 1 and mechanism.nv <= MOST_SPEEDS else []
    for v, (how, factor) in product(single, FACTORS.items()):
        yield Changed(ROTATION, f"speed of {speeds[v]} {how}", b, B=only(factor * B, v))
    turning = [v for v, i in enumerate(mechanism.joint_of) if v not in moving and tree.kind[i] != "slide"]
    if turning:
        dB = only(mechanism.in_body(b, mechanism.motion().axes), turning)
        yield Changed(ROTATION, "with the speeds of all joints, also of those that do not move it", b, B=dB)


def slips_of_components(mechanism: Kinematics, b: int) -> Iterator[Changed]:
    """Of one component of the angular velocity in the body's axes."""
    tree, B, speeds = mechanism.tree, mechanism.B[b], mechanism.equations.speeds
    for v, k in product(range(mechanism.nv), range(3)):
        element, said = only(B, v, k), f"{ROTATION}, {XYZ[k]} in its own axes"
        if not acts(element):
            continue
        for how, factor in FACTORS.items() if acts(np.delete(B[v], k, axis=1)) else ():
            yield Changed(said, f"{speeds[v]}' {how}", b, B=factor * element)
        for i in mechanism.hinges(tree.body_joint[b]):
            other = only(mechanism.angular(b, i, "complement") - B, v, k)
            if acts(other):
                what = f"sine and cosine of {tree.joint_names[i]} exchanged at {speeds[v]}'"
                yield Changed(said, what, b, B=other)


def slips_of_position(mechanism: Kinematics, b: int) -> Iterator[Changed]:
    """Of the velocity of the CoM, and of each segment of its position."""
    tree, J, speeds = mechanism.tree, mechanism.J[b], mechanism.equations.speeds
    moving = [v for v in range(mechanism.nv) if J[v].any()]
    for v in moving if len(moving) > 1 else ():
        yield Changed(VELOCITY, f"speed of {speeds[v]} left out", b, only(-J, v))
    for v, other in product(moving, range(len(tree.mass))):
        if other != b and mechanism.J[other][v].any():
            dJ = only(mechanism.J[other] - J, v)
            yield Changed(VELOCITY, f"part of {speeds[v]} as that of {tree.body_names[other]}", b, dJ)
    path, (axes, origins, _) = tree.path(tree.body_joint[b]), mechanism.motion()
    for i, following in zip(path[1:], path):
        if tree.kind[i] == "hinge" and np.any(tree.offset[following]):
            v, dJ = tree.coordinates.joints[i].qd.start, np.zeros_like(J)
            dJ[v] = np.cross(axes[v], origins[i] - origins[following])
            yield Changed(VELOCITY, f"lever of {speeds[v]} from {tree.joint_names[following]}", b, dJ)
    for s, part in enumerate(mechanism.segments(b)):
        for explains, dJ in wrong_segments(mechanism, b, s):
            place = "CoM of {}" if part.of_com else f"{part.name} in the position of {{}}"
            yield Changed(place, explains, b, dJ)
            if not part.of_com:
                yield Changed(part.name, explains, b, dJ, of_body=False)  # of all that it carries


def wrong_segments(mechanism: Kinematics, b: int, s: int) -> Iterator[tuple[str, ndarray]]:
    part, every, names = mechanism.segments(b)[s], list(range(mechanism.nv)), mechanism.tree.joint_names
    J = part.jacobian
    if not part.of_com:
        yield "left out", -J
    for k in range(3) if acts(J) else ():
        if acts(J[:, :, k]):
            yield f"{XYZ[k]} with the other sign", only(-2.0 * J, every, k)
        order = [k if j == k else 3 - k - j for j in range(3)]
        first, second = np.delete(range(3), k)
        yield f"{XYZ[first]} and {XYZ[second]} exchanged", J[:, :, order] - J
    for i in (i for i in part.hinges if mechanism.tree.kind[i] == "hinge"):
        for other, said in {
            "opposite": f"sign of {names[i]}", "complement": f"sine and cosine of {names[i]} exchanged",
            "zero": f"not turned by {names[i]}",
        }.items():  # fmt: skip
            change = mechanism.segments(b, i, other)[s].jacobian - J
            if other == "zero":
                yield said, change
            for k in (k for k in range(3) if acts(change[:, :, k])):
                yield f"{said} in {XYZ[k]}", only(change, every, k)


def slips_of_axes(mechanism: Kinematics) -> Iterator[Changed]:
    """The axis of a hinge: that of the next joint, or not turned by one of those before."""
    tree, (axes, origins, turns) = mechanism.tree, mechanism.motion()
    for i in (i for i, kind in enumerate(tree.kind) if kind == "hinge"):
        v, name, wrong = tree.coordinates.joints[i].qd.start, tree.joint_names[i], dict[str, ndarray]()
        following = [k for k, parent in enumerate(tree.parent) if parent == i and tree.kind[k] == "hinge"]
        for k in following[:1]:
            wrong[f"that of {tree.joint_names[k]}"] = axes[tree.coordinates.joints[k].qd.start]
        before = mechanism.hinges(tree.parent[i])
        for k in before:
            wrong[f"not turned by {tree.joint_names[k]}"] = mechanism.motion(k, "zero").axes[v]
        if len(before) > 1:
            wrong["not turned to the inertial frame"] = 0.0 * axes[v] + np.array(tree.axis[v])
        for b, (said, axis) in product(range(len(tree.mass)), wrong.items()):
            joint, change = tree.body_joint[b], axis - axes[v]
            if tree.moves(b)[i] and acts(change):
                com = origins[joint] + turns[joint] @ np.array(tree.com[b])
                dJ, dB = np.zeros((2, *mechanism.J[b].shape), complex)
                dJ[v], dB[v] = np.cross(change, com - origins[i]), mechanism.in_body(b, change)
                yield Changed(f"axis of {name}", said, b, dJ, dB, of_body=False)
