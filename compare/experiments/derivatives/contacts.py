"""A robot that stands: differences of its step with all contacts on, beside the closed form, which holds where contacts stay."""

from dataclasses import dataclass

import numpy as np

from ...core.rows import Row
from ...engines.mujoco.differences import touching
from ...engines.mujoco.forces import forces_near
from ...engines.mujoco.reading import Reading
from ...engines.mujoco.step import Step
from ...stability.closed_form import COVERED, matrix
from ...stability.place import postures_of, standing_at
from ...stability.rest import rest_near
from .ways import SIZES, relative, units_of_speeds


@dataclass(kw_only=True)
class ContactRow(Row):
    """Centred differences of the step of a robot that stands."""

    posture: str
    integrator: str
    contacts: int  # in which forces act
    eps: float
    difference: (
        float | None
    )  # from the closed form, relative to its largest entry of the same unit; None: there is no closed form
    changed: str  # pairs that open or close within eps; "": contacts stay


def contact_rows(reading: Reading) -> list[ContactRow]:
    """For each eps, where the file's first posture sinks to; none where nothing touches it there."""
    posture = postures_of(reading)[0]
    place = standing_at(reading, posture)
    if not place.is_touching:
        return []
    integrator = reading.integrator if reading.integrator in COVERED else "implicitfast"
    step = Step(place.model, float(place.model.opt.timestep), integrator)
    rest = rest_near(step, place.rest)
    forces, nv = forces_near(step, rest.state), place.model.nv
    closed = None if forces is None else matrix(rest, place.tree, forces)[: 2 * nv, : 2 * nv]
    units = units_of_speeds(place.tree, 2)
    base = touching(step, rest.state, np.zeros(step.size))
    rows = []
    for eps in SIZES:
        A = step.derivative(rest.state, eps)[: 2 * nv, : 2 * nv]
        ends = [
            touching(step, rest.state, by) for by in (*np.eye(step.size) * eps, *np.eye(step.size) * -eps)
        ]
        changed = sorted(set().union(*(base ^ end for end in ends)))
        off = None if closed is None else relative(A - closed, closed, (units, units))
        rows.append(ContactRow(
            posture=posture.name, integrator=integrator, contacts=len(base), eps=eps,
            difference=off if off is not None and np.isfinite(off) else None, changed="; ".join(changed),
        ))  # fmt: skip
    return rows
