"""MuJoCo Warp: the model that MuJoCo compiles, computed by Warp's kernels, in float32, here on a CPU."""

import os
from collections.abc import Callable
from dataclasses import replace
from functools import cached_property
from operator import attrgetter
from typing import Any

import numpy as np

from tmt import Tree
from tmt.methods import lone_speeds

from . import Array, Course, EngineRecord
from .outside.model import File, Unread
from .outside.of_compiled import METHODS as METHODS
from .outside.of_compiled import STAGES, OfCompiled

ENGINE = EngineRecord(order=65, label="MuJoCo Warp", colour="#117733", marker="p", package="mujoco_warp",
                      reads_file=True, compiles=True, precision="float32")  # fmt: skip


def methods_for(tree: Tree) -> dict[str, tuple[int, str]]:
    """METHODS for a Tree: implicitfast is implicit in the bias of a free body on its own, as MuJoCo's is since 4.0."""
    return METHODS | ({"implicitfast": (1, "implicitfast")} if lone_speeds(tree) else {})


class Model(OfCompiled):
    def __init__(self, file: File, precision: str):
        import warp

        warp.config.log_level = warp.LOG_ERROR
        silently(warp.init)
        warp.set_device("cpu")
        import mujoco_warp

        from .mujoco.handed_on import Bare

        self.warp, self.engine = warp, mujoco_warp
        self.bare = Bare(file.path, file.names, rotors_in_joints=True)
        self.bare.model.opt.iterations = 0  # of its solver of constraints
        try:
            self.models = {name: mujoco_warp.put_model(self.bare.with_integrator(name)) for name in METHODS}
        except NotImplementedError as error:
            raise Unread(f"MuJoCo Warp does not have what it needs: {error}") from None
        self.worlds: dict[int, Any] = {}  # data by the number of states
        self.graphs: dict[tuple[str, int], Any] = {}

    def held(self, name: str) -> Array:
        field = getattr(self.models["Euler"], name)
        values: Array = field.numpy()
        return values[0] if field.ndim > 1 else values  # all worlds share the first

    def gravity(self) -> Array:
        return np.array(self.models["Euler"].opt.gravity.numpy()[0])

    def set_field(self, method: str, name: str, index: Array, values: Array) -> None:
        field = attrgetter(name)(self.models[method])
        numbers = field.numpy()
        numbers[0, index] = values
        field.assign(numbers)

    @cached_property
    def model(self) -> Any:
        """The model without damping and stiffness, which are part of the force."""
        model = self.models["RK4"]
        none = [self.warp.zeros_like(field) for field in (model.dof_damping, model.jnt_stiffness)]
        return replace(model, dof_damping=none[0], jnt_stiffness=none[1])

    def at(self, q: Array, v: Array, force: Array) -> Any:
        """Data of as many worlds as there are states, at these states (worlds, n)."""
        if len(q) not in self.worlds:
            # njmax=0 is possible, but then Euler and implicitfast do not accelerate
            self.worlds[len(q)] = self.engine.make_data(self.bare.model, len(q), nconmax=0, njmax=1)
        data = self.worlds[len(q)]
        for field, values in ((data.qpos, q), (data.qvel, v), (data.qfrc_applied, force)):
            placed = np.zeros(field.shape, np.float32)
            placed[:, self.bare.qpos if field is data.qpos else self.bare.dofs] = values
            field.assign(placed)
        return data

    def replay(self, name: str, call: Callable[[Any], object], data: Any) -> Callable[[], None]:
        """A function that repeats a call for these data; the kernels that it launches are recorded once."""
        if (name, data.nworld) not in self.graphs:
            call(data)  # compiles
            with self.warp.ScopedCapture() as capture:
                call(data)
            self.graphs[name, data.nworld] = capture.graph
        return lambda: self.warp.capture_launch(self.graphs[name, data.nworld])

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

    def run(self, course: Course) -> tuple[Array, int]:
        model, path = self.models[course.method], [course.start]
        start = course.q[None], course.v[None], course.tau[None]
        data = self.at(*start)
        model.opt.timestep.fill_(course.dt)
        advance = self.replay(course.method, lambda data: self.engine.step(model, data), data)
        self.at(*start)  # the recording has moved them
        for _ in course.times[1:]:
            for _ in range(course.every):
                advance()
            qpos, qvel = data.qpos.numpy()[0], data.qvel.numpy()[0]
            path.append(np.hstack([qpos[self.bare.qpos], qvel[self.bare.dofs]]))
        return np.array(path), course.steps * STAGES[course.method]


def silently(call: Callable[[], object]) -> None:
    """Call without what compiled code writes to standard error: here that there is no CUDA."""
    kept, null = os.dup(2), os.open(os.devnull, os.O_WRONLY)
    os.dup2(null, 2)
    try:
        call()
    finally:
        os.dup2(kept, 2)
