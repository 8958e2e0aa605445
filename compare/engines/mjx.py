"""MJX: the model that MuJoCo compiles, computed by JAX."""

from collections.abc import Callable
from functools import cache, partial
from operator import attrgetter
from typing import Any

import numpy as np

from tmt import Tree

from . import Array, Course
from .outside import as_it_runs
from .outside.file import File
from .outside.of_compiled import METHODS as METHODS
from .outside.of_compiled import OfCompiled
from .outside.order import State

# its fusions repeat what they share: an acceleration of an arm of seven hinges took 412 ms, 3 ms without them
COMPILER = {"xla_cpu_use_fusion_emitters": False}


def methods_for(tree: Tree) -> dict[str, tuple[int, str]]:
    """METHODS for a Tree: RK4 turns a ball by the mean of its speeds, as MuJoCo's did up to 3.17."""
    return METHODS | ({"RK4": (2, "rk4_mean_speed")} if tree.coordinates.balls else {})


class Model(OfCompiled):
    def __init__(self, file: File, precision: str):
        import jax
        from mujoco import mjx

        jax.config.update("jax_default_device", jax.devices("cpu")[0])
        super().__init__(file, precision)
        self.data = mjx.make_data(self.bare, impl="jax")

    def put_model(self, model: Any) -> Any:
        from mujoco import mjx

        return mjx.put_model(model, impl="jax")

    def held(self, model: Any, name: str) -> Array:
        return np.array(attrgetter(name)(model))

    def dynamics(self, at: State, force: Array) -> tuple[Array, Array, Array]:
        """Without damping and stiffness, which are part of the force."""
        none = {name: 0.0 * getattr(self.first, name) for name in ("jnt_stiffness", "dof_damping")}
        state = (values.astype(self.precision) for values in (at.x, at.u, force))
        M, h, a = map(np.asarray, functions()["values"](self.first.replace(**none), self.data, *state))
        return M, h, a

    def prepare(self, course: Course) -> None:
        """Compile, by a run without steps."""
        self.run(course._replace(steps=0))

    def run(self, course: Course) -> tuple[Array, None]:
        dt, records = np.asarray(course.dt, self.precision), len(course.times) - 1
        model = self.model_of(course).tree_replace({"opt.timestep": dt})
        path = functions()["path"](model, self.data, *self.start(course), course.every, records=records)
        qpos, qvel = map(np.asarray, path)
        return np.vstack([course.start, np.hstack([qpos[:, self.qpos], qvel[:, self.dofs]])]), None


@cache
def functions() -> dict[str, Callable[..., Any]]:
    """The compiled functions; models that differ only in their numbers have one compilation."""
    import jax
    from mujoco import mjx

    def values(model: Any, data: Any, qpos: Any, qvel: Any, force: Any) -> Any:
        data = mjx.forward(model, data.replace(qpos=qpos, qvel=qvel, qfrc_applied=force))
        return mjx.full_m(model, data), data.qfrc_bias, data.qacc

    def path(model: Any, data: Any, qpos: Any, qvel: Any, force: Any, every: Any, records: int) -> Any:
        def step(_: Any, state: Any) -> Any:
            now = mjx.step(model, data.replace(qpos=state[0], qvel=state[1], qfrc_applied=force))
            return now.qpos, now.qvel

        def record(state: Any, _: Any) -> Any:
            return (jax.lax.fori_loop(0, every, step, state),) * 2

        return jax.lax.scan(record, (qpos, qvel), None, records)[1]

    compiled = partial(jax.jit, compiler_options=COMPILER)
    return {"values": compiled(values), "path": compiled(path, static_argnames="records")}


class Stepper(as_it_runs.Stepper):
    def __init__(self, file: File, model: Any):
        import jax
        from mujoco import mjx

        jax.config.update("jax_default_device", jax.devices("cpu")[0])
        self.model, self.mjx, self.put_model = model, mjx, mjx.put_model(model, impl="jax")
        self.advance = jax.jit(mjx.step, compiler_options=COMPILER)

    def put(self, data: Any) -> Any:
        return self.mjx.put_data(self.model, data, impl="jax")

    def step(self, data: Any) -> Any:
        return self.advance(self.put_model, data)

    def get(self, data: Any) -> Any:
        return self.mjx.get_data(self.model, data)
