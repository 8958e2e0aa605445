"""Engines that take the model that MuJoCo compiles."""

from abc import abstractmethod
from operator import attrgetter
from typing import Any, ClassVar

import numpy as np

import tmt

from .. import Array, Course
from .bodies import Numbers
from .file import EngineError, File, Unread
from .model import ReadModel
from .order import Order

METHODS = {"Euler": (1, "semi_implicit_euler"), "implicitfast": (1, "semi_implicit_euler"), "RK4": (4, "rk4")}
BODIES = ("body_mass", "body_inertia", "body_pos", "body_quat", "body_ipos", "body_iquat", "jnt_axis",
          "jnt_pos")  # fmt: skip


class OfCompiled(ReadModel):
    """Coordinates are MuJoCo's, of the joints of the Tree in the order of the file."""

    methods: ClassVar[tuple[str, ...]] = tuple(METHODS)
    rotors_in_joints: ClassVar[bool] = False  # the armature of actuators is that of their joints

    def __init__(self, file: File, precision: str):
        from ..mujoco.engine import bare_model
        from ..mujoco.names import joint_places
        from ..mujoco.source import Source

        self.file, self.precision = file, precision
        self.bare = bare_model(Source(file.path, file.floating), self.rotors_in_joints)
        by_name = joint_places(self.bare)
        places = [by_name[name] for name in file.names]
        # the indices of the Tree's coordinates and speeds in MuJoCo's
        self.qpos = np.array([i for place in places for i in place.qpos])
        self.dofs = np.array([i for place in places for i in place.dofs])
        self.order = Order(file, {k: (place.qpos.start, place.dofs.start) for k, place in enumerate(places)})
        joints = self.bare.dof_jntid[self.dofs]
        # of `used`: MuJoCo's names, and the indices of the Tree's speeds
        self.places = {"armature": ("dof_armature", self.dofs), "damping": ("dof_damping", self.dofs),
                       "stiffness": ("jnt_stiffness", joints), "gravity": ("opt.gravity", np.arange(3))}  # fmt: skip
        self.put_models()

    def put_models(self) -> None:
        """Make the engine's models of it by the names of methods that have all that it needs; Unread if none has."""
        from ..mujoco.names import INTEGRATORS

        models: dict[str, Any] = {}
        self.missing: dict[str, str] = {}  # why a method has no model of the file
        for name in self.methods:
            self.bare.opt.integrator = INTEGRATORS[name]
            try:
                models[name] = self.put_model(self.bare)
            except NotImplementedError as error:
                self.missing[name] = f"it does not have what it needs: {error}"
        if not models:
            raise Unread(next(iter(self.missing.values())))
        self.models, self.first = models, next(iter(models.values()))

    @abstractmethod
    def put_model(self, model: Any) -> Any:
        """The engine's model of one of MuJoCo's."""

    @abstractmethod
    def held(self, model: Any, name: str) -> Array:
        """A field of a model of the engine's by MuJoCo's name of it."""

    def numbers_stated(self, tree: tmt.Tree) -> Numbers:
        return {**super().numbers_stated(tree), **{name: getattr(self.bare, name).copy() for name in BODIES}}

    def numbers(self) -> Numbers:
        fields = {name: self.held(self.first, field)[index] for name, (field, index) in self.places.items()}
        return fields | {name: self.held(self.first, name) for name in BODIES}

    def set(self, name: str, values: Array) -> None:
        if name in self.places:
            field, index = self.places[name]
            attrgetter(field)(self.bare)[index] = values
            self.put_models()

    def model_of(self, course: Course) -> Any:
        if course.method in self.missing:
            raise EngineError(self.missing[course.method])
        return self.models[course.method]

    def start(self, course: Course) -> list[Array]:
        """qpos, qvel and the applied force, in MuJoCo's order of joints."""
        start = [np.zeros(len(values), self.precision) for values in (course.q, course.v, course.tau)]
        for vector, places, values in zip(start, (self.qpos, self.dofs, self.dofs), course[:3]):
            vector[places] = values
        return start
