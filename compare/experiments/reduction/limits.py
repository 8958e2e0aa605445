"""Which steps are stable where a robot rests near its start: of the whole file and of smaller ones."""

from collections.abc import Iterable, Sequence

import numpy as np

from ...engines.mujoco.reading import read
from ...engines.mujoco.smaller import Smaller, finished
from ...engines.mujoco.source import without_visuals
from ...stability.answer import Asked, limit_row
from ...stability.limits import GIVES_WAY, tried
from ...stability.place import Place, postures_of, standing_at
from .records import FrontierRow, LimitRow
from .scene import FINER, Scene
from .search import Answer, Candidate, answer_within


def rest_of(scene: Scene, small: Smaller) -> Place | None:
    """Where a model rests near the start of the first motion; None: elsewhere."""
    start = finished(small, scene.motions[:1], scene.reading.dt, scene.reading.integrator)
    reading = read(without_visuals(start.spec).compile())
    place = standing_at(reading, postures_of(reading)[0])
    return place if np.abs(place.moved).max(initial=0.0) <= GIVES_WAY else None


def stable_answers(scene: Scene, candidates: Sequence[Candidate], errors: Iterable[float]) -> list[Answer]:
    """The answers for errors, rad or m, by steps that are stable at rest, where a run may show nothing."""
    rows, judged, rests = [candidate.row for candidate in candidates], set[int](), dict[str, Place | None]()
    while True:
        answers = [answer_within(rows, error) for error in errors]
        told = {id(row) for answer in answers for row in (answer.row, answer.exact)} - judged
        candidate = next((candidate for candidate in candidates if id(candidate.row) in told), None)
        if candidate is None:
            return answers
        row = candidate.row
        judged.add(id(row))
        if row.model not in rests:
            rests[row.model] = rest_of(scene, candidate.small)
        if not is_stable(rests[row.model], row):
            for other in rows:
                is_alike = (other.model, other.integrator) == (row.model, row.integrator)
                other.stable_at_rest &= not (is_alike and other.dt >= row.dt)


def is_stable(place: Place | None, row: FrontierRow) -> bool:
    """Whether its step is not the cause of what grows at rest; the file's own step is what it is."""
    if place is None or row.error_at_own_step is not None:
        return True
    own, finer = (tried(place.model, place.rest, dt, row.integrator) for dt in (row.dt, row.dt / FINER))
    return own.is_stable or not finer.is_stable


def compared_limits(scene: Scene, small: Smaller, integrators: Sequence[str]) -> list[LimitRow]:
    """The step limits of the whole and of the smaller file."""
    rows, asked = [], Asked(scene.reading.dt, scene.reading.integrator, (), in_runs=False)
    for model, file in (("whole", scene.whole), ("smaller", small)):
        place = rest_of(scene, file)
        for integrator in integrators:
            row = LimitRow(model, integrator, "rests_elsewhere")
            if place:
                answer, _ = limit_row(place, integrator, asked)
                row = LimitRow(model, integrator, answer.limit, answer.predicted_dt, answer.limiting_joint)
            rows.append(row)
    return rows
