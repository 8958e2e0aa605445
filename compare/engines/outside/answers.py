"""What an engine's own process does: read a file, give quantities at states, run."""

import importlib
import time
from collections.abc import Callable
from functools import cache, partial
from typing import Any, NamedTuple, TypeVar

import numpy as np

import tmt

from ...core.errors import described
from ...core.timing import fastest
from ...core.words import in_one_line
from ...judge.scale import FACTOR
from .. import RECORDS, Array, Course
from .model import EngineError, File, ReadModel, Unread, numbers_of, size_of

CALLS = 50  # at most, that are timed
LIMIT = 120.0  # s, of an answer: compiling a large model may take hours
QUANTITIES = "mass_matrix", "bias", "acceleration", "derivatives"
T = TypeVar("T")


class Run(NamedTuple):
    states: Array  # (times, nq + nv)
    evaluations: int | None
    seconds: float  # of the run alone
    why: str  # why it may have ended early


def answer(act: Callable[..., T], name: str, file: File, tree: tmt.Tree, *arguments: Any) -> T:
    """What a function of an engine's model of a file returns; EngineError with the reason, in one line, where it raises."""
    kind: type[EngineError] = Unread
    try:
        model = read(name, file, tree)
        kind = EngineError
        return act(model, *arguments)
    except EngineError:
        raise
    except Exception as error:
        raise kind(in_one_line(" ".join(described(error).split()))) from None


@cache
def read(name: str, file: File, tree: tmt.Tree) -> ReadModel:
    """The model of an engine, in which the numbers that differ from those of the Tree are mended; once in a process."""
    begin = time.perf_counter()
    record = RECORDS[name]
    module = importlib.import_module(f"..{record.module or name}", __package__)
    kind: type[ReadModel] = module.Model
    model, stated = kind(file, record.precision), numbers_of(tree)
    model.stated = stated
    numbers = {number: np.array(values, float) for number, values in model.numbers().items()}
    mended = {}
    for number, values in numbers.items():
        if np.shape(values) != np.shape(stated[number]):
            raise Unread(f"{number}: {len(values)} values, {len(stated[number])} in the compared model")
        tolerance = FACTOR * record.eps * size_of(stated, number)
        if not np.abs(values - stated[number]).max(initial=0.0) <= tolerance:
            mended[number] = number in model.drops or model.mend(number, stated[number])
    has = {quantity for quantity in QUANTITIES if gives(model, quantity)}
    seconds = time.perf_counter() - begin
    model.reading = {"read": numbers, "stated": stated, "mended": mended, "seconds": seconds, "has": has}
    return model


def gives(model: ReadModel, quantity: str) -> bool:
    """Whether the class of a model computes a quantity, for this robot too."""
    is_defined = getattr(type(model), quantity) is not getattr(ReadModel, quantity)
    return is_defined and quantity not in model.lacks


def each(model: ReadModel, quantity: str, *values: Array) -> Array:
    """A quantity at many states, (states, ...)."""
    return np.array([getattr(model, quantity)(*state) for state in zip(*values)], dtype=float)


def seconds(model: ReadModel, quantity: str, *state: Array) -> float:
    """Of one evaluation of a quantity at a state, the shortest."""
    call = partial(getattr(model, quantity), *state)
    return fastest({quantity: call}, CALLS)[quantity]


def prepared(model: ReadModel, course: Course) -> float:
    """Seconds until a run could begin."""
    begin = time.perf_counter()
    model.prepare(course)
    return time.perf_counter() - begin


def ran(model: ReadModel, course: Course) -> Run:
    begin, why = time.perf_counter(), "a number is not finite"
    states, evaluations = course.start[None], None
    try:
        states, evaluations = model.run(course)
    except ArithmeticError as error:  # it cannot go on
        why = str(error)
    return Run(np.asarray(states, float), evaluations, time.perf_counter() - begin, why)
