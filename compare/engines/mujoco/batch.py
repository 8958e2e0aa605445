"""Many states at once by MuJoCo's own batches, mujoco.batch: a loop in C over the states, on as many threads as wanted."""

from collections.abc import Callable
from importlib.util import find_spec

import mujoco
import numpy as np

from .calls import TINY_STEP
from .dynamics import MujocoDynamics
from .flags import FLAGS


class BatchedCalls:
    """N states of a case in one batch, their contact and constraint stages off; q (N, nq), v and tau (N, nv)."""

    def __init__(self, dynamics: MujocoDynamics, q, v, tau, threads: int = 1):
        from mujoco.batch import Batch

        model = dynamics.own_copy(TINY_STEP, "RK4")[0]
        model.opt.disableflags |= int(FLAGS["contact"]) | int(FLAGS["constraint"])
        self.batch, self.dofs = Batch(model, len(q), threads), dynamics.dofs
        state = self.batch.bind("qpos"), self.batch.bind("qvel"), self.batch.bind("qfrc_applied")
        for part, values, places in zip(state, (q, v, tau), (dynamics.qpos, dynamics.dofs, dynamics.dofs)):
            part[:, places] = values
        self.found = self.batch.bind("qacc")

    @staticmethod
    def unavailable() -> str | None:
        """Why it cannot take part here, or None."""
        if find_spec("mujoco.batch") is None:
            return f"MuJoCo {mujoco.__version__} has no mujoco.batch, which came with 4.0"
        return None

    def forward(self) -> np.ndarray:
        """rad/s2, (N, nv): mj_forward of each state."""
        self.batch.forward()
        return self.found[:, self.dofs]

    def step(self) -> None:
        """mj_step of each state, a step so short that it stays where it is."""
        self.batch.step()

    def forward_loop(self) -> Callable[[int], object]:
        """run(count): mj_forward of all states so many times, each time a call from Python."""
        return lambda count: [self.batch.forward() for _ in range(count)]
