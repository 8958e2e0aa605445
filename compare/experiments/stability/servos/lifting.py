"""Changes that lift the step limit: another integrator, less kv, more armature; each is tried in MuJoCo."""

from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ....engines.mujoco.acting import Acting
from ....engines.mujoco.names import INTEGRATORS
from ....truth.driven import Posture
from ....truth.step_limits import Limit, Small
from . import observed

CHANGE_SPARE = 1.01  # of the step: so far above it a change must hold by the prediction
CHANGE_BISECTED = 1e-3  # of the range of a change
CHANGE_HEAVIER = 100.0  # fold, of the armature that a joint would need if it were alone
CHANGE_DIGITS = 2  # of the numbers that are proposed


class Lift(NamedTuple):
    """One change, all of whose parts are needed.

    kind: integrator; kv, the largest speed gains of the named actuators; armature, the smallest of the named joints.
    """

    kind: str
    names: tuple[str, ...]  # of an integrator, of actuators, of joints
    values: tuple[float, ...]  # kv, N m s/rad or N s/m over the gear squared; armature, kg m2 or kg; integrator: ()
    limit: Limit  # with it
    factor: float | None  # of the limit over the one before; None: it has none up to 5 s
    tried: bool  # nothing grew in a run at the file's step


def lifts(acting: Acting, at: Posture, base: str, integrator: str, dt: float) -> list[Lift]:
    """What lifts the limit of an integrator, each tried at dt, s; kv and armature only where dt itself is unstable."""
    small = at.small(base)
    now = small.limit(integrator)
    if now.limit != "finite":
        return []
    found = []
    for other in INTEGRATORS:
        changed = small.limit(other)
        if (changed.dt or np.inf) > max(now.dt, dt) and other != integrator:
            found.append(Lift("integrator", (other,), (), *lifted(now, changed), holds(acting, at, other, dt)))
    if now.dt < dt:
        found += [
            *less_damping(acting, at, small, now, integrator, dt),
            *heavier(acting, at, small, now, integrator, dt),
        ]
    return found


def less_damping(acting: Acting, at: Posture, small: Small, now: Limit, integrator: str, dt: float) -> list[Lift]:
    """The largest kv of as few actuators as it takes; []: none is small enough."""
    along, kept = at.driven.along(at.q), observed.measured_speeds(acting, at)
    moments = along.moments[: len(at.u), kept]
    ease = np.einsum("ki,ik->k", moments, np.linalg.solve(small.M, moments.T))  # 1 over the inertia along each length
    now_kv = np.zeros(len(at.u))
    for i, (one, u) in enumerate(zip(at.robot.drive.actuators, at.u)):
        if one.acts and i not in at.cut.forces and not one.gain[2]:
            now_kv[i] = max(one.damping(u), 0.0)
    able = np.flatnonzero((now_kv > 0.0) & (ease > 0.0))
    if not len(able):
        return []

    def capped(share: float, chosen) -> np.ndarray:
        kv = now_kv.copy()
        kv[chosen] = np.minimum(kv[chosen], share / (dt * ease[chosen]))
        return kv

    def with_kv(kv: np.ndarray) -> Small:
        less = moments.T @ ((now_kv - kv)[:, None] * moments)
        return replace(small, D=small.D - less, uncut=small.uncut - less, brakes=small.brakes - less)

    def is_stable(share: float, chosen) -> bool:
        return stable(with_kv(capped(share, chosen)), integrator, CHANGE_SPARE * dt)

    most = 1.01 * float((now_kv * ease)[able].max() * dt)
    if (found := needed_changes(lambda left, chosen: is_stable(most - left, chosen), able, most)) is None:
        return []
    chosen, left = found
    kv = capped(most - left, chosen)
    kv[chosen] = [rounded(value, np.floor) for value in kv[chosen]]
    tried = acting.changed(damping={int(i): kv[i] for i in chosen})
    names = tuple(at.robot.drive.actuators[i].name for i in chosen)
    return [Lift("kv", names, tuple(map(float, kv[chosen])), *lifted(now, with_kv(kv).limit(integrator)),
                 holds(tried, at, integrator, dt))]  # fmt: skip


def heavier(acting: Acting, at: Posture, small: Small, now: Limit, integrator: str, dt: float) -> list[Lift]:
    """The least armature on as few joints as it takes; []: none is large enough."""
    kept, coordinates = observed.measured_speeds(acting, at), at.robot.coordinates
    explicit = small.D - small.braking(integrator)
    # inertia that a joint needs if it is alone, and its own
    needed = (dt * dt * np.abs(np.diag(small.K)) + 2.0 * dt * np.abs(np.diag(explicit))) / 4.0
    has = 1.0 / np.diag(np.linalg.inv(small.M))
    able = np.flatnonzero([name in coordinates.names for name in small.names] & (needed > 0.0))

    def added(share: float, chosen) -> np.ndarray:
        more = np.zeros(len(has))
        more[chosen] = np.maximum(share * needed[chosen] - has[chosen], 0.0)
        return more

    def is_stable(share: float, chosen) -> bool:
        return stable(replace(small, M=small.M + np.diag(added(share, chosen))), integrator, CHANGE_SPARE * dt)

    if (found := needed_changes(is_stable, able, CHANGE_HEAVIER)) is None:
        return []
    chosen, share = found
    own = acting.model.dof_armature[kept]
    total = np.array([rounded(value, np.ceil) for value in (own + added(share, chosen))[chosen]])
    more = total - own[chosen]
    tried = acting.changed(armature={kept[k]: float(a) for k, a in zip(chosen, more)})
    changed = replace(small, M=small.M + np.diag(np.bincount(chosen, more, len(has))))
    names = tuple(small.names[k] for k in chosen)
    return [Lift("armature", names, tuple(map(float, total)), *lifted(now, changed.limit(integrator)),
                 holds(tried, at, integrator, dt))]  # fmt: skip


def needed_changes(is_stable: Callable, able: np.ndarray, most: float) -> tuple[np.ndarray, float] | None:
    """Which of those that can be changed must be, and by the least share that does it, up to `most`; None: none does."""

    def least(chosen, high) -> float:
        low = 0.0
        while high - low > CHANGE_BISECTED * high:
            middle = 0.5 * (low + high)
            low, high = (low, middle) if is_stable(middle, chosen) else (middle, high)
        return high

    if not is_stable(most, able):
        return None
    share, chosen = least(able, most), able
    for one in able:
        fewer = chosen[chosen != one]
        if len(fewer) and is_stable(share, fewer):
            chosen = fewer
    return chosen, least(chosen, share)


def stable(small: Small, integrator: str, dt: float) -> bool:
    """Whether a step is stable, in closed form where there is one."""
    if not small.has_closed_form(integrator):
        return small.is_stable(integrator, dt)
    return small.holds(integrator, dt) and all(dt < most for most, _ in small.pole_limits(integrator))


def lifted(now: Limit, changed: Limit) -> tuple[Limit, float | None]:
    """The limit with a change, and how much longer a step it allows."""
    return changed, changed.dt / now.dt if changed.dt else None


def holds(acting: Acting, at: Posture, integrator: str, dt: float) -> bool:
    """Whether nothing grows in a run."""
    return not observed.grows_in_runs(acting, at, integrator, dt)


def rounded(value: float, way: Callable) -> float:
    """To a few digits, upwards or downwards."""
    if not value:
        return 0.0
    power = 10.0 ** (np.floor(np.log10(abs(value))) - CHANGE_DIGITS + 1)
    return float(f"{way(value / power) * power:.{CHANGE_DIGITS}g}")
