"""Run a fleet: submit what the cache does not have, store the results, write a report for each file."""

import pickle
from bisect import insort
from collections.abc import Callable, Mapping, Sequence
from math import inf
from pathlib import Path
from types import MappingProxyType

from ..experiments import EXPERIMENTS, TIMED
from ..process.child import Outcome
from .cache import Cache, write_report
from .file_tasks import FileInfo, FleetOptions, read_file, reported, result_of, untimed_part
from .models import Model, bundle, place_of_report
from .progress import FileState, Progress, QueuedStep
from .table import BROKE, DIFFER, REFUSED
from .tasks import Executor, Task

TO_READ, TO_COMPUTE, TO_TIME, TO_REPORT = range(4)  # ranks
UNTIMED = ", untimed"  # suffix of the step before a timed experiment
AHEAD_PER_WORKER, AHEAD = 4, 16  # tasks that are submitted in advance; they are in memory
MARK = ".fleet"  # file in a report with its cache key


def files_of(models: Sequence[Model]) -> list[FileState]:
    files, by_content = [], {}
    for model in models:
        same = [] if model.included_by or not model.sha256 else by_content.setdefault(model.sha256, [])
        try:
            first = next((file for file in same if model.is_copy_of(file.model)), None)
        except OSError:
            first = None
        if first:
            first.copies.append(model)
        else:
            files.append(FileState(model))
            same.append(files[-1])
    return files


class Run(Progress):
    """A running fleet. After carry_out `rows` has a row for each model."""

    def __init__(
        self,
        models: Sequence[Model],
        options: FleetOptions,
        executor: Executor,
        cache: Cache,
        out: Path,
        sent: Mapping = MappingProxyType({}),
    ):
        """sent: the files of a solution, added to the bundle of each model; see FleetOptions."""
        super().__init__(files_of(models))
        self.options, self.executor, self.cache, self.out, self.sent = options, executor, cache, out, dict(sent)
        self.waiting, self.timed, self.under_way, self.count = [], [], {}, 0
        self.no_timing = executor.no_timing()
        self.workers = max(1, executor.workers())
        self.ahead = AHEAD_PER_WORKER * self.workers + AHEAD

    def carry_out(self, progress: Callable[[], object]) -> None:
        """Run to the end. progress is called after each change."""
        for file in self.files:
            self.begin(file)
            self.submit_waiting()
            progress()
        while self.executor.under_way:
            progress()
            if done := self.executor.next():
                task, outcome = done
                file, step = self.under_way.pop(task.name)
                file.submitted -= 1
                self.walls[task.timed].append(outcome.wall)
                self.machines |= {outcome.machine} - {""}
                file.seconds += outcome.seconds
                self.receive(file, step, outcome)
            self.submit_waiting()
        progress()

    def begin(self, file: FileState) -> None:
        """Read a file, unless the cache has its properties."""
        try:
            file.keys["read"] = self.key(file, "read", self.options)
        except OSError as error:
            self.end_file(file, REFUSED, f"not readable: {error.strerror}")
            return
        info = self.cache.get(file.keys["read"])
        if info is None:
            self.queue(file, "read", TO_READ)
        else:
            self.begin_experiments(file, info)

    def key(self, file: FileState, *inputs: object) -> str:
        return self.cache.key(file.model.hash, file.model.sha256, file.model.shown, *inputs)

    def queue(self, file: FileState, step: str, rank: int) -> None:
        self.count += 1
        weight = inf if step == "report" else file.joints or 0  # finish a file before the next one begins
        insort(self.timed if step in TIMED else self.waiting, QueuedStep(rank, -weight, self.count, file, step))

    def submit_waiting(self) -> None:
        """Submit enough tasks to keep the workers busy; a pool runs timed tasks at the end, because all others wait meanwhile."""
        timed = sum(step in TIMED for _, step in self.under_way.values())
        while self.waiting and len(self.under_way) - timed < self.ahead:
            self.submit(self.waiting.pop(0))
        first = self.waiting[0].rank if self.waiting else TO_REPORT
        while self.timed and timed < self.workers and (first > TO_TIME or not self.executor.times_alone):
            timed += self.submit(self.timed.pop(0))

    def submit(self, entry: QueuedStep) -> bool:
        """Submit a task, unless its file has changed since the fleet began."""
        rank, _, _, file, step = entry
        if file.row is not None:
            return False
        try:
            file.packed = file.packed or pickle.dumps(bundle(file.model) | self.sent)
        except OSError as error:
            self.end_file(file, BROKE, error.strerror)
            return False
        name, options = file.model.shown, self.options
        if step == "read":
            function, arguments = read_file, (name, options)
        elif step == "report":
            function, arguments = reported, (self.results(file), file.left_out, file.seconds, name, options)
        elif step.endswith(UNTIMED):
            function, arguments = untimed_part, (step.removesuffix(UNTIMED), name, options)
        else:
            work = self.cache.get(file.keys[step + UNTIMED]) if step in TIMED else None
            function, arguments = result_of, (step, work and work[0], name, options)
        task = Task(
            f"{step} of {name}", function, arguments, file.model.hash, rank, -entry.lighter, step in TIMED, file.packed
        )
        self.under_way[task.name] = file, step
        file.submitted += 1
        self.executor.submit(task)
        return True

    def results(self, file: FileState) -> dict:
        """The results of the experiments of a file, or why one broke off."""
        names = [name for name in EXPERIMENTS if name in file.keys and name not in file.lost]
        values = {name: self.cache.get(file.keys[name]) for name in names}
        return file.lost | {name: value[0] if value else "lost from the cache" for name, value in values.items()}

    def receive(self, file: FileState, step: str, outcome: Outcome) -> None:
        """Store an outcome and queue the steps that depend on it."""
        if file.submitted == 0:
            file.packed = b""
        if file.row is not None:
            return
        if outcome.broke and step in ("read", "report"):
            self.end_file(file, BROKE, f"{step}: {outcome.broke}")
        elif outcome.broke:
            name = step.removesuffix(UNTIMED)
            file.lost[name] = outcome.broke
            self.end_experiment(file, name)
        elif step == "read":
            self.cache.put(file.keys[step], outcome.returned)
            self.begin_experiments(file, outcome.returned)
        elif step == "report":
            row, written = outcome.returned
            write_report(self.out / place_of_report(file.model.shown), written | {MARK: file.keys[step].encode()})
            if not file.lost:
                self.cache.put(file.keys[step], row)
            self.end_file(file, **row)
        else:
            self.cache.put(file.keys[step], (outcome.returned, outcome.seconds))
            if step.endswith(UNTIMED):
                self.queue_experiment(file, step.removesuffix(UNTIMED))
            else:
                self.end_experiment(file, step)

    def begin_experiments(self, file: FileState, info: FileInfo) -> None:
        """Queue the experiments of a file that the cache does not have."""
        file.info = info
        if info.refused and file.model.included_by:
            file.row = {}
            self.parts.append((file.model.shown, f"not a complete model; included by {file.model.included_by}"))
            return
        if info.refused or info.differs:
            self.end_file(file, *((REFUSED, info.refused) if info.refused else (DIFFER, info.differs)))
            return
        timed = [name for name in info.experiments if name in TIMED] if self.no_timing else []
        file.left_out = [*info.reasons, *((name, f"it measures time: {self.no_timing}") for name in timed)]
        names = [name for name in info.experiments if name not in timed]
        if not names:
            self.end_file(file, REFUSED, f"no experiment applies: {'; '.join(map(': '.join, file.left_out))}")
            return
        computed = [name for name in names if name != "diagnosis"]  # it is part of the report, if a check fails
        for name in computed:
            for step in (name, name + UNTIMED):
                file.keys[step] = self.key(file, step, *self.options.key)
        file.keys["report"] = self.key(file, "report", self.options, names, file.left_out)
        row = self.cache.get(file.keys["report"])
        if row is not None and self.is_written(file):
            self.files_cached += file.files
            self.end_file(file, **row)
            return
        for name in computed:
            steps = [name + UNTIMED, name] if name in TIMED else [name]
            seconds = {step: value[1] for step in steps if (value := self.cache.get(file.keys[step]))}
            file.seconds += sum(seconds.values())
            self.tasks_cached += len(seconds)
            if name not in seconds:
                file.expected.add(name)
                self.queue_experiment(file, next(step for step in steps if step not in seconds))
        self.end_experiment(file, "")

    def queue_experiment(self, file: FileState, step: str) -> None:
        rank = TO_COMPUTE if step not in TIMED else TO_TIME if self.executor.times_alone else TO_READ
        self.queue(file, step, rank)

    def is_written(self, file: FileState) -> bool:
        """Whether the report in the folder is up to date."""
        try:
            return (self.out / place_of_report(file.model.shown) / MARK).read_bytes() == file.keys["report"].encode()
        except OSError:
            return False

    def end_experiment(self, file: FileState, name: str) -> None:
        """Queue the report after the last experiment, but not between timed tasks during which all others wait."""
        file.expected.discard(name)
        if not file.expected:
            after_timed = self.executor.times_alone and any(name in TIMED for name in file.keys)
            self.queue(file, "report", TO_REPORT if after_timed else TO_COMPUTE)

    def tasks_left(self) -> dict[bool, int]:
        """The number of tasks to run, by `timed`; a file that is not read counts with all experiments."""
        steps = [*self.under_way.values(), *((entry.file, entry.step) for entry in [*self.waiting, *self.timed])]
        names = [step for file, step in steps if file.row is None and step != "report"]
        names += [step.removesuffix(UNTIMED) for step in names if step.endswith(UNTIMED)]
        files = [file for file in self.files if file.row is None]  # each has a report to come
        for file in files:
            names += self.options.names if file.info is None else ()
        timed = sum(name in TIMED for name in names)
        return {True: timed, False: len(names) - timed + len(files)}
