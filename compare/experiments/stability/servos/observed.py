"""Runs of MuJoCo under a robot's own servos: the largest stable step."""

from collections.abc import Iterator

import numpy as np

from ....engines.mujoco import Reading
from ....engines.mujoco.acting import Acting
from ....robots.case import SEED
from ....truth.driven import Posture
from ....truth.step_limits import LIMIT_UP_TO, bisected
from .predicted import acting_at

MOVED_BY, MOVED_LEAST, MOVED_MOST = (
    1e-6,
    1e-8,
    1e-5,
)  # rad or m at the start, of a joint of middling inertia; of any
SOUGHT_FROM = 1e-7  # s: from which the limit is sought
SOUGHT_BY = 4.0  # from one step to the next, upwards, until one fails
SOUGHT_STEPS, NARROWED_STEPS = 400, 4000  # of a run: upwards, and where the limit is narrowed
SOFTLY = 0.01  # of a deviation at the start where soft constraints are, which resist the more the more they give way
APART = 0.01  # of a deviation at the start: what constraints do not allow, which they answer with much
RUN_PARTS = 8  # of a run: after each it ends if the deviation has grown far
GROWN_FAR = 100.0  # fold, of the deviation at the start: it has grown. A motion that is bounded comes back long before
GROWN_STILL = (
    3.0  # fold, of the largest deviation up to the middle of a run: what exceeds it in the last quarter grows
)
OBSERVED_WITHIN = 0.01  # relative
NARROWED = 1e-3  # relative, between a step that holds and one that does not


def limit(at: Posture, integrator: str, reading: Reading) -> tuple[str, float | None]:
    """The largest dt, s, at which no small deviation grows in MuJoCo: ("finite", dt); ("none", None): none grows up to 5 s.

    Upwards to the first step that fails, then by bisection; ("always", None): the shortest that is tried fails.
    """
    acting = acting_at(reading, at)
    count = int(np.log(LIMIT_UP_TO / SOUGHT_FROM) / np.log(SOUGHT_BY)) + 2
    tried = LIMIT_UP_TO / SOUGHT_BY ** np.arange(count)[::-1]  # the first at most SOUGHT_FROM
    failed = next(
        (k for k, dt in enumerate(tried) if grows_in_runs(acting, at, integrator, dt, SOUGHT_STEPS)), count
    )
    # a short run may not show what hardly grows: the longest step that held is tried once more
    while failed and grows_in_runs(acting, at, integrator, tried[failed - 1]):
        failed -= 1
    if failed in (0, count):
        return ("none" if failed else "always"), None
    low, high = tried[failed - 1], tried[failed]
    return "finite", bisected(lambda dt: not grows_in_runs(acting, at, integrator, dt), low, high, NARROWED)


def grows_in_runs(
    acting: Acting, at: Posture, integrator: str, dt: float, steps: int = NARROWED_STEPS
) -> bool:
    """Whether a small random deviation from rest grows in a run."""
    sizes = []
    with np.errstate(over="ignore", invalid="ignore"):
        for off in run_parts(acting, at, integrator, dt, steps):
            sizes.append(np.linalg.norm(off, axis=1).max())
            if not sizes[-1] <= GROWN_FAR:  # or no number
                return True
    return max(sizes[3 * RUN_PARTS // 4 :]) > GROWN_STILL * max(1.0, *sizes[: RUN_PARTS // 2])


def is_shown(at: Posture, integrator: str, dt: float) -> bool:
    """Whether a run shows that something grows 1 % beyond a limit."""
    growth = at.small.growth(integrator, (1.0 + OBSERVED_WITHIN) * dt)
    return at.small.pole_limit(integrator)[0] <= dt or growth ** (NARROWED_STEPS // 2) > GROWN_STILL


def run_parts(acting: Acting, at: Posture, integrator: str, dt: float, steps: int) -> Iterator[np.ndarray]:
    """Deviations in each part of a run, (steps, n), in units of that at its start.

    The square of their length is dx' M dx, of which no swing makes more than it was. At the start each joint has its part of it,
    by chance, and so have activations of filters. A free base moves so that there is no momentum, and is not measured.
    """
    times = SOFTLY if acting.is_coupled else 1.0
    rng, kept = np.random.default_rng(SEED), at.kept
    M = at.whole.M
    inner = np.linalg.inv(np.linalg.inv(M)[np.ix_(kept, kept)])  # of the joints where the base gives way
    root = np.linalg.cholesky(0.5 * (inner + inner.T))
    inertia = np.diag(inner)
    each = times * np.clip(MOVED_BY * np.sqrt(np.median(inertia) / inertia), MOVED_LEAST, MOVED_MOST)
    movement, speed = np.zeros((2, len(M)))
    allowed = at.small.meeting
    together = (1.0 - APART) * allowed @ allowed.T + APART * np.eye(len(kept))
    movement[kept] = together @ (each * rng.uniform(-1.0, 1.0, len(kept)))
    # what nothing pulls back drifts no farther in the run than it was moved
    speed[kept] = together @ (each * rng.uniform(-1.0, 1.0, len(kept))) / (steps * dt)
    base = np.setdiff1d(np.arange(len(M)), kept)
    speed[base] = -np.linalg.solve(M[np.ix_(base, base)], M[np.ix_(base, kept)] @ speed[kept])
    start = np.linalg.norm(movement[kept] @ root)
    parts = [steps // RUN_PARTS] * RUN_PARTS
    for off in acting.deviations(at.q, at.u, dt, integrator, parts, movement, speed, times * MOVED_BY):
        filters = off[:, len(M) :] / (times * MOVED_BY * np.sqrt(max(1, off.shape[1] - len(M))))
        yield np.hstack([off[:, kept] @ (root / start), filters])
