"""MJX: the model that MuJoCo compiles, computed by JAX."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache, cached_property, partial
from operator import attrgetter
from typing import TYPE_CHECKING, Any

import numpy as np

from tmt import Tree

from . import Array, Course, EngineRecord
from .outside.file import File
from .outside.of_compiled import METHODS as METHODS
from .outside.of_compiled import OfCompiled
from .outside.order import State

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
        model = next(iter(self.models.values()))
        return model.replace(**{name: 0.0 * getattr(model, name) for name in STIFFNESS_AND_DAMPING})

    def held(self, name: str) -> Array:
        return np.array(attrgetter(name)(next(iter(self.models.values()))))

    def values(self, at: State, force: Array | None = None) -> tuple[Array, ...]:
        """M, h and the acceleration."""
        force = np.zeros_like(at.u) if force is None else force
        state = (values.astype(self.precision) for values in (at.x, at.u, force))
        return tuple(map(np.asarray, functions()["values"](self.model, self.data, *state)))

    def mass_matrix(self, at: State) -> Array:
        return self.values(at)[0]

    def bias(self, at: State) -> Array:
        return self.values(at)[1]

    def acceleration(self, at: State, force: Array) -> Array:
        return self.values(at, force)[2]

    def with_step(self, model: Any, dt: float) -> Any:
        return model.tree_replace({"opt.timestep": np.asarray(dt, self.precision)})

    def batch(self, course: Course) -> tuple[Callable[[], Array], str]:
        """On the first device that JAX has, which may be a GPU."""
        import jax

        device, model = jax.devices()[0], self.with_step(self.models[course.method], course.dt)
        start = self.placed(course.q, course.v, course.tau)
        arguments = jax.device_put((model, self.data, *start), device)

        def ends() -> Array:
            qpos, _ = functions()["worlds"](*arguments, course.steps)
            return np.asarray(qpos.block_until_ready()[0, 0])[self.bare.qpos]

        return ends, str(device.device_kind)

    @property
    def quantities(self) -> tuple[str, ...]:
        """Quaternions do not move like numbers."""
        return super().quantities + ("derivatives",) * (not self.file.coordinates.has_balls)

    def derivatives(self, at: State, force: Array) -> Array:
        state = (values.astype(self.precision) for values in (at.x, at.u, force))
        return np.array(functions()["derivatives"](self.model, self.data, *state))

    def path(self, bare: Bare, model: Any, start: list[Array], course: Course) -> tuple[Array, Array]:
        data = self.data if bare is self.bare else self.made_data(bare)
        model = self.with_step(model, course.dt)
        path = functions()["path"](model, data, *start, course.every, records=len(course.times) - 1)
        qpos, qvel = map(np.asarray, path)
        return qpos, qvel


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
        "worlds": compiled(worlds),
    }
