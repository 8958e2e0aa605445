"""Who computes: one file an engine, and what is asked of each of them.

An engine makes the dynamics of a case; gravity, damping, locked joints and torques are applied there and nowhere else. The
dynamics know positions q (..., nq), speeds v (..., nv) and torques tau (..., nv), in rad, rad/s and N m, of any leading batch
shape, in the order of the case's joints; and Mbar a + bias = tau - D v.
"""

from collections.abc import Callable, Mapping
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import ArrayLike

from ..robots.case import Case, Coordinates

LABELS = {"tmt": "TMT", "own": "yours", "mujoco": "MuJoCo", "scipy": "SciPy", "heyoka": "heyoka"}  # in text
WHOSE = {"tmt": "TMT's", "own": "your", "mujoco": "MuJoCo's"}  # before what they have
COMPARED = ("tmt", "mujoco")  # the two engines that every experiment compares, except for equations of a user's own
GRID = 64  # equal times, and the start, at which a prepared run is read


class Method(NamedTuple):
    """A method of integration of one engine."""

    engine: str
    name: str
    order: int | None  # of its error in the step; None: it chooses its own steps
    scheme: str  # what it does: methods of the same scheme do the same except for rounding
    adaptive: bool = False  # it chooses its own steps and takes a tolerance

    @property
    def label(self) -> str:
        return f"{LABELS[self.engine]} {self.name}"


class Setting(NamedTuple):
    """How a method follows a motion: so many steps, or a tolerance, in a duration in s."""

    duration: float
    steps: int | None = None
    tolerance: float | None = None

    @property
    def every(self) -> int:
        """How many of its steps lie between two of the times at which the run is read; ValueError if that is no whole number."""
        if not self.steps or self.steps % GRID:
            raise ValueError(f"steps is {self.steps}; a multiple of {GRID} is expected")
        return self.steps // GRID


class Motion(NamedTuple):
    """One run, or a batch of them. A run that ends early is NaN from there on."""

    t: np.ndarray  # (times,) s
    q: np.ndarray  # (..., times, nq) rad
    v: np.ndarray  # (..., times, nv) rad/s
    evaluations: int | None = None  # of the dynamics in all; None where a method has no such thing
    ended: str | np.ndarray | None = None  # when and why a run ended early, or None; of a batch an array of its shape
    steps: int | None = None  # that the method took; None: not known

    @property
    def states(self) -> np.ndarray:
        """q and v side by side, (..., times, nq + nv)."""
        return np.concatenate([self.q, self.v], axis=-1)


Prepared = tuple[Callable, Callable[..., Motion]]  # run() and read(what it returned)


class Dynamics(Protocol):
    """One case in one engine. Engines may know more: energy, com_positions, jacobians, convective_terms ..."""

    coordinates: Coordinates

    def mass_matrix(self, q: np.ndarray) -> np.ndarray:
        """Mbar, kg m2, (..., nv, nv)."""

    def bias(self, q: np.ndarray, v: np.ndarray) -> np.ndarray:
        """h, N m, (..., nv)."""

    def acceleration(self, q: np.ndarray, v: np.ndarray, tau: np.ndarray) -> np.ndarray:
        """rad/s2, (..., nv), from Mbar a = tau - D v - h."""

    def run(self, q, v, tau, dt: float, steps: int, method: str, tolerance: float | None = None) -> Motion:
        """Motion under constant torque from q, v, recorded at every multiple of dt."""

    def prepare(self, q, v, tau, setting: Setting, method: str) -> Prepared:
        """run() follows one motion once more and does nothing else; read(what it returned) is what is judged of it.

        q, v, tau: (n,). read gives the motion at 64 equal times and the start.
        """


class Engine(Protocol):
    """One engine with its methods of integration."""

    @property
    def name(self) -> str: ...

    @property
    def methods(self) -> Mapping[str, Method]:
        """By their names."""

    def unavailable(self) -> str | None:
        """Why it cannot take part here, or None."""

    def of(self, case: Case) -> Dynamics:
        """The dynamics of a case."""


def compared(engines: Mapping[str, Engine], case: Case) -> dict[str, Dynamics]:
    """The dynamics of a case in the two engines that are compared, by their names, mujoco last."""
    return {name: engines[name].of(case) for name in case.robot.compared}


def methods_in(engine: Engine, case: Case) -> Mapping[str, Method]:
    """An engine's methods in a case: where a robot's own actuators act, others may be the same scheme."""
    return engine.methods_in(case) if hasattr(engine, "methods_in") else engine.methods


def rows_of_states(*values: ArrayLike) -> tuple[tuple[int, ...], list[np.ndarray]]:
    """The batch shape that values (..., n) have together, and each of them as rows, (states, n), contiguous.

    Each has an n of its own, as positions and speeds may; a number is a row of one.
    """
    values = [np.atleast_1d(np.asarray(value, float)) for value in values]
    batch = np.broadcast_shapes(*(value.shape[:-1] for value in values))
    rows = [np.broadcast_to(value, (*batch, value.shape[-1])) for value in values]
    return batch, [np.array(row, order="C").reshape(-1, row.shape[-1]) for row in rows]


def same_scheme(engines: Mapping[str, Engine], method: Method, engine: str) -> Method:
    """The first method of an engine that is the same scheme as a given one."""
    return next(m for m in engines[engine].methods.values() if m.scheme == method.scheme)


def one_of_each_scheme(engine: Engine) -> tuple[Method, ...]:
    """Of methods of one engine that are the same scheme the first."""
    return tuple({method.scheme: method for method in reversed(engine.methods.values())}.values())[::-1]
