"""What an engine's own process does: read a file, give quantities at states, run."""

import importlib
import time
from collections.abc import Callable
from functools import cache, partial
from typing import Any, TypeVar

import numpy as np

import tmt

from ...core import timing
from ...core.errors import described
from ...core.words import in_one_line
from ...judge.scale import FACTOR
from .. import RECORDS, Array, Course, Motion
from .bodies import numbers_of, size_of
from .file import EngineError, File, Unread
from .model import ReadModel

CALLS = 50  # at most, that are timed
LIMIT = 120.0  # s, of an answer: compiling a large model may take hours
T = TypeVar("T")


def answer(act: Callable[..., T], name: str, file: File, tree: tmt.Tree, is_set: bool, *arguments: Any) -> T:
    """What a function of an engine's model of a file returns; EngineError with the reason, in one line, where it raises."""
    kind: type[EngineError] = Unread
    try:
        model = read(name, file, tree, is_set)
        kind = EngineError
        return act(model, *arguments)
    except EngineError:
        raise
    except (Exception, SystemExit) as error:  # the latter by assertions of Drake
        raise kind(in_one_line(" ".join(described(error, with_place=kind is EngineError).split()))) from None


@cache
def read(name: str, file: File, tree: tmt.Tree, is_set: bool) -> ReadModel:
    """The model of an engine; is_set: the numbers that differ from those of the Tree are set. Once in a process."""
    begin = time.perf_counter()
    record = RECORDS[name]
    module = importlib.import_module(f"..{record.module or name}", __package__)
    kind: type[ReadModel] = module.Model
    model = kind(file, record.precision)
    model.stated = stated = numbers_of(tree)
    numbers = {number: np.array(values, float) for number, values in model.numbers().items()}
    differing = []
    for number, values in numbers.items():
        most = np.abs(values - stated[number]).max(initial=0.0)
        if not most <= FACTOR * record.eps * size_of(stated, number):
            differing.append(number)
    mended = {number: is_set and model.mend(number, stated[number]) for number in differing}
    unwritten = tuple(number for number in model.unwritten if mended.get(number))
    model.reading = {
        "read": numbers, "stated": stated, "copied": model.copied, "way": model.way, "unwritten": unwritten,
        "mended": {number: is_right for number, is_right in mended.items() if number not in unwritten},
        "lacking": tuple(number for number in model.drops if stated[number].any()),
        "has": set(model.quantities),
        "seconds": time.perf_counter() - begin,
    }  # fmt: skip
    return model


def each(model: ReadModel, quantity: str, *values: Array) -> Array:
    """A quantity at many states of the Tree, (states, ...)."""
    return np.array([value(model, quantity, *state) for state in zip(*values)], dtype=float)


def value(
    model: ReadModel, quantity: str, q: Array, v: Array | None = None, force: Array | None = None
) -> Array:
    at = model.order.state(q, v)
    own_force = at.force(np.zeros_like(at.u) if force is None else force)
    if quantity == "mass_matrix":
        return at.S.T @ model.mass_matrix(at) @ at.S
    if quantity == "bias":
        return at.S.T @ model.bias(at)
    if quantity == "acceleration":
        return np.linalg.solve(at.S, model.acceleration(at, own_force) - at.c)
    return np.array([at.S.T @ by @ at.S for by in model.derivatives(at, own_force)])  # S is a permutation


def seconds_of_derivatives(model: ReadModel, q: Array, v: Array, force: Array) -> float:
    """Of one call of the engine, the shortest."""
    at = model.order.state(q, v)
    call = partial(model.derivatives, at, at.force(force))
    return timing.fastest({"": call}, CALLS)[""]


def prepared(model: ReadModel, course: Course) -> tuple[float, float | None]:
    """Seconds until a run could begin; and of a step without what Python does around it, None where that is nothing."""
    begin = time.perf_counter()
    model.prepare(course)
    seconds = time.perf_counter() - begin
    step = model.step_alone(course) if course.steps else None
    if step is None:
        return seconds, None
    count = 1 + int(timing.WARM / timing.fastest({"": step}, 3)[""])

    def steps() -> None:
        for _ in range(count):
            step()

    return seconds, timing.fastest({"": steps}, 5)[""] / count


def batched(model: ReadModel, course: Course) -> tuple[float, float, str, np.ndarray]:
    """Seconds of preparation and of the steps of many worlds, the device, and q of the first world."""
    begin = time.perf_counter()
    run, device = model.batch(course)
    q = run()
    seconds = time.perf_counter() - begin
    return seconds, timing.fastest({"": run}, 5)[""], device, q


def ran(model: ReadModel, course: Course) -> Motion:
    begin, why = time.perf_counter(), "a number is not finite"
    states, evaluations = course.start[None], None
    try:
        states, evaluations = model.run(course)
    except ArithmeticError as error:  # it cannot go on
        why = str(error)
    motion = course.motion(np.asarray(states, float), why)
    return motion._replace(evaluations=evaluations, seconds=time.perf_counter() - begin)
