"""What an engine's own process does: read a file, give quantities at states, run."""

import faulthandler
import importlib
import os
import time

import numpy as np

import tmt

from ...core.errors import described
from ...core.words import in_one_line
from ...judge.scale import FACTOR
from ...process.workers import begin
from .. import RECORDS
from .model import EngineError, File, ReadModel, Unread, numbers_of, size_of

LIMIT = 120.0  # s, of an answer: compiling a large model may take hours
QUANTITIES = "mass_matrix", "bias", "acceleration"


def started(environment: tuple[tuple[str, str], ...]) -> None:
    begin()
    os.environ.update(environment)
    nowhere = os.open(os.devnull, os.O_WRONLY)
    for stream in (1, 2):  # what engines print, their libraries of C++ too
        os.dup2(nowhere, stream)


models = {}  # by the key of the case: what this process has read


def answer(key: int, act: str, arguments: tuple) -> object:
    """What a function below returns for a case; EngineError with the reason, in one line, where it raises.

    After the time limit the process ends, whatever its libraries do.
    """
    faulthandler.dump_traceback_later(LIMIT, exit=True)
    try:
        return {"read": read, "each": each, "prepared": prepared, "ran": ran}[act](key, *arguments)
    except EngineError:
        raise
    except Exception as error:
        kind = Unread if act == "read" else EngineError
        raise kind(in_one_line(" ".join(described(error).split()))) from None
    finally:
        faulthandler.cancel_dump_traceback_later()


def read(key: int, name: str, file: File, tree: tmt.Tree) -> dict:
    """The numbers that the engine has read, those of the Tree, which that differ were mended, and the seconds that it took."""
    begin = time.perf_counter()
    record = RECORDS[name]
    module = importlib.import_module(f"..{record.module or name}", __package__)
    model, stated = module.Model(file, record.precision), numbers_of(tree)
    model.stated = stated
    found = {number: np.array(values, float) for number, values in model.numbers().items()}
    mended = {}
    for number, values in found.items():
        if np.shape(values) != np.shape(stated[number]):
            raise Unread(f"{number}: {len(values)} values, {len(stated[number])} in the compared model")
        if not np.abs(values - stated[number]).max(initial=0.0) <= FACTOR * record.eps * size_of(
            stated, number
        ):
            mended[number] = number in model.drops or model.mend(number, stated[number])
    models[key] = model
    has = {name for name in QUANTITIES if getattr(type(model), name) is not getattr(ReadModel, name)}
    has -= set(model.lacks)
    return {
        "read": found,
        "stated": stated,
        "mended": mended,
        "seconds": time.perf_counter() - begin,
        "has": has,
    }


def each(key: int, quantity: str, *values: np.ndarray) -> np.ndarray:
    model = models[key]
    return np.array([getattr(model, quantity)(*state) for state in zip(*values)], dtype=float)


def prepared(key: int, q, v, tau, t, steps, method, tolerance) -> float:
    """Seconds until a run could begin."""
    begin = time.perf_counter()
    models[key].prepare(method, tau, t[-1] / steps if steps else None, tolerance)
    return time.perf_counter() - begin


def ran(key: int, q, v, tau, t, steps, method, tolerance) -> tuple[np.ndarray, int | None, float, str]:
    """The states at the times t, evaluations, seconds of the run alone, and why it may have ended early."""
    model = models[key]
    begin, why = time.perf_counter(), "a number is not finite"
    try:
        states, evaluations = model.run(q, v, tau, t, steps, method, tolerance)
    except ArithmeticError as error:  # it cannot go on
        states, evaluations, why = np.concatenate([q, v])[None], None, str(error)
    return np.asarray(states, float), evaluations, time.perf_counter() - begin, why
