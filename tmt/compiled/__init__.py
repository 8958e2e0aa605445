"""Machine code for a tree: `evaluator` of its quantities, `runner` of its motions, `Library` of any LLVM text."""

from .evaluator import Evaluator, evaluator
from .runner import runner

__all__ = ["Evaluator", "Library", "evaluator", "runner"]


def __getattr__(name: str):
    if name != "Library":
        raise AttributeError(name)
    from .machine import Library  # here, so that `import tmt` need not wait for llvmlite

    return Library
