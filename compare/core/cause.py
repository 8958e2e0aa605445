"""A cause: what explains failing checks, as the tables, results.json and the terminal list it."""

from dataclasses import dataclass
from math import inf, isfinite
from typing import Any


@dataclass(frozen=True, kw_only=True)
class Cause:
    """One explanation: an option, a convention, a number or a term that is not as stated, or two of them."""

    rank: int  # 1: an option, or the convention of a joint; 2: one number, term or coefficient; 3: two, or rounding
    place: str  # such as "mass of forearm"
    stated: float | str
    explains: float | str | None  # the value that explains the difference; None: it is not a finite number
    text: str = ""  # the cause in words
    kind: str = ""  # "number", "term", "slip", "order", ...
    unit: str = ""  # "times" of a factor
    left_over: float = 0.0  # of the difference, a share
    tied: int = 0  # other causes of the same rank that explain as much
    parts: tuple["Cause", ...] = ()  # that are said instead of this one: the two of rank 3
    joints: str = ""  # how joints are to be stated, joints=[...]; "": no convention, or they cannot be
    quantity: str = ""  # of a number of the file: its name in `parameters`
    form: str = ""  # its place with {} for the body or joint
    owners: int = 1  # the bodies or joints that it is of; of a body's numbers how many differ
    cost: float = 0.0  # beside that of its kind and its numbers, see diagnosis/likelihood.py
    size: float = inf  # of such a number: its difference over its tolerance

    def record(self) -> dict[str, Any]:
        """As in results.json and in a report."""
        values = {"stated": self.stated, "found": self.explains}
        unknown = {
            name: None for name, value in values.items() if isinstance(value, float) and not isfinite(value)
        }
        return {"rank": self.rank, "place": self.place} | values | unknown | {"text": self.text}
