"""A and B where a file stands on its contacts, with everything on: which eps agree, and what no control moves."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import groupby, pairwise

import numpy as np

from ...core.rows import Row
from ...engines.mujoco.motion import acting
from ...engines.mujoco.names import element_name, kind_of
from ...engines.mujoco.reading import Reading
from ...engines.mujoco.stepper import Stepper
from ...judge.scale import EPS, FACTOR
from ...stability.motion import postures_of
from .ways import SIZES, Array, number, worst_block

DURATION, MOST_STEPS = 1.0, 5000  # s and steps, in which the state is looked for
AGREES = 0.01  # of the largest entry of a block: extrapolated derivatives that are the same
FEWEST = 3  # neighbouring eps that have to agree
GROWS = 1e-3  # an eigenvalue that is nearer to 1 is 1, as a double one is known to the root of an error
SMALL = 1e-3  # of the speeds in a direction: tangents that count
AXES = {"free": ("x", "y", "z", "turn x", "turn y", "turn z"), "ball": ("turn x", "turn y", "turn z")}


@dataclass
class ContactRow(Row):
    """Centred differences of the step of a robot that stands."""

    posture: str
    acting: str
    eps: float
    error: float | None  # from what agrees over eps; None: nothing does
    changed: str  # what opens, closes or begins to act within eps


class Standing:
    """The state in the first second from the first posture in which a file accelerates least on contacts or limits.

    stands: at no state without them does it accelerate less.
    """

    def __init__(self, reading: Reading) -> None:
        posture = postures_of(reading)[0]
        self.name, self.stepper = posture.name, Stepper(reading.model, reading.dt, reading.integrator)
        state, least, self.acting = self.stepper.start(posture.key), np.inf, set[str]()
        self.state, stillest = state, np.inf
        for data in self.stepper.watch(state, min(MOST_STEPS, round(DURATION / reading.dt))):
            size = float(np.abs(data.qacc).max(initial=0.0))
            stillest = min(stillest, size)
            if size < least and (found := acting(self.stepper.model, data)):
                least, self.state, self.acting = size, state, found
            state = self.stepper.state()
        self.stands = bool(self.acting) and least <= stillest

    def values(self, eps: float) -> Array:
        """[A B] by tangents, speeds, activations and controls, centred: (n, n + nu), n = 2 nv + na."""
        return np.hstack(self.stepper.derivative(self.state, eps))

    def rows(self) -> tuple[list[ContactRow], Array | None]:
        """A row for each eps, and what is taken for the true A and B."""
        values, halved = ([self.values(eps / part) for eps in SIZES] for part in (1.0, 2.0))
        errors, truth = errors_of(values, halved, self.stepper.model.nv)
        names, rows = "; ".join(sorted(self.acting)), list[ContactRow]()
        for eps, error in zip(SIZES, errors):
            rows.append(
                ContactRow(self.name, names, eps, number(error), "; ".join(sorted(self.changed_by(eps))))
            )
        return rows, truth

    def changed_by(self, eps: float) -> set[str]:
        """What acts otherwise where a position is moved by eps."""
        m, changed = self.stepper.model, set[str]()
        for by in eps * np.vstack([np.eye(m.nv, 2 * m.nv + m.na), -np.eye(m.nv, 2 * m.nv + m.na)]):
            changed |= acting(m, self.stepper.forward(self.state, by)) ^ self.acting
        return changed


def errors_of(values: Sequence[Array], halved: Sequence[Array], nv: int) -> tuple[list[float], Array | None]:
    """The errors of derivatives by neighbouring eps, and the truth: what agrees over their widest range.

    values, halved: with each eps and half of it. Richardson's extrapolation takes the term in eps^2 away;
    what is then the same for FEWEST neighbours is true, where they agree best. An error is that from both of
    these, as one is made of the same values. inf for all, and None: nothing agrees.
    """
    finer = [half + (half - value) / 3.0 for value, half in zip(values, halved)]
    apart = [worst_block(one - other, one, nv)[0] for one, other in pairwise(finer)]
    runs = [list(run) for agrees, run in groupby(range(len(apart)), lambda k: apart[k] <= AGREES) if agrees]
    widest = max(runs, key=len, default=[])
    if len(widest) + 1 < FEWEST:
        return [np.inf] * len(values), None
    best = min(widest, key=lambda k: apart[k])
    truths = finer[best], finer[best + 1]
    return [max(worst_block(value - truth, truth, nv)[0] for truth in truths) for value in values], truths[0]


def not_moved(values: Array, truth: Array, units: Array) -> Array:
    """The directions that no control moves and that do not decay: left vectors w, (k, n), w' A = l w', w' B = 0.

    Those that stay, at l = 1, then those that grow. units: of the state, speeds in units of a step, (n,). A
    singular value of [A - l, B] that is no larger than the norm of the error of values may be zero (Weyl).
    """
    n, by_input = len(values), units[:, None] * values[:, len(values) :]
    A, B = (
        units[:, None] * values[:, :n] / units,
        by_input / max(np.abs(by_input).max(), np.finfo(float).tiny),
    )
    error = units[:, None] * (values - truth)[:, :n] / units
    least, found = np.linalg.norm(error, 2) + FACTOR * EPS * np.linalg.norm(A, 2), list[Array]()
    eigenvalues = np.linalg.eigvals(A)
    for value in (1.0, *eigenvalues[np.abs(eigenvalues) > 1.0 + GROWS]):
        vectors, sizes, _ = np.linalg.svd(np.hstack([A - value * np.eye(n), B]))
        found += [np.abs(vectors[:, k]) for k in np.flatnonzero(sizes <= least)]
    return np.array(found).reshape(-1, n)


def directions(stepper: Stepper, vectors: Array) -> list[str]:
    """The joints that have most part in each direction; of a free one and a ball also along or about which axis."""
    m, names = stepper.model, list[str]()
    for vector in vectors:
        moved, speeds = vector[: m.nv], vector[m.nv : 2 * m.nv]
        part, directed = moved if moved.max() > SMALL * speeds.max() else speeds, []
        for dof in np.flatnonzero(part >= 0.5 * part.max()).tolist():
            joint = m.dof_jntid[dof]
            axis = AXES.get(kind_of(m, joint), [""])[dof - m.jnt_dofadr[joint]]
            directed.append(f"{element_name(m, 'joint', joint)} {axis}".strip())
        names.append(" with ".join(directed))
    return names
