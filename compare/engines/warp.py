"""MuJoCo Warp: the model that MuJoCo compiles, computed by Warp's kernels, in float32, here on a CPU."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cached_property, partial
from operator import attrgetter
from typing import TYPE_CHECKING, Any

import numpy as np

from tmt import Tree
from tmt.methods import lone_speeds

from . import Array, Course, EngineRecord
from .outside.file import File
from .outside.of_compiled import METHODS as OF_MJX
from .outside.of_compiled import OfCompiled
from .outside.order import State

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

    def put_model(self, model: Any) -> Any:
        return self.engine.put_model(model)

    def held(self, name: str) -> Array:
        values: Array = attrgetter(name)(next(iter(self.models.values()))).numpy()
        return values[0]  # all worlds share it

    @cached_property
    def model(self) -> Any:
        """The model without damping and stiffness, which are part of the force."""
        model = next(iter(self.models.values()))
        none = [self.warp.zeros_like(field) for field in (model.dof_damping, model.jnt_stiffness)]
        return replace(model, dof_damping=none[0], jnt_stiffness=none[1])

    def data_at(self, start: Sequence[Array], bare: Bare | None = None) -> Any:
        """Data of as many worlds as there are states qpos, qvel and force (worlds, n). bare: with actuators that act."""
        source = bare or self.bare
        key = id(source), len(start[0]), str(self.warp.get_device())
        if key not in self.worlds:
            # njmax=0 is possible, but then Euler and implicitfast do not accelerate
            self.worlds[key] = self.engine.make_data(source.model, len(start[0]), nconmax=0, njmax=1)
        data, controls = self.worlds[key], source.engaged
        fields = data.qpos, data.qvel, data.qfrc_applied, data.ctrl, data.act
        for field, values in zip(fields, (*start, controls.ctrl, controls.act)):
            field.assign(np.broadcast_to(np.asarray(values, np.float32), field.shape))
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

    def forward(self, at: State, force: Array | None = None) -> Any:
        """Data after forward dynamics at a state."""
        force = np.zeros_like(at.u) if force is None else force
        data = self.data_at([at.x[None], at.u[None], force[None]])
        self.replay("forward", lambda data: self.engine.forward(self.model, data), data)()
        return data

    def mass_matrix(self, at: State) -> Array:
        M, model = np.zeros((at.u.size, at.u.size)), self.model
        row, column = np.repeat(np.arange(at.u.size), model.M_rownnz.numpy()), model.M_colind.numpy()
        M[row, column] = M[column, row] = self.forward(at).M.numpy()[0]  # the lower triangle, row by row
        return M

    def bias(self, at: State) -> Array:
        return np.array(self.forward(at).qfrc_bias.numpy()[0])

    def acceleration(self, at: State, force: Array) -> Array:
        return np.array(self.forward(at, force).qacc.numpy()[0])

    def step_alone(self, course: Course) -> Callable[[], None]:
        bare, model, tau = self.of_course(course)
        return self.begun(bare, model, self.placed(course.q, course.v, tau), course)[0]

    def begun(
        self, bare: Bare, model: Any, start: list[Array], course: Course
    ) -> tuple[Callable[[], None], Any]:
        """A step from a start and on, by the kernels that were recorded, and the data. start: of a world or of several."""
        worlds = [np.atleast_2d(values) for values in start]
        data = self.data_at(worlds, bare)
        model.opt.timestep.fill_(course.dt)
        advance = self.replay(course.method, partial(self.engine.step, model), data)
        self.data_at(worlds, bare)  # the recording has moved them
        return advance, data

    def batch(self, course: Course) -> tuple[Callable[[], Array], str]:
        """On Warp's preferred device, which may be a GPU; each step is a graph of kernels that was recorded once."""
        device, start = self.warp.get_preferred_device(), self.placed(course.q, course.v, course.tau)
        with self.warp.ScopedDevice(device):
            model = self.models[course.method]
            if not device.is_cpu:
                model = self.made_models(self.bare)[course.method]
            advance, data = self.begun(self.bare, model, start, course)

        def run() -> Array:
            with self.warp.ScopedDevice(device):
                self.data_at(start)
                for _ in range(course.steps):
                    advance()
                self.warp.synchronize_device(device)
            return np.asarray(data.qpos.numpy()[0, self.bare.qpos])

        return run, str(device.name)

    def path(self, bare: Bare, model: Any, start: list[Array], course: Course) -> tuple[Array, Array]:
        (advance, data), states = self.begun(bare, model, start, course), []
        for _ in course.times[1:]:
            for _ in range(course.every):
                advance()
            # on a CPU the arrays are views
            states.append((data.qpos.numpy()[0].copy(), data.qvel.numpy()[0].copy()))
        qpos, qvel = map(np.array, zip(*states))
        return qpos, qvel
