"""A fleet is run: what is missing is handed out, what comes back is kept, and each file's report follows."""

import pickle
from bisect import insort
from collections.abc import Callable, Mapping, Sequence
from math import inf
from pathlib import Path
from types import MappingProxyType

from ..experiments import EXPERIMENTS, TIMED
from .file_pieces import Asked, Known, findings, read_file, reported, untimed_part
from .kept import Kept, write_report
from .models import Model, bundle, place_of_report
from .piece import Door, Outcome, Piece
from .row import BROKE, DIFFER, REFUSED
from .standing import Standing
from .task import Task, Waiting

TO_READ, TO_COMPUTE, TO_TIME, TO_REPORT = range(4)  # ranks: what comes first
UNTIMED = ", untimed"  # of a timed experiment, the step before it
# pieces that are handed out beforehand, for each worker and besides: they are in memory
AHEAD_FOR_EACH, AHEAD_FOR_ALL = 4, 16
MARK = ".fleet"  # the file in a report that says from what it was made


def tasks_of(models: Sequence[Model]) -> list[Task]:
    """The files that are computed, each with those that have the same content."""
    tasks, by_content = [], {}
    for model in models:
        same = [] if model.included_by or not model.sha256 else by_content.setdefault(model.sha256, [])
        try:
            first = next((task for task in same if model.is_copy_of(task.model)), None)
        except OSError:
            first = None
        if first:
            first.copies.append(model)
        else:
            tasks.append(Task(model))
            same.append(tasks[-1])
    return tasks


class Run(Standing):
    """A fleet under way. After it `rows` has a row for each model, and `parts` the files that are only included by others."""

    def __init__(
        self,
        models: Sequence[Model],
        asked: Asked,
        door: Door,
        kept: Kept,
        out: Path,
        sent: Mapping = MappingProxyType({}),
    ):
        """sent: the files of a solution, which are sent with each model; see Asked."""
        super().__init__(tasks_of(models))
        self.sent = dict(sent)
        self.asked, self.door, self.kept, self.out = asked, door, kept, out
        self.waiting, self.timed, self.under_way, self.count = [], [], {}, 0
        self.no_timing = door.no_timing()
        self.workers = max(1, door.workers())
        self.most = AHEAD_FOR_EACH * self.workers + AHEAD_FOR_ALL

    def carry_out(self, progress: Callable[[], object]) -> None:
        """All of it. progress is called when something has changed."""
        for task in self.tasks:
            self.begin(task)
            self.hand_out()
            progress()
        while self.door.under_way:
            progress()
            if done := self.door.next():
                piece, outcome = done
                task, step = self.under_way.pop(piece.name)
                task.in_door -= 1
                self.took.setdefault(step, []).append((task.joints or 0, outcome.wall))
                self.machines |= {outcome.machine} - {""}
                task.seconds += outcome.seconds
                self.came(task, step, outcome)
            self.hand_out()
        progress()

    def begin(self, task: Task) -> None:
        """The file is read, if that is not known."""
        try:
            task.keys["read"] = self.key(task, "read", self.asked)
        except OSError as error:
            self.ended(task, REFUSED, f"it cannot be read: {error.strerror}")
            return
        known = self.kept.get(task.keys["read"])
        if known is None:
            self.ask(task, "read", TO_READ)
        else:
            self.was_read(task, known)

    def key(self, task: Task, *what: object) -> str:
        return self.kept.key(task.model.hash, task.model.sha256, task.model.shown, *what)

    def ask(self, task: Task, step: str, rank: int) -> None:
        """A piece waits until it is handed out."""
        self.count += 1
        weight = inf if step == "report" else task.joints or 0  # what ends a file comes before what begins another
        insort(
            self.timed if step in TIMED else self.waiting,
            Waiting(rank, -weight, self.count, task, step),
        )

    def hand_out(self) -> None:
        """As many pieces as keep the workers busy; timed ones of a pool at the end, for all others wait meanwhile."""
        of_timed = sum(step in TIMED for _, step in self.under_way.values())
        while self.waiting and len(self.under_way) - of_timed < self.most:
            self.hand(self.waiting.pop(0))
        first = self.waiting[0].rank if self.waiting else TO_REPORT
        while self.timed and of_timed < self.workers and (first > TO_TIME or not self.door.times_alone):
            of_timed += self.hand(self.timed.pop(0))

    def hand(self, entry: Waiting) -> bool:
        """Hand out a piece, if its file is still what it was when the fleet began."""
        rank, _, _, task, step = entry
        if task.row is not None:
            return False
        try:
            task.packed = task.packed or pickle.dumps(bundle(task.model) | self.sent)
        except OSError as error:
            self.ended(task, BROKE, error.strerror)
            return False
        function, arguments = {
            "read": lambda: (read_file, (task.model.shown, self.asked)),
            "report": lambda: (reported, (self.found(task), task.left_out, task.seconds, task.model.shown, self.asked)),
        }.get(step, lambda: self.computing(task, step))()
        piece = Piece(
            f"{step} of {task.model.shown}", function, arguments, task.model.hash, rank, -entry.lighter,
            step in TIMED, task.packed,
        )  # fmt: skip
        self.under_way[piece.name] = task, step
        task.in_door += 1
        self.door.submit(piece)
        return True

    def computing(self, task: Task, step: str) -> tuple[Callable, tuple]:
        """The call of an experiment, or of what of it is no timing."""
        about = task.model.shown, self.asked
        if step.endswith(UNTIMED):
            return untimed_part, (step.removesuffix(UNTIMED), *about)
        work = self.kept.get(task.keys[step + UNTIMED]) if step in TIMED else None
        return findings, (step, work and work[0], *about)

    def found(self, task: Task) -> dict:
        """What the experiments of a file found, or in words why one gave nothing."""
        names = [name for name in EXPERIMENTS if name in task.keys and name not in task.lost]
        kept = {name: self.kept.get(task.keys[name]) for name in names}
        return task.lost | {
            name: value[0][0] if value else "what was kept of it is gone" for name, value in kept.items()
        }

    def came(self, task: Task, step: str, outcome: Outcome) -> None:
        """What a piece has found is kept, and what follows from it begins."""
        if task.in_door == 0:
            task.packed = b""
        if task.row is not None:
            return
        if outcome.broke and step in ("read", "report"):
            self.ended(task, BROKE, f"{step}: {outcome.broke}")
        elif outcome.broke:
            name = step.removesuffix(UNTIMED)
            task.lost[name] = outcome.broke
            self.has_ended(task, name)
        elif step == "read":
            self.kept.put(task.keys[step], outcome.returned)
            self.was_read(task, outcome.returned)
        elif step == "report":
            row, written = outcome.returned
            write_report(self.out / place_of_report(task.model.shown), written | {MARK: task.keys[step].encode()})
            if not task.lost:
                self.kept.put(task.keys[step], row)
            self.ended(task, **row)
        else:
            self.kept.put(task.keys[step], (outcome.returned, outcome.seconds))
            self.go_on(task, step, outcome.returned)

    def was_read(self, task: Task, known: Known) -> None:
        """Its experiments are asked for, except for those that are known; a file without a model of its own is left out."""
        task.known = known
        if known.refused and task.model.included_by:
            task.row = {}
            self.parts.append((task.model.shown, f"no model of its own, and included by {task.model.included_by}"))
            return
        if known.refused:
            self.ended(task, REFUSED, known.refused)
            return
        if known.differs:
            self.ended(task, DIFFER, known.differs)
            return
        timed = [name for name in known.experiments if name in TIMED] if self.no_timing else []
        task.left_out = [*known.reasons, *((name, f"it measures time: {self.no_timing}") for name in timed)]
        names = [name for name in known.experiments if name not in timed]
        if not names:
            self.ended(task, REFUSED, f"nothing can be compared: {'; '.join(map(': '.join, task.left_out))}")
            return
        for name in names:
            if name != "diagnosis":  # it is made with the report, if something fails
                task.keys[name] = self.key(task, name, *self.asked.alike)
                task.keys[name + UNTIMED] = self.key(task, name + UNTIMED, *self.asked.alike)
        task.keys["report"] = self.key(task, "report", self.asked, names, task.left_out)
        row = self.kept.get(task.keys["report"])
        if row is not None and self.is_written(task):
            self.done_before += task.files
            self.ended(task, **row)
            return
        for name in (name for name in names if name in task.keys):
            steps = [name + UNTIMED, name] if name in TIMED else [name]
            have = {step: value[1] for step in steps if (value := self.kept.get(task.keys[step]))}
            task.seconds += sum(have.values())
            self.pieces_before += len(have)
            if name not in have:
                task.expected.add(name)
                self.ask_next(task, next(step for step in steps if step not in have))
        self.has_ended(task, "")

    def ask_next(self, task: Task, step: str) -> None:
        """A step of an experiment is asked for."""
        when_timed = TO_TIME if self.door.times_alone else TO_READ
        self.ask(task, step, when_timed if step in TIMED else TO_COMPUTE)

    def go_on(self, task: Task, step: str, value: object) -> None:
        """After what of an experiment is no timing come its times; after the last one the report."""
        if step.endswith(UNTIMED):
            self.ask_next(task, step.removesuffix(UNTIMED))
            return
        self.differs(task, value[1])
        self.has_ended(task, step)

    def is_written(self, task: Task) -> bool:
        """Whether the report of a file that is there is the one that is asked for."""
        try:
            return (self.out / place_of_report(task.model.shown) / MARK).read_bytes() == task.keys["report"].encode()
        except OSError:
            return False

    def has_ended(self, task: Task, name: str) -> None:
        """An experiment has come back; after the last one comes the report, but not between timed ones that all wait for."""
        task.expected.discard(name)
        if not task.expected:
            after_timed = self.door.times_alone and any(name in TIMED for name in task.keys)
            self.ask(task, "report", TO_REPORT if after_timed else TO_COMPUTE)

    def still(self) -> list[tuple[Task, str]]:
        """The pieces that have not ended, as far as they are known: a file that is not read has all of them."""
        asked = [*self.under_way.values(), *((entry.task, entry.step) for entry in [*self.waiting, *self.timed])]
        asked = [(task, step) for task, step in asked if task.row is None]
        asked += [(task, step.removesuffix(UNTIMED)) for task, step in asked if step.endswith(UNTIMED)]
        reports = {id(task) for task, step in asked if step == "report"}
        for task in (task for task in self.tasks if task.row is None):
            asked += [(task, name) for name in self.asked.names if task.known is None and name != "diagnosis"]
            asked += [(task, "report")] * (id(task) not in reports)
        return asked
