"""Engines that take the model that MuJoCo compiles."""

from __future__ import annotations

from abc import abstractmethod
from functools import cache
from operator import attrgetter
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from ...robots.actuators import Controller
from .. import GRID, Array, Course
from .bodies import Numbers
from .file import EngineError, File, Unread
from .model import FROM_COMPILED, ReadModel
from .order import Order

if TYPE_CHECKING:
    from ..mujoco.handed_on import Bare

METHODS = {"Euler": (1, "semi_implicit_euler"), "implicitfast": (1, "semi_implicit_euler"), "RK4": (4, "rk4")}
STAGES = {"Euler": 1, "implicitfast": 1, "implicit": 1, "discrete": 1, "RK4": 4}


class OfCompiled(ReadModel):
    """Coordinates are MuJoCo's, of the joints of the Tree in the order of the file."""

    way = FROM_COMPILED
    methods: ClassVar[tuple[str, ...]] = tuple(METHODS)
    rotors_in_joints: ClassVar[bool] = False  # the armature of actuators is that of their joints

    def __init__(self, file: File, precision: str):
        self.file, self.precision = file, precision
        self.missing: dict[str, str] = {}  # why a method has no model of the file
        self.controllers: dict[tuple[float | None, ...], Controller] = {}
        # by MuJoCo's names: indices, and the values that are set there
        self.fields_set: dict[str, tuple[Array, Array]] = {}
        self.driven = cache(self.made_driven)
        self.bare = self.made_bare(None)
        self.models = self.made_models(self.bare)
        places = enumerate(self.bare.places.values())
        self.order = Order(file, {k: (place.qpos.start, place.dofs.start) for k, place in places})
        joints = self.bare.model.dof_jntid[self.bare.dofs]
        # of `fields`: MuJoCo's names, and the indices of the Tree's speeds
        self.where = {"armature": ("dof_armature", self.bare.dofs), "damping": ("dof_damping", self.bare.dofs),
                      "stiffness": ("jnt_stiffness", joints), "gravity": ("opt.gravity", np.arange(3))}  # fmt: skip

    def made_bare(self, controller: Controller | None) -> Bare:
        """The model that the engine takes, whose actuators act if there is a controller."""
        from ..mujoco.handed_on import Bare
        from ..mujoco.source import Source

        source = Source(self.file.path, self.file.floating)
        bare = Bare(source, self.file.names, self.rotors_in_joints, controller)
        bare.model.opt.noslip_iterations = 0  # of contacts, which are off: MuJoCo Warp's discrete has none
        for name, (index, values) in self.fields_set.items():
            attrgetter(name)(bare.model)[index] = values
        return bare

    def made_models(self, bare: Bare) -> dict[str, Any]:
        """The engine's models of it by the names of methods that have all that it needs; Unread if none has."""
        models: dict[str, Any] = {}
        for name in self.methods:
            try:
                models[name] = self.put_model(bare.with_integrator(name))
            except NotImplementedError as error:
                self.missing[name] = f"it does not have what it needs: {error}"
        if not models:
            raise Unread(next(iter(self.missing.values())))
        return models

    @abstractmethod
    def put_model(self, model: Any) -> Any:
        """The engine's model of one of MuJoCo's."""

    @abstractmethod
    def held(self, name: str) -> Array:
        """A field of the engine's models by MuJoCo's name of it."""

    def made_driven(self, key: tuple[float | None, ...]) -> tuple[Bare, dict[str, Any]]:
        """Models in which the actuators act with these controls."""
        bare = self.made_bare(self.controllers[key])
        return bare, self.made_models(bare)

    def of_course(self, course: Course) -> tuple[Bare, Any, Array]:
        """The models that a course needs: MuJoCo's, the engine's; and the torque that is applied beside its actuators, (nv,)."""
        if course.method in self.missing:
            raise EngineError(self.missing[course.method])
        if course.servos is None:
            return self.bare, self.models[course.method], course.tau
        controller = course.servos.controller
        self.controllers[controller.controls] = controller
        bare, models = self.driven(controller.controls)
        return bare, models[course.method], course.tau - controller.torque

    def placed(self, q: Array, *of_speeds: Array) -> list[Array]:
        """q, and speeds or forces, (..., n), in MuJoCo's order of joints."""
        placed = [np.zeros(np.shape(values), self.precision) for values in (q, *of_speeds)]
        placed[0][..., self.bare.qpos] = q
        for vector, values in zip(placed[1:], of_speeds):
            vector[..., self.bare.dofs] = values
        return placed

    def fields(self) -> Numbers:
        return {name: self.held(field)[index] for name, (field, index) in self.where.items()}

    def set_field(self, name: str, values: Array) -> bool:
        field, index = self.where[name]
        self.fields_set[field] = index, values
        self.bare = self.made_bare(None)
        self.models = self.made_models(self.bare)
        return True

    @abstractmethod
    def path(self, bare: Bare, model: Any, start: list[Array], course: Course) -> tuple[Array, Array]:
        """qpos and qvel at the times of a course after the first, (times, n). start: qpos, qvel, applied force."""

    def run(self, course: Course) -> tuple[Array, int]:
        bare, model, tau = self.of_course(course)
        qpos, qvel = self.path(bare, model, self.placed(course.q, course.v, tau), course)
        states = np.hstack([qpos[:, bare.qpos], qvel[:, bare.dofs]])
        return np.vstack([course.start, states]), course.steps * STAGES[course.method]

    def prepare(self, course: Course) -> None:
        """Compile, by a run without steps."""
        q, rest = self.bare.model.qpos0[self.bare.qpos], np.zeros_like(course.tau)
        self.run(course._replace(q=q, v=rest, times=np.arange(GRID + 1.0), steps=0))
