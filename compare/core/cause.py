"""A cause: what explains failing checks, as the tables, results.json and the terminal list it."""

from dataclasses import dataclass
from math import inf

COLUMNS = ("rank", "place", "stated", "found", "text")  # of results.json and of a report


@dataclass(frozen=True, kw_only=True)
class Cause:
    """One explanation: an option, a convention, a number or a term that is not as stated, or two of them."""

    rank: (
        int  # 1: an option, or the convention of a joint; 2: one number, term or coefficient; 3: two of these
    )
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
    size: float = inf  # of such a number: its difference over its tolerance

    def record(self) -> dict[str, float | str | None]:
        """The values of COLUMNS."""
        values = self.rank, self.place, self.stated, self.explains, self.text
        return dict(zip(COLUMNS, values))
