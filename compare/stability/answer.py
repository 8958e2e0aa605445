"""The answer for a file: rows of limits at its postures, by the derivative of its step, in closed form and in runs."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from ..core.rows import Row, column
from ..engines.mujoco.names import INTEGRATORS
from ..engines.mujoco.reading import Reading
from ..engines.mujoco.step import distance
from ..engines.mujoco.variants import has_free_base
from ..robots.coordinates import Coordinates
from ..robots.file import names_of_keys
from .closed_form import radius_apart
from .cures import Cure, cures
from .limits import COARSER, LONGEST, Limit, Tried, limit, tried
from .naming import limiting
from .place import Place, in_the_air_at, standing_at
from .rest import SETTLED
from .runs import growth_in_run, largest_push, observed, own_limit

MOST_POSTURES = 6  # the first keyframes
MOVING = 0.01  # rad/s or m/s: what creeps faster does not rest
STEP_DIGITS = 4
CURVE_STEPS, CURVE_RUNS = (
    18,
    (0.8, 1.05, 1.15, 1.4, 2.0),
)  # of a curve: its steps, and those of runs over the limit


def step_column(**more: Any) -> Any:
    """A field with a time step, s."""
    return column("s", digits=STEP_DIGITS, **more)


@dataclass(kw_only=True)
class StepLimitRow(Row):
    """The step limit of an integrator at a posture: step_limits.csv.

    limit: finite, none, below, saddle, or no_rest, see limits.Limit; moving, it creeps too fast for a rest.
    observed_dt, failing_dt: the longest step at which runs
    hold and the shortest at which they fail. growth: per step, at the file's step; apart: in closed form minus that.
    """

    posture: str
    base: str  # fixed, free
    surroundings: str  # contact; free, nothing touches; air, contacts off
    integrator: str
    limit: str
    predicted_dt: float | None = step_column()
    observed_dt: float | None = step_column(default=None)
    failing_dt: float | None = step_column(default=None)
    own_dt: float | None = step_column(
        default=None
    )  # the file's own run, from where it sinks to, fails beyond
    smooth_dt: float | None = step_column(default=None)  # the limit without dry friction
    file_dt: float = column("s")
    file_integrator: str
    stable_at_file_dt: bool | None
    limiting_joint: str = ""
    limiting_contact: str = ""
    growth_rate: float | None = column(
        "per_s", default=None
    )  # just beyond the limit; of a saddle that of its fall
    growth: float | None = column(digits=8, default=None)
    apart: float | None = None
    largest_push: float | None = None  # rad/s or m/s
    finer_push: bool | None = None  # whether a finer step bears no larger push
    gives_way: float | None = None  # rad or m, from the rest to that at the limit
    has_fallen: bool = False  # a free body rests far from its posture
    moved: float | None = None  # rad or m, from the posture to the rest
    moved_joint: str = ""
    creep: float | None = None  # rad/s or m/s
    creeping_joint: str = ""

    @property
    def contradicted(self) -> bool:
        """Whether runs near rest hold or fail elsewhere than at the limit of the derivative."""
        if (
            self.limit != "finite"
            or not self.predicted_dt
            or (self.observed_dt is None and self.failing_dt is None)
        ):
            return False
        holds = self.observed_dt is not None and self.observed_dt >= 0.95 * self.predicted_dt
        fails = self.failing_dt is not None and self.failing_dt <= 1.05 * self.predicted_dt
        return not (holds and fails)

    @property
    def is_known(self) -> bool:
        return self.limit in ("finite", "none", "below", "moving")

    @property
    def is_held_by_friction(self) -> bool:
        """Whether the limit is lower without dry friction, which holds small deviations at any step."""
        return self.smooth_dt is not None and self.smooth_dt < 0.99 * self.longest

    @property
    def longest(self) -> float:
        """The longest stable step, s; inf: none fails. Runs have the last word."""
        predicted = {"none": np.inf, "moving": np.inf, "below": 0.0}.get(self.limit, self.predicted_dt or 0.0)
        if self.contradicted:
            predicted = self.observed_dt or 0.0
        return predicted if self.own_dt is None else min(predicted, self.own_dt)

    @property
    def decided_by_runs(self) -> bool:
        """Whether runs say another limit than the derivative."""
        if self.limit not in ("finite", "none", "moving"):
            return False
        return not 0.95 <= min(self.longest, LONGEST) / (self.predicted_dt or LONGEST) <= 1.05


class Posture(NamedTuple):
    """A posture that is asked for. key: the keyframe, "": qpos0; q: positions instead, (nq,), or ()."""

    name: str
    key: str
    q: tuple[float, ...] = ()


def postures_of(reading: Reading) -> list[Posture]:
    """The keyframes, by the names of their postures; qpos0 if there is none."""
    named = names_of_keys(reading)
    return [Posture(named[key], key) for key in list(reading.keyframes)[:MOST_POSTURES]] or [
        Posture("qpos0", "")
    ]


def posture_of(asked: str | Sequence[float], reading: Reading) -> Posture:
    """The posture of a name, or positions of all joints (deg, m, quaternions); ValueError, in one line, for neither.

    A name may be numbers separated by commas.
    """
    named = {posture.name: posture for posture in postures_of(reading)} | {"qpos0": Posture("qpos0", "")}
    if isinstance(asked, str) and asked in named:
        return named[asked]
    coordinates = Coordinates(reading.tree.joint_names, reading.tree.kind)
    try:
        numbers = tuple(map(float, asked.split(",") if isinstance(asked, str) else asked))
    except ValueError:
        numbers = ()
    if len(numbers) != len(reading.qpos0) or not np.isfinite(numbers).all():
        choices = f"{', '.join(named)}, or {len(reading.qpos0)} numbers (deg, m, quaternions)"
        raise ValueError(f"posture {asked} is not one of this file: expected {choices}")
    q = coordinates.from_degrees(numbers, positions=True)
    return Posture(
        asked if isinstance(asked, str) else ",".join(f"{x:g}" for x in numbers), "", tuple(q.tolist())
    )


def integrators_at_rest() -> list[str]:
    """The integrators of the installed MuJoCo; without implicit, which at rest is implicitfast."""
    return [name for name in INTEGRATORS if name != "implicit"]


class Curve(NamedTuple):
    """The factor by which deviations grow in a step, over the step, s, of an integrator at a place; and that seen in runs."""

    predicted: list[tuple[float, float]]
    observed: list[tuple[float, float]]


class PlaceAnswer(NamedTuple):
    """What is known of a place: a row of each integrator, the curves, what makes the file's step stable."""

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


def answer(posture: Posture, contacts: bool, reading: Reading, asked: Asked) -> PlaceAnswer:
    """All that is asked of a posture as it stands, or in the air if that is another place: no rows if it is not."""
    q = np.array(posture.q) if posture.q else None
    standing = standing_at(reading, posture.name, posture.key, q)
    place = standing if contacts else in_the_air_at(standing, posture.key, q)
    if place is None:
        return PlaceAnswer([], {}, [])
    rows, curves = [], {}
    for integrator in asked.integrators:
        rows.append(limit_row(place, integrator, asked.dt, asked.integrator, asked.in_runs))
        if asked.drawn and rows[-1].is_known:
            curves[integrator] = curve(place, rows[-1])
    fails = [row for row in rows if row.integrator == asked.integrator and row.stable_at_file_dt is False]
    changes = cures(place.model, place.rest, asked.dt, asked.integrator) if fails and contacts else []
    return PlaceAnswer(rows, curves, changes)


def curve(place: Place, row: StepLimitRow) -> Curve:
    """The growth over the step: from an eighth of the file's step to four times the limit, and about the limit in runs."""
    limit_dt = row.predicted_dt or LONGEST / COARSER
    low, high = min(row.file_dt, limit_dt) / 8.0, min(4.0 * max(limit_dt, row.file_dt), LONGEST)
    predicted, state = [], place.rest
    steps = [*np.geomspace(low, high, CURVE_STEPS), *(share * limit_dt for share in CURVE_RUNS)]
    for dt in sorted(step for step in steps if step <= high):
        at = tried(place.model, state, float(dt), row.integrator)
        if not at.rest.is_found:
            break
        predicted.append((float(dt), at.growth.factor))
        state = at.rest.state
    seen = []
    for share in CURVE_RUNS if row.predicted_dt else ():
        dt = share * limit_dt
        seen.append((dt, growth_in_run(place.model, place.rest, dt, row.integrator)))
    return Curve(predicted, [(dt, factor) for dt, factor in seen if factor is not None])


def limit_row(
    place: Place, integrator: str, dt: float, file_integrator: str, in_runs: bool = True
) -> StepLimitRow:
    """The limit of an integrator at a place, and what its step of dt, s, does there; in_runs: with what runs show."""
    model = place.model
    found = limit(model, place.rest, integrator, dt)
    at = found.first
    end = limiting(place, found.rest, found.growth)
    row = StepLimitRow(
        posture=place.posture,
        base="free" if has_free_base(model) else "fixed",
        surroundings=place.surroundings,
        integrator=integrator,
        limit=found.kind.replace(" ", "_"),
        predicted_dt=found.dt,
        file_dt=dt,
        file_integrator=file_integrator,
        stable_at_file_dt=holds(found, dt),
        limiting_joint=end.joint,
        limiting_contact=end.contact,
        growth_rate=found.growth.rate or None,
        growth=at.growth.factor,
    )
    row.has_fallen = place.has_fallen
    if moves_on(place, found):
        row.limit, row.predicted_dt = "moving", None
    if found.dt:
        row.gives_way = float(np.abs(distance(model, place.rest, found.rest.state)).max())
    add_rest(row, place, at)
    if place.frictionless is not None and row.is_known:
        smooth = limit(place.frictionless, place.rest, integrator, dt)
        row.smooth_dt = smooth.dt
    if in_runs or row.limit == "moving":
        add_runs(row, place, found)
    return row


def add_runs(row: StepLimitRow, place: Place, found: Limit) -> None:
    """What runs show; they have the last word."""
    if not row.is_known:
        return
    model, creep = place.model, float(np.abs(place.creep).max(initial=0.0))
    if row.limit == "finite":
        row.observed_dt, row.failing_dt = observed(model, found, row.integrator)
    if longest := min(row.longest, LONGEST):
        own = own_limit(model, place.rest, row.integrator, longest, creep)
        row.own_dt = own if own < longest else None
    row.stable_at_file_dt = row.file_dt <= row.longest
    row.largest_push, row.finer_push = largest_push(model, found.first.rest, creep)


def moves_on(place: Place, found: Limit) -> bool:
    """Whether a robot that touches something goes on moving there, slowly, and does not fall."""
    if found.kind == "saddle" or not place.touching:
        return False
    return found.kind == "no rest" or bool(np.abs(place.creep).max(initial=0.0) > MOVING)


def holds(found: Limit, dt: float) -> bool | None:
    """Whether a step is within a limit; None: there is none of the step alone."""
    if found.kind in ("saddle", "no rest"):
        return None
    return found.kind == "none" or (found.dt is not None and dt <= found.dt)


def add_rest(row: StepLimitRow, place: Place, at: Tried) -> None:
    """How far the rest is from the posture, how it creeps, and the growth in closed form."""
    moved, creep = np.abs(place.moved), np.abs(at.rest.speeds)
    row.moved, row.moved_joint = float(moved.max()), place.speed_names[int(np.argmax(moved))]
    if at.rest.is_found:  # else what Newton's method has tried
        row.creep, row.creeping_joint = float(creep.max()), place.speed_names[int(np.argmax(creep))]
    if at.rest.left <= SETTLED:
        row.apart = radius_apart(at.rest, place.tree)
