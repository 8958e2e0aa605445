"""Run a fleet: submit the files whose reports are missing or old, write the report of each as it comes."""

import hashlib
import os
from collections import Counter
from collections.abc import Iterator, Sequence
from concurrent.futures import Future
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from queue import Empty, SimpleQueue

from ..core.text import block
from .cache import program, save, saved
from .executors import Executor, Outcome
from .models import Model, place_of_report
from .table import BROKE, REFUSED, FileRow
from .task import FleetOptions, compare_file

POLLING = 0.3  # s between two questions whether somebody is left to answer
Answer = Future[Outcome[FileRow]]


@dataclass
class Run:
    models: Sequence[Model]
    options: FleetOptions
    executor: Executor
    out: Path
    solution: Model | None = None  # with which all are compared
    rows: list[FileRow] = field(default_factory=list)  # in the end one for each model
    first: dict[object, Model] = field(default_factory=dict)  # by the content of a model and its parts
    copies: list[tuple[Model, Model]] = field(default_factory=list)  # and the first model of the same content
    under_way: dict[Answer, tuple[Model, str]] = field(default_factory=dict)  # and the keys of their reports
    done: SimpleQueue[Answer] = field(default_factory=SimpleQueue)

    def carried_out(self) -> Iterator[FileRow]:
        """Run to the end; each row as it comes, copies last."""
        for model in self.models:
            self.start(model)
        yield from self.rows
        while self.under_way:
            try:
                self.receive(self.done.get(timeout=POLLING))
            except Empty:
                self.executor.check()
            else:
                yield self.rows[-1]
        rows = {row.file: row for row in self.rows}
        for model, first in self.copies:
            row = replace(rows[first.shown], file=model.shown, same_as=first.shown, seconds=0.0)
            row.reason = block("fleet", "copy", file=first.shown, reason=row.reason)
            self.rows.append(row)
            yield row

    def start(self, model: Model) -> None:
        """Submit a file, unless it is not readable, a copy, or its report is up to date."""
        try:
            contents = model.contents
        except OSError as error:
            reason = block("fleet", "unreadable", why=error.strerror)
            self.rows.append(FileRow(file=model.shown, verdict=REFUSED, reason=reason))
            return
        (own_name, own_hash), *others = contents
        first = self.first.setdefault((Path(own_name).with_stem("model"), own_hash, *others), model)
        if first is not model:
            self.copies.append((model, first))
            return
        of_solution = self.solution.contents if self.solution else ()
        inputs = repr((program(), contents, of_solution, model.shown, self.options))
        key = hashlib.sha256(inputs.encode("utf-8", "backslashreplace")).hexdigest()
        place = self.out / place_of_report(model.shown)
        if row := saved(place, key):
            self.rows.append(FileRow(**row))
            return
        paths = os.path.abspath(model.path), os.path.abspath(place)
        answer = self.executor.submit(compare_file, model.shown, *paths, self.options)
        self.under_way[answer] = model, key
        answer.add_done_callback(self.done.put)

    def receive(self, answer: Answer) -> None:
        """A file is done: save its row beside its report."""
        (model, key), (row, why) = self.under_way.pop(answer), self.executor.outcome(answer)
        if row is None:
            row = FileRow(file=model.shown, verdict=BROKE, reason=why)
        else:
            save(self.out / place_of_report(model.shown), key, asdict(row))
        self.rows.append(row)

    def progress(self) -> list[str]:
        """How far the fleet is: "3 of 12 files", "1 differ", "2 agree"."""
        verdicts = Counter(row.verdict for row in self.rows)
        numbers = [f"{number} {verdict}" for verdict, number in sorted(verdicts.items())]
        return [f"{len(self.rows)} of {len(self.models)} files", *numbers]

    @property
    def is_good(self) -> bool:
        return not any(row.is_bad for row in self.rows)
