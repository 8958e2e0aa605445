"""MJX: the model that MuJoCo compiles, computed by JAX."""

from functools import cache, cached_property, partial

import numpy as np

from . import GRID, EngineRecord
from .outside.model import ReadModel, Unread

ENGINE = EngineRecord(
    order=60, label="MJX", colour="#332288", marker="<", package="mujoco.mjx", extra="mjx", reads_file=True, compiles=True,
    environment=(("JAX_ENABLE_X64", "1"), ("JAX_PLATFORMS", "cpu")),
)  # fmt: skip
METHODS = {"Euler": (1, "semi_implicit_euler"), "implicitfast": (1, "semi_implicit_euler"), "RK4": (4, "rk4")}
# its fusions repeat what they share: an acceleration of an arm of seven hinges took 412 ms, 3 ms without them
COMPILER = {"xla_cpu_use_fusion_emitters": False}
STIFFNESS_AND_DAMPING = ("jnt_stiffness", "dof_damping")


def methods_for(tree):
    """METHODS for a Tree: RK4 turns a ball by the mean of its speeds, as MuJoCo's did up to 3.17."""
    return METHODS | ({"RK4": (2, "rk4_mean_speed")} if tree.coordinates.balls else {})


class Model(ReadModel):
    def __init__(self, file, precision):
        from mujoco import mjx

        from .mujoco.bare import Bare

        self.bare, self.precision = Bare(file.path, file.names), precision
        put = partial(mjx.put_model, impl="jax")
        try:
            self.models = {method: put(self.bare.with_integrator(method)) for method in METHODS}
        except NotImplementedError as error:
            raise Unread(f"MJX does not have what it needs: {error}") from None
        self.data = mjx.make_data(self.bare.model, impl="jax")

    @cached_property
    def model(self):
        """The model without damping and stiffness, which are part of the force."""
        model = self.models["RK4"]
        return model.replace(**{name: 0.0 * getattr(model, name) for name in STIFFNESS_AND_DAMPING})

    def numbers(self):
        model = self.models["Euler"]
        held = self.bare.numbers(lambda name: np.array(getattr(model, name)))
        return {"gravity": np.asarray(model.opt.gravity)} | held

    def mend(self, name, values):
        changes = {}
        if name == "gravity":
            changes = {"opt.gravity": values}
        elif name in ("armature", "damping"):
            changes = {f"dof_{name}": np.zeros(len(values))}
            changes[f"dof_{name}"][self.bare.dofs] = values
        elif name == "stiffness":
            changes = {"jnt_stiffness": np.zeros(self.bare.model.njnt)}
            changes["jnt_stiffness"][self.bare.model.dof_jntid[self.bare.dofs]] = values
        changes = {field: values.astype(self.precision) for field, values in changes.items()}
        self.models = {method: model.tree_replace(changes) for method, model in self.models.items()}
        return bool(changes)

    def placed(self, q, *of_speeds):
        """The arguments in MuJoCo's order of joints."""
        placed = [np.zeros(np.shape(values), self.precision) for values in (q, *of_speeds)]
        placed[0][..., self.bare.qpos] = q
        for vector, values in zip(placed[1:], of_speeds):
            vector[..., self.bare.dofs] = values
        return placed

    def values(self, q, v, force):
        M, h, a = functions()["values"](self.model, self.data, *self.placed(q, v, force))
        at = self.bare.dofs
        return np.asarray(M)[np.ix_(at, at)], np.asarray(h)[at], np.asarray(a)[at]

    def mass_matrix(self, q):
        zero = np.zeros(len(self.bare.dofs))
        return self.values(q, zero, zero)[0]

    def bias(self, q, v):
        return self.values(q, v, np.zeros_like(v))[1]

    def acceleration(self, q, v, force):
        return self.values(q, v, force)[2]

    def prepare(self, method, tau, dt, tolerance):
        q = self.bare.model.qpos0[self.bare.qpos]
        self.run(q, np.zeros_like(tau), tau, np.arange(GRID + 1.0), 0, method, tolerance)

    def run(self, q, v, tau, times, steps, method, tolerance):
        records = len(times) - 1
        dt = np.asarray(times[-1] / max(steps, 1), self.precision)
        model = self.models[method].tree_replace({"opt.timestep": dt})
        path = functions()["path"](
            model, self.data, *self.placed(q, v, tau), steps // records, records=records
        )
        qpos, qvel = map(np.asarray, path)
        path = np.hstack([qpos[:, self.bare.qpos], qvel[:, self.bare.dofs]])
        return np.vstack([np.hstack([q, v]), path]), steps * (4 if method == "RK4" else 1)


@cache
def functions() -> dict:
    """The compiled functions; models that differ only in their numbers have one compilation."""
    import jax
    from mujoco import mjx

    def values(model, data, qpos, qvel, force):
        data = mjx.forward(model, data.replace(qpos=qpos, qvel=qvel, qfrc_applied=force))
        return mjx.full_m(model, data), data.qfrc_bias, data.qacc

    def path(model, data, qpos, qvel, force, every, records):
        def step(_, state):
            now = mjx.step(model, data.replace(qpos=state[0], qvel=state[1], qfrc_applied=force))
            return now.qpos, now.qvel

        def record(state, _):
            return (jax.lax.fori_loop(0, every, step, state),) * 2

        return jax.lax.scan(record, (qpos, qvel), None, records)[1]

    compiled = partial(jax.jit, compiler_options=COMPILER)
    return {"values": compiled(values), "path": compiled(path, static_argnames="records")}
