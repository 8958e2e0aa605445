"""MuJoCo Warp: the model that MuJoCo compiles, computed by Warp's kernels, in float32, here on a CPU."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cached_property, partial
from operator import attrgetter
from typing import TYPE_CHECKING, Any

import numpy as np

from tmt import Tree
from tmt.methods import lone_speeds

from ..robots.actuators import Controller
from . import Array, Course, EngineRecord
from .outside.model import File
from .outside.of_compiled import METHODS as OF_MJX
from .outside.of_compiled import STAGES, OfCompiled

if TYPE_CHECKING:
    from .mujoco.handed_on import Bare

ENGINE = EngineRecord(order=65, label="MuJoCo Warp", colour="#117733", marker="p", package="mujoco_warp",
                      reads_file=True, compiles=True, precision="float32")  # fmt: skip
METHODS = OF_MJX | {"implicit": (1, "implicit"), "discrete": (1, "semi_implicit_euler")}


def methods_for(tree: Tree) -> dict[str, tuple[int, str]]:
    """METHODS for a Tree: as MuJoCo since 4.0, implicitfast and discrete are implicit in the bias of a free body on its own, and
    discrete in springs."""
    lone = {"implicitfast": (1, "implicitfast"), "discrete": (1, "implicitfast")} if lone_speeds(tree) else {}
    return METHODS | lone | ({"discrete": (1, "discrete")} if tree.has_springs else {})


class Model(OfCompiled):
    methods, rotors_in_joints = tuple(METHODS), True

    def __init__(self, file: File, precision: str):
        import warp

        warp.config.log_level = warp.LOG_ERROR
        warp.set_device("cpu")
        import mujoco_warp

        self.warp, self.engine = warp, mujoco_warp
        super().__init__(file, precision)
        # data, by MuJoCo's model, the number of states, the device
        self.worlds: dict[tuple[int, int, str], Any] = {}
        self.graphs: dict[tuple[Any, ...], Any] = {}

    def made_bare(self, controller: Controller | None) -> Bare:
        bare = super().made_bare(controller)
        if controller is None:
            bare.model.opt.iterations = 0  # of its solver of constraints
        return bare

    def put_model(self, model: Any) -> Any:
        return self.engine.put_model(model)

    def held(self, name: str) -> Array:
        field = getattr(self.models["Euler"], name)
        values: Array = field.numpy()
        return values[0] if field.ndim > 1 else values  # all worlds share the first

    def gravity(self) -> Array:
        return np.array(self.models["Euler"].opt.gravity.numpy()[0])

    def with_field(self, model: Any, name: str, index: Array, values: Array) -> Any:
        field = attrgetter(name)(model)
        numbers = field.numpy()
        numbers[0, index] = values
        field.assign(numbers)
        return model

    @cached_property
    def model(self) -> Any:
        """The model without damping and stiffness, which are part of the force."""
        model = self.models["RK4"]
        none = [self.warp.zeros_like(field) for field in (model.dof_damping, model.jnt_stiffness)]
        return replace(model, dof_damping=none[0], jnt_stiffness=none[1])

    def at(self, q: Array, v: Array, force: Array, bare: Bare | None = None) -> Any:
        """Data of as many worlds as there are states, at these states (worlds, n). bare: with actuators that act."""
        source = bare or self.bare
        key = id(source), len(q), str(self.warp.get_device())
        if key not in self.worlds:
            # njmax=0 is possible, but then Euler and implicitfast do not accelerate
            self.worlds[key] = self.engine.make_data(source.model, len(q), nconmax=0, njmax=1)
        data = self.worlds[key]
        for field, values in ((data.ctrl, source.engaged.ctrl), (data.act, source.engaged.act)):
            field.assign(np.broadcast_to(np.asarray(values, np.float32), field.shape))
        for field, values in ((data.qpos, q), (data.qvel, v), (data.qfrc_applied, force)):
            placed = np.zeros(field.shape, np.float32)
            placed[:, self.bare.qpos if field is data.qpos else self.bare.dofs] = values
            field.assign(placed)
        return data

    def replay(self, name: str, call: Callable[[Any], object], data: Any) -> Callable[[], None]:
        """A function that repeats a call for these data; the kernels that it launches are recorded once."""
        key = name, id(data)
        if key not in self.graphs:
            call(data)  # compiles
            with self.warp.ScopedCapture() as capture:
                call(data)
            self.graphs[key] = capture.graph
        return lambda: self.warp.capture_launch(self.graphs[key])

    def forward(self, q: Array, v: Array, force: Array) -> Any:
        """Data after forward dynamics at states (worlds, n)."""
        data = self.at(q, v, force)
        self.replay("forward", lambda data: self.engine.forward(self.model, data), data)()
        return data

    def mass_matrix(self, q: Array) -> Array:
        zero, model, at = np.zeros((1, len(self.bare.dofs))), self.model, self.bare.dofs
        row, column = np.repeat(np.arange(zero.size), model.M_rownnz.numpy()), model.M_colind.numpy()
        M = np.zeros((zero.size, zero.size))  # its lower triangle is given, row by row
        M[row, column] = M[column, row] = self.forward(q[None], zero, zero).M.numpy()[0]
        return M[np.ix_(at, at)]

    def bias(self, q: Array, v: Array) -> Array:
        return self.forward(q[None], v[None], np.zeros_like(v[None])).qfrc_bias.numpy()[0, self.bare.dofs]

    def acceleration(self, q: Array, v: Array, force: Array) -> Array:
        return self.forward(q[None], v[None], force[None]).qacc.numpy()[0, self.bare.dofs]

    def step_alone(self, course: Course) -> Callable[[], None]:
        return self.begun(course)[0]

    def begun(self, course: Course) -> tuple[Callable[[], None], Any]:
        """A step from the start of a run and on, by the kernels that were recorded, and the data."""
        bare, model, tau = self.of_course(course)
        start = course.q[None], course.v[None], tau[None], bare if course.servos else None
        data = self.at(*start)
        model.opt.timestep.fill_(course.dt)
        call: Callable[[Any], object] = partial(self.engine.step, model)
        advance = self.replay(course.method, call, data)
        self.at(*start)  # the recording has moved them
        return advance, data

    def batch(self, course: Course) -> tuple[Callable[[], Array], str]:
        """On Warp's preferred device, which may be a GPU; each step is a graph of kernels that was recorded once."""
        device = self.warp.get_preferred_device()
        with self.warp.ScopedDevice(device):
            model = self.models[course.method]
            if not device.is_cpu:
                model = self.with_all_fields(self.made_models(self.bare))[course.method]
            data = self.at(course.q, course.v, course.tau)
            model.opt.timestep.fill_(course.dt)
            advance = self.replay(course.method, partial(self.engine.step, model), data)

        def run() -> Array:
            with self.warp.ScopedDevice(device):
                self.at(course.q, course.v, course.tau)
                for _ in range(course.steps):
                    advance()
                self.warp.synchronize_device(device)
            return np.asarray(data.qpos.numpy()[0, self.bare.qpos])

        return run, str(device.name)

    def run(self, course: Course) -> tuple[Array, int]:
        path, (advance, data) = [course.start], self.begun(course)
        for _ in course.times[1:]:
            for _ in range(course.every):
                advance()
            qpos, qvel = data.qpos.numpy()[0], data.qvel.numpy()[0]
            path.append(np.hstack([qpos[self.bare.qpos], qvel[self.bare.dofs]]))
        return np.array(path), course.steps * STAGES[course.method]
