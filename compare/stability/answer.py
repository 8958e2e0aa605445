"""The answer for a file: rows of limits at its postures, by the derivative of its step, in closed form and in runs."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from ..core.rows import Row, column
from ..engines.mujoco.forces import rows_at
from ..engines.mujoco.names import INTEGRATORS, contact_name
from ..engines.mujoco.reading import Reading
from ..engines.mujoco.variants import stands
from . import runs
from .closed_form import radius_apart
from .cures import Cure, cures
from .growth import Growth
from .limits import LONGEST, Curve, Limit, limit, tried
from .place import MOVING, Place, Posture, in_the_air_at, standing_at
from .rest import SETTLED, Rest
from .start import StartRuns

UNHELD = 0.99  # of a limit: lower ones without dry friction
SHARE = 0.1  # of the energy of a mode: what a contact has more of takes part


def step_column(digits: int = 4, **more: Any) -> Any:
    """A field with a time step, s."""
    return column("s", digits=digits, **more)


@dataclass(kw_only=True)
class StepLimitRow(Row):
    """The step limit of an integrator at a posture: step_limits.csv.

    limit: finite, none, below, saddle, or no_rest, see limits.Limit; moving, it moves on where others rest.
    observed_dt, failing_dt: the longest step at which runs hold and the shortest at which they fail; failing_dt alone is None
    where they hold up to the longest that is tried.
    start_dt: the longest step up to which a run from the posture itself comes to rest where it rests, where that is lower.
    limiting_joint, limiting_contact: of the mode that grows beyond predicted_dt; where runs decide, of no limit but that.
    smooth_dt: the limit without dry friction, where that is lower. growth: per step, at the file's step; apart: in closed form
    minus that. growth_rate: just beyond the limit; of a saddle that of its fall. finer_push: whether a finer step bears no
    larger push, asked below the usual push. moved: from the posture to the rest. has_fallen: by a free body.
    held_objects: loose objects that move on, held where they are. Speeds are in rad/s or m/s, movements in rad or m.
    """

    posture: str
    base: str  # fixed, free
    surroundings: str  # contact; free, nothing touches; air, contacts off
    integrator: str
    limit: str
    predicted_dt: float | None = step_column()
    observed_dt: float | None = step_column(default=None)
    failing_dt: float | None = step_column(default=None)
    start_dt: float | None = step_column(default=None)
    smooth_dt: float | None = step_column(default=None)
    file_dt: float = column("s")
    file_integrator: str
    stable_at_file_dt: bool | None = None
    limiting_joint: str = ""
    limiting_contact: str = ""
    growth_rate: float | None = column("per_s", default=None)
    growth: float | None = column(digits=8, default=None)
    apart: float | None = None
    largest_push: float | None = None
    finer_push: bool | None = None
    has_fallen: bool = False
    moved: float | None = None
    moved_joint: str = ""
    creep: float | None = None
    creeping_joint: str = ""
    held_objects: str = ""

    @property
    def is_known(self) -> bool:
        return self.limit in ("finite", "none", "below", "moving")

    @property
    def is_held_by_friction(self) -> bool:
        """Whether the limit is lower without dry friction, which holds small deviations at any step."""
        return self.smooth_dt is not None and self.smooth_dt < UNHELD * self.longest

    def needs_friction(self, dt: float) -> bool:
        """Whether a step, s, is stable by dry friction alone, as far as small deviations go."""
        return self.is_held_by_friction and (self.smooth_dt or 0.0) < dt <= self.longest

    @property
    def is_weak(self) -> bool:
        """Whether a usual push is borne by a finer step than that in use alone."""
        if self.largest_push is None or self.has_fallen or self.finer_push:
            return False
        return self.largest_push < runs.USUAL_PUSH

    @property
    def predicted(self) -> float:
        """The longest stable step by the derivative, s; inf: none fails."""
        return {"none": np.inf, "moving": np.inf, "below": 0.0}.get(self.limit, self.predicted_dt or 0.0)

    @property
    def decided_by_runs(self) -> bool:
        """Whether runs hold or fail elsewhere than at the limit of the derivative."""
        if not self.is_known or self.observed_dt is self.failing_dt is None:
            return False
        holds = (self.observed_dt or 0.0) >= 0.95 * min(self.predicted, LONGEST)
        return not (holds and (self.failing_dt or np.inf) <= 1.05 * self.predicted)

    @property
    def longest(self) -> float:
        """The longest stable step, s; inf: none fails. Runs have the last word."""
        if self.decided_by_runs:
            middle = float(np.sqrt((self.observed_dt or 0.0) * (self.failing_dt or 0.0)))
            return np.inf if self.failing_dt is None else middle
        return self.predicted


def integrators_at_rest() -> list[str]:
    """The integrators of the installed MuJoCo; without implicit, which at rest is implicitfast."""
    return [name for name in INTEGRATORS if name != "implicit"]


class PlaceAnswer(NamedTuple):
    """What is known of a place: a row of each integrator, curves of growth, what makes the file's step stable."""

    rows: list[StepLimitRow]
    curves: dict[str, Curve]
    cures: list[Cure]


class Asked(NamedTuple):
    """What is asked of a place. dt, s, integrator: of the step in use; drawn: with curves; in_runs: with what runs show."""

    dt: float
    integrator: str
    integrators: Sequence[str]
    drawn: bool = False
    in_runs: bool = True


def answers(posture: Posture, reading: Reading, asked: Asked, air: bool = True) -> list[PlaceAnswer]:
    """All that is asked of a posture: as it stands, and in the air if that is another place."""
    standing = standing_at(reading, posture)
    found, other = [answer(standing, asked)], in_the_air_at(standing) if air else None
    del standing  # its models take memory
    return [*found, answer(other, asked)] if other else found


def answer(place: Place, asked: Asked) -> PlaceAnswer:
    """All that is asked of a place."""
    rows, curves, changes = [], {}, []
    for integrator in asked.integrators:
        row, found = limit_row(place, integrator, asked)
        rows.append(row)
        if asked.drawn and row.is_known:
            curves[integrator] = found.curve
        if place.contacts and integrator == asked.integrator and row.stable_at_file_dt is False:
            changes = cures(runs_of(place, found, integrator, asked.dt), asked.dt)
    return PlaceAnswer(rows, curves, changes)


def limit_row(place: Place, integrator: str, asked: Asked) -> tuple[StepLimitRow, Limit]:
    """The limit of an integrator at a place, what the step in use does there, and the search for it."""
    model, dt = place.model, asked.dt
    found = limit(model, place.rest, integrator, dt)
    if found.kind == "saddle" and runs_of(place, found, integrator, dt).is_calm(runs.LIMIT_PUSHES[0], dt):
        # friction or a stop holds, or what grows remains small
        found = limit(model, place.rest, integrator, dt, found.growth.rate)
    at, moved, creep = found.first, np.abs(place.moved), np.abs(found.first.rest.speeds)
    joint, contact = limiting(place, found.rest, found.growth)
    row = StepLimitRow(
        posture=place.posture.name, base="free" if stands(place.reading.model) else "fixed",
        surroundings=place.surroundings, integrator=integrator, limit=found.kind,
        predicted_dt=found.dt, file_dt=dt, file_integrator=asked.integrator,
        limiting_joint=joint, limiting_contact=contact, growth_rate=found.growth.rate or None, growth=at.growth.factor,
        has_fallen=place.has_fallen, moved=float(moved.max()), moved_joint=place.speed_names[int(np.argmax(moved))],
        held_objects=place.held_objects,
    )  # fmt: skip
    if at.rest.is_found:  # else the speeds are those that Newton's method has tried
        row.creep, row.creeping_joint = float(creep.max()), place.speed_names[int(np.argmax(creep))]
    if at.rest.left <= SETTLED and not place.held_objects:
        row.apart = radius_apart(at.rest, place.tree)
    moves = found.kind == "no_rest" or (place.is_touching and place.creep > MOVING)
    if moves and found.kind != "saddle" and not place.falls:
        row.limit, row.predicted_dt = "moving", None
    is_asked = place.contacts or integrator == asked.integrator  # in the air the others have no use
    if row.is_known and is_asked:
        if asked.in_runs or row.limit == "moving":
            add_runs(row, place, found)
        add_smooth_limit(row, place)
    if row.is_known:
        row.stable_at_file_dt = dt <= row.longest
    if row.stable_at_file_dt and asked.in_runs and integrator == asked.integrator and row.limit != "moving":
        row.start_dt = (
            StartRuns(place.reading, place.posture, integrator, place).longest(dt, row.longest)
            if place.contacts
            else None
        )
    return row, found


def runs_of(place: Place, found: Limit, integrator: str, longest: float) -> runs.Runs:
    """Runs from the rest of a place. longest: s, a step that the derivative calls stable; fine ones are finer."""
    fine, first = min(longest / 2.0, max(longest / runs.FINER, runs.FINEST)), found.first
    creep = max(place.creep, np.abs(first.rest.speeds).max(initial=0.0) if first.is_stable else 0.0)
    return runs.Runs(place.model, place.rest, integrator, fine, first.rest.is_held, creep)


def add_runs(row: StepLimitRow, place: Place, found: Limit) -> None:
    """What runs show; they have the last word."""
    shown = runs_of(place, found, row.integrator, min(row.file_dt, row.predicted or LONGEST))
    if row.limit == "moving":
        shown = replace(shown, is_held=np.zeros_like(shown.is_held), creep=0.0)
        row.creep = shown.fine_speed(runs.LIMIT_PUSHES[0])
        row.creeping_joint = place.speed_names[int(np.argmax(np.abs(place.speeds)))]
    row.observed_dt, row.failing_dt = shown.limit(row.file_dt, row.predicted or np.inf)
    if row.limit != "moving" and row.file_dt <= row.longest:
        row.largest_push, row.finer_push = shown.largest_push(row.file_dt)


def add_smooth_limit(row: StepLimitRow, place: Place) -> None:
    """The limit without dry friction, if that is lower."""
    longest = min(row.longest, LONGEST)
    if place.frictionless is None or not longest:
        return
    if not tried(place.frictionless, place.rest, UNHELD * longest, row.integrator).is_stable:
        row.smooth_dt = limit(place.frictionless, place.rest, row.integrator, row.file_dt).dt


def limiting(place: Place, rest: Rest, growth: Growth) -> tuple[str, str]:
    """What a mode moves: the speed with most of its kinetic energy w' M w, and the contact that takes most of it in a step.

    A contact takes (J w)' (J M^-1 J' + R)^-1 (J w): the part of w that the solver would stop at once. "" if there is none.
    """
    nv = rest.step.model.nv
    w = growth.shape[nv : 2 * nv]
    if not np.abs(w).max(initial=0.0) > 0.0:
        return "", ""
    M, rows = rows_at(rest.step, rest.state)
    energies = np.abs(w.conj() * (M @ w))
    contact, most = "", SHARE * float(np.abs(w.conj() @ M @ w))
    for number in sorted(set(rows.contact.tolist()) - {-1}):
        J, R = rows.J[rows.contact == number], rows.R[rows.contact == number]
        against, A = J @ w, J @ np.linalg.solve(M, J.T) + np.diag(R)
        taken = float(np.abs(against.conj() @ np.linalg.solve(A, against)))
        if taken > most:
            contact, most = contact_name(rest.step.model, rest.step.data, number), taken
    return place.speed_names[int(np.argmax(energies))], contact
