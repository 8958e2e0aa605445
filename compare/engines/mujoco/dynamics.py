"""The dynamics of a case in MuJoCo, in the project's symbols.

    q, v, a <-> qpos, qvel, qacc      h <-> qfrc_bias      tau <-> qfrc_applied
    M a + h = tau - D v

MuJoCo's derived fields belong to the last mj_forward, not to the last step: every quantity is evaluated with
mj_forward.
"""

from collections.abc import Callable, Sequence

import mujoco
import numpy as np
from numpy.typing import ArrayLike

from ...robots.case import Case
from .. import rows_of_states
from .inventory import contact_pairs
from .names import (
    INTEGRATORS,
    OF_A_JOINT,
    element_name,
    geom_name,
    joint_name,
    moving,
    number_of_actuators,
    on,
)
from .runs import Array, Runs
from .whole import Whole

Pair = tuple[np.ndarray, np.ndarray]
Read = Callable[[mujoco.MjData], ArrayLike]  # a quantity of a state


class MujocoDynamics(Runs):
    """MuJoCo with one model; quantities at states q (..., nq), v, tau (..., nv), joints in the case's order.

    bodies: their numbers in the model; the axes of a body are those that coincide with the world's at the
    position zero. bare: it is compared with a Tree that has the springs of the joints, and not the bodies
    that never move.
    """

    def __init__(self, model: mujoco.MjModel, case: Case, bodies: Sequence[int], bare: bool) -> None:
        # where states are evaluated the file's integrator must not matter, as `discrete` does
        model.opt.integrator = INTEGRATORS["RK4"]
        model.opt.enableflags &= ~int(mujoco.mjtEnableBit.mjENBL_INVDISCRETE)
        if bare:  # their height would count in the energy
            model.body_mass[np.setdiff1d(np.flatnonzero(~moving(model)), bodies)] = 0.0
        super().__init__(model, case)
        self.bodies, self.bare = list(bodies), bare
        self.forward(np.array(case.tree.zero))
        self.whole = Whole(model, self.bodies)
        self.zero_axes = self.turns(self.data.xmat)

    def com_positions(self, q: Array) -> np.ndarray:
        """CoM positions in the world, m, (..., m, 3): xipos."""
        return self._each(lambda d: d.xipos[self.bodies], q)

    def angular_velocities(self, q: Array, v: Array) -> np.ndarray:
        """Angular velocities in body axes, rad/s, (..., m, 3): R' times the angular part of cvel."""
        return self._each(lambda d: self._to_body(d.cvel[self.bodies, :3]), q, v)

    def jacobians(self, q: Array) -> Pair:
        """T_b and B_b, (..., m, 3, nv): mj_jacBodyCom, its rotational part turned into body axes."""

        def both(d: mujoco.MjData) -> np.ndarray:
            pair = np.zeros((2, len(self.bodies), 3, self.model.nv))
            for T, B, body in zip(*pair, self.bodies):
                mujoco.mj_jacBodyCom(self.model, d, T, B, body)
            T, B = pair[..., self.dofs]
            return np.stack([T, self._to_body(B)])

        T, B = np.moveaxis(self._each(both, q), -4, 0)
        return T, B

    def convective_terms(self, q: Array, v: Array) -> Pair:
        """v_conv, world, and w_conv, body axes, (..., m, 3): accelerations at qacc = 0 without gravity.

        mj_jacDot of MuJoCo 4.0 leaves out what a ball does to a slide after it in the same body.
        """
        model, gravity = self.model, self.model.opt.gravity.copy()

        def terms(d: mujoco.MjData) -> Pair:
            both = np.zeros((len(self.bodies), 6))
            d.qacc[:] = 0.0
            mujoco.mj_rnePostConstraint(model, d)
            for row, body in zip(both, self.bodies):
                mujoco.mj_objectAcceleration(model, d, mujoco.mjtObj.mjOBJ_BODY, body, row, 0)
            return both[:, 3:], self._to_body(both[:, :3])

        try:
            model.opt.gravity[:] = 0.0
            v_conv, w_conv = np.moveaxis(self._each(terms, q, v), -3, 0)
        finally:
            model.opt.gravity[:] = gravity
        return v_conv, w_conv

    def mass_matrix(self, q: Array) -> np.ndarray:
        """M, kg m2, (..., nv, nv): mj_fullM."""
        full = np.zeros((self.model.nv, self.model.nv))

        def dense(d: mujoco.MjData) -> np.ndarray:
            mujoco.mj_fullM(self.model, d, full)
            return full[np.ix_(self.dofs, self.dofs)]

        return self._each(dense, q)

    def bias(self, q: Array, v: Array) -> np.ndarray:
        """h, N m, (..., nv): qfrc_bias."""
        return self._each(lambda d: d.qfrc_bias[self.dofs], q, v)

    def com(self, q: Array) -> np.ndarray:
        """Centre of mass of all that moves, m, (..., 3): subtree_com."""
        return self._each(self.whole.com, q)

    def com_jacobian(self, q: Array) -> np.ndarray:
        """m/rad, (..., 3, nv): mj_jacSubtreeCom."""
        return self._each(lambda d: self.whole.com_jacobian(d)[:, self.dofs], q)

    def centroidal_momentum_matrix(self, q: Array) -> np.ndarray:
        """kg m/rad and kg m2/rad, (..., 6, nv): mass times mj_jacSubtreeCom, above mj_angmomMat."""
        return self._each(lambda d: self.whole.momentum(d)[:, self.dofs], q)

    def gravity_balance(self, q: Array) -> np.ndarray:
        """N m, (..., nv): qfrc_bias at rest."""
        return self.bias(q, 0.0)

    def spring_torque(self, q: Array) -> np.ndarray:
        """N m, (..., nv): -qfrc_spring."""
        return self._each(lambda d: -d.qfrc_spring[self.dofs], q)

    def compensation(self, q: Array, shares: np.ndarray) -> np.ndarray:
        """N m, (..., nv): qfrc_gravcomp, where the bodies have these shares of their weight taken, (nbody,)."""
        before = self.model.body_gravcomp.copy()
        self.model.body_gravcomp[:] = shares
        try:
            return self._each(lambda d: d.qfrc_gravcomp[self.dofs], q)
        finally:
            self.model.body_gravcomp[:] = before

    def acceleration(self, q: Array, v: Array, tau: Array) -> np.ndarray:
        """a, rad/s2, (..., nv): qacc."""
        return self._each(lambda d: d.qacc[self.dofs], q, v, tau - self.constant)

    def inverse(self, q: Array, v: Array, a: Array) -> np.ndarray:
        """The torque for which a is the acceleration, N m, (..., nv): mj_inverse."""

        def torque(d: mujoco.MjData) -> np.ndarray:
            d.qacc[self.dofs] = d.qfrc_applied[self.dofs]
            mujoco.mj_inverse(self.model, d)
            return d.qfrc_inverse[self.dofs]

        return self._each(torque, q, v, a)  # a travels in the place of tau

    def acting_actuators(self, q: Array, v: Array) -> list[str]:
        """The names of the actuators that exert a force at a state, and their joints."""
        m, names = self.model, []
        forces = self._each(lambda d: d.actuator_force, q, v).reshape(-1, number_of_actuators(m))
        for i in np.flatnonzero(forces.any(axis=0)).tolist():
            has_joint = mujoco.mjtTrn(m.actuator_trntype[i]) in OF_A_JOINT
            joint = f" on {joint_name(m, m.actuator_trnid[i, 0])}" if has_joint else ""
            names.append(element_name(m, "actuator", i) + joint)
        return names

    def additional_bodies(self) -> list[tuple[str, float]]:
        """Bodies with mass, kg, that are not among those of the case, by name."""
        others = np.setdiff1d(np.flatnonzero(self.model.body_mass), self.bodies)
        masses = self.model.body_mass[others].tolist()
        return [(element_name(self.model, "body", body), mass) for body, mass in zip(others, masses)]

    @property
    def may_touch(self) -> bool:
        """Whether contacts are in force, and some geoms may touch."""
        m = self.model
        return on(m, "CONTACT") and on(m, "CONSTRAINT") and len(contact_pairs(m)) > 0

    def touching(self, q: np.ndarray) -> list[set[tuple[str, str]]]:
        """The pairs of geoms with a contact at each position, (states, nq), by name."""
        pairs = []
        for state in q:
            contacts = self.forward(state).contact
            acting = contacts.geom[contacts.efc_address >= 0].tolist()
            pairs.append({(geom_name(self.model, a), geom_name(self.model, b)) for a, b in acting})
        return pairs

    def other_forces(self, q: Array, v: Array) -> dict[str, np.ndarray]:
        """Forces that the case's equations do not have, by source, N m, (..., nv) each."""
        D, has_springs = self.model.dof_damping, self.bare

        def passive(d: mujoco.MjData) -> np.ndarray:
            return (d.qfrc_passive + D * d.qvel - has_springs * d.qfrc_spring)[self.dofs]

        return {
            "fluid and tendons" if has_springs else "springs, fluid and tendons": self._each(passive, q, v),
            "actuators": self._each(lambda d: d.qfrc_actuator[self.dofs], q, v),
            "constraints and contacts": self._each(lambda d: d.qfrc_constraint[self.dofs], q, v),
        }

    def potential_energy(self, q: Array) -> np.ndarray:
        """V, J, (...): mj_energyPos."""
        return self._energies(q, 0.0)[..., 0]

    def energy(self, q: Array, v: Array) -> np.ndarray:
        """Potential and kinetic energy together, J, (...): mj_energyPos and mj_energyVel."""
        return self._energies(q, v).sum(axis=-1)

    def _energies(self, q: Array, v: Array) -> np.ndarray:
        def energies(d: mujoco.MjData) -> np.ndarray:
            mujoco.mj_energyPos(self.model, d)
            mujoco.mj_energyVel(self.model, d)
            return d.energy

        return self._each(energies, q, v)

    def _each(self, read: Read, q: Array, v: Array = 0.0, tau: Array = 0.0) -> np.ndarray:
        """read(data) after mj_forward at each state, stacked to the batch shape of the states."""
        batch, states = rows_of_states(q, v, tau)
        values = [np.array(read(self.forward(*state))) for state in zip(*states)]
        return np.array(values).reshape((*batch, *values[0].shape))

    def forward(self, q: Array, v: Array = 0.0, tau: Array = 0.0) -> mujoco.MjData:
        d = self.data
        d.qpos[self.qpos], d.qvel[self.dofs], d.qfrc_applied[self.dofs] = q, v, tau
        mujoco.mj_forward(self.model, d)
        return d

    def turns(self, xmat: np.ndarray) -> np.ndarray:
        """The orientations of the bodies, (m, 3, 3), of xmat or ximat."""
        return xmat[self.bodies].reshape(-1, 3, 3).copy()

    def _to_body(self, vectors: np.ndarray) -> np.ndarray:
        """World components to body axes, the axes of the world at the position zero."""
        turns = self.turns(self.data.xmat) @ self.zero_axes.transpose(0, 2, 1)
        return np.einsum("bji,bj...->bi...", turns, vectors)
