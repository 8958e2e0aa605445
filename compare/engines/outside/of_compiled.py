"""Engines that take the model that MuJoCo compiles."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from .. import GRID, Array, Course
from .model import Numbers, ReadModel

if TYPE_CHECKING:
    from ..mujoco.handed_on import Bare

METHODS = {"Euler": (1, "semi_implicit_euler"), "implicitfast": (1, "semi_implicit_euler"), "RK4": (4, "rk4")}
STAGES = {"Euler": 1, "implicitfast": 1, "RK4": 4}


class OfCompiled(ReadModel):
    bare: Bare
    models: dict[str, Any]  # the engine's, by the names of METHODS

    def held(self, name: str) -> Array:
        """A field of the engine's models by MuJoCo's name of it."""
        raise NotImplementedError

    def gravity(self) -> Array:
        raise NotImplementedError

    def numbers(self) -> Numbers:
        return {"gravity": self.gravity(), **self.bare.numbers(self.held)}

    def mend(self, name: str, values: Array) -> bool:
        dofs, joints = self.bare.dofs, self.bare.model.dof_jntid[self.bare.dofs]
        places = {"armature": ("dof_armature", dofs), "damping": ("dof_damping", dofs)}
        places |= {"stiffness": ("jnt_stiffness", joints), "gravity": ("opt.gravity", np.arange(3))}
        for method in self.models if name in places else ():
            self.set_field(method, *places[name], values)
        return name in places

    def set_field(self, method: str, name: str, index: Array, values: Array) -> None:
        """Set a field of the engine's model for a method, by MuJoCo's name of it."""
        raise NotImplementedError

    def prepare(self, course: Course) -> None:
        """Compile, by a run without steps."""
        q, rest = self.bare.model.qpos0[self.bare.qpos], np.zeros_like(course.tau)
        self.run(course._replace(q=q, v=rest, times=np.arange(GRID + 1.0), steps=0))
