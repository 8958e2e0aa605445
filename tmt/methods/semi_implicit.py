"""The semi-implicit Euler method: what MuJoCo calls Euler, implicitfast, implicit and discrete."""

from dataclasses import dataclass
from functools import lru_cache

from tmt.derivation import articulated
from tmt.derivation.method import bias_rates, mass_matrix_and_bias, reduced_force
from tmt.derivation.vectors import solve_any
from tmt.methods.stepping import Method, advance, increments, left_over
from tmt.model.coordinates import FLAT


@dataclass(frozen=True)
class SemiImplicitEuler(Method):
    """qd+ = qd + dt a, then q+ = q moved by dt qd+, with a from the linear system

        (Mbar + dt D [+ dt dh/dqd] [+ dt S] [+ dt^2 (k + P)]) a = tau - D qd - k (q - rest) - P q - S qd - h [- dt (k + P) qd].

    Joint damping is implicit in the speeds, and so is the bias if `implicit_bias`, or that of `lone_bodies`, which have no
    other body on them or under them; `implicit_gains`: so is a controller's S, in the entries whose two joints lie on one path
    to the world; `implicit_springs`: so are springs, and all entries of S and P. What MuJoCo calls Euler (none of these),
    implicit (bias, gains), implicitfast (lone bodies, gains) and discrete (lone bodies, springs, gains). MuJoCo documentation,
    numerical integration; which gains are implicit was measured.
    """

    implicit_bias: bool
    lone_bodies: bool = False
    implicit_springs: bool = False
    implicit_gains: bool = False

    damps_implicitly = True

    def gains_held(self, tree) -> tuple:
        """The implicit entries of a controller's gains, of position and of speed: (nv, nv) each, () where there are none."""
        if self.implicit_springs:
            return tree.position_gain, tree.speed_gain
        if not (self.implicit_gains and tree.speed_gain):
            return (), ()
        both = zip(tree.speed_gain, on_one_path(tree))
        return (), tuple(tuple(gain if one else 0.0 for gain, one in zip(*rows)) for rows in both)

    def matrix(self, tree, q, qd, dt, terms=mass_matrix_and_bias):
        """The matrix of the linear system for the slope: Mbar + dt D [+ dt dh/dqd] [+ dt S] [+ dt^2 k + dt^2 P]."""
        n = len(qd)
        matrix = terms(tree, q, [0.0] * n)[0]
        held = [dt * d for d in tree.damping]
        if self.implicit_springs and tree.has_springs:
            held = [x + dt * dt * k for x, k in zip(held, by_speed(tree, tree.stiffness))]
        matrix = [[matrix[i][j] + (held[i] if i == j else 0.0) for j in range(n)] for i in range(n)]
        lone = lone_speeds(tree) if self.lone_bodies else set()
        if self.implicit_bias or lone:
            rates = bias_rates(tree, q, qd, terms)
            own = range(n) if self.implicit_bias else lone
            added = [[dt * rate if i in own else 0.0 for rate in row] for i, row in enumerate(rates)]
            matrix = [[x + y for x, y in zip(*rows)] for rows in zip(matrix, added)]
        for gain, power in zip(self.gains_held(tree), (2, 1)):
            if gain:
                share = dt * dt if power == 2 else dt
                matrix = [[x + share * g if g else x for x, g in zip(*rows)] for rows in zip(matrix, gain)]
        return matrix

    def residual(self, tree, a, q, qd, tau, dt, terms=mass_matrix_and_bias):
        """What a leaves of the linear system above, (nv,): zero where it is the slope, and linear in a.

        dh/dqd a is (h(qd + a) - h(qd - a)) / 2, as h is quadratic in the speeds.
        """
        M, h = terms(tree, q, qd)
        force = reduced_force(tree, h, q, qd, tau)
        held = [dt * d for d in tree.damping]
        if self.implicit_springs and tree.has_springs:
            stiffness = by_speed(tree, tree.stiffness)
            force = [f - dt * k * v for f, k, v in zip(force, stiffness, qd)]
            held = [x + dt * dt * k for x, k in zip(held, stiffness)]
        left = [x + d * y for x, d, y in zip(left_over(M, a, force), held, a)]
        position_gain, speed_gain = self.gains_held(tree)
        if position_gain:
            moved = [dt * (v + dt * y) for v, y in zip(qd, a)]
            left = [x + weighted(row, moved) for x, row in zip(left, position_gain)]
        if speed_gain:
            left = [x + weighted(row, [dt * y for y in a]) for x, row in zip(left, speed_gain)]
        if (
            own := set(range(len(qd)))
            if self.implicit_bias
            else lone_speeds(tree)
            if self.lone_bodies
            else ()
        ):
            ahead, behind = (terms(tree, q, [v + sign * x for v, x in zip(qd, a)])[1] for sign in (1.0, -1.0))
            left = [x + 0.5 * dt * (ahead[i] - behind[i]) if i in own else x for i, x in enumerate(left)]
        return left

    def slope(self, tree, q, qd, tau, dt, terms=mass_matrix_and_bias):
        """a from the linear system above."""
        force = reduced_force(tree, terms(tree, q, qd)[1], q, qd, tau)
        if self.implicit_springs and tree.has_springs:
            force = [f - dt * k * v for f, k, v in zip(force, by_speed(tree, tree.stiffness), qd)]
        if position_gain := self.gains_held(tree)[0]:
            force = [f - weighted(row, [dt * v for v in qd]) for f, row in zip(force, position_gain)]
        solution = getattr(terms, "solve_any", solve_any)
        return solution(self.matrix(tree, q, qd, dt, terms), force)

    def articulates(self, tree) -> bool:
        """Whether all that is implicit acts at single joints alone: then it counts as armature."""
        across = any(
            g
            for gain in self.gains_held(tree)
            for i, row in enumerate(gain)
            for j, g in enumerate(row)
            if i != j
        )
        return not (self.implicit_bias or (self.lone_bodies and lone_speeds(tree)) or across)

    def articulated(self, tree, q, qd, tau, dt):
        """The slope with dt D + dt^2 k and the gains' dt S + dt^2 P as armature, and dt k and dt P as damping."""
        force, stiffness = reduced_force(tree, [0.0] * len(qd), q, qd, tau), by_speed(tree, tree.stiffness)
        held, (position_gain, speed_gain) = [0.0] * len(qd), self.gains_held(tree)
        if self.implicit_springs:
            held = [k + (position_gain[i][i] if position_gain else 0.0) for i, k in enumerate(stiffness)]
        force = [f - dt * k * v if k else f for f, k, v in zip(force, held, qd)]
        armature = [
            rotor + dt * (d + (speed_gain[i][i] if speed_gain else 0.0) + dt * k)
            for i, (rotor, d, k) in enumerate(zip(tree.armature, tree.damping, held))
        ]
        return articulated.acceleration(tree, q, qd, force, armature)

    def step(self, slope, q, qd, dt, joints=FLAT):
        """The state (q, qd) one dt later."""
        qd = advance(qd, dt, (1.0,), [slope(q, qd)])
        return joints.move(q, increments(dt, (1.0,), [qd], len(qd))), qd


def by_speed(tree, of_joints) -> list:
    """For each speed the value of its joint."""
    pairs = zip(of_joints, tree.coordinates.joints)
    return [value for value, joint in pairs for _ in range(joint.qd.start, joint.qd.stop)]


def weighted(row, values):
    """The sum of the entries of a row times values; 0.0 where all are zero."""
    return sum((g * x for g, x in zip(row, values) if g), 0.0)


@lru_cache(maxsize=64)
def on_one_path(tree) -> list:
    """Whether the joints of two speeds lie on one path to the world, (nv, nv)."""
    before = [{i} for i in range(len(tree.parent))]
    for i, parent in enumerate(tree.parent):
        before[i] |= before[parent] if parent >= 0 else set()
    joint = by_speed(tree, range(len(tree.parent)))
    return [[i in before[j] or j in before[i] for j in joint] for i in joint]


@lru_cache(maxsize=64)
def lone_speeds(tree) -> set:
    """The speeds of free bodies that stand alone: three slides and a ball from the world, and nothing on them."""
    lone = set()
    for i, kind in enumerate(tree.kind):
        chain = [i - 3, i - 2, i - 1, i]
        free = kind == "ball" and i >= 3 and [tree.kind[j] for j in chain] == ["slide"] * 3 + ["ball"]
        alone = (
            i not in tree.parent and tree.body_joint.count(i) == 1 and not {*chain[:3]} & {*tree.body_joint}
        )
        if free and alone and [tree.parent[j] for j in chain] == [-1, *chain[:3]]:
            lone |= set(range(tree.coordinates.joints[i - 3].qd.start, tree.coordinates.joints[i].qd.stop))
    return lone
