"""Changes that make a step stable: of the file's gains, armature and contacts; each is tried in a run."""

from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

import mujoco

from ..engines.mujoco import variants
from .limits import bisected, tried
from .runs import PUSHES, Runs

SPARE = 1.01  # of the step: so far above it a change must hold
WITHIN = 1.05  # fold: how closely the least change is found


class Change(NamedTuple):
    """A kind of change: its strength is a factor, the least of which is sought from `first` to `most`."""

    name: str  # its macro
    made: Callable[[mujoco.MjModel, float], mujoco.MjModel | None]  # None: the model has nothing to change
    first: float
    most: float


class Cure(NamedTuple):
    """A change that makes a step stable. change: the name of a Change; factor: its least strength."""

    change: str
    factor: float


CHANGES = (
    Change("less_kv", lambda model, factor: variants.with_kv(model, 1.0 / factor), 1.1, 1e3),
    Change("more_armature", variants.with_armature, 1e-3, 1e3),
    Change("slower_contacts", variants.with_slower_contacts, 1.1, 50.0),
    Change("more_impratio", variants.with_impratio, 2.0, 1e3),
    Change("other_cone", variants.with_other_cone, 1.0, 1.0),
)


def cures(shown: Runs, dt: float) -> list[Cure]:
    """The least change of each kind that makes a step stable, by its derivative and in a run. shown: runs of the model."""
    return [
        Cure(change.name, factor)
        for change in CHANGES
        if (factor := least_factor(change, shown, dt)) is not None
    ]


def least_factor(change: Change, shown: Runs, dt: float) -> float | None:
    """The least strength of a change that holds; None: the model has nothing to change, or none holds."""

    def holds(factor: float) -> bool:
        changed = change.made(shown.model, factor)
        return changed is not None and tried(changed, shown.state, SPARE * dt, shown.integrator).is_stable

    if not holds(change.most):
        return None
    high = bisected(lambda factor: not holds(factor), change.first, change.most, WITHIN)[1]
    changed = change.made(shown.model, high)
    return high if changed and replace(shown, model=changed).survives(PUSHES[-1], dt) else None
