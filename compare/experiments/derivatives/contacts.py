"""A robot that stands: differences of its step with all contacts on, beside the closed form, which holds where contacts stay."""

import numpy as np

from ...engines.mujoco.differences import touching
from ...engines.mujoco.forces import forces_near
from ...engines.mujoco.reading import Reading
from ...engines.mujoco.step import Step
from ...stability.answer import postures_of
from ...stability.closed_form import COVERED, matrix
from ...stability.place import standing_at
from ...stability.rest import rest_near
from .tables import ContactRow
from .ways import SIZES, STATE, relative, units_of


def contact_rows(reading: Reading) -> list[ContactRow]:
    """For each eps, where the file's first posture sinks to; none where nothing touches it there."""
    posture = postures_of(reading)[0]
    place = standing_at(reading, posture.name, posture.key)
    if not place.touching:
        return []
    integrator = reading.integrator if reading.integrator in COVERED else "implicitfast"
    step = Step(place.model, float(place.model.opt.timestep), integrator)
    rest = rest_near(step, place.rest)
    forces, states = forces_near(step, rest.state), 2 * place.model.nv
    closed = None if forces is None else matrix(rest, place.tree, forces)[:states, :states]
    units = units_of(place.tree, STATE)
    base = touching(step, rest.state, np.zeros(step.size))
    rows = []
    for eps in SIZES:
        changed: set[str] = set()
        for nudge in eps * np.eye(step.size):
            for by in (nudge, -nudge):
                changed |= base ^ touching(step, rest.state, by)
        A, difference = step.derivative(rest.state, eps)[:states, :states], None
        if closed is not None:
            error, *_ = relative(A - closed, closed, (units, units))
            difference = error if np.isfinite(error) else None
        rows.append(ContactRow(
            posture=posture.name, integrator=integrator, contacts=len(base), eps=eps, difference=difference,
            changed="; ".join(sorted(changed)),
        ))  # fmt: skip
    return rows
