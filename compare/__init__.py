"""TMT and MuJoCo compared; your own equations compared with MuJoCo; a file as a Tree; the largest stable steps of a file.

ARCHITECTURE.md shows the parts. How a tolerance is derived: 64 eps times the sum of the absolute values of
the terms that are added, times the condition number of Mbar where a linear system is solved. Of a trajectory
it is a band: the rounding that every step can add, carried on by the exact Jacobians of the method's steps.
"""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from .agreement import assert_agrees, differences, tree
    from .stability.api import step_limits

__all__ = ["assert_agrees", "differences", "step_limits", "tree"]


def __getattr__(name: str) -> object:
    """The public functions when they are asked for: `python -m compare` need not wait for them."""
    if name == "step_limits":
        from .stability.api import step_limits

        return step_limits
    if name in __all__:
        from . import agreement

        return getattr(agreement, name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
