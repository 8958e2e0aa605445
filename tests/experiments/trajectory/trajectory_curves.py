"""The scenes by name, and curves of runs whose numbers a test chooses. Used by all tests of this folder."""

import numpy as np

from compare.robots.arm import ARM

CASES = {case.name: case for case in ARM.cases}
FREE, HELD, DAMPED = (CASES[name] for name in ("bent, free", "ball catch, held", "bent, damped"))


def run_of(case, ours=0.0, theirs=0.0, until=5.0, left=(None, None)) -> dict:
    """The curves of a run of 64 steps whose angles end so far from where they started."""
    t = np.linspace(0.0, 5.0, 65)
    ramp = np.linspace(0.0, 1.0, 65)[:, None] * np.ones(len(case.joints))
    return {
        "integrator": "RK4", "t": t, "every": 1, "tmt": [case.q + ours * ramp, 10.0 + ours * ramp],
        "mujoco": [case.q + theirs * ramp, 20.0 + theirs * ramp], "band": np.full(65, 1e-9),
        "judged_until_s": until, "ended": {"tmt": None, "mujoco": None}, "left": dict(zip(("tmt", "mujoco"), left)),
    }  # fmt: skip
