"""A fleet is run: what is missing is handed out, what comes back is kept, and each file's report follows."""

import pickle
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from ..experiment import TIMED_LAST
from ..experiments import EXPERIMENTS
from .file_pieces import Asked, Known, computed, read_file, reported
from .kept import Kept, write_report
from .models import Model, bundle, place_of
from .piece import Door, Outcome, Piece
from .row import AGREE, BROKE, REFUSED

READ, COMPUTE, TIME, REPORT = range(4)  # ranks: timed experiments wait for the others, and with them for nothing

EXPECTED = {
    "trajectory": 5.0,
    "stability": 3.0,
    "speed": 8.0,
    "reduction": 3.0,
    "report": 3.0,
}  # s, before one has ended
FEW_SECONDS = 0.4  # of any other


@dataclass
class Task:
    """One file, as far as it is done."""

    model: Model
    known: Known | None = None
    found: dict = field(default_factory=dict)  # what experiments found, by name; in words why one gave nothing
    keys: dict = field(default_factory=dict)
    expected: set = field(default_factory=set)  # experiments that have not come back
    left_out: list = field(default_factory=list)
    broke: bool = False
    seconds: float = 0.0
    row: dict | None = None


class Run:
    """A fleet under way. after it `rows` has a row for each model, and `parts` the files that are only included by others."""

    def __init__(self, models: Sequence[Model], asked: Asked, door: Door, kept: Kept, out: Path):
        self.asked, self.door, self.kept, self.out = asked, door, kept, out
        self.tasks = [Task(model) for model in models]
        self.rows, self.parts, self.under_way = [], [], {}
        self.took, self.done_before, self.new, self.machines = (
            {},
            0,
            [],
            set(),
        )  # s by a watch of pieces that ended, by their kind
        self.no_timing = door.no_timing()

    def carry_out(self, progress: Callable[[], object]) -> None:
        """All of it. progress is called when something has changed."""
        for task in self.tasks:
            self.begin(task)
        while self.door.under_way:
            progress()
            if done := self.door.next():
                piece, outcome = done
                task, step = self.under_way.pop(piece.name)
                self.took.setdefault(step, []).append(outcome.wall)
                self.machines.add(outcome.machine)
                task.seconds += outcome.seconds
                self.came(task, step, outcome)
        progress()

    def begin(self, task: Task) -> None:
        """The file is read, if that is not known."""
        task.keys["read"] = self.key(task, "read", self.asked)
        known = self.kept.get(task.keys["read"])
        if known is None:
            self.hand_out(task, "read", Piece("", read_file, (task.model.shown, self.asked), rank=READ))
        else:
            self.was_read(task, known)

    def key(self, task: Task, *what: object) -> str:
        return self.kept.key(task.model.hash, task.model.shown, *what)

    def hand_out(self, task: Task, step: str, piece: Piece) -> None:
        piece = piece._replace(
            name=f"{step} of {task.model.shown}", group=task.model.hash, shared=pickle.dumps(bundle(task.model)),
            weight=float(task.known.joints or 0) if task.known else 0.0,
        )  # fmt: skip
        self.under_way[piece.name] = task, step
        self.door.submit(piece)

    def came(self, task: Task, step: str, outcome: Outcome) -> None:
        """What a piece has found is kept, and what follows from it begins."""
        if outcome.broke:
            task.broke = True
            if step in ("read", "report"):
                self.ended(
                    task, {"verdict": BROKE, "reason": f"{step}: {outcome.broke}", "seconds": round(task.seconds, 2)}
                )
                return
            task.found[step] = outcome.broke
        else:
            value = outcome.returned
            if step == "report":
                row, written = value
                write_report(self.out / place_of(task.model.shown), written)
                if not task.broke:
                    self.kept.put(task.keys[step], row)
                self.ended(task, row)
                return
            self.kept.put(task.keys[step], value if step == "read" else (value, outcome.seconds))
            if step == "read":
                self.was_read(task, value)
                return
            task.found[step] = value
        task.expected.discard(step)
        self.report_if_whole(task)

    def was_read(self, task: Task, known: Known) -> None:
        """Its experiments are asked for, but for those that are known; a file without a model of its own is left out."""
        task.known = known
        if known.refused:
            if task.model.included_by:
                self.parts.append(
                    (task.model.shown, f"it is no model of its own, and included by {task.model.included_by}")
                )
                task.row = {}
            else:
                self.ended(task, {"verdict": REFUSED, "reason": known.refused, "seconds": round(task.seconds, 2)})
            return
        task.left_out = list(known.reasons)
        for name in known.experiments:
            timed = name in TIMED_LAST
            if name == "diagnosis":  # it is made with the report, if something fails
                continue
            if timed and self.no_timing:
                task.left_out.append((name, f"it measures time: {self.no_timing}"))
                continue
            task.keys[name] = self.key(task, name, self.asked.is_quick)
            task.expected.add(name)
        self.report_key(task)
        row = self.kept.get(task.keys["report"])
        if row is not None and (self.out / place_of(task.model.shown) / "index.html").is_file():
            self.done_before += 1
            self.ended(task, row)
            return
        for name in tuple(task.expected):
            value = self.kept.get(task.keys[name])
            if value is not None:
                task.found[name], seconds = value
                task.seconds += seconds
                task.expected.discard(name)
        for name in sorted(task.expected, key=list(EXPERIMENTS).index):
            timed = name in TIMED_LAST
            arguments = (name, timed, task.model.shown, self.asked)
            self.hand_out(task, name, Piece("", computed, arguments, rank=TIME if timed else COMPUTE, timed=timed))
        self.report_if_whole(task)

    def report_key(self, task: Task) -> None:
        task.keys["report"] = self.key(task, "report", self.asked, sorted(task.expected), task.left_out)

    def report_if_whole(self, task: Task) -> None:
        if not task.expected:
            arguments = (task.found, task.left_out, task.seconds, task.model.shown, self.asked)
            self.hand_out(task, "report", Piece("", reported, arguments, rank=REPORT))
            task.found = {}

    def ended(self, task: Task, row: dict) -> None:
        """A file is done."""
        known = task.known or Known("")
        about = {"file": task.model.shown, "sha256": task.model.sha256, "joints": known.joints}
        about |= {"file_integrator": known.integrator, "file_dt_s": known.dt}
        about |= dict.fromkeys(("worst_ratio", "stable_at_file_dt", "limit_s"))
        task.row = about | row
        self.rows.append(task.row)
        self.new.append(task.row)

    def take_new(self) -> list[dict]:
        """The rows of files that have ended since the last call."""
        new, self.new = self.new, []
        return new

    @property
    def work(self) -> float:
        """Seconds by a watch in all pieces."""
        return sum(sum(each) for each in self.took.values())

    @property
    def pieces_done(self) -> int:
        return sum(len(each) for each in self.took.values())

    def still(self) -> list[str]:
        """The kinds of the pieces that have not ended, as far as they are known: a file that is not read has all of them."""
        under_way = [step for _, step in self.under_way.values()]
        waiting = [task for task in self.tasks if task.row is None]
        later = [name for task in waiting if task.known is None for name in self.asked.names]
        return under_way + later + ["report"] * (len(waiting) - under_way.count("report"))

    @property
    def pieces_known(self) -> int:
        return self.pieces_done + len(self.still())

    def seconds_left(self, workers: int) -> float | None:
        """How long it takes still, at what pieces of each kind took so far; None where no piece has ended."""
        if not self.took:
            return None
        means = EXPECTED | {step: sum(each) / len(each) for step, each in self.took.items()}
        left = [(means.get(step, FEW_SECONDS), step in TIMED_LAST) for step in self.still()]
        return sum(took if timed else took / workers for took, timed in left)

    @property
    def files_done(self) -> int:
        return sum(task.row is not None for task in self.tasks)

    def verdicts(self) -> Counter:
        """How many files have which verdict, so far."""
        return Counter(row["verdict"] for row in self.rows)

    @property
    def is_good(self) -> bool:
        """Whether none differs, and none broke."""
        return set(self.verdicts()) <= {AGREE, REFUSED}
