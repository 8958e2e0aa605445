"""Why a held robot leaves its posture: the acceleration that the torque leaves, grown by RK4's own linear map."""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from tmt.methods import METHODS, amplification

from ...engines import LABELS, Engine, compared
from ...judge.rounding import slope_rounding
from ...judge.run import LEFT, movement_unit
from ...judge.words import capital
from ...robots.case import Case

NO_TIME = 1e-6  # s: a step in which nothing moves
STEADY = 1e-3  # per second: a slower growth is none in these runs
NEAR_PREDICTION = 2  # steps: so near the time that is predicted from rounding, rounding is the cause


def accelerations_left(case: Case, engines: Mapping[str, Engine]) -> dict[str, np.ndarray]:
    """The acceleration that each engine finds at the start under the torque that is to hold, rad/s2, (nv,)."""
    (name, ours), (other, theirs) = compared(engines, case).items()
    return {
        name: ours.run(*case.start, case.tau, NO_TIME, 1, "rk4").v[1] / NO_TIME,
        other: theirs.acceleration(*case.start, case.tau),
    }


def allowed(case: Case) -> float:
    """How large that acceleration may be by rounding alone, rad/s2."""
    dt = case.duration / case.steps
    return float(slope_rounding(METHODS["rk4"], case.tree, case.q[None], case.v[None], case.tau, dt)[2][0])


def linear_map(case: Case) -> tuple[np.ndarray, np.ndarray]:
    """J and G of x+ = J x + G a: one step of RK4 of the linear motion about the start, pushed by a constant a, rad/s2.

    x: deviations of positions, as movements, and of speeds; J (2 nv, 2 nv), G (2 nv, nv). A = dxd/dx is exact: an explicit step
    of Euler's method of 1 s is 1 + A.
    """
    n, dt = case.coordinates.nv, case.duration / case.steps
    A = amplification(METHODS["explicit_euler"], case.tree, case.q, case.v, case.tau, 1.0) - np.eye(2 * n)
    Z = dt * A
    pushed = dt * (np.eye(2 * n) + Z / 2 + Z @ Z / 6 + Z @ Z @ Z / 24)
    return np.eye(2 * n) + A @ pushed, pushed[:, n:]


def predicted_leaving(case: Case, push: np.ndarray) -> float | None:
    """When the linear map has the robot 0.1 rad, or m, away under a constant push, rad/s2: s; None: not in this scene."""
    J, G = linear_map(case)
    state = np.zeros(len(J))
    for k in range(1, case.steps + 1):
        state = J @ state + G @ push
        if np.abs(state[: len(push)]).max() > LEFT:
            return k * case.duration / case.steps
    return None


def causes_in_words(case: Case, engines: Mapping[str, Engine], left: Mapping[str, float | None]) -> list[str]:
    """A sentence for each engine: what the torque leaves, what becomes of it, when the robot left, and what the cause is."""
    may, unit = allowed(case), movement_unit(case.coordinates)
    per = per_s2(unit)
    sentences = [f"The linear map of RK4 lets {growing_in_words(case)}."]
    for name, push in accelerations_left(case, engines).items():
        if not np.isfinite(push).all():
            sentences.append(f"{capital(LABELS[name])} gives no acceleration there.")
            continue
        size, at = float(np.abs(push).max()), predicted_leaving(case, push)
        away = (
            f"be {LEFT} {unit} away at {at:.2f} s"
            if at is not None
            else f"stay within {LEFT} {unit} for {case.duration:g} s"
        )
        why = cause_in_words(case, size, may, at, left[name])
        left_over = f"{size:.1e}" if size else "0"
        sentences.append(
            f"{capital(LABELS[name])}: the torque leaves an acceleration of {left_over} {per} (rounding allows {may:.1e}); by "
            f"that map alone the {case.robot.noun} would {away}; it {left_in_words(left[name], unit)}{why}."
        )
    return sentences


def growing_in_words(case: Case) -> str:
    """What the linear map of RK4 lets small deviations do."""
    rate = growth_rate(case)
    return f"small deviations grow by up to e^{rate:.1f} per second" if rate > STEADY else "no small deviation grow"


def growth_rate(case: Case) -> float:
    """How fast the linear map of RK4 lets the fastest small deviation grow, 1/s; below 0: it shrinks."""
    J, _ = linear_map(case)
    return float(np.log(np.abs(np.linalg.eigvals(J)).max()) / (case.duration / case.steps))


class Leaving(NamedTuple):
    """Why the engines leave a held posture, or do not."""

    rate: float  # 1/s, at which small deviations grow
    allowed: float  # rad/s2, of the acceleration that rounding may leave
    left_over: dict[str, float]  # rad/s2, of each engine: the acceleration that the torque leaves
    predicted: dict[
        str, float | None
    ]  # s: when the linear map has the robot away by that alone; None: not in this scene


def leaving(case: Case, engines: Mapping[str, Engine]) -> Leaving:
    """What explains when each engine leaves the posture of a case."""
    pushes = accelerations_left(case, engines)
    return Leaving(
        growth_rate(case),
        allowed(case),
        {name: float(np.abs(push).max()) for name, push in pushes.items()},
        {name: predicted_leaving(case, push) if np.isfinite(push).all() else None for name, push in pushes.items()},
    )


def per_s2(unit: str) -> str:
    """The unit of accelerations, by that of movements."""
    return " or ".join(f"{one}/s2" for one in unit.split(" or "))


def why_in_words(found: Leaving, unit: str = "rad") -> str:
    """Why the engines leave a held posture when they do, or stay, in one line."""
    beyond = [name for name, size in found.left_over.items() if not size <= found.allowed]
    if beyond:
        sizes = " and ".join(f"{found.left_over[name]:.1e} {per_s2(unit)} in {LABELS[name]}" for name in beyond)
        return f"the torque leaves an acceleration of {sizes}: that is no rounding, which allows {found.allowed:.1e}"
    if found.rate <= STEADY:
        return "no small deviation grows here, and the torque leaves no more than rounding"
    (first, at), *others = found.predicted.items()
    times = [f"{LABELS[first]} would {f'be {LEFT} {unit} away at {at:.2f} s' if at is not None else 'stay'}"]
    times += [f"{LABELS[name]} {f'at {at:.2f} s' if at is not None else 'would stay'}" for name, at in others]
    return f"rounding of the torque grows by e^{found.rate:.1f} per second; by that alone {', '.join(times)}"


def stays_in_words(case: Case, engines: Mapping[str, Engine], left: Mapping[str, float | None]) -> str | None:
    """What is said where the robot stays in every run and by the linear map, in one sentence; None: it leaves in one of them."""
    pushes = accelerations_left(case, engines)
    if not all(np.isfinite(push).all() for push in pushes.values()):
        return None
    if any(time is not None for time in (*left.values(), *(predicted_leaving(case, push) for push in pushes.values()))):
        return None
    unit = movement_unit(case.coordinates)
    sizes = " and ".join(f"{LABELS[name]} {np.abs(push).max():.1e}" for name, push in pushes.items())
    return (
        f"the {case.robot.noun} stays within {LEFT} {unit} for {case.duration:g} s in both engines, as it would by RK4's linear "
        f"map, which lets {growing_in_words(case)}, under the acceleration that the torque leaves, {sizes} {per_s2(unit)} "
        f"(rounding allows {allowed(case):.1e})"
    )


def left_in_words(left: float | None, unit: str = "rad") -> str:
    """Whether and when a held robot left."""
    return f"stays within {LEFT} {unit}" if left is None else f"is {LEFT} {unit} away at {left:.2f} s"


def cause_in_words(case: Case, size: float, may: float, at: float | None, left: float | None) -> str:
    """The cause of leaving, in words; nothing where the robot stays."""
    if left is None:
        return ""
    if size > may:
        return ": that is no rounding"
    steps = np.inf if at is None else abs(left - at) * case.steps / case.duration
    return (
        ": the cause is rounding of the torque"
        if steps < NEAR_PREDICTION + 0.5
        else ": rounding of the torque alone does not explain it"
    )
