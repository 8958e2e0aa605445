"""The scenes by name, and runs whose numbers a test chooses. Used by all tests of this folder."""

from types import SimpleNamespace

import numpy as np

from compare.experiments.trajectory.pairs import Pair
from compare.robots.arm import ARM

NEVER = (np.inf, np.inf)  # of both engines
CASES = {case.name: case for case in ARM.cases}
FREE, HELD, DAMPED = (CASES[name] for name in ("bent, free", "ball catch, held", "bent, damped"))


def run_of(case, q, v, ended=np.inf, left=None):
    """A run of one engine."""
    t = np.linspace(0.0, case.duration, len(q))
    return SimpleNamespace(case=case, t=t, q=q, v=v, ended=ended, left=left)


def pair_of(
    case, ours=0.0, theirs=0.0, left=(None, None), ended=NEVER, scheme="rk4", steps=64, until=None
) -> Pair:
    """Runs of so many steps by RK4 whose angles end so far from where they started; judged until some time, s, or the end."""
    ramp = np.linspace(0.0, 1.0, steps + 1)[:, None] * np.ones(len(case.joints))
    runs = {
        "tmt": run_of(case, case.q + ours * ramp, 10.0 + ours * ramp, ended[0], left[0]),
        "mujoco": run_of(case, case.q + theirs * ramp, 20.0 + theirs * ramp, ended[1], left[1]),
    }
    nv = case.coordinates.nv
    width = np.full((case.steps + 1, 2 * nv), 1e-9)
    if until is not None:
        width[np.linspace(0.0, case.duration, case.steps + 1) > until] = 1.0
    return Pair(runs=runs, scheme=scheme, integrator="RK4", width=width, widest=np.full(2 * nv, 1e-3))
