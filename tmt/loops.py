"""Forward dynamics, and Mbar and h, of any tree as a loop over its joints, compiled once for all models.

The sums of method.py in another order, in the axes of the world about one point O: the origin of the first joint that turns.
A frame's motion at qdd = 0 is omega, omegad and the acceleration a of its point at O; another of its points, x, accelerates by
a + P x, P = [omegad]x + [omega]x[omega]x. A joint hands on a where it is, so that the speed of no point is needed. What a joint
carries itself has mass m, first moment s and inertia J about O; moment and force about O are

    n = J omegad + omega x J omega + s x a        f = m a + P s.

Forward dynamics, from the tips inward (articulated bodies: Featherstone, Rigid Body Dynamics Algorithms, 2008, chapter 7): a
speed has the direction S = (axis, r x axis), of a slide (0, axis). It gives way to what acts along it: its parent meets
I - U U'/D and p + U u/D, where I = [J H; H' M] and p = (n, f) are those of all that is carried, U = I S,
D = S'U + armature, u = Q - S'p. Mbar, of composite bodies: a row is the moment and force of S along the directions inward.

`tree` is a loop_trees.Arrays, w a workspace, numbers are those of inlined.py; complex ones carry an exact derivative along.
"""

# isort: off
from tmt.inlined import get, put, put_sines, zero
from tmt.loop_joints import (
    BALL, HINGE, LEFT, MET, OMEGAD, OWN, ROW, SINE, SLIDE, SPEED, TURN, accelerated_along, along, angular_velocity, articulated,
    at_rest, ball_turned, carried, carried_along, frame, gives_way, hinge_turned, moment_and_force, no_body, nothing_carried, own,
    pair, plus, put_acceleration, put_all, slid, spun, take_spring_of_ball, with_own, world,
)  # fmt: skip
from tmt.machine_code import compiled, part


@compiled
def forward_dynamics(tree, q, qd, tau, w, qdd):
    """qdd (nv,) of one state, or of eight; q (nq,), qd, tau (nv,), w (workspace(tree),)."""
    put_forces(tree, q, qd, tau, w)
    outward(tree, q, qd, w)
    inward(tree, w)
    accelerated(tree, w, qdd)


@compiled
def mass_matrix_and_bias(tree, q, qd, w, M, h):
    """Mbar (nv * nv,), of it what `composite` finds, and h (nv,) of one state, or of eight."""
    outward(tree, q, qd, w)
    composite(tree, w, M, h)


@part
def workspace(tree) -> int:
    """How many numbers a workspace has."""
    return len(tree.joints) * ROW + len(tree.before) * SPEED


@part
def outward(tree, q, qd, w):
    """Frames, directions and motions at qdd = 0, and what each joint itself carries, with its moment and force."""
    for i in range(len(tree.joints)):  # in a loop of its own: many are found at once
        if tree.joints[i].kind == HINGE:
            put_sines(q, tree.joints[i].at, tree.joints[i].reference, w, i * ROW + SINE)
    R, r, P, omega, omegad, a = world(zero(w), tree.gravity)
    for i in range(len(tree.joints)):
        joint, row = tree.joints[i], i * ROW
        at, v = len(tree.joints) * ROW + joint.by * SPEED, joint.by
        if joint.parent < 0:
            R, r, P, omega, omegad, a = world(zero(w), tree.gravity)
        elif joint.parent != i - 1:
            R, r, P, omega, omegad, a = frame(w, joint.parent * ROW)
        r = carried_along(r, R, joint.offset)
        if joint.kind == SLIDE:
            off = (get(q, joint.at) - joint.reference) * joint.moves
            r, a = slid(R, r, omega, a, joint.axis, off, get(qd, v), w, at)
        else:
            if joint.kind == HINGE:
                R = hinge_turned(R, joint.axis, get(w, row + SINE), get(w, row + SINE + 1))
            else:
                R = ball_turned(R, joint.axis, q, joint.at)
            spin = angular_velocity(R, r, joint.axis, 0, get(qd, v), w, at)
            for k in range(1, joint.count):
                spin = plus(spin, angular_velocity(R, r, joint.axis, k, get(qd, v + k), w, at + k * SPEED))
            P, omega, omegad, a = spun(P, omega, omegad, a, r, spin)
        if joint.forks:
            put_all(w, row + TURN, (R, r, omega, omegad, a))
            for k in range(row + MET, row + ROW):
                put(w, k, zero(w))
        put_all(w, row + OWN, own(joint.mass, joint.moment, joint.inertia, R, r, P, omega, omegad, a))


@part
def inward(tree, w):
    """Articulated bodies: of each speed U / D, and u / D in the place of Q."""
    body = no_body(w)
    for i in range(len(tree.joints) - 1, -1, -1):
        joint, row = tree.joints[i], i * ROW
        if not joint.goes_on:  # the joint after it hangs on another
            body = no_body(w)
        if joint.forks:
            body = plus(body, articulated(w, row + MET))
        body = with_own(body, w, row + OWN, joint.mass)
        for k in range(joint.count - 1, -1, -1):
            body = gives_way(body, w, len(tree.joints) * ROW + (joint.by + k) * SPEED, get(joint.armature, k))
        if joint.parent >= 0 and joint.parent != i - 1:
            k = joint.parent * ROW + MET
            put_all(w, k, plus(articulated(w, k), body))


@part
def accelerated(tree, w, qdd):
    """qdd, outward; OMEGAD and A of a row become what the accelerations of its joints add."""
    moved = at_rest(w)
    for i in range(len(tree.joints)):
        joint = tree.joints[i]
        if joint.parent < 0:
            moved = at_rest(w)
        elif joint.parent != i - 1:
            moved = pair(w, joint.parent * ROW + OMEGAD)
        for v in range(joint.by, joint.by + joint.count):
            moved = put_acceleration(moved, w, len(tree.joints) * ROW + v * SPEED, qdd, v)
        if joint.forks:
            put_all(w, i * ROW + OMEGAD, moved)


@part
def composite(tree, w, M, h):
    """h and the rows of Mbar, flat, each up to its diagonal, between a speed and those inward of it: of composite bodies."""
    speeds, nv = len(tree.joints) * ROW, len(tree.before)
    body, m = nothing_carried(w), zero(w)
    for i in range(len(tree.joints) - 1, -1, -1):
        joint, row = tree.joints[i], i * ROW
        if not joint.goes_on:
            body, m = nothing_carried(w), zero(w)
        if joint.forks:
            body, m = plus(body, carried(w, row + MET)), m + get(w, row + MET + 15)
        body, m = plus(body, carried(w, row + OWN)), m + joint.mass
        for v in range(joint.by, joint.by + joint.count):
            put(h, v, along(w, speeds + v * SPEED, moment_and_force(body)))
            pushed = accelerated_along(body, m, w, speeds + v * SPEED)
            put(M, v * nv + v, along(w, speeds + v * SPEED, pushed) + joint.armature[v - joint.by])
            j = tree.before[v]
            while j >= 0:
                put(M, v * nv + j, along(w, speeds + j * SPEED, pushed))
                j = tree.before[j]
        if joint.parent >= 0 and joint.parent != i - 1:
            k = joint.parent * ROW + MET
            put_all(w, k, (plus(carried(w, k), body), m + get(w, k + 15)))


@part
def put_forces(tree, q, qd, tau, w):
    """Q = tau - D qd - k (q - rest) - P q - S qd of every speed."""
    first = len(tree.joints) * ROW + LEFT
    for i in range(len(tree.joints)):
        joint, at = tree.joints[i], first + tree.joints[i].by * SPEED
        for v in range(joint.by, joint.by + joint.count):
            put(w, first + v * SPEED, get(tau, v) - joint.damping[v - joint.by] * get(qd, v))
        if joint.stiffness != 0.0 and joint.kind == BALL:
            take_spring_of_ball(q, joint.at, joint.stiffness, joint.rest, w, at)
        elif joint.stiffness != 0.0:
            put(w, at, get(w, at) - joint.stiffness * (get(q, joint.at) - joint.rest[0]))
    for i in range(len(tree.joints) if len(tree.position_gain) else 0):
        joint = tree.joints[i]
        for v in range(len(tree.before) if joint.kind != BALL else 0):
            at = first + v * SPEED
            put(w, at, get(w, at) - tree.position_gain[v, joint.by] * get(q, joint.at))
    for k in range(len(tree.speed_gain)):
        for v in range(len(tree.before)):
            put(w, first + v * SPEED, get(w, first + v * SPEED) - tree.speed_gain[v, k] * get(qd, k))
