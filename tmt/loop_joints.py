"""What loops.py does at one joint, or along one of its speeds, with the vectors of space.py; written in its place.

A symmetric matrix is its diagonal and (yz, xz, xy). A body is (n, f, *J, H, *M), or as what is carried (n, f, *J, s).
"""

from tmt.equations.composite import outer, turning
from tmt.equations.vectors import IDENTITY, ZERO, Matrix, Vector, turn_of
from tmt.inlined import inlined, zero
from tmt.model.coordinates import conjugate, logarithm, product

HINGE, SLIDE, BALL = 0, 1, 2
# where a joint's numbers begin in its row of a workspace: what it carries itself (n, f, J, s), sine and cosine, its frame and
# motion, and what hangs on it, but for the joint after it (n, f, J, H, M; or n, f, J, s, m)
OWN, SINE, TURN, AT, OMEGA, OMEGAD, A, MET, ROW = 0, 15, 17, 26, 29, 32, 35, 38, 65
# and those of a speed: S, U / D, and u / D, before that Q
S, U, LEFT, SPEED = 0, 6, 12, 13


@inlined
def vector(w, k):
    return Vector(w[k], w[k + 1], w[k + 2])


@inlined
def pair(w, k):
    return vector(w, k), vector(w, k + 3)


@inlined
def matrix(w, k):
    return Matrix([vector(w, k + 3 * j) for j in range(3)])


@inlined
def carried(w, k):
    """n, f, J, s."""
    return tuple(vector(w, k + 3 * j) for j in range(5))


@inlined
def articulated(w, k):
    """n, f, J, H, M."""
    return (*(vector(w, k + 3 * j) for j in range(4)), matrix(w, k + 12), *pair(w, k + 21))


@inlined
def no_body(w):
    """n, f, J, H, M of nothing."""
    z = Vector(zero(w), zero(w), zero(w))
    return z, z, z, z, Matrix([z, z, z]), z, z


@inlined
def nothing_carried(w):
    """n, f, J, s of nothing."""
    return no_body(w)[:4] + no_body(w)[:1]


@inlined
def at_rest(w):
    return no_body(w)[:2]


@inlined
def put_all(w, k, parts):
    """Put the numbers of nested parts, from k on; the place after them."""
    if isinstance(parts, tuple | Vector | Matrix):
        for part in parts:
            k = put_all(w, k, part)
        return k
    w[k] = parts
    return k + 1


@inlined
def plus(a, b):
    return tuple(x + y for x, y in zip(a, b)) if isinstance(a, tuple) else a + b


@inlined
def world(o, gravity):
    """Turn, place and motion of the world, P before omega; gravity is an acceleration of it."""
    still = Vector(o, o, o)
    R, P = (Matrix([row + still for row in unit]) for unit in (IDENTITY, [ZERO] * 3))
    return R, still, P, still, still, still - Vector(*gravity)


@inlined
def frame(w, row):
    """The same of a joint that forks."""
    omega, omegad = vector(w, row + OMEGA), vector(w, row + OMEGAD)
    return matrix(w, row + TURN), vector(w, row + AT), turning(omega, omegad), omega, omegad, vector(w, row + A)


@inlined
def carried_along(r, R, offset):
    return r + R @ vector(offset, 0)


@inlined
def slid(R, r, omega, a, axes, off, speed, w, at):
    """Place and motion beyond a slide, whose direction is put."""
    axis, o = R @ vector(axes, 0), zero(w)
    put_all(w, at + S, (Vector(o, o, o), axis))
    return r + axis * off, a + omega.cross(axis) * (2.0 * speed)  # Coriolis


@inlined
def hinge_turned(R, axes, s, c):
    """The turn beyond a hinge."""
    axis = vector(axes, 0)
    (x, y, z), (u, v, w), (a, b, d) = axis, axis * s, axis * (1.0 - c)
    return R @ Matrix(
        [[a * x + c, a * y - w, a * z + v], [a * y + w, b * y + c, b * z - u], [a * z - v, b * z + u, d * z + c]]
    )


@inlined
def ball_turned(R, axes, q, at):
    """The turn beyond a ball."""
    own = matrix(axes, 0)
    return R @ (own.transposed @ turn_of([q[at + k] for k in range(4)]) @ own)


@inlined
def angular_velocity(R, r, axes, k, speed, w, at):
    """The angular velocity about axis k of a joint at r; its direction is put."""
    axis = R @ vector(axes, 3 * k)
    put_all(w, at + S, (axis, r.cross(axis)))
    return axis * speed


@inlined
def spun(P, omega, omegad, a, r, spin):
    """The motion beyond a joint at r that turns at this angular velocity: a is handed on where the joint is."""
    omegad, omega, a = omegad + omega.cross(spin), omega + spin, a + P @ r
    P = turning(omega, omegad)
    return P, omega, omegad, a - P @ r


@inlined
def own(m, moment, inertia, R, r, P, omega, omegad, a):
    """n, f, J and s of what a joint at r itself carries."""
    turned = R @ vector(moment, 0)
    s = turned + r * m
    (x, xy, xz), (_, y, yz), (_, _, z) = outer(r, turned) + outer(s, r)
    (A, D, E), (_, B, F), (_, _, C) = R @ matrix(inertia, 0) @ R.transposed
    J = Vector(A + (y + z), B + (x + z), C + (x + y)), Vector(F - yz, E - xz, D - xy)
    return symmetric(J, omegad) + omega.cross(symmetric(J, omega)) + s.cross(a), a * m + P @ s, *J, s


def symmetric(A, v) -> Vector:
    """A v of a symmetric A."""
    (xx, yy, zz), (yz, xz, xy) = A
    return Matrix([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]) @ v


def less_squared(A, a, b) -> tuple:
    """A - a b' of a symmetric A, a along b."""
    (xx, yy, zz), (yz, xz, xy) = A
    return Vector(xx - a.x * b.x, yy - a.y * b.y, zz - a.z * b.z), Vector(
        yz - a.y * b.z, xz - a.x * b.z, xy - a.x * b.y
    )


@inlined
def with_own(body, w, k, m):
    """The body with what a joint itself carries, of which H = [s]x, M = m."""
    (n, f, *J, H, diagonal, off), (own_n, own_f, *own_J, (x, y, z)) = body, carried(w, k)
    H = H + Matrix([[0.0, z * -1.0, y], [z, 0.0, x * -1.0], [y * -1.0, x, 0.0]])
    return n + own_n, f + own_f, *plus(tuple(J), own_J), H, diagonal + Vector(m, m, m), off


@inlined
def gives_way(body, w, at, armature):
    """What the parent meets of a body that gives way along a speed, of which U / D and u / D are put."""
    n, f, Jd, Jo, H, Md, Mo = body
    axis, shift = pair(w, at + S)
    y, x = symmetric((Jd, Jo), axis) + H @ shift, symmetric((Md, Mo), shift) + H.transposed @ axis
    inverse = 1.0 / (axis.dot(y) + shift.dot(x) + armature)
    u = (w[at + LEFT] - (axis.dot(n) + shift.dot(f))) * inverse
    y_share, x_share = y * inverse, x * inverse
    put_all(w, at + U, (y_share, x_share, u))
    J, M = less_squared((Jd, Jo), y_share, y), less_squared((Md, Mo), x_share, x)
    return n + y * u, f + x * u, *J, H - outer(y_share, x), *M


@inlined
def put_acceleration(moved, w, at, qdd, v):
    """What has moved beyond a speed, whose own acceleration is put."""
    (turn, shift), (y, x) = moved, pair(w, at + U)
    found = w[at + LEFT] - (y.dot(turn) + x.dot(shift))
    qdd[v] = found
    axis, along = pair(w, at + S)
    return turn + axis * found, shift + along * found


@inlined
def moment_and_force(body):
    return body[:2]


@inlined
def accelerated_along(body, m, w, at):
    """Moment and force of a unit acceleration along a direction, on all that is carried."""
    (_, _, *J, s), (axis, shift) = body, pair(w, at + S)
    return symmetric(J, axis) + s.cross(shift), axis.cross(s) + shift * m


@inlined
def along(w, at, acting):
    """What a moment and a force do along a direction."""
    axis, shift = pair(w, at + S)
    return axis.dot(acting[0]) + shift.dot(acting[1])


@inlined
def moved_from_rest(q, k, rest):
    """The movement of a ball from its rest, see coordinates.py."""
    return Vector(*logarithm(product(conjugate([rest[j] for j in range(4)]), [q[k + j] for j in range(4)])))


@inlined
def take_spring_of_ball(q, k, stiffness, rest, w, at):
    """Take off k times the movement from the rest."""
    for j, moved in enumerate(moved_from_rest(q, k, rest)):
        w[at + j * SPEED] = w[at + j * SPEED] - stiffness * moved
