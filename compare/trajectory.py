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
    "in every scene but the held ball catch, an unstable posture in which rounding grows by e^7.5 a second, so that two "
    "runs can be judged for its first seconds only."
)
BAR = (
    "A band computed along the run: the sum over all earlier steps of the rounding that a step can add, carried to the "
    "present by the exact Jacobians of the method's own steps. Judged while the band of the angles is below 1e-3 rad; "
    "each scene states how long that must be. A free run must move by 0.1 rad, and the parties must not give the same bits."
)
MOVES = 0.1  # rad: a free run that moves less shows nothing
LEFT = 0.1  # rad: a held arm that is so far from its posture has left it


def rows(setup) -> Result:
    """Each scene with each step: open-loop difference of angles and rates against the band."""
    result = Result(
        "trajectory",
        shown=["scene", "dt_s", "quantity", "largest_difference", "worst_difference", "band", "difference_over_band",
               "largest_motion_tmt", "largest_motion_mujoco", "judged_until_s", "required_s", "unit"],
    )  # fmt: skip
    for scene in SCENES:
        for steps in setup.steps:
            follow(result, scene, steps, setup.engine)
    result.notes = published_claims(result)
    return result


def follow(result, scene, steps, engine) -> None:
    """One scene with one step size: both runs, their band, the checks, the rows, the curves."""
    dt = scene.duration / steps
    where = f"{scene.name}, dt = 5/{steps} s"
    start = scene.start, np.zeros(3)
    t, *ours = tmt.simulate(*start, scene.tau, dt, steps)
    _, *theirs = engine.trajectory(*start, scene.tau, dt, steps)
    with np.errstate(over="ignore", invalid="ignore"):
        width = band(METHODS["rk4"], *ours, scene.tau, dt)
    judged = np.cumsum(~(width[:, :3].max(axis=1) < NARROW)) == 0
    until = float(t[judged][-1])
    finite = np.isfinite(np.concatenate([*ours, *theirs], axis=1)).all(axis=1)
    diverged_at = None if finite.all() else float(t[~finite][0])

    for quantity, unit, a, b, q0, bar in zip(
        ("angles", "rates"), ("rad", "rad/s"), ours, theirs, start, (width[:, :3], width[:, 3:])
    ):
        difference = np.where(judged[:, None], np.abs(a - b), 0.0)
        ratio = np.divide(difference, bar, out=np.zeros_like(bar), where=bar > 0)
        k, i = np.unravel_index(np.argmax(ratio), ratio.shape)  # NaN counts as the largest
        place = f"{tmt.ARM.hinge_names[i]} at t = {t[k]:.3f} s"
        check = result.check(where, f"{quantity}, TMT to MuJoCo", difference[k, i], bar[k, i], unit, place, True)
        result.rows.append(
            {
                "scene": scene.name,
                "engine_integrator": "RK4",
                "twin": "rk4",
                "dt_s": dt,
                "level": "open loop",
                "quantity": quantity,
                "unit": unit,
                "largest_difference": None if check.value is None else difference.max(),
                "worst_difference": check.value,
                "band": check.tolerance,
                "difference_over_band": check.over_bar,
                "largest_motion_tmt": farthest(a - q0),
                "largest_motion_mujoco": farthest(b - q0),
                "judged_until_s": until,
                "required_s": scene.judged,
                "diverged_at_s": diverged_at,
            }
        )
    result.check(where, f"judged for less than {scene.judged:g} s", max(0.0, scene.judged - until), 0.0, "s missing")
    if scene.torque == "free":
        moved = min(farthest(path - scene.start) for path in (ours[0], theirs[0]))
        result.check(where, f"moves less than {MOVES} rad", max(0.0, MOVES - moved), 0.0, "rad missing")
        result.check(where, "both parties give the same bits", np.array_equal(ours[0], theirs[0]), 0.0, "runs")
    result.curves[(scene, steps)] = {
        "t": t, "tmt": ours, "mujoco": theirs, "difference": np.abs(ours[0] - theirs[0]).max(axis=1),
        "band": width[:, :3].max(axis=1), "judged_until_s": until,
        "left": {"TMT": departure(t, ours[0]), "MuJoCo": departure(t, theirs[0])},
    }  # fmt: skip


def farthest(deviation) -> float:
    """The largest deviation of a run, as long as it has not diverged."""
    return float(np.nanmax(np.abs(deviation)))


def departure(t, path) -> float | None:
    """The time at which a hinge is first 0.1 rad from where it started; None: never."""
    away = np.abs(path - path[0]).max(axis=1) > LEFT
    return float(t[away][0]) if away.any() else None


def published_claims(result) -> list[str]:
    """What these runs say of the assignment's claims about its Figures 2 and 3."""
    curves = {scene.name: curve for (scene, steps), curve in result.curves.items() if steps == 64}
    left = ", ".join(
        f"{party}'s arm {'never leaves' if at is None else f'is 0.1 rad away at {at:.2f} s'}"
        for party, at in curves["ball catch, held"]["left"].items()
    )
    moved = max(
        row["largest_motion_mujoco"] for row in result.rows if row["scene"] == "bent, held" and row["unit"] == "rad"
    )
    return [
        "Claim: held at ball catch with dt = 5/64 s, the arm leaves after about 4.5 s, by rounding in an unstable posture. "
        f"Here, under TMT's torque, {left}. Rounding is the cause: the torque is off by its last bits, and what they start "
        "grows by e^7.5 a second. An engine whose own bias is the torque bit for bit has nothing to start from.",
        f"Claim: held at bent, the arm does not move. Here it moves by at most {moved:.1e} rad in five seconds.",
    ]


def figures(result):
    """The assignment's Figures 2 and 3, then one figure for each scene."""
    from . import draw  # matplotlib is for the process that draws

    yield draw.held(result, "ball catch, held", "assignment_figure_2")
    yield draw.held(result, "bent, held", "assignment_figure_3")
    for scene in SCENES:
        yield draw.run(result, scene)
