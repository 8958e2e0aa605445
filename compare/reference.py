"""The runs with many digits that errors are measured against: a table, made anew where a number of the model has changed.

`python -m compare.reference` remakes reference.csv. How many digits are right is seen by halving the step: each run stands in
the table with the largest difference from a run with half as many steps, which bounds the error of the coarser of the two.
"""

import csv
import hashlib
import os
import sys
import tempfile
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from contextlib import suppress
from decimal import Decimal, InvalidOperation
from functools import partial
from multiprocessing import get_context
from pathlib import Path
from typing import NamedTuple

import numpy as np

from tmt.cache import own_file
from tmt.reference_run import trajectory

from .scenes import SCENES, Scene

TABLE = Path(__file__).with_name("reference.csv")
RECORDS = 64  # of a run, and its start
STEPS = {"zero, free": 1024, "ball catch, free": 2048, "bent, free": 512, "bent, damped": 512}
STATE = [f"{name}_{unit}" for unit in ("rad", "rad_per_s") for name in ("alpha", "beta", "gamma")]
UNUSABLE = (
    OSError,
    RuntimeError,
    ValueError,
    csv.Error,
)  # of a cache folder: none, not the user's own; or of what is in it
COLUMNS = ["scene", "key", "steps", "halving_difference", "t_s", *STATE]


class Reference(NamedTuple):
    """One run: every number as the sum of two doubles."""

    t: np.ndarray  # (65,) s
    high: np.ndarray  # (65, 6) rad, rad/s
    low: np.ndarray  # (65, 6)
    halving: float  # largest difference from the run with half the steps
    steps: int

    def error(self, q: np.ndarray, hinges=(0, 1, 2)) -> np.ndarray:
        """The largest error of the angles q (65, n) of these hinges at each time, rad, (65,)."""
        return np.abs((q - self.high[:, hinges]) - self.low[:, hinges]).max(axis=1)


def key(scene: Scene) -> str:
    """A hash of every number on which the motion depends."""
    numbers = scene.model, *(a.tolist() for a in scene.start), scene.tau.tolist(), scene.duration
    return hashlib.sha256(repr(numbers).encode()).hexdigest()[:16]


def references(map: Callable = map, tell: Callable = print) -> dict[str, Reference]:
    """Each scene's reference: from the committed table, else from the user's cache folder, else computed and kept there."""
    scenes = [scene for scene in SCENES if scene.name in STEPS]
    rows = read(TABLE)
    missing = [scene for scene in scenes if key(scene) not in rows]
    for scene in missing:
        with suppress(*UNUSABLE):  # it only costs time
            found = read(kept(scene)).get(key(scene))
            if found and begins(found, scene):
                rows[key(scene)] = found
    missing = [scene for scene in missing if key(scene) not in rows]
    for scene, made in zip(missing, remade(missing, map, tell)):
        rows[key(scene)] = made
        with suppress(*UNUSABLE):
            write(kept(scene), made)
    return {scene.name: reference(rows[key(scene)]) for scene in scenes}


def begins(rows, scene) -> bool:
    """Whether a run starts as the scene does, and has its times."""
    times = np.linspace(0.0, scene.duration, RECORDS + 1)
    start = [float(rows[0][name]) for name in STATE]
    return start == np.concatenate(scene.start).tolist() and [float(row["t_s"]) for row in rows] == times.tolist()


def kept(scene: Scene) -> Path:
    """Where the reference of a scene is kept that the committed table does not have."""
    return own_file(f"reference_{key(scene)}.csv")


def remade(scenes: list[Scene], map: Callable, tell: Callable) -> list[list[dict]]:
    """The rows of each scene, computed: two runs a scene, one with half the steps."""
    runs = [(scene, RECORDS, STEPS[scene.name] // part) for scene in scenes for part in (2, 1)]
    paths = []
    for path in map(run, runs):
        paths.append(path)
        tell(f"runs with many digits: {len(paths)} of {len(runs)}")
    result = []
    for scene, coarse, fine in zip(scenes, paths[::2], paths[1::2]):
        difference = float(abs(fine - coarse).max())
        about = {
            "scene": scene.name,
            "key": key(scene),
            "steps": STEPS[scene.name],
            "halving_difference": f"{difference:.2e}",
        }
        times = np.linspace(0.0, scene.duration, RECORDS + 1)
        result.append(
            [
                about | {"t_s": t} | dict(zip(STATE, (f"{v:.32g}" if v else "0" for v in row)))
                for t, row in zip(times, fine)
            ]
        )
    return result


def run(job) -> np.ndarray:
    """One run with many digits; a job is a scene, the number of records and that of steps."""
    scene, records, steps = job
    return trajectory(scene.model, *scene.start, scene.tau, scene.duration, records, steps)


def reference(rows) -> Reference:
    """The rows of one scene as numbers."""
    exact = np.array([[Decimal(row[name]) for name in STATE] for row in rows])
    high = exact.astype(float)
    low = np.array([[float(d - Decimal(h)) for d, h in zip(*pair)] for pair in zip(exact, high.tolist())])
    times = np.array([float(row["t_s"]) for row in rows])
    return Reference(times, high, low, float(rows[0]["halving_difference"]), int(rows[0]["steps"]))


def read(path) -> dict[str, list[dict]]:
    """The rows of a table by their key, of each run that is whole and has a finite number wherever one belongs."""
    if not path.exists():
        return {}
    with open(path, newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    by_key = {row.get("key"): [r for r in rows if r.get("key") == row.get("key")] for row in rows}
    return {name: of_key for name, of_key in by_key.items() if name and whole(of_key)}


def whole(rows) -> bool:
    """Whether these are the rows of a run: so many, with nothing but finite numbers."""
    try:
        numbers = [Decimal(row[name]) for row in rows for name in (*COLUMNS[2:5], *STATE)]
    except (KeyError, TypeError, InvalidOperation):
        return False
    return len(rows) == RECORDS + 1 and all(number.is_finite() for number in numbers)


def write(path, rows) -> None:
    """The rows as a table, written aside and moved."""
    path.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
    aside = {"dir": path.parent, "suffix": ".new", "delete": False}
    with tempfile.NamedTemporaryFile("w", newline="", encoding="utf-8", **aside) as file:
        writer = csv.DictWriter(file, COLUMNS, lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)
    os.chmod(file.name, 0o644)
    os.replace(file.name, path)


def main() -> None:
    """Remake the committed table."""
    scenes = [scene for scene in SCENES if scene.name in STEPS]
    with ProcessPoolExecutor(2, get_context("spawn")) as pool:
        tables = remade(scenes, pool.map, partial(print, file=sys.stderr))
    write(TABLE, [row for rows in tables for row in rows])
    for rows in tables:
        print(f"{rows[0]['scene']}: {rows[0]['steps']} steps, {rows[0]['halving_difference']} from half as many")


if __name__ == "__main__":
    sys.exit(main())
