"""Machine code for a tree: `evaluator` of its quantities, `runner` of its motions, `prepared` for one that is timed.

`Library`: of any LLVM text.
"""

from . import sources  # noqa: F401 - which notes what is imported now
from .evaluator import Evaluator, evaluator
from .runner import prepared, runner

__all__ = ["Evaluator", "Library", "evaluator", "prepared", "runner"]


def __getattr__(name: str):
    if name != "Library":
        raise AttributeError(name)
    from .machine import Library  # here, so that `import tmt` need not wait for llvmlite

    return Library
