"""Slips in positions, angular velocities and tensors, and what becomes of them in M and h.

The position of a body's CoM is a sum of segments: offsets, slides, the CoM in its body. With J, the Jacobian of
that sum, B, that of the angular velocity in body axes, and I the body adds

    M = m J'J + B'IB,   gravity = -m J'g.

A slip changes J, B or I of one body. Into the velocity terms of h it goes in one of three ways:

    Lagrange       Mdot qd - d(qd' M qd / 2)/dq of the wrong M
    Newton, Euler  m J'(Jdot qd) + B'(I Bdot qd + omega x I omega) of the wrong J, B, I
    projection     m J'a + B'(I alpha + omega x I omega) with the right a, alpha and omega

Derivatives are those of imaginary changes of 1e-100, exact to rounding; a slip's effect is the sum over bodies.
"""

from collections.abc import Iterable, Iterator
from itertools import combinations, combinations_with_replacement, product
from typing import NamedTuple

import numpy as np
from numpy import ndarray

from tmt.derivation import method

from ..core.words import listed
from .hypothesis import Hypothesis, slip
from .model import MOST_SPEEDS, TINY, Equations, vectors
from .places import EVERY_BODY, XYZ, Place, factor

BLOCK = 48  # slips that are evaluated together
MOST_ENTRIES = 10  # of Mbar, in which cross terms are tried alone
SAME = 1e-12  # of the largest: two ways that give the same
ALTERNATES = {  # the angle of a hinge from its zero that is taken instead, and its derivative
    "": (lambda angle: angle, 1.0), "zero": (lambda angle: 0.0 * angle, 0.0),
    "opposite": (lambda angle: -angle, -1.0), "complement": (lambda angle: np.pi / 2.0 - angle, -1.0),
}  # fmt: skip
WAYS = "", "", ", with the right accelerations"  # how it is said


class Motion(NamedTuple):
    """Axes of all speeds (nv, rows, 3), origins (n, rows, 3) and turns (n, rows, 3, 3) of all joints."""

    axes: ndarray
    origins: ndarray
    turns: ndarray


class Segment(NamedTuple):
    """A part of the position of a CoM: what it is called, its Jacobian (nv, rows, 3), the hinges that turn it."""

    name: str
    jacobian: ndarray
    hinges: list[int]
    of_com: bool = False
    slides: bool = False


class Changed(NamedTuple):
    """A slip in one body: what is added to J and B (nv, rows, 3), and its tensor (rows, 3, 3); None: it is right."""

    place: str
    explains: str
    body: int
    J: ndarray | None = None
    B: ndarray | None = None
    inertia: ndarray | None = None
    of_body: bool = True  # whether {} in its place is the body


class Kinematics:
    """J, B and turns of all bodies at the states of equations, and close by along each joint and the motion."""

    def __init__(self, equations: Equations):
        self.equations, self.tree, q = equations, equations.tree, equations.q.astype(complex)
        self.nv, self.states = equations.nv, len(q)
        places = self.tree.coordinates
        rates = np.array(places.component_rates(list(equations.q.T), list(equations.qd.T))).T
        self.has_slopes = not equations.coordinates.has_balls
        along = [q + 1j * TINY * unit for unit in np.eye(self.nv)] if self.has_slopes else []
        self.q = np.concatenate([q, *along, q + 1j * TINY * rates])
        self.motions: dict[tuple[int, str], Motion] = {}
        self.joint_of = [i for i, joint in enumerate(places.joints) for _ in self.tree.axis[joint.qd]]
        bodies = range(len(self.tree.mass))
        self.J = [np.sum([part.jacobian for part in self.segments(b)], axis=0) for b in bodies]
        self.B = [self.angular(b) for b in bodies]

    def motion(self, joint: int = -1, other: str = "") -> Motion:
        """The motion, with another angle of a hinge."""
        if (joint, other) not in self.motions:
            q = self.q.copy()
            if other:
                k, zero = self.tree.coordinates.joints[joint].q.start, self.tree.reference[joint]
                q[:, k] = zero + ALTERNATES[other][0](q[:, k] - zero)
            frames, rows = method.joint_frames(self.tree, list(q.T)), len(q)
            axes = vectors([[axis for frame in frames for axis in frame.axes]], rows)[0]
            origins = vectors([[frame.origin for frame in frames]], rows)[0]
            turns = np.array([[[np.broadcast_to(x, rows) for x in row] for row in f.turn] for f in frames])
            self.motions[joint, other] = Motion(axes, origins, np.moveaxis(turns, 3, 1))
        return self.motions[joint, other]

    def speeds_of(self, joints: Iterable[int]) -> list[int]:
        chosen = set(joints)
        return [v for v, joint in enumerate(self.joint_of) if joint in chosen]

    def turning(self, joint: int) -> list[int]:
        """The hinges and balls that turn what a joint carries."""
        return [i for i in self.tree.path(joint)[::-1] if self.tree.kind[i] != "slide"] if joint >= 0 else []

    def segments(self, b: int, joint: int = -1, other: str = "") -> list[Segment]:
        """The segments of the CoM of a body; with another angle of a hinge."""
        tree, found = self.tree, []
        motion, factor = self.motion(joint, other), ALTERNATES[other][1]
        for i in tree.path(tree.body_joint[b])[::-1] if tree.body_joint[b] >= 0 else ():
            parent, at = tree.parent[i], tree.coordinates.joints[i]
            carrying = self.turning(parent)
            if parent >= 0 and np.any(tree.offset[i]):
                arm = motion.turns[parent] @ np.array(tree.offset[i])
                jacobian = self.swung(motion, arm, carrying, joint, factor)
                found.append(Segment(f"offset of {tree.joint_names[i]}", jacobian, carrying))
            if at.kind == "slide":
                v = at.qd.start
                length = self.q[:, at.q.start] - tree.reference[i]
                jacobian = self.swung(motion, motion.axes[v] * length[:, None], carrying, joint, factor)
                jacobian[v] = motion.axes[v]
                name = tree.joint_names[i]
                if found and parent >= 0 and tree.kind[parent] == "slide" and found[-1].slides:
                    before = found.pop()
                    name, jacobian = f"{before.name}, {name}", before.jacobian + jacobian
                found.append(Segment(name, jacobian, carrying, slides=True))
        arm, carrying = (
            motion.turns[tree.body_joint[b]] @ np.array(tree.com[b]),
            self.turning(tree.body_joint[b]),
        )
        jacobian = self.swung(motion, arm, carrying, joint, factor)
        return [*found, Segment(f"CoM of {tree.body_names[b]}", jacobian, carrying, True)]

    def swung(self, motion: Motion, arm: ndarray, hinges: list[int], joint: int, factor: float) -> ndarray:
        """The Jacobian of an arm that hinges turn."""
        jacobian = np.zeros((self.nv, len(self.q), 3), complex)
        for v in self.speeds_of(hinges):
            jacobian[v] = np.cross(motion.axes[v], arm) * (factor if self.joint_of[v] == joint else 1.0)
        return jacobian

    def angular(self, b: int, joint: int = -1, other: str = "") -> ndarray:
        """B of a body, in its axes; with another angle of a hinge."""
        motion, B = self.motion(joint, other), np.zeros((self.nv, len(self.q), 3), complex)
        for v in self.speeds_of(self.turning(self.tree.body_joint[b])):
            B[v] = self.in_body(b, motion.axes[v], motion)
        return B

    def in_body(self, b: int, vector: ndarray, motion: Motion | None = None) -> ndarray:
        turn = (motion or self.motion()).turns[self.tree.body_joint[b]]
        return np.einsum("sji,sj->si", turn, vector)

    # slips

    def slips(self) -> Iterator[Changed]:
        for b in (b for b, joint in enumerate(self.tree.body_joint) if joint >= 0):
            yield from self.slips_of_rotation(b)
            yield from self.slips_of_tensor(b)
            if self.nv <= MOST_SPEEDS:
                yield from self.slips_of_position(b)
        if self.nv <= MOST_SPEEDS:
            yield from self.slips_of_axes()

    def own_speeds(self, b: int) -> list[int]:
        """The speeds of the joints between a body and the one before it."""
        path, carriers = self.tree.path(self.tree.body_joint[b]), set(self.tree.body_joint)
        count = next((k for k, joint in enumerate(path[1:], 1) if joint in carriers), len(path))
        return self.speeds_of(path[:count])

    def slips_of_rotation(self, b: int) -> Iterator[Changed]:
        tree, B = self.tree, self.B[b]
        place, own = "angular velocity of {}", self.own_speeds(b)
        moving = [v for v in range(self.nv) if B[v].any()]
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
        if self.nv > MOST_SPEEDS:
            return
        speeds = self.equations.speeds
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
            for i in self.hinges_that_turn(b):
                other = np.zeros_like(element)
                other[:, k] = self.angular(b, i, "complement")[v][:, k] - B[v][:, k]
                if np.abs(other).max() > SAME:
                    what = f"sine and cosine of {tree.joint_names[i]} exchanged at {speeds[v]}'"
                    yield Changed(said, what, b, B=only(v, other))
        others = [v for v, i in enumerate(self.joint_of) if v not in moving and tree.kind[i] != "slide"]
        if others:
            dB = np.zeros_like(B)
            for v in others:
                dB[v] = self.in_body(b, self.motion().axes[v])
            yield Changed(place, "with the speeds of all joints, also of those that do not move it", b, B=dB)

    def hinges_that_turn(self, b: int) -> list[int]:
        return [i for i in self.turning(self.tree.body_joint[b]) if self.tree.kind[i] == "hinge"]

    def slips_of_tensor(self, b: int) -> Iterator[Changed]:
        R, I = self.motion().turns[self.tree.body_joint[b]], np.array(self.tree.inertia[b])
        place, back = "inertia of {}", np.swapaxes(R, 1, 2)
        yield Changed(place, "not turned to the inertial frame", b, inertia=back @ I @ R)
        yield Changed(place, "turned back, R' I R for R I R'", b, inertia=back @ back @ I @ R @ R)
        yield Changed(place, "in world axes, R I R', for one in its own axes", b, inertia=R @ I @ back)

    def slips_of_position(self, b: int) -> Iterator[Changed]:
        tree, J, speeds = self.tree, self.J[b], self.equations.speeds
        place = "velocity of the CoM of {}"
        moving = [v for v in range(self.nv) if J[v].any()]
        for v in moving if len(moving) > 1 else ():
            dJ = np.zeros_like(J)
            dJ[v] = -J[v]
            yield Changed(place, f"speed of {speeds[v]} left out", b, dJ)
        path = tree.path(tree.body_joint[b])
        for i, following in zip(path[1:], path):
            if tree.kind[i] == "hinge" and np.any(tree.offset[following]):
                v, dJ = tree.coordinates.joints[i].qd.start, np.zeros_like(J)
                origins = self.motion().origins
                dJ[v] = np.cross(self.motion().axes[v], origins[i] - origins[following])
                yield Changed(place, f"lever of {speeds[v]} from {tree.joint_names[following]}", b, dJ)
        for s, part in enumerate(self.segments(b)):
            place = "CoM of {}" if part.of_com else f"{part.name} in the position of {{}}"
            for where, dJ in self.wrong_segments(b, s, part):
                yield Changed(place, where, b, dJ)
                if not part.of_com:
                    yield Changed(part.name, where, b, dJ, of_body=False)  # of all that it carries

    def wrong_segments(self, b: int, s: int, part: Segment) -> Iterator[tuple[str, ndarray]]:
        tree, J = self.tree, part.jacobian
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
            yield f"not turned by {name}", self.segments(b, i, "zero")[s].jacobian - J
            for other, said in (("opposite", "sign of {}"), ("complement", "sine and cosine of {} exchanged"),
                                ("zero", "not turned by {}")):  # fmt: skip
                change = self.segments(b, i, other)[s].jacobian - J
                for k in range(3):
                    dJ = np.zeros_like(J)
                    dJ[:, :, k] = change[:, :, k]
                    if np.abs(dJ).max() > SAME:
                        yield f"{said.format(name)} in {XYZ[k]}", dJ

    def slips_of_axes(self) -> Iterator[Changed]:
        """The axis of a hinge: that of the next joint, or not turned by one of those before."""
        tree, motion = self.tree, self.motion()
        for i, joint in enumerate(tree.coordinates.joints):
            if joint.kind != "hinge":
                continue
            v, name = joint.qd.start, tree.joint_names[i]
            wrong = {}
            following = [k for k, parent in enumerate(tree.parent) if parent == i and tree.kind[k] == "hinge"]
            for k in following[:1]:
                wrong[f"that of {tree.joint_names[k]}"] = motion.axes[tree.coordinates.joints[k].qd.start]
            before = [k for k in self.turning(tree.parent[i]) if tree.kind[k] == "hinge"]
            for k in before:
                wrong[f"not turned by {tree.joint_names[k]}"] = self.motion(k, "zero").axes[v]
            if len(before) > 1:
                wrong["not turned to the inertial frame"] = 0.0 * motion.axes[v] + np.array(tree.axis[v])
            for b, (said, axis) in product(range(len(tree.mass)), wrong.items()):
                change = axis - motion.axes[v]
                if not tree.moves(b)[i] or np.abs(change).max() <= SAME:
                    continue
                com = motion.origins[tree.body_joint[b]]
                com = com + motion.turns[tree.body_joint[b]] @ np.array(tree.com[b])
                dJ, dB = np.zeros((2, *self.J[b].shape), complex)
                dJ[v], dB[v] = np.cross(change, com - motion.origins[i]), self.in_body(b, change)
                yield Changed(f"axis of {name}", said, b, dJ, dB, of_body=False)

    # what becomes of them

    def effects(self, slips: list[Changed]) -> list[list[ndarray]]:
        """What each slip adds to the values, (states, entries), in each of the ways."""
        n, bodies, tree = self.states, [item.body for item in slips], self.tree
        J, B = (np.stack([those[b] for b in bodies]) for those in (self.J, self.B))
        I = np.array(tree.inertia)[bodies][:, None] + np.zeros((1, len(self.q), 1, 1))
        mass = np.array(tree.mass)[bodies]
        J2 = np.stack([right if item.J is None else right + item.J for right, item in zip(J, slips)])
        B2 = np.stack([right if item.B is None else right + item.B for right, item in zip(B, slips)])
        I2 = np.stack([right if item.inertia is None else item.inertia for right, item in zip(I, slips)])

        def inertia_of(J: ndarray, B: ndarray, I: ndarray) -> ndarray:
            of_mass = np.einsum("k,kvsc,kwsc->ksvw", mass, J, J, optimize=True)
            return of_mass + np.einsum("kvsc,kscd,kwsd->ksvw", B, I, B, optimize=True)

        M = inertia_of(J2, B2, I2) - inertia_of(J, B, I)
        found = []
        if self.has_slopes:
            found.append(self.lagrange(M)[1])
        found.append(self.newton_euler(mass, J2, B2, I2) - self.newton_euler(mass, J, B, I))
        found.append(self.projected(bodies, J2, B2, I2) - self.projected(bodies, J, B, I))
        rest = -np.einsum("k,kvsc,c->ksv", mass, (J2 - J)[:, :, :n].real, np.array(tree.gravity))
        pack = self.equations.layout.packed
        return [[pack(M[k, :n].real, of_h[k], rest[k]) for of_h in found] for k in range(len(slips))]

    def lagrange(self, M: ndarray) -> tuple[ndarray, ndarray]:
        """Parts of Mbar (slips, rows, nv, nv) at the states, and Mdot qd - d(qd' M qd / 2)/dq."""
        n, nv, qd = self.states, self.nv, self.equations.qd
        slopes = M[:, n : n * (nv + 1)].imag.reshape(len(M), nv, n, nv, nv) / TINY
        moved = np.einsum("kjsab,sj,sb->ksa", slopes, qd, qd)
        return M[:, :n].real, moved - np.einsum("kjsab,sa,sb->ksj", slopes, qd, qd) / 2.0

    def newton_euler(self, mass: ndarray, J: ndarray, B: ndarray, I: ndarray) -> ndarray:
        n, qd = self.states, self.equations.qd
        a, alpha = (np.einsum("kvsc,sv->ksc", part[:, :, -n:].imag / TINY, qd) for part in (J, B))
        omega = np.einsum("kvsc,sv->ksc", B[:, :, :n].real, qd)
        return self.along(mass, J, B, I[:, :n].real, a, alpha, omega)

    def projected(self, bodies: list[int], J: ndarray, B: ndarray, I: ndarray) -> ndarray:
        n, qd = self.states, self.equations.qd
        right = np.stack([self.J[b] for b in bodies]), np.stack([self.B[b] for b in bodies])
        a, alpha = (np.einsum("kvsc,sv->ksc", part[:, :, -n:].imag / TINY, qd) for part in right)
        omega = np.einsum("kvsc,sv->ksc", right[1][:, :, :n].real, qd)
        return self.along(np.array(self.tree.mass)[bodies], J, B, I[:, :n].real, a, alpha, omega)

    def along(
        self, mass: ndarray, J: ndarray, B: ndarray, I: ndarray, a: ndarray, alpha: ndarray, omega: ndarray
    ) -> ndarray:
        """m J'a + B'(I alpha + omega x I omega), (slips, states, nv)."""
        n = self.states
        spun = np.cross(omega, np.einsum("kscd,ksd->ksc", I, omega))
        moment = np.einsum("kscd,ksd->ksc", I, alpha) + spun
        force = np.einsum("k,kvsc,ksc->ksv", mass, J[:, :, :n].real, a, optimize=True)
        return force + np.einsum("kvsc,ksc->ksv", B[:, :, :n].real, moment)


def slips_of_kinematics(equations: Equations) -> Iterator[Hypothesis]:
    """The values with each slip of one body, and with those that all bodies can have, in each of the ways."""
    kinematics, names = Kinematics(equations), equations.tree.body_names
    total: dict[tuple[str, str, str], list[ndarray]] = {}  # by the place, its owner, and what it explains
    owners: dict[tuple[str, str, str], int] = {}
    slips = list(kinematics.slips())
    for start in range(0, len(slips), BLOCK):
        block = slips[start : start + BLOCK]
        for item, added in zip(block, kinematics.effects(block)):
            for owner in (names[item.body], EVERY_BODY) if item.of_body else ("",):
                key = item.place, owner, item.explains
                total[key] = [a + b for a, b in zip(total[key], added)] if key in total else added
                owners[key] = owners.get(key, 0) + 1
    for (place, owner, explains), ways in total.items():
        size, said = max(np.abs(way).max() for way in ways), list[ndarray]()
        count = owners[place, owner, explains]
        if owner == EVERY_BODY and count < 2:
            continue
        for values, how in zip(ways, WAYS[-len(ways) :]):
            if size > 0.0 and all(np.abs(values - other).max() > SAME * size for other in said):
                said.append(values)
                yield slip(place, "", explains + how, equations.right + values, owner, count if owner else 1)


def parts_of_translation(equations: Equations) -> Iterator[Place]:
    """Factors in v^2 of a body's CoM, and the mass with which it moves along some axes.

    v is the sum of those of its segments, v^2 of their squares and products: in all, in an entry of Mbar.
    """
    if equations.nv > MOST_SPEEDS:
        return
    kinematics, layout, tree, nv = Kinematics(equations), equations.layout, equations.tree, equations.nv
    entries = [entry.named(equations.speeds) for entry in equations.entries[equations.in_M]]

    def column(
        mass: float, pairs: list[tuple[ndarray, ndarray]], gravity: ndarray, lifted: ndarray | None = None
    ) -> ndarray:
        n, M, h = len(equations.q), 0.0 * equations.parts[0], 0.0 * equations.qd
        lifted = pairs[0][0] if lifted is None else lifted
        for J, other in pairs:
            a = np.einsum("vsc,sv->sc", other[:, -n:].imag / TINY, equations.qd)
            M = M + mass * np.einsum("vsc,wsc->svw", J[:, :n].real, other[:, :n].real)
            h = h + mass * np.einsum("vsc,sc->sv", J[:, :n].real, a)
        return layout.packed(M, h, -mass * np.einsum("vsc,c->sv", lifted[:, :n].real, gravity))

    for b in (b for b, joint in enumerate(tree.body_joint) if joint >= 0):
        body, mass, segments = tree.body_names[b], float(tree.mass[b]), kinematics.segments(b)
        pairs = combinations_with_replacement(segments, 2) if len(segments) > 1 else ()
        for first, second in pairs:
            both = [(first.jacobian, second.jacobian), (second.jacobian, first.jacobian)]
            added = column(mass, both if first is not second else both[:1], np.zeros(3))
            name = f"2 ({first.name}) * ({second.name}) in v^2 of {body}"
            name = f"({first.name})^2 in v^2 of {body}" if first is second else name
            yield factor("part", name, added)
            if first.slides and first is not second:
                moment = added + column(mass, [], np.array(tree.gravity), second.jacobian)
                yield factor("part", f"mass of {body} times ({second.name}) along {first.name}", moment)
            active = np.abs(added[:, layout.in_M]).max(axis=0) > SAME * np.abs(added).max()
            for k in np.flatnonzero(active).tolist() if len(entries) <= MOST_ENTRIES else ():
                yield factor("part", f"{name} in {entries[k]}", added, [k])
        chosen = [np.isin(range(3), axes) for count in (1, 2) for axes in combinations(range(3), count)]
        for axes in chosen if mass and nv > 1 else ():
            J = kinematics.J[b] * axes
            along = listed([XYZ[k] for k in np.flatnonzero(axes)])
            added = column(1.0, [(J, J)], np.array(tree.gravity) * axes)
            yield Place("part", f"mass of {body} along {along}", mass, "kg", mass, column=added, least=0.0)
