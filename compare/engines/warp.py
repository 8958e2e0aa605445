"""MuJoCo Warp: the model that MuJoCo compiles, computed by Warp's kernels, in float32, here on a CPU."""

import os
from dataclasses import replace
from functools import cached_property

import numpy as np

from tmt.methods import lone_speeds

from . import GRID, EngineRecord
from .outside.model import ReadModel, Unread

ENGINE = EngineRecord(order=65, label="MuJoCo Warp", colour="#117733", marker="p", package="mujoco_warp", extra="warp",
                      reads_file=True, compiles=True, precision="float32")  # fmt: skip
METHODS = {"Euler": (1, "semi_implicit_euler"), "implicitfast": (1, "semi_implicit_euler"), "RK4": (4, "rk4")}


def methods_for(tree):
    """METHODS for a Tree: implicitfast is implicit in the bias of a free body on its own, as MuJoCo's is since 4.0."""
    return METHODS | ({"implicitfast": (1, "implicitfast")} if lone_speeds(tree) else {})


class Model(ReadModel):
    def __init__(self, file, precision):
        import warp

        warp.config.log_level = warp.LOG_ERROR
        silently(warp.init)
        warp.set_device("cpu")
        import mujoco_warp

        from .mujoco.bare import Bare

        self.bare = Bare(file.path, file.names, rotors_in_joints=True)
        self.bare.model.opt.iterations = 0  # of its solver of constraints
        try:
            self.models = {name: mujoco_warp.put_model(self.bare.with_integrator(name)) for name in METHODS}
        except NotImplementedError as error:
            raise Unread(f"MuJoCo Warp does not have what it needs: {error}") from None
        self.worlds, self.graphs = {}, {}

    def numbers(self):
        model = self.models["Euler"]
        held = self.bare.numbers(lambda name: shared(getattr(model, name)))
        return {"gravity": model.opt.gravity.numpy()[0]} | held

    def mend(self, name, values):
        joints = self.bare.model.dof_jntid[self.bare.dofs]
        index = {"stiffness": joints, "gravity": slice(None)}.get(name, self.bare.dofs)
        for model in self.models.values():
            fields = {
                "gravity": model.opt.gravity,
                "armature": model.dof_armature,
                "damping": model.dof_damping,
            }
            if (field := (fields | {"stiffness": model.jnt_stiffness}).get(name)) is None:
                return False
            numbers = field.numpy()
            numbers[0, index] = values
            field.assign(numbers)
        return True

    @cached_property
    def model(self):
        """The model without damping and stiffness, which are part of the force."""
        import warp

        model = self.models["RK4"]
        none = [warp.zeros_like(field) for field in (model.dof_damping, model.jnt_stiffness)]
        return replace(model, dof_damping=none[0], jnt_stiffness=none[1])

    def at(self, q, v, force):
        """Data of as many worlds as there are states, at these states (worlds, n)."""
        import mujoco_warp

        if (
            len(q) not in self.worlds
        ):  # njmax=0 is possible, but then Euler and implicitfast do not accelerate
            self.worlds[len(q)] = mujoco_warp.make_data(self.bare.model, len(q), nconmax=0, njmax=1)
        data = self.worlds[len(q)]
        for field, values in ((data.qpos, q), (data.qvel, v), (data.qfrc_applied, force)):
            placed = np.zeros(field.shape, np.float32)
            placed[:, self.bare.qpos if field is data.qpos else self.bare.dofs] = values
            field.assign(placed)
        return data

    def replay(self, name, call, data):
        """A function that repeats a call for these data; the kernels that it launches are recorded once."""
        import warp

        if (name, data.nworld) not in self.graphs:
            call(data)  # compiles
            with warp.ScopedCapture() as capture:
                call(data)
            self.graphs[name, data.nworld] = capture.graph
        return lambda: warp.capture_launch(self.graphs[name, data.nworld])

    def forward(self, q, v, force):
        """Data after forward dynamics at states (worlds, n)."""
        from mujoco_warp import forward

        data = self.at(q, v, force)
        self.replay("forward", lambda data: forward(self.model, data), data)()
        return data

    def mass_matrix(self, q):
        zero, model, at = np.zeros((1, len(self.bare.dofs))), self.model, self.bare.dofs
        row, column = np.repeat(np.arange(zero.size), model.M_rownnz.numpy()), model.M_colind.numpy()
        M = np.zeros((zero.size, zero.size))  # its lower triangle is given, row by row
        M[row, column] = M[column, row] = self.forward(q[None], zero, zero).M.numpy()[0]
        return M[np.ix_(at, at)]

    def bias(self, q, v):
        return self.forward(q[None], v[None], np.zeros_like(v[None])).qfrc_bias.numpy()[0, self.bare.dofs]

    def acceleration(self, q, v, force):
        return self.forward(q[None], v[None], force[None]).qacc.numpy()[0, self.bare.dofs]

    def prepare(self, method, tau, dt, tolerance):
        q = self.bare.model.qpos0[self.bare.qpos]
        self.run(q, np.zeros_like(tau), tau, np.arange(GRID + 1.0), 0, method, tolerance)

    def run(self, q, v, tau, times, steps, method, tolerance):
        from mujoco_warp import step

        model, data, path = self.models[method], self.at(q[None], v[None], tau[None]), [np.hstack([q, v])]
        model.opt.timestep.fill_(times[-1] / max(steps, 1))
        advance = self.replay(method, lambda data: step(model, data), data)
        self.at(q[None], v[None], tau[None])  # the recording has moved them
        for _ in times[1:]:
            for _ in range(steps // (len(times) - 1)):
                advance()
            path.append(
                np.hstack([data.qpos.numpy()[0, self.bare.qpos], data.qvel.numpy()[0, self.bare.dofs]])
            )
        return np.array(path), steps * (4 if method == "RK4" else 1)


def silently(call):
    """Call without what compiled code writes to standard error: here that there is no CUDA."""
    kept, null = os.dup(2), os.open(os.devnull, os.O_WRONLY)
    os.dup2(null, 2)
    try:
        call()
    finally:
        os.dup2(kept, 2)


def shared(field):
    """The numbers of a field that all worlds share."""
    values = field.numpy()
    return values[0] if field.ndim > 1 else values
