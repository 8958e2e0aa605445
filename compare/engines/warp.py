"""MuJoCo Warp: the model that MuJoCo compiles, computed by Warp's kernels, in float32, here on a CPU."""

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from operator import attrgetter
from typing import Any

import numpy as np

from tmt import Tree
from tmt.methods import isolated_speeds

from . import Array, Course
from .outside import as_it_runs
from .outside.file import File
from .outside.of_compiled import METHODS as OF_MJX
from .outside.of_compiled import OfCompiled
from .outside.order import State

MOST_CONTACTS, MOST_ROWS = 200, 1000  # of a world in a run of the file as it is
METHODS = OF_MJX | {"implicit": (1, "implicit"), "discrete": (1, "semi_implicit_euler")}


def methods_for(tree: Tree) -> dict[str, tuple[int, str]]:
    """METHODS for a Tree: as MuJoCo since 4.0, implicitfast and discrete are implicit in the bias of a free body on its own, and
    discrete in springs."""
    lone = dict.fromkeys(("implicitfast", "discrete"), (1, "implicitfast")) if isolated_speeds(tree) else {}
    return METHODS | lone | ({"discrete": (1, "discrete")} if tree.has_springs else {})


def loaded() -> tuple[Any, Any]:
    """warp, on the CPU, and mujoco_warp."""
    import warp

    warp.config.log_level = warp.LOG_ERROR
    warp.set_device("cpu")
    import mujoco_warp

    return warp, mujoco_warp


class Model(OfCompiled):
    methods, rotors_in_joints = tuple(METHODS), True

    def __init__(self, file: File, precision: str):
        self.warp, self.engine = loaded()
        super().__init__(file, precision)
        # njmax=0 is possible, but then Euler and implicitfast do not accelerate
        self.data = self.engine.make_data(self.bare, nconmax=0, njmax=1)

    def put_models(self) -> None:
        super().put_models()
        self.graphs: dict[str, Any] = {}  # of recorded kernels, by what they compute
        # without damping and stiffness, which are part of the force
        none = [self.warp.zeros_like(getattr(self.first, name)) for name in ("dof_damping", "jnt_stiffness")]
        self.undamped = replace(self.first, dof_damping=none[0], jnt_stiffness=none[1])

    def put_model(self, model: Any) -> Any:
        return self.engine.put_model(model)

    def held(self, model: Any, name: str) -> Array:
        return np.asarray(attrgetter(name)(model).numpy()[0])  # all worlds share it

    def replay(self, name: str, call: Callable[[Any], object]) -> Callable[[], None]:
        """A function that repeats a call for the data; the kernels that it launches are recorded once."""
        if name not in self.graphs:
            call(self.data)  # compiles
            with self.warp.ScopedCapture() as capture:
                call(self.data)
            self.graphs[name] = capture.graph
        return lambda: self.warp.capture_launch(self.graphs[name])

    def dynamics(self, at: State, force: Array) -> tuple[Array, Array, Array]:
        forward = self.replay("forward", lambda data: self.engine.forward(self.undamped, data))
        self.place(at.x, at.u, force)
        forward()
        nv, data = at.u.size, self.data
        M, row, column = np.zeros((nv, nv)), np.arange(nv), self.undamped.M_colind.numpy()
        row = np.repeat(row, self.undamped.M_rownnz.numpy())
        M[row, column] = M[column, row] = data.M.numpy()[0]  # the lower triangle, row by row
        return M, data.qfrc_bias.numpy()[0].copy(), data.qacc.numpy()[0].copy()

    def place(self, *start: Array) -> None:
        """Give the data a state: qpos, qvel and applied force."""
        for field, values in zip((self.data.qpos, self.data.qvel, self.data.qfrc_applied), start):
            field.assign(np.asarray(values, np.float32)[None])

    def step_alone(self, course: Course) -> Callable[[], None]:
        """A step from the start and on, by the kernels that were recorded."""
        model = self.model_of(course)
        model.opt.timestep.fill_(course.dt)
        advance = self.replay(course.method, partial(self.engine.step, model))
        self.place(*self.start(course))  # the recording has moved them
        return advance

    def reached(self) -> tuple[Array, Array]:
        return self.data.qpos.numpy()[0][self.qpos], self.data.qvel.numpy()[0][self.dofs]


class Stepper(as_it_runs.Stepper):
    def __init__(self, file: File, model: Any):
        (_, self.engine), self.model = loaded(), model
        self.put_model = self.engine.put_model(model)

    def put(self, data: Any) -> Any:
        return self.engine.put_data(self.model, data, nconmax=MOST_CONTACTS, njmax=MOST_ROWS)

    def step(self, data: Any) -> Any:
        self.engine.step(self.put_model, data)
        return data

    def get(self, data: Any) -> Any:
        from mujoco import MjData

        values = MjData(self.model)
        self.engine.get_data_into(values, self.model, data)
        return values
