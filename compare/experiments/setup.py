"""What an experiment is given: the robot, the engines, and how much is to be done."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import TypeVar

from ..engines import Dynamics, Engine, compared, made
from ..robots import Robot
from ..robots import states as samples
from ..robots.case import Case

T = TypeVar("T")
SECONDS_OF_OWN = 5.0  # of a user's own equations, called once at each random state


def engines(mujoco: Engine, own: Engine | None = None) -> dict[str, Engine]:
    """All engines by name; some may be unavailable. own: the engine of a user's own equations, if there are any."""
    schemes = [method.scheme for method in mujoco.methods.values()]
    return made(schemes, {"mujoco": mujoco} | ({"own": own} if own else {}))


def nothing(*_: object) -> None:
    """Do nothing."""


@dataclass(frozen=True)
class Setup:
    """What an experiment needs: the robot, the engines, and how much is to be done."""

    robot: Robot
    engines: Mapping[str, Engine]
    states: int = 10_000  # random states
    exact_states: int = 200  # of these, how many are compared with the exact values too
    map: Callable = map  # where the scenes of an experiment may run side by side
    reading: object | None = None  # what the file was read as, see engines.mujoco.reading; None: the numbers are stated
    quiet: Callable = nothing  # waits until nothing runs beside: for timings
    progress: Callable = nothing  # says how far long work has come
    background: dict = field(default_factory=dict)  # work under way, by its name
    finer: tuple[int, ...] = (1, 16, 128)  # steps of a trajectory, as multiples of the scene's own
    faults: bool = False  # diagnosis: of made faults, in place of the robot's own differences
    alone: bool = False  # whether an experiment is asked for by itself, and may take longer than in `all`
    # where the calls of a long list go, see fleet.calls.Calls; None: wherever `map` has them made
    door: object | None = None
    asked: tuple[float, str] | None = None  # stability: a step, s, and an integrator of MuJoCo that are asked about
    size: str = "full"  # or "quick": some paths, for a first answer in seconds; "small": all paths, as little as may be

    @property
    def is_quick(self) -> bool:
        """Whether some paths are left out."""
        return self.size == "quick"

    def of(self, full: T, quick: T, small: T) -> T:
        """What a run of this size takes."""
        return {"full": full, "quick": quick, "small": small}[self.size]

    @classmethod
    def quick(cls, robot: Robot, engines: Mapping[str, Engine], **more) -> "Setup":
        """Fewer of everything, for a first answer in seconds."""
        return cls(robot, engines, states=1000, exact_states=20, finer=(1,), size="quick", **more)

    @classmethod
    def small(cls, robot: Robot, engines: Mapping[str, Engine], **more) -> "Setup":
        """Every path of a full run with few states and steps: for tests."""
        return cls(robot, engines, states=50, exact_states=2, finer=(1, 2), size="small", **more)

    def compared(self, case: Case | None = None) -> dict[str, Dynamics]:
        """The dynamics of a case (of the robot as it is) in the two engines that are compared, mujoco last."""
        return compared(self.engines, case or self.robot.case())

    @cached_property
    def named(self) -> samples.Sample:
        """The named postures."""
        return samples.named(self.robot)

    @cached_property
    def random(self) -> samples.Sample:
        """Random states."""
        own = self.engines.get("own")
        count = own.equations.affordable(self.states, SECONDS_OF_OWN) if own else self.states
        sample = samples.random(self.robot, count, self.exact_states)
        if count < self.states:
            takes = f"your equations take {own.equations.seconds:.2g} s a state"
            sample.notes = (f"{count:,} random states in place of {self.states:,}: {takes}.", *sample.notes)
        return sample
