"""The progress of a fleet: the state of each file, verdicts so far, time left."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field
from statistics import fmean
from typing import NamedTuple

from .file_tasks import FileInfo
from .models import Model
from .table import BAD_VERDICTS


@dataclass
class FileState:
    """One file and what is done of it."""

    model: Model
    copies: list[Model] = field(default_factory=list)  # files with the same content
    info: FileInfo | None = None
    keys: dict = field(default_factory=dict)  # cache keys by step
    lost: dict = field(default_factory=dict)  # experiments that broke off, and why
    expected: set = field(default_factory=set)  # experiments that have not ended
    left_out: list = field(default_factory=list)  # other experiments, and why
    seconds: float = 0.0  # processor time
    submitted: int = 0  # tasks at the executor
    packed: bytes = b""  # the bundle, while tasks are at the executor
    row: dict | None = None

    @property
    def files(self) -> int:
        return 1 + len(self.copies)

    @property
    def joints(self) -> int | None:
        return self.info.joints if self.info else None


class QueuedStep(NamedTuple):
    """A step of a file before it is submitted; sorted in this order."""

    rank: int
    lighter: float
    number: int
    file: FileState
    step: str


class Progress:
    """rows: of the files that are done; parts: files that other models include, and why they are no models."""

    def __init__(self, files: Sequence[FileState]):
        self.files = files
        self.rows, self.new, self.parts, self.machines = [], [], [], set()
        self.walls = {False: [], True: []}  # s, of the tasks that ended, by whether they are timed
        self.files_cached, self.tasks_cached = 0, 0

    def end_file(self, file: FileState, verdict: str, reason: str | None, **more: object) -> None:
        """A file is done. more: the rest of its row, if it has a report."""
        info, name = file.info or FileInfo(""), file.model.shown
        file.row = {
            "file": name, "sha256": file.model.sha256, "verdict": verdict, "reason": reason or "", "joints": info.joints,
            "reference": info.reference, "why_itself": info.why_itself, "file_integrator": info.integrator,
            "file_dt_s": info.dt, "worst_ratio": None, "stable_at_file_dt": None, "limit_s": None,
            "seconds": round(file.seconds, 2), "has_report": bool(more), "report_of": name,
        } | more  # fmt: skip
        same = ": ".join(filter(None, (f"copy of {name}", reason)))
        rows = [file.row, *(file.row | {"file": copy.shown, "reason": same, "seconds": 0.0} for copy in file.copies)]
        self.rows += rows
        self.new += rows

    def take_new(self) -> list[dict]:
        new, self.new = self.new, []
        return new

    @property
    def files_done(self) -> int:
        return sum(file.files for file in self.files if file.row is not None)

    @property
    def files_in_all(self) -> int:
        return sum(file.files for file in self.files)

    @property
    def tasks_done(self) -> int:
        return sum(map(len, self.walls.values()))

    def verdicts(self) -> Counter:
        return Counter(row["verdict"] for row in self.rows)

    @property
    def is_good(self) -> bool:
        return not set(self.verdicts()) & set(BAD_VERDICTS)

    def seconds_left(self, left: dict[bool, int], workers: int, times_alone: bool) -> float | None:
        """An estimate from the mean duration of the tasks so far; None before one has ended. left: tasks by `timed`."""
        if not self.tasks_done:
            return None
        mean = {timed: fmean(walls or self.walls[not timed]) for timed, walls in self.walls.items()}
        timed, others = left[True] * mean[True], left[False] * mean[False] / workers
        return timed + others if times_alone else max(timed, others)
