"""Changes that make a step stable: another integrator, less kv, more armature; each is tried in MuJoCo."""

from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ....engines.mujoco.acting import Acting
from ....engines.mujoco.names import INTEGRATORS
from ....truth.driven import Posture
from ....truth.step_limits import Small, bisected
from . import observed

CHANGE_SPARE = 1.01  # of the step: so far above it a change must hold by the prediction
CHANGE_BISECTED = 1e-3  # of a change: its relative accuracy
CHANGE_HEAVIER = 100.0  # fold, of the armature that a joint would need if it were alone
CHANGE_ROUNDED = 0.995, 1.005  # fold: rounding to three digits neither raises a cap nor lowers a floor


class Lift(NamedTuple):
    """A change with which nothing grows in a run at the step.

    kind: integrator; kv, the largest speed gains of the named actuators; armature, the smallest of the named joints.
    """

    kind: str
    names: tuple[str, ...]
    values: tuple[
        float, ...
    ] = ()  # kv, N m s/rad or N s/m over the gear squared; armature, kg m2 or kg; integrator: ()


def lifts(acting: Acting, at: Posture, integrator: str, dt: float) -> list[Lift]:
    """What makes the step dt, s, stable: other integrators, and with this one less kv or more armature."""
    others = [
        Lift("integrator", (name,)) for name in INTEGRATORS if name != integrator and at.small.is_stable(name, dt)
    ]
    found = [other for other in others if not observed.grows_in_runs(acting, at, other.names[0], dt)]
    for lift, changed in filter(None, (less_damping(acting, at, integrator, dt), heavier(acting, at, integrator, dt))):
        if not observed.grows_in_runs(changed, at, integrator, dt):
            found.append(lift)
    return found


def less_damping(acting: Acting, at: Posture, integrator: str, dt: float) -> tuple[Lift, Acting] | None:
    """One cap of all kv, relative to the inertia along the length of each actuator: those above it change."""
    small, actuators = at.small, at.robot.drive.actuators
    moments = at.driven.along(at.q).moments[: len(at.u), at.kept]
    ease = np.einsum("ki,ik->k", moments, np.linalg.solve(small.M, moments.T))  # 1 over the inertia along each length
    able = [one.acts and i not in at.cut and not one.gain[2] for i, one in enumerate(actuators)] & (ease > 0.0)
    now = np.array([max(one.damping(u), 0.0) for one, u in zip(actuators, at.u)]) * able

    def capped(share: float) -> np.ndarray:
        return np.minimum(now, share / (dt * np.where(able, ease, 1.0)))

    def with_kv(kv: np.ndarray) -> Small:
        less = moments.T @ ((now - kv)[:, None] * moments)
        return replace(small, D=small.D - less, brakes=small.brakes - less)

    share = largest_change(lambda share: with_kv(capped(share)), integrator, dt, float((now * ease).max() * dt))
    if not share:
        return None
    chosen = np.flatnonzero(capped(share) < now)
    kv = {int(i): float(f"{CHANGE_ROUNDED[0] * capped(share)[i]:.3g}") for i in chosen}
    return Lift("kv", tuple(actuators[i].name for i in kv), tuple(kv.values())), acting.changed(damping=kv)


def heavier(acting: Acting, at: Posture, integrator: str, dt: float) -> tuple[Lift, Acting] | None:
    """One floor of all armature, relative to what each joint needs if it were alone: those below it change."""
    small, names = at.small, at.small.names
    explicit = small.D - small.braking(integrator)
    needed = (dt * dt * np.abs(np.diag(small.K)) + 2.0 * dt * np.abs(np.diag(explicit))) / 4.0
    needed = np.where([name in at.robot.coordinates.names for name in names], needed, 0.0)
    has = 1.0 / np.diag(np.linalg.inv(small.M))

    def added(lighter: float) -> np.ndarray:
        return np.maximum(CHANGE_HEAVIER / lighter * needed - has, 0.0)

    def with_armature(lighter: float) -> Small:
        return replace(small, M=small.M + np.diag(added(lighter)))

    lighter = largest_change(with_armature, integrator, dt, 100.0 * CHANGE_HEAVIER, least=1.0)
    if not lighter:
        return None
    chosen, own = np.flatnonzero(added(lighter)), acting.model.dof_armature[at.kept]
    total = {k: float(f"{CHANGE_ROUNDED[1] * (own[k] + added(lighter)[k]):.3g}") for k in chosen}
    changed = acting.changed(armature={at.kept[k]: float(a - own[k]) for k, a in total.items()})
    return Lift("armature", tuple(names[k] for k in chosen), tuple(total.values())), changed


def largest_change(changed: Callable, integrator: str, dt: float, most: float, least: float = 0.0) -> float | None:
    """The largest number up to `most` with which the changed equations are stable at dt; None: not even with the least."""

    def holds(number: float) -> bool:
        return changed(number).is_stable(integrator, CHANGE_SPARE * dt)

    if not holds(least):
        return None
    return bisected(holds, least, most, CHANGE_BISECTED)
