"""The runs with many digits that errors are measured against: a table, made anew where a number of the model has changed.

How many digits are right is seen by halving the step: each run stands in the table with the largest difference from a run with
half as many steps, which bounds the error of the coarser of the two. The robot of a file has a run in doubles instead, of order
8, whose digits are seen in the same way.
"""

import csv
import hashlib
import os
import tempfile
from collections.abc import Callable, Sequence
from contextlib import suppress
from decimal import Decimal, InvalidOperation
from pathlib import Path
from typing import NamedTuple

import numpy as np

import tmt
from tmt.cache import own_file
from tmt.methods import METHODS
from tmt.reference_run import trajectory

from ..case import Case, Coordinates, rates_at
from .steps import growth_of

TABLE = Path(__file__).with_name("reference.csv")
RECORDS = 64  # of a run, and its start
FIRST_STEPS, MOST_STEPS_IN_5_S = 256, 2048  # of a run of 5 s: the halving begins and ends there
SMALL_ENOUGH = 2e-22  # rad, rad/s: a difference from the run with half the steps that need not be smaller
UNUSABLE = (
    OSError,
    RuntimeError,
    ValueError,
    csv.Error,
)  # of a cache folder: none, not the user's own; or of what is in it
DOUBLES, MOST_DOUBLINGS = "dopri8", 5  # the method of a run in doubles; how often its steps are doubled at most
DIVERGES = 1.05  # growth in a step: in the thousands of steps of a run a number overflows
ABOUT = ["scene", "key", "steps", "halving_difference", "t_s"]


class Reference(NamedTuple):
    """One run: every number as the sum of two doubles."""

    t: np.ndarray  # (65,) s
    high: np.ndarray  # (65, nq + nv) rad, rad/s
    low: np.ndarray  # (65, nq + nv)
    halving: float  # largest difference from the run with half the steps
    steps: int
    coordinates: Coordinates | None = None  # of a run in doubles; None: of hinges, with many digits

    def error(self, q: np.ndarray, joints: Sequence[int]) -> np.ndarray:
        """The largest error of the positions q (65, ...) of some joints by their places at each time, rad or m, (65,)."""
        if self.coordinates is None:
            return np.abs((q - self.high[:, joints]) - self.low[:, joints]).max(axis=1)
        whole = self.coordinates
        part = Coordinates(*(tuple(names[i] for i in joints) for names in (whole.names, whole.all_kinds)))
        places = [whole.places.joints[i].q for i in joints]
        columns = [k for place in places for k in range(place.start, place.stop)]
        return np.abs(part.difference(q, self.high[:, columns])).max(axis=1)


def columns(case: Case) -> list[str]:
    """The names of the state's columns: angles, then rates."""
    return [f"{name}_{unit}" for unit in ("rad", "rad_per_s") for name in case.joints]


def key(case: Case) -> str:
    """A hash of every number on which the motion depends."""
    numbers = case.tree, *(a.tolist() for a in case.start), case.tau.tolist(), case.duration
    return hashlib.sha256(repr(numbers).encode()).hexdigest()[:16]


def references(cases: Sequence[Case], map: Callable = map, progress: Callable = print) -> dict[str, Reference]:
    """Each case's reference by its name: from the committed table, else from the user's cache folder, else computed, and kept.

    Of the robot of a file a run in doubles: what an evaluation with many digits costs has no bound there.
    """
    known = {case.name: in_doubles(case) for case in cases if case.robot.is_read}
    cases = [case for case in cases if case.name not in known]
    rows = read_table(TABLE)
    for case in cases:
        if key(case) not in rows:
            with suppress(*UNUSABLE):  # it only costs time
                found = read_table(cache_file(case)).get(key(case))
                if found and begins(found, case):
                    rows[key(case)] = found
    missing = [case for case in cases if key(case) not in rows]
    for case, made in zip(missing, remade(missing, map, progress)):
        rows[key(case)] = made
        with suppress(*UNUSABLE):
            write_table(cache_file(case), made)
    return known | {case.name: reference(rows[key(case)]) for case in cases}


def in_doubles(case: Case) -> Reference:
    """A run in doubles by tmt's method of order 8: twice the steps as long as two runs come nearer to each other.

    ValueError if none reaches the end of the scene.
    """
    count, found = -(-case.steps // RECORDS) * RECORDS, []
    before = after = None
    for _ in range(MOST_DOUBLINGS + 1):
        after = tmt.simulate(*case.start, case.tau, case.duration / count, count, DOUBLES, case.tree)
        every = count // RECORDS
        after = after.q[::every], after.qd[::every]
        if before is not None:
            apart = case.coordinates.difference(after[0], before[0]), after[1] - before[1]
            found.append((np.abs(np.concatenate(apart, axis=1)).max(), after, count))
            if len(found) > 1 and np.isfinite(found[-2][0]) and not found[-1][0] < found[-2][0] / 2.0:
                break
        before, count = after, 2 * count
    apart, path, count = min(found, key=lambda run: np.nan_to_num(run[0], nan=np.inf))
    if not np.isfinite(apart):
        raise ValueError(
            f"scene {case.name!r}: runs with up to {count} steps of {DOUBLES} do not reach its end; a slower start or a "
            "shorter scene is expected"
        )
    high = np.concatenate(path, axis=1)
    times = np.linspace(0.0, case.duration, RECORDS + 1)
    return Reference(times, high, np.zeros_like(high), float(apart), count, case.coordinates)


def has_no_reference(robot: object) -> str | None:
    """Why a run in doubles cannot follow a file's robot: with its finest steps too the fastest mode diverges; or None."""
    for case in robot.cases_of_torque if robot.is_read else ():
        count = -(-case.steps // RECORDS) * RECORDS << MOST_DOUBLINGS
        decay, swing = rates_at(case.tree, case.q)
        grown = np.abs(growth_of(METHODS[DOUBLES], np.array([-decay, 1j * swing]) * case.duration / count)).max()
        if not grown <= DIVERGES:
            return (
                f"the {robot.noun}'s fastest rate, {max(decay, swing):.1e} per second, is too fast for the reference's finest "
                f"step, {case.duration / count:.1e} s"
            )
    return None


def committed(case: Case) -> Reference | None:
    """The reference of a case, if it is in the committed table."""
    rows = read_table(TABLE).get(key(case))
    return rows and reference(rows)


def begins(rows: list[dict], case: Case) -> bool:
    """Whether a run starts as the case does, and has its times."""
    times = np.linspace(0.0, case.duration, RECORDS + 1)
    try:
        start = [float(rows[0][name]) for name in columns(case)]
    except KeyError:
        return False
    return start == np.concatenate(case.start).tolist() and [float(row["t_s"]) for row in rows] == times.tolist()


def cache_file(case: Case) -> Path:
    """Where the reference of a case is kept that the committed table does not have."""
    return own_file(f"reference_{key(case)}.csv")


def remade(cases: Sequence[Case], map: Callable, progress: Callable) -> list[list[dict]]:
    """The rows of each case, computed: with twice the steps until that changes nothing of importance, at most 2048 in 5 s."""
    runs = {case.name: [] for case in cases}  # (steps, path), each with twice the steps of the one before
    going = list(cases)
    while going:
        jobs = [(case, RECORDS, count) for case in going for count in next_counts(case, runs[case.name])]
        for done, ((case, _, count), path) in enumerate(zip(jobs, map(path_with_many_digits, jobs)), start=1):
            runs[case.name].append((count, path))
            progress(f"runs with many digits: {done} of {len(jobs)}, {count} steps")
        going = [case for case in going if next_counts(case, runs[case.name])]
    return [case_rows(case, runs[case.name]) for case in cases]


def next_counts(case: Case, runs: Sequence[tuple]) -> list[int]:
    """The numbers of steps with which the case is to be run next: two at first; none where the digits are enough."""
    first = max(1, round(case.duration / 5.0 * FIRST_STEPS / RECORDS)) * RECORDS
    if not runs:
        return [first, 2 * first]
    count, _ = runs[-1]
    enough = halving(runs) <= SMALL_ENOUGH or 2 * count > first * MOST_STEPS_IN_5_S / FIRST_STEPS
    return [] if enough else [2 * count]


def halving(runs: Sequence[tuple]) -> float:
    """The largest difference of the two finest runs, rad or rad/s; infinite if one of them did not reach its end."""
    (_, coarse), (_, fine) = runs[-2:]
    return np.inf if coarse is None or fine is None else float(abs(fine - coarse).max())


def case_rows(case: Case, runs: Sequence[tuple]) -> list[dict]:
    """The rows of a case from its two finest runs; ValueError if they did not reach its end."""
    count, fine = runs[-1]
    if not np.isfinite(halving(runs)):
        raise ValueError(
            f"scene {case.name!r}: runs with many digits and up to {count} steps do not reach its end; a slower start or a "
            "shorter scene is expected"
        )
    about = {"scene": case.name, "key": key(case), "steps": count, "halving_difference": f"{halving(runs):.2e}"}
    times = np.linspace(0.0, case.duration, RECORDS + 1)
    return [
        about | {"t_s": t} | dict(zip(columns(case), (f"{v:.32g}" if v else "0" for v in row)))
        for t, row in zip(times, fine)
    ]


def path_with_many_digits(job: tuple[Case, int, int]) -> np.ndarray | None:
    """One run with many digits, None if its numbers overflow; a job is a case, the number of records and that of steps."""
    case, records, steps = job
    try:
        return trajectory(case.tree, *case.start, case.tau, case.duration, records, steps)
    except ArithmeticError:
        return None


def reference(rows: list[dict]) -> Reference:
    """The rows of one case as numbers."""
    names = [name for name in rows[0] if name not in ABOUT]
    exact = np.array([[Decimal(row[name]) for name in names] for row in rows])
    high = exact.astype(float)
    low = np.array([[float(d - Decimal(h)) for d, h in zip(*pair)] for pair in zip(exact, high.tolist())])
    times = np.array([float(row["t_s"]) for row in rows])
    return Reference(times, high, low, float(rows[0]["halving_difference"]), int(rows[0]["steps"]))


def read_table(path: Path) -> dict[str, list[dict]]:
    """The rows of a table by their key, of each run that is whole and has a finite number wherever one belongs."""
    if not path.exists():
        return {}
    with open(path, newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    by_key = {row.get("key"): [r for r in rows if r.get("key") == row.get("key")] for row in rows}
    return {name: of_key for name, of_key in by_key.items() if name and whole(of_key)}


def whole(rows: list[dict]) -> bool:
    """Whether these are the rows of a run: so many, with nothing but finite numbers."""
    try:
        numbers = [Decimal(value) for row in rows for name, value in row.items() if name not in ABOUT[:2]]
    except (TypeError, InvalidOperation):
        return False
    return len(rows) == RECORDS + 1 and {*ABOUT} < {*rows[0]} and all(number.is_finite() for number in numbers)


def write_table(path: Path, rows: list[dict]) -> None:
    """The rows as a table, written aside and moved."""
    path.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
    aside = {"dir": path.parent, "suffix": ".new", "delete": False}
    with tempfile.NamedTemporaryFile("w", newline="", encoding="utf-8", **aside) as file:
        writer = csv.DictWriter(file, list(rows[0]), lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)
    os.chmod(file.name, 0o644)
    os.replace(file.name, path)
