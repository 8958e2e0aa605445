"""How a fleet stands: which files are done, with what verdict, and what its pieces took."""

from collections import Counter
from collections.abc import Sequence

from .file_pieces import Known
from .row import BAD_VERDICTS
from .task import Task


class Standing:
    """The files, and what is known of them so far. rows: of those that are done; parts: those that others include, and why."""

    def __init__(self, tasks: Sequence[Task]):
        self.tasks = tasks
        self.rows, self.new, self.early, self.parts, self.machines = [], [], [], [], set()
        self.took = {}  # joints and s by a watch of the pieces that ended, by their kind
        self.done_before, self.pieces_before = 0, 0  # files and further pieces that were known when this run began

    def differs(self, task: Task, check: str) -> None:
        """A check of a file does not hold; "": all do."""
        if check and not task.differs:
            task.differs = check
            self.early.append(task)

    def ended(self, task: Task, verdict: str, reason: str | None, **more: object) -> None:
        """A file is done. more: what else its row has, if there is a report."""
        known = task.known or Known("")
        about = {"file": task.model.shown, "sha256": task.model.sha256, "verdict": verdict, "reason": reason or ""}
        about |= {
            "joints": known.joints,
            "reference": known.reference,
            "why_itself": known.why_itself,
            "file_integrator": known.integrator,
            "file_dt_s": known.dt,
        }
        about |= dict.fromkeys(("worst_ratio", "stable_at_file_dt", "limit_s"))
        of = task.model.shown
        task.row = about | {"seconds": round(task.seconds, 2), "has_report": bool(more), "report_of": of} | more
        same = ": ".join(filter(None, (f"the same as {of}", reason)))
        copies = [task.row | {"file": copy.shown, "reason": same, "seconds": 0.0} for copy in task.copies]
        self.rows += [task.row, *copies]
        self.new += [task.row, *copies]

    def take_early(self) -> list[Task]:
        """The files without a row of which it is known since the last call that they differ."""
        early, self.early = [task for task in self.early if task.row is None], []
        return early

    def take_new(self) -> list[dict]:
        """The rows of files that have ended since the last call."""
        new, self.new = self.new, []
        return new

    @property
    def files_done(self) -> int:
        return sum(task.files for task in self.tasks if task.row is not None)

    @property
    def files(self) -> int:
        return sum(task.files for task in self.tasks)

    def verdicts(self) -> Counter:
        """How many files have which verdict, so far."""
        return Counter(row["verdict"] for row in self.rows)

    @property
    def is_good(self) -> bool:
        """Whether no file has one of BAD_VERDICTS."""
        return not set(self.verdicts()) & set(BAD_VERDICTS)

    @property
    def pieces_done(self) -> int:
        return sum(len(each) for each in self.took.values())
