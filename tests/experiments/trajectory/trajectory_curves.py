"""The scenes by name, and runs whose numbers a test chooses. Used by all tests of this folder."""

import numpy as np

from compare.experiments.trajectory.runs import Path, Run
from compare.robots.arm import ARM

NEVER = (None, None)  # of both engines
CASES = {case.name: case for case in ARM.cases}
FREE, HELD, DAMPED = (CASES[name] for name in ("bent, free", "ball catch, held", "bent, damped"))


def run_of(case, ours=0.0, theirs=0.0, left=NEVER, ended=NEVER, scheme="rk4", steps=64, until=5.0) -> Run:
    """A run of 64 steps by RK4 whose angles end so far from where they started, or one that is said to be another."""
    ramp = np.linspace(0.0, 1.0, 65)[:, None] * np.ones(len(case.joints))
    mine = Path(case.q + ours * ramp, 10.0 + ours * ramp, ended[0], left[0])
    other = Path(case.q + theirs * ramp, 20.0 + theirs * ramp, ended[1], left[1])
    paths = {"tmt": mine, "mujoco": other}
    nv = case.coordinates.nv
    return Run(
        case=case, scheme=scheme, steps=steps, t=np.linspace(0.0, 5.0, 65), paths=paths, integrator="RK4",
        width=np.full((65, 2 * nv), 1e-9), widest=np.full(2 * nv, 1e-3), judged_until=until,
    )  # fmt: skip
