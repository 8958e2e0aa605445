"""Machine code for a tree: an `Evaluator` of each quantity, `runner_of` for its motions."""

from . import sources  # noqa: F401 - which notes what is imported now
from .evaluator import Evaluator
from .runner import runner_of

__all__ = ["Evaluator", "runner_of"]
