"""The engines: who computes. Each is a row of RECORDS, and a module or a folder of its name, which is imported where it is asked.

The module has

    engine(schemes) -> Engine    the engine, for a robot on which MuJoCo's integrators are these schemes

unless its record says from_file, where run.reference makes an engine of a file of the user's, or reads_file:
see engines.outside.

An engine gives the dynamics of a case; it applies gravity, damping, locked joints and torques itself.
Dynamics take positions q (..., nq), speeds v (..., nv) and torques tau (..., nv) in rad, rad/s and N m, of
any leading batch shape, with joints in the order of the case; and Mbar a + bias = tau - D v.
"""

import importlib
from abc import ABC, abstractmethod
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from importlib.util import find_spec
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import ArrayLike

from ..robots.case import Case
from ..robots.coordinates import Coordinates

Array = np.ndarray  # of floats
Tolerance = float | None  # of a method that chooses its steps; None: its own, or fixed steps
GRID = 64  # number of equal intervals at whose ends a run is read, by default


@dataclass(frozen=True)
class EngineRecord:
    """What the program has to know of an engine before it imports it."""

    label: str  # its name in text
    possessive: str = ""  # before what it has; by default the label with 's
    colour: str = "#666666"  # in charts
    marker: str = "v"  # in charts, by matplotlib's names
    in_quick_runs: bool = False  # a quick run measures its speed too, and a small run with more settings
    from_file: bool = False  # it is made of a user's file: of a model, or of the user's own equations
    package: str = ""  # that must be installed
    extra: str = ""  # of this project, which installs the package
    reads_file: bool = False  # it reads the robot's file itself, in a process of its own: see engines.outside
    precision: str = "float64"
    environment: tuple[tuple[str, str], ...] = ()  # of that process
    module: str = ""  # which has the methods and the model, if it is another one
    compiles: bool = False  # its first calls take tens of seconds

    @property
    def eps(self) -> float:
        """Of its precision."""
        return float(np.finfo(self.precision).eps)


RECORDS = {  # in the order of tables and charts
    "mujoco": EngineRecord("MuJoCo", colour="#E69F00", marker="s", in_quick_runs=True, from_file=True),
    "tmt": EngineRecord("TMT", colour="#0072B2", marker="o", in_quick_runs=True),
    "scipy": EngineRecord("SciPy", colour="#009E73", marker="^"),
    "heyoka": EngineRecord("heyoka", colour="#CC79A7", marker="D", package="heyoka", extra="taylor"),
    "own": EngineRecord("yours", possessive="your", from_file=True),
    "drake": EngineRecord("Drake", colour="#D55E00", marker="P", package="pydrake", extra="drake", reads_file=True),
    "pinocchio": EngineRecord("Pinocchio", colour="#56B4E9", marker="X", package="pinocchio", extra="pinocchio", reads_file=True),
    "mjx": EngineRecord("MJX", colour="#332288", marker="<", package="mujoco.mjx", extra="mjx", reads_file=True, compiles=True,
                        environment=(("JAX_ENABLE_X64", "1"),)),
    "mjx_float32": EngineRecord("MJX float32", colour="#88CCEE", marker=">", package="mujoco.mjx", extra="mjx", reads_file=True,
                                compiles=True, precision="float32", module="mjx"),  # its usual precision
    "warp": EngineRecord("MuJoCo Warp", colour="#117733", marker="p", package="mujoco_warp", extra="warp", reads_file=True,
                         compiles=True, precision="float32"),
    "newton": EngineRecord("Newton", colour="#999933", marker="h", package="newton", extra="newton", reads_file=True,
                           precision="float32"),
}  # fmt: skip
LABELS = {name: record.label for name, record in RECORDS.items()}
WHOSE = {name: record.possessive or f"{record.label}'s" for name, record in RECORDS.items()}
COLOURS = {name: record.colour for name, record in RECORDS.items()}
MARKS = {name: record.marker for name, record in RECORDS.items()}
IN_QUICK_RUNS = tuple(name for name, record in RECORDS.items() if record.in_quick_runs)


def made(schemes: Collection[str], from_file: Mapping[str, "Engine"]) -> dict[str, "Engine"]:
    """All engines by their names, in their order; some may be unavailable. from_file: those made of a user's files."""
    engines = {}
    for name, record in RECORDS.items():
        if record.reads_file:
            engines[name] = importlib.import_module(".outside", __name__).Outside(name)
        elif not record.from_file:
            engines[name] = importlib.import_module(f".{name}", __name__).engine(schemes)
        elif name in from_file:
            engines[name] = from_file[name]
    return engines


class Method(NamedTuple):
    engine: str
    name: str
    order: int | None  # of its error; None: it chooses its own steps
    scheme: str  # methods of the same scheme differ only by rounding
    adaptive: bool = False  # it chooses its own steps and takes a tolerance

    @property
    def label(self) -> str:
        return f"{LABELS[self.engine]} {self.name}"


class Setting(NamedTuple):
    """How a method follows a motion: in a number of steps, or within a tolerance; and where the run is read."""

    duration: float  # s
    steps: int | None = None
    tolerance: Tolerance = None
    intervals: int = GRID  # equal ones, at whose ends the run is read

    @property
    def times(self) -> Array:
        """s, (intervals + 1,)."""
        return np.linspace(0.0, self.duration, self.intervals + 1)

    @property
    def every(self) -> int:
        """The number of steps of an interval; ValueError if it is not a whole number."""
        if not self.steps or self.steps % self.intervals:
            raise ValueError(f"steps = {self.steps} is not a multiple of {self.intervals}")
        return self.steps // self.intervals


class Motion(NamedTuple):
    """One run, or a batch of them. A run that ends early is NaN from there on."""

    t: Array  # (times,) s
    q: Array  # (..., times, nq) rad
    v: Array  # (..., times, nv) rad/s
    evaluations: int | None = None  # of the dynamics in all; None where a method has no such thing
    # when and why a run ended early, or None; of a batch an array of its shape
    ended: str | Array | None = None
    steps: int | None = None  # that the method took; None: not known
    seconds: float | None = None  # of the engine's own steps, where it measures them in a process of its own

    @property
    def states(self) -> Array:
        """q and v side by side, (..., times, nq + nv)."""
        return np.concatenate([self.q, self.v], axis=-1)


class Course(NamedTuple):
    """A run that an engine is asked for."""

    q: Array  # (nq,)
    v: Array  # (nv,)
    tau: Array  # (nv,) constant
    times: Array  # s, equal, the first one 0, at which it is read
    steps: int  # of equal length, a multiple of len(times) - 1; 0: within the tolerance
    method: str
    tolerance: Tolerance = None

    @property
    def dt(self) -> float:
        return float(self.times[-1]) / max(self.steps, 1)

    @property
    def every(self) -> int:
        """The number of steps from one time to the next."""
        return self.steps // (len(self.times) - 1)

    @property
    def start(self) -> Array:
        """q and v side by side."""
        return np.concatenate([self.q, self.v])

    def motion(self, states: Array, why: str) -> Motion:
        """The motion of these states (times reached, nq + nv), as far as it goes; why: the reason if it ends early."""
        path, ended = as_far_as_it_goes(self.times, states, self.start, why)
        return Motion(self.times, path[:, : self.q.size], path[:, self.q.size :], ended=ended)


Prepared = tuple[Callable[[], Any], Callable[[Any], Motion]]  # run() and read(what it returned)


class Dynamics(Protocol):
    """One case in one engine. Engines may know more: energy, com_positions, jacobians, convective_terms ..."""

    coordinates: Coordinates

    def mass_matrix(self, q: Array) -> Array:
        """Mbar, kg m2, (..., nv, nv)."""

    def bias(self, q: Array, v: Array) -> Array:
        """h, N m, (..., nv)."""

    def acceleration(self, q: Array, v: Array, tau: Array) -> Array:
        """rad/s2, (..., nv), from Mbar a = tau - D v - h."""

    def run(
        self, q: Array, v: Array, tau: Array, dt: float, steps: int, method: str, tolerance: Tolerance = None
    ) -> Motion:
        """Motion under constant torque from q, v, recorded at every multiple of dt."""

    def prepare(self, q: Array, v: Array, tau: Array, setting: Setting, method: str) -> Prepared:
        """run() follows one motion once more; read(what it returned) is the motion at the times of the setting."""


class OneByOne(ABC):
    """Runs of dynamics that follow one motion at a time."""

    @abstractmethod
    def prepared(self, course: Course) -> Prepared:
        """The functions of `Dynamics.prepare` for a course."""

    def run(
        self, q: Array, v: Array, tau: Array, dt: float, steps: int, method: str, tolerance: Tolerance = None
    ) -> Motion:
        t, (batch, states), motions = np.linspace(0.0, dt * steps, steps + 1), rows_of_states(q, v, tau), []
        for position, speed, torque in zip(*states):
            count = 0 if tolerance else steps
            run, read = self.prepared(Course(position, speed, torque, t, count, method, tolerance))
            motions.append(read(run()))
        q, v = (np.reshape([motion[i] for motion in motions], (*batch, steps + 1, -1)) for i in (1, 2))
        counts = [motion.evaluations for motion in motions if motion.evaluations is not None]
        evaluations = sum(counts) if len(counts) == len(motions) else None
        ended = np.array([motion.ended for motion in motions], dtype=object).reshape(batch)
        return Motion(t, q, v, evaluations, ended[()])

    def prepare(self, q: Array, v: Array, tau: Array, setting: Setting, method: str) -> Prepared:
        return self.prepared(Course(q, v, tau, setting.times, setting.steps or 0, method, setting.tolerance))


class Engine(Protocol):
    """One engine with its methods of integration, by their names."""

    name: str

    @property
    def methods(self) -> Mapping[str, Method]: ...

    def unavailable(self) -> str | None:
        """Why it cannot take part here, or None."""
        package, extra = RECORDS[self.name].package, RECORDS[self.name].extra
        if not package or find_spec(package):
            return None
        return f"{package} is not installed; `pip install .[{extra}]` installs it"

    def methods_in(self, case: Case) -> Mapping[str, Method]:
        """The methods in a case: where a robot's own actuators act, others may be the same scheme."""
        return self.methods

    def of(self, case: Case) -> Dynamics:
        """The dynamics of a case."""


def compared(engines: Mapping[str, Engine], case: Case) -> dict[str, Dynamics]:
    """The dynamics of a case in the two engines that are compared, by their names, mujoco last."""
    return {name: engines[name].of(case) for name in case.robot.compared}


def rows_of_states(*values: ArrayLike) -> tuple[tuple[int, ...], list[Array]]:
    """The batch shape that values (..., n) have together, and each of them as rows, (states, n), contiguous.

    Each has an n of its own, as positions and speeds may; a number is a row of one.
    """
    arrays = [np.atleast_1d(np.asarray(value, float)) for value in values]
    batch = np.broadcast_shapes(*(array.shape[:-1] for array in arrays))
    rows = [np.broadcast_to(array, (*batch, array.shape[-1])) for array in arrays]
    return batch, [np.array(row, order="C").reshape(-1, row.shape[-1]) for row in rows]


def as_far_as_it_goes(t: Array, states: Array, start: Array, why: str) -> tuple[Array, str | None]:
    """The states of one run at the times t, NaN from where they are no longer finite; and when and why that is, or None.

    states: (times reached, n); start: (n,), the first.
    """
    path = np.full((len(t), start.size), np.nan)
    path[: len(states)], path[0] = states, start
    finite = np.isfinite(path).all(axis=1)
    path[np.cumsum(~finite) > 0] = np.nan
    ended = None if finite.all() else f"at t = {t[int(np.argmin(finite)) - 1]:g} s: {' '.join(why.split())}"
    return path, ended
