"""Scales of tolerances of every quantity: in general one for each entry, for stated hinges one number for each state.

Entries differ in unit (kg and kg m2, N and N m) and size: one number for all would hide errors of small ones. The scale of an
entry is the sum of the absolute values of the terms that are added in it, each at its maximum. With L the largest possible
distance of a centre of mass from the origin at that state:

    a column of T_b     t = L of a hinge or ball, 1 of a slide, 0 if the joint does not move the body
    of B_b              u = 1 of a hinge or ball, 0 of a slide
    speeds              S = sum of |rates| that turn the body, V of those that slide it, w = L S + V
    Mbar_ij             sum of m t_i t_j + |I| u_i u_j, and the armature
    h_i                 sum of t_i m (2 S w + g) + u_i (m V^2 + |I| S^2)

Every term of a body is multiplied by k, the number of hinges and balls that turn it, at least 1: each turn passes on the
rounding of those before it and adds its own. Where a system is solved, errors of eps in Mbar and in the forces are multiplied by
|Mbar^-1|, entry by entry: a condition number would depend on the units. Mbar times the solution has no more than those errors.
"""

from collections.abc import Iterable
from functools import cached_property
from itertools import chain, repeat

import numpy as np
from numpy.typing import ArrayLike

import tmt
from tmt import literal
from tmt.model.singular import mass_matrices

from .scale import (
    acceleration_scale,
    bias_scale,
    condition,
    gravity_scale,
    mass_scale,
    reaches,
    spring_scale,
)


def has_own_scales(tree: tmt.Tree, is_read: bool) -> bool:
    """Whether each entry has its own scale: all robots but stated hinges without springs and armature. is_read: from a file."""
    return is_read or set(tree.kind) != {"hinge"} or tree.has_springs or any(tree.armature)


def scales(tree: tmt.Tree, is_read: bool, q: np.ndarray, qd: ArrayLike = 0.0) -> "Entries | Numbers":
    """The scales of a robot at states q (states, nq), qd (states, nv). is_read: its numbers are from a file."""
    return (Entries if has_own_scales(tree, is_read) else Numbers)(tree, q, qd)


def unit(tree: tmt.Tree, of_hinge: str, of_slide: str, of_both: str = "") -> str:
    """The units of a quantity's entries for hinges and balls, for slides, and for one of each, as far as the tree has them."""
    turns, slides = set(tree.kind) != {"slide"}, "slide" in tree.kind
    units = [of_hinge] * turns + [of_both] * (turns and slides) + [of_slide] * slides
    return " or ".join(filter(None, units))


class Numbers:
    """Scales of hinges at states q, qd (states, n): a number, or (states,), from norms."""

    B = 1.0

    def __init__(self, tree: tmt.Tree, q: np.ndarray, qd: ArrayLike = 0.0):
        self.tree, self.q, self.qd = tree, q, np.broadcast_to(qd, q.shape)
        self.drag = np.abs(np.array(tree.damping) * self.qd).max(axis=1)
        self.angular_velocities = np.abs(self.qd).sum(axis=1)
        self.positions = self.T = reaches(tree).max()
        self.v_conv, self.w_conv = self.positions * self.angular_velocities**2, self.angular_velocities**2
        self.potential_energy = self.weight = self.holding = gravity_scale(tree)

    @cached_property
    def mass_matrix(self) -> np.ndarray:
        return mass_scale(self.tree, self.q)

    @cached_property
    def bias(self) -> np.ndarray:
        return bias_scale(self.tree, self.q, self.qd)

    @cached_property
    def condition(self) -> np.ndarray:
        return condition(self.tree, self.q)

    @cached_property
    def energy(self) -> np.ndarray:
        speeds = np.abs(self.qd)
        M = np.abs(literal.mass_matrix(self.q, self.tree))
        return self.potential_energy + np.einsum("si,sij,sj->s", speeds, M, speeds) / 2

    def force(self, tau: np.ndarray) -> np.ndarray:
        """Of Mbar qdd = tau - D qd - h, N m, (states,)."""
        return self.bias + np.abs(tau).max(axis=1) + self.drag

    def acceleration(self, force: ArrayLike, qdd: ArrayLike) -> np.ndarray:
        """Of qdd, with its bound |Mbar^-1| force in place of its size."""
        return acceleration_scale(self.tree, self.q, force)

    def closing(self, force: np.ndarray, qdd: ArrayLike) -> np.ndarray:
        """Of the torque that one engine computes for another's qdd, N m, (states,)."""
        return self.condition * force

    def power(self, force: np.ndarray, qdd: ArrayLike) -> np.ndarray:
        """Of the rate of the energy at an engine's qdd, W, (states,)."""
        return self.closing(force, qdd) * self.angular_velocities

    def change(self, qdd: ArrayLike) -> np.ndarray:
        """Of the rate of Mbar qd without gravity and torque, N m, (states,): quadratic in the rates."""
        return self.condition * (self.mass_matrix * self.angular_velocities**2 + self.drag)


class Entries:
    """Scales at states q (states, nq), qd (states, nv), each of the shape of its quantity, or of one that broadcasts to it."""

    def __init__(self, tree: tmt.Tree, q: np.ndarray, qd: ArrayLike = 0.0):
        self.tree, self.q = tree, q
        self.qd = np.broadcast_to(qd, (len(q), tree.coordinates.nv))
        self.length = reaches(tree, q).max(axis=1)  # (states,)
        moved = [tree.moves(b) for b in range(len(tree.mass))]
        kinds, moved = np.array(per_speed(tree, tree.kind)), np.array([per_speed(tree, which) for which in moved])
        self.slides, self.turns = moved & (kinds == "slide"), moved & (kinds != "slide")  # (m, nv)
        turning = [[w and kind != "slide" for w, kind in zip(tree.moves(b), tree.kind)] for b in range(len(tree.mass))]
        self.count = np.maximum(1, np.sum(turning, axis=1))  # k, (m,)
        self.mass = self.count * np.array(tree.mass)
        self.inertia = self.count * np.linalg.norm(tree.inertia, 2, axis=(1, 2))
        self.spin, self.slip = np.abs(self.qd) @ self.turns.T, np.abs(self.qd) @ self.slides.T  # S and V, (states, m)
        self.speed = self.length[:, None] * self.spin + self.slip
        self.positions, self.B = (self.count * self.length[:, None])[:, :, None], self.count[None, :, None, None]
        self.angular_velocities, self.w_conv = ((self.count * self.spin**k)[:, :, None] for k in (1, 2))
        self.v_conv = (self.count * 2.0 * self.spin * self.speed)[:, :, None]

    @cached_property
    def T(self) -> np.ndarray:
        return (self.count[:, None] * (self.slides + self.length[:, None, None] * self.turns))[:, :, None, :]

    @cached_property
    def mass_matrix(self) -> np.ndarray:
        m, I, s, u = self.mass[:, None], self.inertia[:, None], self.slides.astype(float), self.turns.astype(float)
        L = self.length[:, None, None]
        fixed = s.T @ (m * s) + u.T @ (I * u) + np.diag(self.tree.armature)
        crossed = s.T @ (m * u)
        return fixed + L * (crossed + crossed.T) + L**2 * (u.T @ (m * u))

    @cached_property
    def weight(self) -> np.ndarray:
        """Of the torque that balances gravity, N m or N, (states, nv)."""
        g = float(np.linalg.norm(self.tree.gravity))
        return g * (self.mass @ self.slides + self.length[:, None] * (self.mass @ self.turns))

    @cached_property
    def holding(self) -> np.ndarray:
        """Of the torque that holds gravity and springs."""
        return self.weight + spring_scale(self.tree, self.q)

    @cached_property
    def bias(self) -> np.ndarray:
        newton = self.mass * 2.0 * self.spin * self.speed
        euler = self.mass * self.slip**2 + self.inertia * self.spin**2
        turned = self.length[:, None] * (newton @ self.turns) + euler @ self.turns
        return newton @ self.slides + turned + self.weight

    @cached_property
    def potential_energy(self) -> np.ndarray:
        """J, (states,): m g L, and k (|q| + |rest|)^2 / 2."""
        g, springs = float(np.linalg.norm(self.tree.gravity)), spring_scale(self.tree, self.q)
        stiffness = np.array(per_speed(self.tree, self.tree.stiffness))
        stretched = np.divide(springs**2, stiffness, out=np.zeros_like(springs), where=stiffness > 0.0)
        return g * self.length * self.mass.sum() + stretched.sum(axis=1) / 2.0

    @cached_property
    def energy(self) -> np.ndarray:
        speeds = np.abs(self.qd)
        return self.potential_energy + np.einsum("si,sij,sj->s", speeds, self.mass_matrix, speeds) / 2.0

    @cached_property
    def M(self) -> np.ndarray:
        return mass_matrices(self.tree, self.q)

    @cached_property
    def inverse(self) -> np.ndarray:
        """|Mbar^-1|, entry by entry."""
        return np.abs(np.linalg.inv(self.M))

    def force(self, tau: ArrayLike = 0.0) -> np.ndarray:
        """Of Mbar qdd = tau - D qd - k (q - rest) - h, N m or N, (states, nv)."""
        drag = np.array(self.tree.damping) * np.abs(self.qd)
        return self.bias + np.abs(tau) + drag + spring_scale(self.tree, self.q)

    def residual(self, force: np.ndarray, qdd: ArrayLike) -> np.ndarray:
        """Of Mbar qdd and the forces together; a factorization of Mbar has terms up to sqrt(Mbar_ii Mbar_jj)."""
        root = np.sqrt(np.einsum("sii->si", self.M))
        sizes = self.mass_matrix + root[:, :, None] * root[:, None, :]
        return np.einsum("sij,sj->si", sizes, np.abs(qdd)) + force

    def acceleration(self, force: np.ndarray, qdd: ArrayLike) -> np.ndarray:
        """Of qdd: errors of eps in Mbar and in the forces times |Mbar^-1|, (states, nv)."""
        return np.einsum("sij,sj->si", self.inverse, self.residual(force, np.broadcast_to(qdd, force.shape)))

    def closing(self, force: np.ndarray, qdd: ArrayLike) -> np.ndarray:
        """Of the force that one engine computes for another's qdd, N m or N, (states, nv).

        The qdd of a backward stable solver solves a system with errors of eps in Mbar and in the forces, whatever the condition
        of Mbar: once for each engine.
        """
        return 2.0 * self.residual(force, np.broadcast_to(qdd, force.shape))

    def power(self, force: np.ndarray, qdd: ArrayLike) -> np.ndarray:
        """Of the rate of the energy at an engine's qdd, W, (states,)."""
        return np.einsum("si,si->s", self.closing(force, qdd), np.abs(self.qd))

    def change(self, qdd: ArrayLike) -> np.ndarray:
        """Of the rate of Mbar qd without torque at an engine's qdd, N m or N, (states, nv)."""
        return self.closing(self.force(), qdd)


def per_speed(tree: tmt.Tree, values: Iterable) -> list:
    """One value for each speed, (nv,), of one for each joint."""
    joints = tree.coordinates.joints
    return list(
        chain.from_iterable(repeat(value, 3 if joint.kind == "ball" else 1) for value, joint in zip(values, joints))
    )
