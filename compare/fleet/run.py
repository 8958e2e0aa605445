"""Run a fleet: submit the files whose reports are missing or old, and write the report of each as it comes."""

import pickle
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from queue import Empty, SimpleQueue

from .cache import MARK, key_of, saved_row, write_whole
from .executors import Cluster, Pool
from .models import Model, bundle, hash_of, place_of_report
from .table import BAD_VERDICTS, BROKE, EMPTY_ROW, REFUSED
from .task import FleetOptions, compare_file

AHEAD = 2  # files that are submitted for each worker; they are in memory
POLLING = 0.3  # s between two lines of progress


class Run:
    """A running fleet. After carry_out `rows` has a row for each model; parts: files that other models include.

    sent: the files of a solution, added to the bundle of each model; see FleetOptions.
    """

    def __init__(
        self, models: Sequence[Model], options: FleetOptions, executor: Pool | Cluster, out: Path, sent: Mapping
    ):
        self.models, self.options, self.executor, self.out, self.sent = models, options, executor, out, sent
        self.rows, self.parts, self.cached, self.copies = [], [], 0, {}
        self.waiting = self.without_copies()

    def without_copies(self) -> list[Model]:
        """The models of different content; `copies` receives the others."""
        first = {}
        for model in self.models:
            same = first.setdefault(model if model.included_by or not model.hash else model.hash, model)
            if same is not model:
                self.copies.setdefault(same, []).append(model)
        return list(first.values())

    def carry_out(self, progress: Callable[[list[dict]], object]) -> None:
        """Run to the end. progress is called with the new rows, and every POLLING s."""
        done, under_way, waiting = SimpleQueue(), {}, self.waiting[::-1]
        while waiting or under_way:
            before = len(self.rows)
            while waiting and len(under_way) < AHEAD * self.executor.workers and len(self.rows) == before:
                if started := self.start(model := waiting.pop()):
                    future, key = started
                    under_way[future] = model, key
                    future.add_done_callback(done.put)
            if under_way and len(self.rows) == before:
                try:
                    future = done.get(timeout=POLLING)
                except Empty:
                    self.executor.check()
                else:
                    self.receive(*under_way.pop(future), *self.executor.outcome(future))
            progress(self.rows[before:])

    def start(self, model: Model) -> tuple | None:
        """The future of a file and its key; None: it is done, because it is not readable or its report is up to date."""
        try:
            files = bundle(model)
        except OSError as error:
            self.end(model, {"verdict": REFUSED, "reason": f"not readable: {error.strerror}"})
            return None
        key = key_of(hash_of(files), model.shown, self.options)
        if row := saved_row(self.out / place_of_report(model.shown), key):
            self.cached += 1
            self.end(model, row)
            return None
        return self.executor.submit(compare_file, model.shown, self.options, files | self.sent), key

    def receive(self, model: Model, key: str, value: tuple | None, why: str) -> None:
        """A file is done: write its report."""
        if value is None:
            self.end(model, {"verdict": BROKE, "reason": why})
            return
        row, written = value
        write_whole(self.out / place_of_report(model.shown), written | {MARK: pickle.dumps((key, row))})
        self.end(model, row)

    def end(self, model: Model, row: dict) -> None:
        """Add the rows of a file and its copies."""
        if row["verdict"] == REFUSED and model.included_by:
            self.parts.append((model.shown, f"not a complete model; included by {model.included_by}"))
            return
        row = EMPTY_ROW | row | {"file": model.shown, "sha256": model.sha256, "report_of": model.shown}
        self.rows.append(row)
        for copy in self.copies.get(model, ()):
            reason = ": ".join(filter(None, (f"copy of {model.shown}", row["reason"])))
            self.rows.append(row | {"file": copy.shown, "sha256": copy.sha256, "reason": reason, "seconds": 0.0})

    def progress(self) -> list[str]:
        """How far the fleet is: "3 of 12 files", "1 differ", "2 agree"."""
        verdicts = [f"{many} {verdict}" for verdict, many in sorted(self.verdicts.items())]
        return [f"{len(self.rows)} of {len(self.models) - len(self.parts)} files", *verdicts]

    @property
    def verdicts(self) -> Counter:
        return Counter(row["verdict"] for row in self.rows)

    @property
    def is_good(self) -> bool:
        return not set(self.verdicts) & set(BAD_VERDICTS)
