"""Engines that take the model that MuJoCo compiles."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from .. import GRID, Array, Course
from .model import Numbers, ReadModel

if TYPE_CHECKING:
    from ..mujoco.bare import Bare

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

    def prepare(self, course: Course) -> None:
        """Compile, by a run without steps."""
        q, rest = self.bare.model.qpos0[self.bare.qpos], np.zeros_like(course.tau)
        self.run(course._replace(q=q, v=rest, times=np.arange(GRID + 1.0), steps=0))
