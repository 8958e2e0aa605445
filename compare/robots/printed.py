"""What is stated of a robot beside its Tree: what a solution prints and claims, features of a file."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

from numpy.typing import ArrayLike


class Printed(NamedTuple):
    item: str
    quantity: str  # "holding torque", "qdd" or "Mbar"
    posture: str
    values: ArrayLike
    unit: str
    half_digit: float  # half a unit of the last printed digit
    torque: str = "none"  # or the item whose result is applied
    is_rounding: bool = False  # zero except for rounding: compared with the exact value
    to_every_digit: tuple[str, ...] = ()  # "exact", "tmt": computations that reproduce the digits of rounding
    sizes: tuple[str, ...] = ()  # joints whose component agrees with exact arithmetic only in size


class Question(NamedTuple):
    """A question of the assignment, and where the report answers it."""

    part: str
    question: str
    answered_in: str
    # (kind, ...): ("figure", name), ("printed", items), ("largest", experiment, quantity, {column: value})
    answer: tuple[Any, ...]


class Claims(NamedTuple):
    """Claims about RK4 runs of a robot that is held at a posture by the torque that balances gravity."""

    dt: float  # s
    duration: float  # s
    left: str  # posture that the robot leaves because of rounding
    left_after: float  # s, about
    kept: str  # posture that it keeps
    end: str  # claimed last posture of a run from `kept`
    of_scenes: Mapping[str, str]  # the claim in words, by scene
    figures: Mapping[str, int]  # number of the printed figure, by scene


@dataclass(frozen=True)
class Feature:
    """What a file has beside masses and frames, see engines.mujoco.inventory."""

    feature: str
    names: tuple[str, ...]  # of the elements that have it
    treatment: str  # modelled, switched_off, open_tree, left_out
    reason: str

    @property
    def count(self) -> int:
        return len(self.names)
