"""A file of a fleet, as far as it is done, and its pieces that wait."""

from dataclasses import dataclass, field
from typing import NamedTuple

from .file_pieces import Known
from .models import Model


@dataclass
class Task:
    """One file, as far as it is done."""

    model: Model
    copies: list[Model] = field(default_factory=list)  # files with the same content
    known: Known | None = None
    keys: dict = field(default_factory=dict)  # under which results are kept, by their kind
    lost: dict = field(default_factory=dict)  # experiments that gave nothing, and why
    expected: set = field(default_factory=set)  # experiments that have not come back
    left_out: list = field(default_factory=list)
    seconds: float = 0.0
    in_door: int = 0  # pieces that are handed out
    packed: bytes = b""  # the model with what it needs, while pieces are handed out
    differs: str = ""  # the first check that does not hold, before there is a row
    row: dict | None = None

    @property
    def files(self) -> int:
        """How many files it stands for."""
        return 1 + len(self.copies)

    @property
    def joints(self) -> int | None:
        return self.known.joints if self.known else None


class Waiting(NamedTuple):
    """A piece that is not handed out yet; they are in this order."""

    rank: int
    lighter: float
    number: int
    task: Task
    step: str
