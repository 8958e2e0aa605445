"""Places, motions and Jacobians of the bodies of any tree, springs and energies, as loops compiled once for all models.

As method.py has them: frames are walked outward, and what is fixed in one is carried along by it. A frame here is
(R, r, v, omega, conv, omegad): its axes, its origin and that one's velocity, its angular velocity, and the accelerations of
both at qdd = 0; all in the axes of the world.

`tree` is a loop_trees.Arrays about the origin of the world, `bodies` an array of loop_trees.BODY, w a workspace; one state, or
eight side by side, with the same bits.
"""

from tmt.equations.vectors import Vector
from tmt.inlined import get, inlined, put, put_sines, zero
from tmt.loop_joints import (
    BALL,
    HINGE,
    SLIDE,
    ball_turned,
    hinge_turned,
    matrix,
    moved_from_rest,
    put_all,
    vector,
    world,
)
from tmt.machine_code import compiled, part

# where a joint's numbers begin in its row of a workspace: its frame, sine and cosine, the axes of its speeds
FRAME, SINE, AXES, PLACE = 0, 24, 26, 35
# the quantities
POSITIONS, ANGULAR_VELOCITIES, JACOBIANS, CONVECTIVE_TERMS, POTENTIAL_ENERGY, ENERGY, SPRING_TORQUE = range(7)


@compiled
def of_bodies(tree, bodies, quantity, q, qd, w, out):
    """A quantity of one state, or of eight, flat, to out; q (nq,), qd (nv,), w (workspace(tree),)."""
    for k in range(len(out)):
        put(out, k, zero(w))
    if quantity == SPRING_TORQUE:
        put_springs(tree, q, out)
        return
    put_places(tree, q, qd, w)
    if quantity >= POTENTIAL_ENERGY:
        put_energy(tree, bodies, quantity == ENERGY, q, qd, w, out)
        return
    n = len(tree.before)
    for b in range(len(bodies)):
        i = bodies[b].joint
        frame = outside(zero(w)) if i < 0 else placed(w, i * PLACE)
        if quantity == POSITIONS:
            put_all(out, 3 * b, point(frame, bodies[b].com)[0])
        elif quantity == ANGULAR_VELOCITIES:
            put_all(out, 3 * b, angular_velocity_in(frame))
        elif quantity == CONVECTIVE_TERMS:
            put_all(out, 3 * b, point(frame, bodies[b].com)[2])
            put_all(out, 3 * (len(bodies) + b), convective_in(frame))
        else:
            x = point(frame, bodies[b].com)[0]
            while i >= 0:
                for k in range(tree.joints[i].count):
                    axis, at = vector(w, i * PLACE + AXES + 3 * k), 3 * b * n + tree.joints[i].by + k
                    if tree.joints[i].kind == SLIDE:
                        put_column(out, at, n, axis)
                    else:
                        put_column(out, at, n, about(axis, x, vector(w, i * PLACE + FRAME + 9)))
                        put_column(out, 3 * len(bodies) * n + at, n, turned_back(frame, axis))
                i = tree.joints[i].parent


@part
def workspace(tree) -> int:
    """How many numbers a workspace has."""
    return len(tree.joints) * PLACE


@part
def put_places(tree, q, qd, w):
    """The frame and the axes of every joint."""
    for i in range(len(tree.joints)):
        if tree.joints[i].kind == HINGE:
            put_sines(q, tree.joints[i].at, tree.joints[i].reference, w, i * PLACE + SINE)
    for i in range(len(tree.joints)):
        joint, row, v = tree.joints[i], i * PLACE, tree.joints[i].by
        frame = outside(zero(w)) if joint.parent < 0 else placed(w, joint.parent * PLACE)
        if joint.kind == SLIDE:
            off = get(q, joint.at) - joint.reference
            put_all(w, row, slid_along(frame, joint.offset, joint.axis, off, get(qd, v), w, row + AXES))
            continue
        if joint.kind == HINGE:
            R = hinge_turned(frame[0], joint.axis, get(w, row + SINE), get(w, row + SINE + 1))
        else:
            R = ball_turned(frame[0], joint.axis, q, joint.at)
        spin = spin_about(R, joint.axis, 0, get(qd, v), w, row + AXES)
        for k in range(1, joint.count):
            spin = added(spin, spin_about(R, joint.axis, k, get(qd, v + k), w, row + AXES))
        put_all(w, row, turned(frame, R, joint.offset, spin))


@part
def put_energy(tree, bodies, moving, q, qd, w, out):
    """Potential energy of weights and springs; moving: and the kinetic one."""
    energy = zero(w)
    for b in range(len(bodies)):
        i = bodies[b].joint
        frame = outside(zero(w)) if i < 0 else placed(w, i * PLACE)
        energy = energy + bodies[b].mass * height(frame, bodies[b].com, tree.gravity)
        if moving:
            energy = energy + kinetic(frame, bodies[b].com, bodies[b].mass, bodies[b].inertia)
    for i in range(len(tree.joints)):
        joint = tree.joints[i]
        for k in range(joint.count if moving else 0):
            energy = energy + 0.5 * joint.armature[k] * (get(qd, joint.by + k) * get(qd, joint.by + k))
        if joint.stiffness != 0.0:
            if joint.kind == BALL:
                energy = energy + 0.5 * joint.stiffness * squared(moved_from_rest(q, joint.at, joint.rest))
            else:
                off = get(q, joint.at) - joint.rest[0]
                energy = energy + 0.5 * joint.stiffness * (off * off)
    put(out, 0, energy)


@part
def put_springs(tree, q, out):
    """k (q - rest) of every speed."""
    for i in range(len(tree.joints)):
        joint = tree.joints[i]
        if joint.stiffness != 0.0 and joint.kind == BALL:
            put_all(out, joint.by, stretched(moved_from_rest(q, joint.at, joint.rest), joint.stiffness))
        elif joint.stiffness != 0.0:
            put(out, joint.by, joint.stiffness * (get(q, joint.at) - joint.rest[0]))


@inlined
def outside(o):
    """The frame of the world."""
    R, r, *_ = world(o, (0.0, 0.0, 0.0))
    return R, r, r, r, r, r


@inlined
def placed(w, row):
    return matrix(w, row), *(vector(w, row + 9 + 3 * k) for k in range(5))


@inlined
def point(frame, at):
    """Place, velocity and acceleration at qdd = 0 of a point fixed in a frame, given in its axes."""
    R, r, v, omega, conv, omegad = frame
    arm = R @ vector(at, 0)
    return r + arm, v + omega.cross(arm), conv + (omegad.cross(arm) + omega.cross(omega.cross(arm)))


@inlined
def slid_along(frame, offset, axes, off, speed, w, at):
    """The frame beyond a slide, whose axis is put."""
    R, r, v, omega, conv, omegad = frame
    own = vector(axes, 0)
    axis, arm = R @ own, R @ (vector(offset, 0) + own * off)
    put_all(w, at, axis)
    conv = conv + (omegad.cross(arm) + omega.cross(omega.cross(arm))) + omega.cross(axis * (2.0 * speed))  # Coriolis
    return R, r + arm, v + omega.cross(arm) + axis * speed, omega, conv, omegad


@inlined
def spin_about(R, axes, k, speed, w, at):
    """The angular velocity about axis k of a joint, which is put."""
    axis = R @ vector(axes, 3 * k)
    put_all(w, at + 3 * k, axis)
    return axis * speed


@inlined
def turned(frame, R, offset, spin):
    """The frame beyond a joint that turns with this angular velocity to axes R."""
    _, _, _, omega, _, omegad = frame
    r, v, conv = point(frame, offset)
    return R, r, v, omega + spin, conv, omegad + omega.cross(spin)


@inlined
def turned_back(frame, v):
    """Components in the axes of a frame."""
    return frame[0].transposed @ v


@inlined
def angular_velocity_in(frame):
    return frame[0].transposed @ frame[3]


@inlined
def convective_in(frame):
    return frame[0].transposed @ frame[5]


@inlined
def about(axis, x, origin):
    """The velocity of x that turns about an axis by 1 rad/s."""
    return axis.cross(x - origin)


@inlined
def added(a, b):
    return a + b


@inlined
def height(frame, com, gravity):
    """Potential energy of a unit mass at a point fixed in a frame."""
    return (Vector(*gravity) * -1.0).dot(point(frame, com)[0])


@inlined
def kinetic(frame, com, mass, inertia):
    _, v, _ = point(frame, com)
    omega = frame[0].transposed @ frame[3]
    return 0.5 * (mass * v.dot(v) + omega.dot(matrix(inertia, 0) @ omega))


@inlined
def squared(u):
    return u.dot(u)


@inlined
def stretched(u, stiffness):
    return u * stiffness


@inlined
def put_column(out, at, n, v):
    """Put the components of v to every n-th place."""
    for k, x in enumerate(v):
        out[at + k * n] = x
