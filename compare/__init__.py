"""TMT and MuJoCo compared; and equations of one's own compared with MuJoCo: `assert_agrees` and `differences`.

`mjcf` and `tmt`, the two models, know nothing of each other; `compare` knows both, and a test holds that. An experiment is the
module of its name: `python -m compare gravity` runs experiments/gravity.py, where `rows(setup)` computes and
`figures(result, robot)` draws. It asks each engine in `engines` the same way, `engine.of(case)` for the dynamics of a robot in a
scene; what is known without an engine is in `truth`, what decides is in `judge`, and all that only the assignment's arm has
(names, postures, scenes, printed numbers, claims) is in robots/arm.py.

How a tolerance is derived: 64 eps times the sum of the absolute values of the terms that are added up, times the condition
number of Mbar where a linear system is solved; of a trajectory a band, the rounding that every step can add, carried to the
present by the exact Jacobians of the method's own steps. Each section of a report states its own.
"""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from .agreement import assert_agrees, differences

__all__ = ["assert_agrees", "differences"]


def __getattr__(name: str) -> object:
    """The two functions when they are asked for: whoever starts `python -m compare` need not wait for them."""
    if name in __all__:
        from . import agreement

        return getattr(agreement, name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
