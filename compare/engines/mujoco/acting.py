"""A file's model in MuJoCo with its actuators at rest: their moments, constraints, linearized steps, and runs nearby."""

from collections.abc import Iterator, Mapping, Sequence
from copy import deepcopy
from types import MappingProxyType
from typing import Any

import mujoco
import numpy as np
from mujoco.rollout import rollout

from ...robots.actuators import Drive, Rows
from ...robots.coordinates import FREE, Coordinates
from .dynamics import Array
from .engine import MOST_ITERATIONS, SOLVED, UNLIMITED
from .inventory import NOT_HAD_FIELDS, open_equalities, set_fields
from .linear import NUDGE
from .names import INTEGRATORS, bit, control_of, kind_of, output_of

# besides the joints' springs and dampers these drive a robot here and stay
DRIVES = ("body_gravcomp", "tendon_stiffness", "tendon_damping")
# it is implicit in the constraints' springs and dampers
DISCRETE = getattr(mujoco.mjtIntegrator, "mjINT_DISCRETE", None)
Values = Mapping[int, float]  # by the number of an actuator or of a speed
NONE: Values = MappingProxyType({})


class Acting:
    """A compiled model whose actuators act by their laws alone, with equalities: no force range, contact, friction or fluid.

    cut: forces that ranges cut at the posture, by actuator; they stay constant. weightless: without gravity.
    integrator by MuJoCo's name, dt in s.
    """

    def __init__(self, model: mujoco.MjModel, drive: Drive, cut: Values = NONE, weightless: bool = False):
        self.model, self.drive = mujoco.MjModel.__copy__(model), drive
        m = self.model
        for flag in ("CONSTRAINT", "CONTACT", "EQUALITY", "LIMIT", "FRICTIONLOSS", "AUTORESET"):
            m.opt.disableflags |= bit(flag)
        self.is_coupled = bool(open_equalities(model))
        if self.is_coupled:
            m.opt.disableflags &= ~(bit("CONSTRAINT") | bit("EQUALITY"))
            m.opt.tolerance, m.opt.iterations = SOLVED, max(m.opt.iterations, MOST_ITERATIONS)
        m.opt.enableflags, m.opt.density, m.opt.viscosity = 0, 0.0, 0.0
        set_fields(m, (*(set(NOT_HAD_FIELDS) - set(DRIVES)), *UNLIMITED), 0)
        for i, actuator in enumerate(drive.actuators):
            if not actuator.acts or i in cut:
                m.actuator_gaintype[i] = mujoco.mjtGain.mjGAIN_FIXED
                m.actuator_biastype[i] = mujoco.mjtBias.mjBIAS_AFFINE
                m.actuator_gainprm[i], m.actuator_biasprm[i] = 0.0, 0.0
                m.actuator_biasprm[i, 0] = cut.get(i, 0.0)
                if m.actuator_plugin[i] >= 0:  # its own law overrides this one
                    m.actuator_gear[output_of(m, i)] = 0.0
        if weightless:
            m.opt.gravity[:] = 0.0
        self.data = mujoco.MjData(m)
        kinds: list[str] = []
        for j in range(m.njnt):
            kinds += FREE if kind_of(m, j) == "free" else [kind_of(m, j)]
        self.coordinates = Coordinates(tuple(map(str, range(len(kinds)))), tuple(kinds))

    def __getstate__(self) -> dict[str, Any]:
        return {name: value for name, value in self.__dict__.items() if name != "data"}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__.update(state)
        self.data = mujoco.MjData(self.model)  # a pickled one with a plugin ends the process

    def along(self, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Lengths (k,) and moments (k, nv) of all actuators and then of the tendons that pull, at a posture."""
        m, d = self.model, self.data
        d.qpos[:] = q
        mujoco.mj_fwdPosition(m, d)
        outputs = np.array([output_of(m, i) for i in range(len(self.drive.actuators))], int)
        moments = np.zeros((len(d.actuator_length), m.nv))
        mujoco.mju_sparse2dense(moments, d.actuator_moment, d.moment_rownnz, d.moment_rowadr, d.moment_colind)
        numbers = np.array([tendon.number for tendon in self.drive.tendons], int)
        jacobian = np.zeros((m.ntendon, m.nv))
        if m.ntendon:
            of = m if hasattr(m, "ten_J_rownnz") else d
            rows = of.ten_J_rownnz, of.ten_J_rowadr, of.ten_J_colind.reshape(-1)
            mujoco.mju_sparse2dense(jacobian, d.ten_J.reshape(-1), *rows)
        lengths = np.concatenate([d.actuator_length[outputs], d.ten_length[numbers]])
        return lengths, np.concatenate([moments[outputs], jacobian[numbers]])

    def rows(self, q: np.ndarray, dt: float, integrator: str) -> Rows:
        """The constraints that are on, at rest at q (nq,), as they are solved at a step size, s, for an integrator."""
        model, data, discrete = self.model, self.data, INTEGRATORS[integrator] == DISCRETE
        stated = model.opt.timestep, model.opt.integrator
        model.opt.timestep, model.opt.integrator = dt, INTEGRATORS[integrator]
        data.qpos[:], data.qvel[:] = q, 0.0
        mujoco.mj_forward(model, data)
        model.opt.timestep, model.opt.integrator = stated
        k, damping, impedance, slope = data.efc_KBIP.reshape(data.nefc, 4).T
        violation, stiffness, R = data.efc_pos - data.efc_margin, k * impedance, data.efc_R.copy()
        less = 1.0 + (dt * damping + dt * dt * stiffness) * discrete
        jacobian = np.zeros((data.nefc, model.nv))
        if mujoco.mj_isSparse(model):
            places = data.efc_J_rownnz, data.efc_J_rowadr, data.efc_J_colind
            mujoco.mju_sparse2dense(jacobian, data.efc_J, *places)
        else:
            jacobian[:] = data.efc_J.reshape(jacobian.shape)
        return Rows(
            jacobian,
            forces=-stiffness * violation / (less * R),
            damping=(damping + dt * stiffness * discrete) / less,
            # the impedance grows with the violation: aref does, and R falls
            stiffness=(stiffness + k * violation * slope * (1.0 + 1.0 / (1.0 - impedance))) / less,
            softness=R,
        )

    def at(
        self, q: np.ndarray, u: np.ndarray, dt: float, integrator: str
    ) -> tuple[mujoco.MjModel, mujoco.MjData]:
        """Model and data at rest at a posture, under u of each actuator, whose activations, if any, stay as they are."""
        model = mujoco.MjModel.__copy__(self.model)
        model.opt.timestep, model.opt.integrator = dt, INTEGRATORS[integrator]
        data = mujoco.MjData(model)
        data.qpos[:] = q
        for i, actuator in enumerate(self.drive.actuators):
            place, inputs = control_of(model, i)
            if inputs == 1:
                data.ctrl[place] = 0.0 if actuator.dynamics == "integrator" else u[i]
            if actuator.dynamics != "none" and actuator.acts:
                data.act[model.actuator_actadr[i]] = u[i]
        return model, data

    @property
    def filters(self) -> list[int]:
        """Indices of the activations of filters that act: they decay by themselves."""
        addresses = []
        for i, actuator in enumerate(self.drive.actuators):
            if actuator.acts and actuator.dynamics.startswith("filter"):
                addresses.append(int(self.model.actuator_actadr[i]))
        return addresses

    def deviations(
        self, q: np.ndarray, u: np.ndarray, dt: float, integrator: str, steps: Sequence[int],
        movement: Array = 0.0, speed: Array = 0.0, activation: Array = 0.0, jump: Array = 0.0,
    ) -> Iterator[np.ndarray]:  # fmt: skip
        """Deviations from q after each step of a run, then of filters' activations from u; one array for each part of the run.

        steps: their number in each part. Each array is (steps, nv + filters), in rad or m. The run starts at q with a small
        movement (nv,), a speed (nv,), an offset of all activations of filters; jump: of u, (k,), constant. A run that diverges
        stays where MuJoCo stopped it. With constraints, whose rest depends on the step, from a run that starts at rest at q.
        """
        model, data = self.at(q, np.add(u, jump), dt, integrator)
        mujoco.mj_integratePos(model, data.qpos, np.broadcast_to(movement, model.nv).astype(float), 1.0)
        data.qvel[:] = speed
        rest, filters = data.act.copy(), self.filters
        data.act[filters] += activation
        spec = mujoco.mjtState.mjSTATE_FULLPHYSICS
        both = [data, self.at(q, u, dt, integrator)[1]] if self.is_coupled else [data]
        state = np.zeros((len(both), mujoco.mj_stateSize(model, spec)))
        for run, row in zip(both, state):
            mujoco.mj_getState(model, run, row, spec)
        controls = np.array([run.ctrl for run in both])[:, None]
        for count in steps:
            # rollout sets controls anew, and leaves out the initial state
            states, _ = rollout(model, data, state, np.repeat(controls, count, axis=1), nstep=count)
            state, positions = states[:, -1], states[:, :, 1 : 1 + model.nq]
            at = 1 + model.nq + model.nv
            activations = states[0, :, at : at + model.na] - rest
            start = positions[1] if self.is_coupled else q
            yield np.hstack([self.coordinates.difference(positions[0], start), activations[:, filters]])

    def changed(self, damping: Values = NONE, armature: Values = NONE) -> "Acting":
        """A copy with other speed gains kv of actuators, by number, and more armature of speeds, kg m2 or kg."""
        other = deepcopy(self)
        for i, kv in damping.items():
            other.model.actuator_biasprm[i, 2] = -kv
        for k, more in armature.items():
            add_armature(other.model, [k], more)
        return other

    def transition(self, q: np.ndarray, u: np.ndarray, dt: float, integrator: str) -> np.ndarray:
        """d(movement, qd, act)+/d(movement, qd, act) of one step at rest, by central differences of MuJoCo's own; not for RK4."""
        model, data = self.at(q, u, dt, integrator)
        size = 2 * model.nv + model.na
        A = np.zeros((size, size))
        mujoco.mjd_transitionFD(model, data, NUDGE, True, A, None, None, None)
        return A


def add_armature(model: mujoco.MjModel, speeds: Sequence[int], more: float | np.ndarray) -> None:
    """More armature at some speeds of a compiled model, kg m2 or kg.

    Of bodies whose inertia never changes the compiler keeps it ready: there dof_armature alone does nothing.
    """
    model.dof_armature[speeds] += more
    model.dof_M0[speeds] += more
