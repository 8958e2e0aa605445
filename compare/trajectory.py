"""Five seconds of motion by the same method on both sides."""

import numpy as np

import tmt
from tmt.methods import METHODS

from .agreement import Result
from .band import NARROW, band
from .scenes import SCENES

TITLE = "Trajectories: the assignment's five seconds, on both sides"
CLAIM = (
    "TMT's classical RK4 and MuJoCo's RK4, with the same step, stay together as long as rounding allows: five seconds "
    "in every scene but the held ball catch, an unstable posture in which rounding grows until it throws the arm out."
)
BAR = (
    "A band computed along the run: the sum over all earlier steps of the rounding that a step can add, carried to the "
    "present by the exact Jacobians of the method's own steps. Judged while the band of the angles is below 1e-3 rad; "
    "each scene states how long that must be."
)
MOVED = 0.1  # rad


def rows(setup) -> Result:
    """Each scene with each step: open-loop difference of angles and rates against the band."""
    result = Result("trajectory")
    stepping = METHODS["rk4"]
    for scene in SCENES:
        q0, tau, rest = scene.start, scene.tau, np.zeros(3)
        for steps in setup.steps:
            dt = scene.duration / steps
            where = f"{scene.name}, dt = 5/{steps} s"
            t, *ours = tmt.simulate(q0, rest, tau, dt, steps)
            _, *theirs = setup.engine.trajectory(q0, rest, tau, dt, steps)
            with np.errstate(over="ignore", invalid="ignore"):
                width = band(stepping, *ours, tau, dt)
            judged = np.cumsum(~(width[:, :3].max(axis=1) < NARROW)) == 0
            differences = [np.abs(a - b) for a, b in zip(ours, theirs)]
            diverged = ~np.isfinite(np.concatenate([*ours, *theirs], axis=1)).all(axis=1)
            ends = {"judged_until_s": t[judged][-1], "diverged_at_s": t[diverged][0] if diverged.any() else None}
            for quantity, unit, difference, bar in zip(
                ("angles", "rates"), ("rad", "rad/s"), differences, (width[:, :3], width[:, 3:])
            ):
                ratio = np.zeros_like(difference)
                np.divide(difference, bar, out=ratio, where=bar > 0)
                k, i = np.unravel_index(np.nanargmax(np.where(judged[:, None], ratio, -1.0)), ratio.shape)
                note = f"{tmt.ARM.hinge_names[i]} at t = {t[k]:.3f} s"
                value = np.nan if diverged[judged].any() else difference[k, i]
                check = result.check(where, f"{quantity}, TMT to MuJoCo", value, bar[k, i], unit, note, True)
                result.rows.append(
                    {
                        "scene": scene.name,
                        "engine_integrator": "RK4",
                        "twin": "rk4",
                        "dt_s": dt,
                        "level": "open loop",
                        "quantity": quantity,
                        "unit": unit,
                        "worst_difference": check.value,
                        "band": check.tolerance,
                        "difference_over_band": check.over_bar,
                        "largest_motion": np.nanmax(
                            np.abs(ours[quantity == "rates"] - (q0, rest)[quantity == "rates"])
                        ),
                    }
                    | ends
                )
            missing = max(0.0, scene.judged - ends["judged_until_s"])
            result.check(where, f"judged for less than {scene.judged:g} s", missing, 0.0, "s missing")
            if scene.torque == "free":
                still = max(0.0, MOVED - np.nanmax(np.abs(ours[0] - q0)))
                result.check(where, f"moves less than {MOVED} rad (a vacuous run)", still, 0.0, "rad missing")
                same = float(not np.any(differences[0] > 0.0))
                result.check(
                    where, "both parties give the same bits (one run compared with itself?)", same, 0.0, "runs"
                )
            result.curves[(scene, steps)] = {
                "t": t, "tmt": ours, "mujoco": theirs, "differences": differences, "band": width, **ends,
                "left": [departure(t, path - q0) for path in (ours[0], theirs[0])],
            }  # fmt: skip
    return result


def departure(t, deviation) -> float | None:
    """The time at which a hinge is first more than 0.1 rad from the start; None: never."""
    away = np.abs(deviation).max(axis=1) > MOVED
    return float(t[away][0]) if away.any() else None


def figures(result):
    from . import draw  # matplotlib is for the process that draws

    yield draw.held(result, "ball catch, held", "assignment_figure_2")
    yield draw.held(result, "bent, held", "assignment_figure_3")
    for scene in SCENES:
        yield draw.run(result, scene)
