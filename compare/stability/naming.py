"""The joint and the contact of a mode: where most of its motion is."""

from typing import NamedTuple

import numpy as np

from ..engines.mujoco.forces import rows_at
from ..engines.mujoco.names import contact_name
from .growth import Growth
from .place import Place
from .rest import Rest

SHARE = 0.1  # of the energy of a mode: what a contact has more of takes part


class Limiting(NamedTuple):
    """joint: the speed with most of the kinetic energy of a mode, "" if none grows; contact: what it moves against, or ""."""

    joint: str
    contact: str


def limiting(place: Place, rest: Rest, growth: Growth) -> Limiting:
    """What a mode moves: the speed with most of its kinetic energy w' M w, and the contact that takes most of it in a step.

    A contact takes (J w)' (J M^-1 J' + R)^-1 (J w): the part of w that the solver would stop at once.
    """
    nv = rest.step.model.nv
    w = growth.shape[nv : 2 * nv]
    if not np.abs(w).max(initial=0.0) > 0.0:
        return Limiting("", "")
    M, rows = rows_at(rest.step, rest.state)
    energies = np.abs(w.conj() * (M @ w))
    joint = place.speed_names[int(np.argmax(energies))]
    contact, most = "", SHARE * float(np.abs(w.conj() @ M @ w))
    for number in sorted(set(rows.contact.tolist()) - {-1}):
        J, R = rows.J[rows.contact == number], rows.R[rows.contact == number]
        against = J @ w
        taken = float(
            np.abs(against.conj() @ np.linalg.solve(J @ np.linalg.solve(M, J.T) + np.diag(R), against))
        )
        if taken > most:
            contact, most = contact_name(rest.step.model, rest.step.data, number), taken
    return Limiting(joint, contact)
