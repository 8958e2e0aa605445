"""Run a fleet: submit the files whose reports are missing or old, and write the report of each as it comes."""

import hashlib
import json
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from queue import Empty, SimpleQueue

from .cache import MARK, program, saved_row, write_whole
from .executors import Cluster, Pool
from .models import Model, bundle, place_of_report
from .table import BAD_VERDICTS, BROKE, EMPTY_ROW, REFUSED, is_row
from .task import FleetOptions, compare_file

AHEAD = 2  # files that are submitted for each worker; they are in memory
POLLING = 0.3  # s between two lines of progress


class Run:
    """A running fleet. After carry_out `rows` has a row for each model.

    sent: the files of a solution, added to the bundle of each model; see FleetOptions.
    """

    def __init__(
        self,
        models: Sequence[Model],
        options: FleetOptions,
        executor: Pool | Cluster,
        out: Path,
        sent: Mapping,
    ):
        self.models, self.options, self.executor, self.out, self.sent = models, options, executor, out, sent
        self.rows, self.first, self.copies = (
            [],
            {},
            [],
        )  # first: model of each content; copies: (model, first)

    def carry_out(self, progress: Callable[[list[dict]], object]) -> None:
        """Run to the end, copies last. progress is called with the new rows, and every POLLING s."""
        done, under_way, waiting = SimpleQueue(), {}, self.models[::-1]
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
        before, rows = len(self.rows), {row["file"]: row for row in self.rows}
        for model, first in self.copies:
            row = rows[first.shown]
            reason = ": ".join(filter(None, (f"copy of {first.shown}", row["reason"])))
            self.end(model, row | {"same_as": first.shown, "reason": reason, "seconds": 0.0})
        progress(self.rows[before:])

    def start(self, model: Model) -> tuple | None:
        """The future of a file and its key; None: it is not readable, a copy, or its report is up to date."""
        try:
            files = bundle(model) | self.sent
        except OSError as error:
            self.end(model, {"verdict": REFUSED, "reason": f"not readable: {error.strerror}"})
            return None
        hashes = [(name, hashlib.sha256(content).hexdigest()) for name, content in files.items()]
        (own_name, own_hash), *others = hashes
        first = self.first.setdefault((Path(own_name).with_stem("model"), own_hash, *others), model)
        if first is not model:
            self.copies.append((model, first))
            return None
        inputs = repr((program(), hashes, model.shown, self.options))
        key = hashlib.sha256(inputs.encode("utf-8", "backslashreplace")).hexdigest()
        row = saved_row(self.out / place_of_report(model.shown), key)
        if is_row(row):
            self.end(model, row)
            return None
        return self.executor.submit(compare_file, model.shown, self.options, files), key

    def receive(self, model: Model, key: str, value: tuple | None, why: str) -> None:
        """A file is done: write its report."""
        row = {"verdict": BROKE, "reason": why}
        if value is not None:
            row, written = value
            write_whole(
                self.out / place_of_report(model.shown), written | {MARK: json.dumps((key, row)).encode()}
            )
        self.end(model, row)

    def end(self, model: Model, row: dict) -> None:
        self.rows.append(EMPTY_ROW | row | {"file": model.shown})

    def progress(self) -> list[str]:
        """How far the fleet is: "3 of 12 files", "1 differ", "2 agree"."""
        verdicts = [f"{many} {verdict}" for verdict, many in sorted(self.verdicts.items())]
        return [f"{len(self.rows)} of {len(self.models)} files", *verdicts]

    @property
    def verdicts(self) -> Counter:
        return Counter(row["verdict"] for row in self.rows)

    @property
    def is_good(self) -> bool:
        return not set(self.verdicts) & set(BAD_VERDICTS)
