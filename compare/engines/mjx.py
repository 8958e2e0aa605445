"""MJX: the model that MuJoCo compiles, computed by JAX."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache, cached_property, partial
from operator import attrgetter
from typing import TYPE_CHECKING, Any

import numpy as np

from tmt import Tree

from . import Array, Course, EngineRecord
from .outside.model import File
from .outside.of_compiled import METHODS as METHODS
from .outside.of_compiled import STAGES, OfCompiled

if TYPE_CHECKING:
    from .mujoco.handed_on import Bare

ENGINE = EngineRecord(
    order=60, label="MJX", colour="#332288", marker="<", package="mujoco.mjx", reads_file=True, compiles=True,
    environment=(("JAX_ENABLE_X64", "1"),),
)  # fmt: skip
# its fusions repeat what they share: an acceleration of an arm of seven hinges took 412 ms, 3 ms without them
COMPILER = {"xla_cpu_use_fusion_emitters": False}
STIFFNESS_AND_DAMPING = ("jnt_stiffness", "dof_damping")


def methods_for(tree: Tree) -> dict[str, tuple[int, str]]:
    """METHODS for a Tree: RK4 turns a ball by the mean of its speeds, as MuJoCo's did up to 3.17."""
    return METHODS | ({"RK4": (2, "rk4_mean_speed")} if tree.coordinates.balls else {})


class Model(OfCompiled):
    def __init__(self, file: File, precision: str):
        import jax

        jax.config.update("jax_default_device", jax.devices("cpu")[0])  # of all but batches
        super().__init__(file, precision)
        self.data = self.made_data(self.bare)

    def put_model(self, model: Any) -> Any:
        from mujoco import mjx

        return mjx.put_model(model, impl="jax")

    def made_data(self, bare: Bare) -> Any:
        from mujoco import mjx

        data = mjx.make_data(bare.model, impl="jax")
        controls = {"ctrl": bare.engaged.ctrl, "act": bare.engaged.act}
        return data.replace(**{name: values + 0.0 * getattr(data, name) for name, values in controls.items()})

    @cached_property
    def model(self) -> Any:
        """The model without damping and stiffness, which are part of the force."""
        model = self.models["RK4"]
        return model.replace(**{name: 0.0 * getattr(model, name) for name in STIFFNESS_AND_DAMPING})

    def held(self, name: str) -> Array:
        return np.array(getattr(self.models["Euler"], name))

    def gravity(self) -> Array:
        return np.asarray(self.models["Euler"].opt.gravity)

    def with_field(self, model: Any, name: str, index: Array, values: Array) -> Any:
        field = np.array(attrgetter(name)(model))
        field[index] = values
        return model.tree_replace({name: field})

    def placed(self, q: Array, *of_speeds: Array) -> list[Array]:
        """The arguments in MuJoCo's order of joints."""
        placed = [np.zeros(np.shape(values), self.precision) for values in (q, *of_speeds)]
        placed[0][..., self.bare.qpos] = q
        for vector, values in zip(placed[1:], of_speeds):
            vector[..., self.bare.dofs] = values
        return placed

    def values(self, q: Array, v: Array, force: Array) -> tuple[Array, ...]:
        M, h, a = functions()["values"](self.model, self.data, *self.placed(q, v, force))
        at = self.bare.dofs
        return np.asarray(M)[np.ix_(at, at)], np.asarray(h)[at], np.asarray(a)[at]

    def mass_matrix(self, q: Array) -> Array:
        zero = np.zeros(len(self.bare.dofs))
        return self.values(q, zero, zero)[0]

    def bias(self, q: Array, v: Array) -> Array:
        return self.values(q, v, np.zeros_like(v))[1]

    def acceleration(self, q: Array, v: Array, force: Array) -> Array:
        return self.values(q, v, force)[2]

    def batch(self, course: Course) -> tuple[Callable[[], Array], str]:
        """On the first device that JAX has, which may be a GPU."""
        import jax

        device, dt = jax.devices()[0], np.asarray(course.dt, self.precision)
        model = self.models[course.method].tree_replace({"opt.timestep": dt})
        arguments = model, self.data, *self.placed(course.q, course.v, course.tau)
        on_device = jax.device_put(arguments, device)

        def run() -> Array:
            qpos, _ = functions()["worlds"](*on_device, course.steps)
            return np.asarray(qpos.block_until_ready()[0, 0])[self.bare.qpos]

        return run, str(device.device_kind)

    @property
    def lacks(self) -> tuple[str, ...]:
        has_quaternions = len(self.bare.qpos) > len(self.bare.dofs)  # which do not move like numbers
        return ("derivatives",) if has_quaternions else ()

    def derivatives(self, q: Array, v: Array, force: Array) -> Array:
        by = functions()["derivatives"](self.model, self.data, *self.placed(q, v, force))
        rows, at = self.bare.dofs, (self.bare.qpos, self.bare.dofs, self.bare.dofs)
        return np.array([np.asarray(matrix)[np.ix_(rows, columns)] for matrix, columns in zip(by, at)])

    def run(self, course: Course) -> tuple[Array, int]:
        dt = np.asarray(course.dt, self.precision)
        bare, model, tau = self.of_course(course)
        data = self.data if bare is self.bare else self.made_data(bare)
        model, start = model.tree_replace({"opt.timestep": dt}), self.placed(course.q, course.v, tau)
        path = functions()["path"](model, data, *start, course.every, records=len(course.times) - 1)
        qpos, qvel = map(np.asarray, path)
        states = np.hstack([qpos[:, self.bare.qpos], qvel[:, self.bare.dofs]])
        return np.vstack([course.start, states]), course.steps * STAGES[course.method]


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

    worlds = jax.vmap(partial(path, records=1), in_axes=(None, None, 0, 0, 0, None))

    def acceleration(model: Any, data: Any, *state: Any) -> Any:
        return values(model, data, *state)[2]

    compiled = partial(jax.jit, compiler_options=COMPILER)
    return {
        "values": compiled(values),
        "derivatives": compiled(jax.jacfwd(acceleration, argnums=(2, 3, 4))),
        "path": compiled(path, static_argnames="records"),
        "worlds": jax.jit(worlds),
    }
