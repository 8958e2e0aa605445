"""The model that MuJoCo compiles, for engines that take it as it is; and the numbers that they hold then."""

from collections.abc import Callable, Sequence
from pathlib import Path
from types import SimpleNamespace

import mujoco
import numpy as np

from ..outside.model import combined
from .inventory import switch_off
from .names import INTEGRATORS, bit, joint_places, matrix, rotors, tensor
from .reading import carriers
from .source import Source

HELD = (
    "body_parentid", "body_pos", "body_quat", "body_mass", "body_inertia", "body_ipos", "body_iquat", "jnt_bodyid",
    "jnt_stiffness", "dof_jntid", "dof_armature", "dof_damping",
)  # fmt: skip


class Bare:
    """The compiled model of a file with all that a Tree does not have taken away or switched off.

    names: of the Tree's joints. rotors_in_joints: the armature of actuators is that of their joints.
    qpos (nq,), dofs (nv,): the indices of the Tree's coordinates and speeds in MuJoCo's.
    """

    def __init__(self, path: Path, names: Sequence[str], rotors_in_joints: bool = False):
        self.model = Source(path).without({}, bare=True)
        switch_off(self.model)
        self.model.opt.disableflags &= ~bit("AUTORESET")  # MuJoCo Warp refuses it
        # its solver starts from the unconstrained acceleration
        self.model.opt.disableflags |= bit("WARMSTART")
        # of constraints, which are off; both refuse PGS
        self.model.opt.solver = mujoco.mjtSolver.mjSOL_NEWTON
        if rotors_in_joints and hasattr(self.model, "actuator_armature"):
            self.model.dof_armature += rotors(self.model)
            self.model.actuator_armature[:] = 0.0
        # with this flag MuJoCo Warp's implicitfast is explicit in the damping; actuators with armature are still there
        self.model.opt.disableflags &= ~bit("ACTUATION")
        self.model.actuator_gainprm[:] = self.model.actuator_biasprm[:] = 0.0
        # MJX refuses pairs even if there are no contacts
        self.model.geom_contype[:] = self.model.geom_conaffinity[:] = 0
        places = joint_places(self.model)
        self.places = {name: places[name] for name in names}
        self.qpos = np.array([i for place in self.places.values() for i in place.qpos])
        self.dofs = np.array([i for place in self.places.values() for i in place.dofs])

    def with_integrator(self, name: str) -> mujoco.MjModel:
        """The model, which has this integrator now."""
        self.model.opt.integrator = INTEGRATORS[name]
        return self.model

    def numbers(self, held: Callable[[str], np.ndarray]) -> dict[str, np.ndarray]:
        """ReadModel.numbers, except gravity, of what an engine holds by MuJoCo's names, see HELD."""
        m = SimpleNamespace(nbody=self.model.nbody, **{name: held(name) for name in HELD})
        carrier, has_joint = carriers(m, list(self.places.values())), set(m.jnt_bodyid.tolist())
        frames = [(np.zeros(3), np.eye(3))]  # of each body in the axes of the last one that a joint moves
        carried: list[list[tuple[float, np.ndarray, np.ndarray]]] = [[] for _ in self.places]
        for body in range(1, m.nbody):
            at, turn = frames[0]
            if body not in has_joint:
                at, turn = frames[m.body_parentid[body]]
                at, turn = at + turn @ m.body_pos[body], turn @ matrix(m.body_quat[body])
            frames.append((at, turn))
            if carrier[body] >= 0:
                inertia = turn @ tensor(matrix(m.body_iquat[body]), m.body_inertia[body]) @ turn.T
                carried[carrier[body]].append((m.body_mass[body], at + turn @ m.body_ipos[body], inertia))
        mass, _, inertias = map(np.array, zip(*map(combined, carried)))
        numbers = {"mass": mass, "moments": np.linalg.eigvalsh(inertias)}
        numbers |= {"armature": m.dof_armature[self.dofs], "damping": m.dof_damping[self.dofs]}
        return numbers | {"stiffness": m.jnt_stiffness[m.dof_jntid][self.dofs]}
