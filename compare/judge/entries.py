"""Scales of the tolerances of every quantity, one for each entry.

Entries differ in unit (kg and kg m2, N and N m) and size: one number for all would hide errors of small ones.
The scale of an entry is the sum of the absolute values of the terms that are added in it, each at its
maximum; its tolerance is 64 eps x scale. For a body with mass m and inertia I at a state:

    (1)  L_i    largest possible distance of its centre of mass from the axis or anchor of joint i
    (2)  t_i    column of T_b: L_i + W / 4 + R / 64 of a hinge or ball, 1 of a slide, 0 if i does not move it
    (3)  u_i    column of B_b: 1 of a hinge or ball, 0 of a slide or if i does not move it
    (4)  S, V   sums of the |rates| that turn it and that slide it; w = V + sum of t_i |rates|
    (5)  Mbar_ij = sum of k (m t_i t_j + |I| u_i u_j), and the armature
    (6)  h_i = sum of k (t_i m (2 S w + g) + u_i (m V^2 + |I| S^2))

W is the largest distance of the body from the centre of mass of all, at the states: MuJoCo adds moments about
the centre of mass of what hangs on one body of the world, and a Tree does not tell which branches do. Four
terms of m W^2 (of the inertia, twice of the moment, and of the mass) cancel down to m L_i^2; each is rounded
by eps m W^2, together by 64 eps m (W / 4)^2. R is the largest distance of the body from the world's origin.
Its position, and so each of its levers, is rounded by eps R, which is 64 eps (R / 64). k is the number of
hinges and balls that turn the body, at least 1: each turn passes on the rounding of those before it and adds
its own. Where MuJoCo fuses bodies, one after another, each sum is turned into its principal axes and back: k
is then multiplied by the number of bodies that are fused.

A derivative by the tangent of joint j changes at most four factors of a term, a lever and those of an
acceleration. A turn changes each by its own size: the scale of d(Mbar qdd + h)/dq_j is four times that of the
terms of the bodies that j moves. A slide changes levers by 1 and accelerations by S^2.
Where a system is solved, errors of eps in Mbar and in the forces are multiplied by |Mbar^-1|, entry by entry:
a condition number would depend on the units.
"""

from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

import tmt
from tmt.model.singular import mass_matrices

from .scale import FACTOR, from_centre, gain_scale, levers, spring_scale


def unit(tree: tmt.Tree, of_hinge: str, of_slide: str, of_both: str = "") -> str:
    """The units of the entries for hinges and balls, for slides, and one of each, if the tree has them."""
    turns, slides = set(tree.kind) != {"slide"}, "slide" in tree.kind
    units = [of_hinge] * turns + [of_both] * (turns and slides) + [of_slide] * slides
    return " or ".join(filter(None, units))


class Entries:
    """Scales at q (states, nq), qd (states, nv), each of a shape that broadcasts to that of its quantity.

    fused: with how many each body is fused into one, itself among them, 1 or (m,).
    """

    def __init__(self, tree: tmt.Tree, q: np.ndarray, qd: ArrayLike = 0.0, fused: ArrayLike = 1):
        self.tree, self.q = tree, q
        self.qd = np.broadcast_to(qd, (len(q), tree.coordinates.nv))
        from_joints, self.reach = levers(tree, q)  # (1) L_i and R
        if (from_joints == from_joints[:1]).all():  # no slide moves a body farther from a hinge
            from_joints = from_joints[:1]
        joints_of_bodies = np.array([tree.moves(b) for b in range(len(tree.mass))])
        is_turn = np.array(tree.kind) != "slide"
        self.count = np.maximum(1, (joints_of_bodies & is_turn).sum(axis=1)) * fused  # k, (m,)
        self.of_speed = [i for i, joint in enumerate(tree.coordinates.joints) for _ in tree.axis[joint.qd]]
        moved, turns = joints_of_bodies[:, self.of_speed], is_turn[self.of_speed]
        self.slides, self.turns = moved & ~turns, moved & turns  # (3) u_i is that of turns, (m, nv)
        arms = from_joints[..., self.of_speed] + from_centre(tree, q)[:, None] / 4
        arms = arms + self.reach.max(axis=0, initial=0.0)[:, None] / FACTOR
        self.t = self.slides + self.turns * arms  # (2), (1 or states, m, nv)
        self.mass = self.count * np.array(tree.mass)
        self.inertia = self.count * np.linalg.norm(tree.inertia, 2, axis=(1, 2))
        rates = np.abs(self.qd)
        self.spin, self.slip = rates @ self.turns.T, rates @ self.slides.T  # (4) S and V, (states, m)
        self.speed = np.einsum("sbi,si->sb", self.t, rates)  # w
        self.positions, self.B = (self.count * self.reach)[:, :, None], self.count[None, :, None, None]
        self.angular_velocities, self.w_conv = ((self.count * self.spin**k)[:, :, None] for k in (1, 2))
        self.v_conv = (self.count * 2.0 * self.spin * self.speed)[:, :, None]

    @cached_property
    def T(self) -> np.ndarray:
        return (self.count[:, None] * self.t)[:, :, None, :]

    @cached_property
    def mass_matrix(self) -> np.ndarray:
        """Where no body adds a term (two branches) that of the diagonal's, sqrt(ii jj): Mbar is definite."""
        root = np.sqrt(np.einsum("sii->si", self.added))
        return np.where(self.added > 0.0, self.added, root[:, :, None] * root[:, None, :])

    @cached_property
    def added(self) -> np.ndarray:
        """The terms of Mbar, (5), (states, nv, nv)."""
        translation = np.einsum("b,sbi,sbj->sij", self.mass, self.t, self.t, optimize=True)
        rotation = np.einsum("b,bi,bj->ij", self.inertia, self.turns, self.turns)
        return self.of_states(translation + rotation + np.diag(self.tree.armature))

    @cached_property
    def weight(self) -> np.ndarray:
        """Of the torque that balances gravity, N m or N, (states, nv)."""
        return float(np.linalg.norm(self.tree.gravity)) * self.momentum

    @cached_property
    def com(self) -> np.ndarray:
        """Of the centre of mass of all, m, (states, 1)."""
        return (self.reach @ self.mass)[:, None] / sum(self.tree.mass)

    @cached_property
    def com_jacobian(self) -> np.ndarray:
        """(states, 1, nv)."""
        return self.momentum[:, None] / sum(self.tree.mass)

    @cached_property
    def momentum(self) -> np.ndarray:
        """Linear, for unit speeds, (states, nv)."""
        return self.of_states(np.einsum("b,sbi->si", self.mass, self.t))

    @cached_property
    def centroidal_momentum_matrix(self) -> np.ndarray:
        """(states, 6, nv): of the angular rows sum of k (m W t_i + |I| u_i), W as in (2)."""
        arms = from_centre(self.tree, self.q) + self.reach.max(axis=0, initial=0.0) / FACTOR
        angular = np.einsum("b,sbi->si", self.mass * arms, self.t) + self.inertia @ self.turns
        return np.stack([self.momentum] * 3 + [self.of_states(angular)] * 3, axis=1)

    @cached_property
    def coriolis_matrix(self) -> np.ndarray:
        """Of half of dh/dqd, and of Mbar times the speeds of balls, (states, nv, nv)."""
        brackets = np.zeros((len(self.q), *self.added.shape[1:]))
        for joint in self.tree.coordinates.balls:
            brackets[:, joint.qd, joint.qd] = np.abs(self.qd[:, joint.qd]).sum(axis=1)[:, None, None]
        return 2.0 * self.rates_by_speed + self.added @ brackets

    @cached_property
    def rates_by_speed(self) -> np.ndarray:
        """Of half of the derivative of the bias by qd, (states, nv, nv)."""
        stretched = self.mass * self.spin
        by_speed = np.einsum(
            "sb,sbi,sbj->sij", stretched, self.t, np.broadcast_to(self.t, (*self.spin.shape, self.t.shape[2]))
        )
        by_speed += np.einsum("sb,sbi,bj->sij", self.mass * self.speed, self.t, self.turns)
        by_speed += np.einsum("sb,bi,bj->sij", self.inertia * self.spin, self.turns, self.turns)
        return by_speed + np.einsum("sb,bi,bj->sij", self.mass * self.slip, self.turns, self.slides)

    def regressor(self, qdd: ArrayLike) -> np.ndarray:
        """Of a torque for a unit of mass, first moment or inertia of a body, (states, nv, 10 m)."""
        sizes = np.abs(np.broadcast_to(qdd, self.qd.shape))
        turning = sizes @ self.turns.T + self.spin**2  # (states, m)
        a = np.einsum("sbi,si->sb", self.t, sizes) + 2.0 * self.spin * self.speed + self.slip * self.spin
        a = a + np.linalg.norm(self.tree.gravity)
        of_mass = a[:, :, None] * self.t
        of_moment = turning[:, :, None] * self.t + a[:, :, None] * self.turns
        of_inertia = turning[:, :, None] * self.turns
        columns = np.stack([of_mass, *[of_moment] * 3, *[of_inertia] * 6], axis=3) * self.count[:, None, None]
        return columns.transpose(0, 2, 1, 3).reshape(*self.qd.shape, -1)

    def of_states(self, scale: np.ndarray) -> np.ndarray:
        """A scale that may be one for all states, for each of them."""
        return np.broadcast_to(scale, (len(self.q), *scale.shape[1:]))

    @cached_property
    def springs(self) -> np.ndarray:
        return spring_scale(self.tree, self.q)

    @cached_property
    def bias(self) -> np.ndarray:
        """(6), (states, nv)."""
        newton = self.mass * 2.0 * self.spin * self.speed
        euler = self.mass * self.slip**2 + self.inertia * self.spin**2
        return np.einsum("sb,sbi->si", newton, self.t) + euler @ self.turns + self.weight

    @cached_property
    def potential_energy(self) -> np.ndarray:
        """J, (states,): m g L, and k (|q| + |rest|)^2 / 2."""
        stiffness, zero = np.array(self.tree.stiffness)[self.of_speed], np.zeros_like(self.springs)
        stretched = np.divide(self.springs**2, stiffness, out=zero, where=stiffness > 0.0)
        return np.linalg.norm(self.tree.gravity) * (self.reach @ self.mass) + stretched.sum(axis=1) / 2.0

    @cached_property
    def energy(self) -> np.ndarray:
        speeds = np.abs(self.qd)
        return self.potential_energy + np.einsum("si,sij,sj->s", speeds, self.added, speeds) / 2.0

    @cached_property
    def M(self) -> np.ndarray:
        return mass_matrices(self.tree, self.q)

    @cached_property
    def inverse(self) -> np.ndarray:
        """|Mbar^-1|, entry by entry."""
        return np.abs(np.linalg.inv(self.M))

    def force(self, tau: ArrayLike = 0.0) -> np.ndarray:
        """Of Mbar qdd = tau - D qd - k (q - rest) - h, N m or N, (states, nv)."""
        return self.bias + np.abs(tau) + np.array(self.tree.damping) * np.abs(self.qd) + self.springs

    @cached_property
    def factored(self) -> np.ndarray:
        """The terms of Mbar and of its factorization, up to sqrt(Mbar_ii Mbar_jj), (states, nv, nv)."""
        root = np.sqrt(np.einsum("sii->si", self.M))
        return self.added + root[:, :, None] * root[:, None, :]

    def residual(self, force: np.ndarray, qdd: ArrayLike) -> np.ndarray:
        """Of Mbar qdd and the forces."""
        return np.einsum("sij,sj->si", self.factored, np.abs(qdd)) + force

    def acceleration(self, force: np.ndarray, qdd: ArrayLike) -> np.ndarray:
        """Of qdd: errors of eps in Mbar and in the forces times |Mbar^-1|, (states, nv)."""
        return np.einsum("sij,sj->si", self.inverse, self.residual(force, np.broadcast_to(qdd, force.shape)))

    def closing(self, force: np.ndarray, qdd: ArrayLike) -> np.ndarray:
        """Of the force that an engine computes for another's qdd, (states, nv): the residual of each.

        The qdd of a backward stable solver solves a system with errors of eps in Mbar and in the forces,
        whatever cond(Mbar).
        """
        return 2.0 * self.residual(force, np.broadcast_to(qdd, force.shape))

    def force_rates(self, qdd: ArrayLike) -> tuple[np.ndarray, np.ndarray]:
        """Of the derivatives of tau by the tangent of q and by qd, (states, nv, nv) each, at qdd."""
        tree, sizes = self.tree, np.abs(np.broadcast_to(qdd, self.qd.shape))
        turning = sizes @ self.turns.T + self.spin**2  # (states, m)
        pushed = np.einsum("sbi,si->sb", self.t, sizes) + 2.0 * self.spin * self.speed
        force = self.mass * (pushed + np.linalg.norm(tree.gravity))
        moment = self.inertia * turning + self.mass * self.slip**2
        of_turn = np.einsum("sb,sbi->sbi", force, self.t) + moment[:, :, None] * self.turns
        of_slide = force[:, :, None] * self.turns + self.mass[:, None] * self.t * turning[:, :, None]
        by_tangent = 4.0 * (
            of_turn.transpose(0, 2, 1) @ self.turns + of_slide.transpose(0, 2, 1) @ self.slides
        )
        stiffness = np.diag(np.array(tree.stiffness)[self.of_speed]) + np.abs(tree.position_gain or 0.0)
        damping = np.diag(tree.damping) + np.abs(tree.speed_gain or 0.0)
        return by_tangent + stiffness, 2.0 * self.rates_by_speed + damping

    def solved(self, right: np.ndarray, solution: np.ndarray) -> np.ndarray:
        """Of X with Mbar X = right, (states, nv, columns): |Mbar^-1| times the sizes of both sides."""
        return self.inverse @ (right + self.factored @ np.abs(solution))

    def derivatives(self, tau: ArrayLike, qdd: np.ndarray, by: tmt.Derivatives) -> tmt.Derivatives:
        """Of what tmt.derivatives returns at tau, where it is `by`; qdd: the accelerations."""
        force = self.force(tau) + gain_scale(self.tree, self.q, self.qd)
        sizes = np.abs(qdd) + self.acceleration(force, qdd)
        by_tangent, by_speed = self.force_rates(sizes)
        unit_torques = np.broadcast_to(np.eye(self.qd.shape[1]), by.dqdd_dtau.shape)
        by_q, by_qd, by_tau = map(self.solved, (by_tangent, by_speed, unit_torques), by[:3])
        return tmt.Derivatives(by_q, by_qd, by_tau, by_tangent, by_speed)

    def step(self, dt: float | np.ndarray, by: tmt.Derivatives, scale: tmt.Derivatives) -> np.ndarray:
        """Of [A B] of a step, (states, 2 nv, 3 nv): dt times that of the derivatives, carried through it.

        by: the derivatives at the start, of which a step makes the first terms of an exponential; scale:
        theirs.
        """
        nv = self.qd.shape[1]
        rates, sizes = np.zeros((2, len(self.q), 3 * nv, 3 * nv))
        rates[:, :nv, nv : 2 * nv] = np.eye(nv)
        # turns of a ball add to each other
        sizes[:, :nv, nv : 2 * nv] = np.equal.outer(self.of_speed, self.of_speed)
        rates[:, nv : 2 * nv] = np.abs(np.concatenate(by[:3], axis=2))
        sizes[:, nv : 2 * nv] = np.concatenate(scale[:3], axis=2)
        carried = term = np.broadcast_to(np.eye(3 * nv), rates.shape)
        for k in range(1, 5):
            term = dt / k * (rates @ term)
            carried = carried + term
        carried = carried + dt * (carried @ sizes @ carried)
        for ball in self.tree.coordinates.balls:  # products of quaternions, which cancel down to a small turn
            carried[:, ball.qd, ball.qd] += 1.0
        return np.asarray(carried[:, : 2 * nv])
