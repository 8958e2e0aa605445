"""The setup of an experiment: the robot, the engines, and the size of the run."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, fields
from functools import cached_property
from typing import Any, TypeVar, cast

from ..core.finding import Finding
from ..engines import Dynamics, Engine, compared, made
from ..engines.mujoco.reading import Reading
from ..engines.own import Own
from ..robots import Robot
from ..robots import states as samples
from ..robots.case import Case
from .options import Options

SECONDS_OF_OWN = 5.0  # of a user's own equations at all random states together
Value = TypeVar("Value")
Asked = TypeVar("Asked", bound=Options)


def engines(mujoco: Engine, own: Engine | None = None) -> dict[str, Engine]:
    """All engines by name; some may be unavailable. own: of a user's own equations."""
    schemes = [method.scheme for method in mujoco.methods.values()]
    return made(schemes, {"mujoco": mujoco} | ({"own": own} if own else {}))


def different_first(cases: Sequence[Case]) -> list[Case]:
    """The cases whose trees differ before others: their code compiles in parallel, and the others find it."""
    trees = [case.tree for case in cases]
    return sorted(cases, key=lambda case: trees[: cases.index(case)].count(case.tree))


def nothing(*_: Any) -> None:
    """Do nothing."""


@dataclass(frozen=True, eq=False)
class Setup:
    """What an experiment has.

    size: "full"; "quick": some parts, in seconds; "small": all parts, with few states and steps, for tests.
    """

    robot: Robot
    engines: Mapping[str, Engine]
    states: int = 10_000  # random states
    exact_states: int = 200  # the first of these are compared with the exact values too
    map: Callable[..., Iterable[Any]] = map  # for the scenes of an experiment: parallel where possible
    reading: Reading | None = None  # of a robot's file
    quiet: Callable[[], Any] = nothing  # waits until nothing else runs: for timings
    progress: Callable[[str], Any] = nothing  # reports the progress of long work
    tell: Callable[[str], Any] = nothing  # says what is known before long work ends
    finer: tuple[int, ...] = (1, 16, 128)  # steps of a trajectory, as multiples of the scene's own
    alone: bool = False  # whether the experiment runs by itself, and may take longer than in `all`
    options: Options = field(default_factory=Options)  # of the command line
    command: str = ""  # the words of the run
    size: str = "full"

    def asked(self, kind: type[Asked]) -> Asked:
        """The options of an experiment, as far as the run has them; the defaults of the others."""
        names = [field.name for field in fields(kind) if hasattr(self.options, field.name)]
        return kind(**{name: getattr(self.options, name) for name in names})

    @property
    def is_quick(self) -> bool:
        return self.size == "quick"

    @property
    def own(self) -> Own | None:
        """The engine of a user's own equations, if there are any."""
        return cast("Own | None", self.engines.get("own"))

    def of(self, full: Value, quick: Value, small: Value) -> Value:
        """The value for this size of the run."""
        return {"full": full, "quick": quick, "small": small}[self.size]

    @classmethod
    def quick(cls, robot: Robot, engines: Mapping[str, Engine], **more: Any) -> "Setup":
        return cls(robot, engines, states=1000, exact_states=20, finer=(1,), size="quick", **more)

    @classmethod
    def small(cls, robot: Robot, engines: Mapping[str, Engine], **more: Any) -> "Setup":
        return cls(robot, engines, states=50, exact_states=2, finer=(1, 2), size="small", **more)

    def compared(self, case: Case | None = None) -> dict[str, Dynamics]:
        """The dynamics of a case (default: the robot unchanged) in the two engines, mujoco last."""
        return compared(self.engines, case or self.robot.case())

    @cached_property
    def named(self) -> samples.Sample:
        return samples.named(self.robot)

    @cached_property
    def random(self) -> samples.Sample:
        if not self.own:
            return samples.random(self.robot, self.states, self.exact_states)
        equations = self.own.equations
        count = equations.affordable(self.states, SECONDS_OF_OWN)
        sample = samples.random(self.robot, count, self.exact_states)
        if count < self.states:
            values = {"count": count, "states": self.states, "seconds": equations.seconds}
            sample.notes = (Finding("shared", "fewer_states", values), *sample.notes)
        return sample
