"""Changes that make a step stable: another integrator, less kv, more armature; each is tried in MuJoCo."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from ....engines.mujoco import Reading
from ....engines.mujoco.acting import Acting
from ....engines.mujoco.names import INTEGRATORS
from ....truth.driven import Posture
from ....truth.step_limits import Small, bisected
from .observed import grows_in_runs
from .predicted import acting_at

CHANGE_SPARE = 1.01  # of the step: so far above it a change must hold by the prediction
CHANGE_BISECTED = 1e-3  # of a change: its relative accuracy
CHANGE_HEAVIER = 100.0  # fold, of the armature that a joint would need if it were alone
CHANGE_ROUNDED = 0.995, 1.005  # fold: rounding to three digits neither raises a cap nor lowers a floor


def lifts(at: Posture, integrator: str, reading: Reading) -> dict[str, list]:
    """What makes the file's step stable: other integrators, and with this one less kv or more armature.

    kv: (actuator, the largest speed gain in N m s/rad or N s/m over the gear squared, ""). armature: (joint, the smallest, its
    unit), rad for kg m2, m for kg.
    """
    acting, dt = acting_at(reading, at), reading.dt
    others = [name for name in INTEGRATORS if name != integrator and at.small.is_stable(name, dt)]
    found = {"integrators": [name for name in others if not grows_in_runs(acting, at, name, dt)]}
    for kind, change in (("kv", less_damping), ("armature", heavier)):
        numbers, changed = change(acting, at, integrator, dt)
        found[kind] = [] if not numbers or grows_in_runs(changed, at, integrator, dt) else numbers
    return found


def less_damping(acting: Acting, at: Posture, integrator: str, dt: float) -> tuple[list, Acting]:
    """One cap of all kv, relative to the inertia along the length of each actuator: those above it change."""
    small, actuators = at.small, at.robot.drive.actuators
    moments = at.driven.along(at.q).moments[: len(at.u), at.kept]
    ease = np.einsum(
        "ki,ik->k", moments, np.linalg.solve(small.M, moments.T)
    )  # 1 over the inertia along each length
    able = [one.acts and i not in at.cut and not one.gain[2] for i, one in enumerate(actuators)] & (
        ease > 0.0
    )
    now = np.array([max(one.damping(u), 0.0) for one, u in zip(actuators, at.u)]) * able

    def capped(share: float) -> np.ndarray:
        return np.minimum(now, share / (dt * np.where(able, ease, 1.0)))

    def with_cap(share: float) -> Small:
        less = moments.T @ ((now - capped(share))[:, None] * moments)
        return replace(small, D=small.D - less, brakes=small.brakes - less)

    share = largest_change(with_cap, integrator, dt, 0.0, float((now * ease).max() * dt))
    kv = CHANGE_ROUNDED[0] * capped(share)
    chosen = {int(i): float(f"{kv[i]:.3g}") for i in np.flatnonzero(capped(share) < now)} if share else {}
    return [(actuators[i].name, value, "") for i, value in chosen.items()], acting.changed(damping=chosen)


def heavier(acting: Acting, at: Posture, integrator: str, dt: float) -> tuple[list, Acting]:
    """One floor of all armature, relative to what each joint needs if it were alone: those below it change."""
    small, coordinates = at.small, at.robot.coordinates
    explicit = small.D - small.braking(integrator)
    needed = (dt * dt * np.abs(np.diag(small.K)) + 2.0 * dt * np.abs(np.diag(explicit))) / 4.0
    needed = np.where([name in coordinates.names for name in small.names], needed, 0.0)
    has = 1.0 / np.diag(np.linalg.inv(small.M))

    def added(lighter: float) -> np.ndarray:
        return np.maximum(CHANGE_HEAVIER / lighter * needed - has, 0.0)

    def with_armature(lighter: float) -> Small:
        return replace(small, M=small.M + np.diag(added(lighter)))

    lighter = largest_change(with_armature, integrator, dt, 1.0, 100.0 * CHANGE_HEAVIER)
    own = acting.model.dof_armature[at.kept]
    chosen = np.flatnonzero(added(lighter)) if lighter else ()
    total = {k: float(f"{CHANGE_ROUNDED[1] * (own[k] + added(lighter)[k]):.3g}") for k in chosen}
    changed = acting.changed(armature={at.kept[k]: float(a - own[k]) for k, a in total.items()})
    return [(small.names[k], a, coordinates.units[at.kept[k]]) for k, a in total.items()], changed


def largest_change(changed: Callable, integrator: str, dt: float, least: float, most: float) -> float:
    """The largest number up to `most` with which the changed equations are stable at dt; 0: not even with the least."""

    def holds(number: float) -> bool:
        return changed(number).is_stable(integrator, CHANGE_SPARE * dt)

    return bisected(holds, least, most, CHANGE_BISECTED) if holds(least) else 0.0
