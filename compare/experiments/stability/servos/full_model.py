"""The full model, everything as the file has it, at one step with each integrator: does it come to rest?"""

from collections.abc import Mapping

import numpy as np

from ....engines.mujoco.whole import whole_run
from ....robots.case import SEED
from ....truth.driven import Posture

FULL_TIME, FULL_LAST = 2.0, 0.5  # s: of a run, and of its part whose speeds are looked at
FULL_PUSH = 1e-6  # rad/s or m/s at the start, by chance: what rests exactly would stay where it is, however unstable
CALM = 1e-3  # rad/s or m/s, root of the mean square


def rows(model, at: Posture, dt: float, predicted: Mapping[str, bool | None]) -> list[dict]:
    """Rows of tables/full_model.csv of one posture, one for each integrator of `predicted`: whether dt, s, is stable with it.

    model: the file's, as it was compiled. It starts at the posture itself, which need not be where it rests.
    """
    found, speed = [], FULL_PUSH * np.random.default_rng(SEED).normal(size=model.nv)
    for integrator, is_stable in predicted.items():
        with np.errstate(over="ignore", invalid="ignore"):
            run = whole_run(model, at.robot.drive, at.start, at.u, dt, integrator, FULL_TIME, FULL_LAST, speed)
        found.append({
            "posture": at.name, "integrator": integrator, "dt_s": dt,
            "rms_speed": run.rms_speed if np.isfinite(run.rms_speed) else None,
            "warnings": run.warnings, "resets": run.resets,
            "predicted_stable": is_stable, "calm": bool(run.rms_speed < CALM),
        })  # fmt: skip
    return found
