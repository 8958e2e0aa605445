"""Engines that take the model that MuJoCo compiles."""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from ...robots.actuators import Controller
from .. import GRID, Array, Course
from .model import FROM_COMPILED, File, Numbers, ReadModel, Unread

if TYPE_CHECKING:
    from ..mujoco.handed_on import Bare

METHODS = {"Euler": (1, "semi_implicit_euler"), "implicitfast": (1, "semi_implicit_euler"), "RK4": (4, "rk4")}
STAGES = {"Euler": 1, "implicitfast": 1, "implicit": 1, "discrete": 1, "RK4": 4}


class OfCompiled(ReadModel):
    way = FROM_COMPILED
    methods: ClassVar[tuple[str, ...]] = tuple(METHODS)
    rotors_in_joints: ClassVar[bool] = False  # the armature of actuators is that of their joints

    def __init__(self, file: File, precision: str):
        self.file, self.precision = file, precision
        self.controllers: dict[tuple[float | None, ...], Controller] = {}
        # by MuJoCo's names: indices, and the values that are set there
        self.fields_set: dict[str, tuple[Array, Array]] = {}
        self.driven = cache(self.made_driven)
        self.bare = self.made_bare(None)
        self.models = self.made_models(self.bare)

    def made_bare(self, controller: Controller | None) -> Bare:
        """The model that the engine takes, whose actuators act if there is a controller."""
        from ..mujoco.handed_on import Bare

        return Bare(self.file.path, self.file.names, self.rotors_in_joints, controller)

    def made_models(self, bare: Bare) -> dict[str, Any]:
        """The engine's models of it by the names of methods; Unread if it does not have what that needs."""
        try:
            return {name: self.put_model(bare.with_integrator(name)) for name in self.methods}
        except NotImplementedError as error:
            raise Unread(f"it does not have what it needs: {error}") from None

    def put_model(self, model: Any) -> Any:
        """The engine's model of one of MuJoCo's."""
        raise NotImplementedError

    def made_driven(self, key: tuple[float | None, ...]) -> tuple[Bare, dict[str, Any]]:
        """Models in which the actuators act with these controls, with all that is set in the others."""
        bare = self.made_bare(self.controllers[key])
        return bare, self.with_all_fields(self.made_models(bare))

    def with_all_fields(self, models: dict[str, Any]) -> dict[str, Any]:
        """Models with all that is set in `models`."""
        for name, place in self.fields_set.items():
            models = {method: self.with_field(model, name, *place) for method, model in models.items()}
        return models

    def of_course(self, course: Course) -> tuple[Bare, Any, Array]:
        """The models that a course needs: MuJoCo's, the engine's; and the torque that is applied beside its actuators, (nv,)."""
        if course.servos is None:
            return self.bare, self.models[course.method], course.tau
        controller = course.servos.controller
        self.controllers[controller.controls] = controller
        bare, models = self.driven(controller.controls)
        return bare, models[course.method], course.tau - controller.torque

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
        if name in places:
            field, index = places[name]
            self.fields_set[field] = index, values
            self.models = {
                kind: self.with_field(model, field, index, values) for kind, model in self.models.items()
            }
        return name in places

    def with_field(self, model: Any, name: str, index: Array, values: Array) -> Any:
        """One of the engine's models in which a field, by MuJoCo's name of it, has these values at indices."""
        raise NotImplementedError

    def prepare(self, course: Course) -> None:
        """Compile, by a run without steps."""
        q, rest = self.bare.model.qpos0[self.bare.qpos], np.zeros_like(course.tau)
        self.run(course._replace(q=q, v=rest, times=np.arange(GRID + 1.0), steps=0))
