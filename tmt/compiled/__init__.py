"""Machine code for a tree: `evaluator` of its quantities, `runner_of` for its motions."""

from . import sources  # noqa: F401 - which notes what is imported now
from .evaluator import Evaluator, evaluator
from .runner import runner_of

__all__ = ["Evaluator", "evaluator", "runner_of"]
