"""Read scenes from a TOML file, one table [[scene]] each, and recorded controls from a CSV file."""

import csv
import json
import tomllib
from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np

from .case import Case, Robot
from .scene import Scene, WrongField, are_numbers, is_number

KEYS = (
    "name", "posture", "q", "speed", "torque", "targets", "gravity", "damping", "locked", "duration", "dt"
)  # fmt: skip
STEPS = 64  # of a scene without dt
MOST_STEPS = 100_000  # of recorded controls: minutes for one answer
LONGEST = 56  # text of a value in a message
NEARLY_ONE = 1e-3  # accepted deviation of the length of a quaternion from 1, for few digits


class SceneError(ValueError):
    """A file has no scenes of the robot; the message is one line with file and entry."""


def read_scenes(path: str | Path, robot: Robot) -> tuple[Scene, ...]:
    """The scenes of a file for a robot; a scene needs a name, all else has the defaults of a Scene.

    Units: deg, deg/s, N m, N m s/rad, s; of slides m, m/s, N. A ball has a quaternion w, x, y, z, which is
    normalized, and three speeds and torques. SceneError: the file cannot be read; unknown key, wrong value,
    repeated name.
    """
    scenes: list[Scene] = []
    names = {scene.name: f"a scene of {robot.name}" for scene in robot.scenes}
    for number, entry in enumerate(entries_of(path), start=1):
        named = f" ({shown(entry['name'])})" if "name" in entry else ""
        where = f"{path}, scene {number}{named}"
        try:
            scene = scene_of(entry, robot)
        except WrongField as error:
            key = "q" if error.field == "posture" and "q" in entry else error.field
            value = shown(entry.get(key, error.value))
            raise SceneError(f"{where}: {key} is {value}; expected {error.accepted}") from None
        except ValueError as error:
            raise SceneError(f"{where}: {' '.join(str(error).split())}") from None
        if scene.name in names:
            raise SceneError(f"{where}: the name is used by {names[scene.name]}")
        names[scene.name] = f"scene {number}"
        scenes.append(scene)
    return tuple(scenes)


def read_controls(path: str | Path, actuators: Sequence[str], dt: float) -> dict[str, np.ndarray]:
    """The columns of a CSV file: time, s, from 0 on, and controls by the names of actuators.

    dt: s, the step of the file, of which the times may be MOST_STEPS. SceneError, in one line with the column
    or the row, for what is no table of such numbers, and for a file without actuators.
    """
    if not actuators:
        raise SceneError(f"{path}: controls of no actuator: the file has none")
    try:
        lines = [
            line for line in csv.reader(regular(path).splitlines()) if any(cell.strip() for cell in line)
        ]
    except (OSError, ValueError, csv.Error) as error:
        raise SceneError(f"cannot read the controls of {path}: {why_unread(error)}") from None
    names, rows = [name.strip() for name in lines[0]] if lines else [], lines[1:]
    for number, name in enumerate(names):
        if name in names[:number]:
            raise SceneError(f"{path}: the column {shown(name)} is there twice")
    table = np.full((len(rows), len(names)), np.nan)
    for number, row in enumerate(rows):
        if len(row) != len(names):
            raise SceneError(f"{path}, row {number + 1}: {len(row)} cells; expected {len(names)}")
        for column, cell in enumerate(row):
            with suppress(ValueError):
                table[number, column] = float(cell)
    check_controls(path, dict(zip(names, table.T)), actuators, dt, dict(zip(names, zip(*rows))))
    return dict(zip(names, table.T))


def check_controls(
    where: str | Path, columns: Mapping[str, np.ndarray], actuators: Sequence[str], dt: float,
    cells: Mapping[str, Sequence[object]],
) -> None:  # fmt: skip
    """SceneError, as of read_controls, for columns that are no controls. cells: as they were given."""
    for name in columns:
        if name not in ("time", *actuators):
            known = f"expected time and {', '.join(actuators)}" if actuators else "the file has none"
            raise SceneError(f"{where}: there is no actuator {name}; {known}")
    times = columns.get("time", np.zeros(0))
    if len(columns) < 2 or not len(times):
        raise SceneError(
            f"{where}: expected a column time, one of at least one actuator, and rows of numbers"
        )
    for name, values in columns.items():
        if values.shape != times.shape or times.ndim != 1:
            raise SceneError(f"{where}: {name} has the shape {values.shape}, time {times.shape}")
        for number in np.flatnonzero(~np.isfinite(values)).tolist()[:1]:
            cell = shown(cells[name][number])
            raise SceneError(f"{where}, row {number + 1}: {name} is {cell}; expected a number")
    if times[0] != 0.0 or len(times) < 2:
        begins = f"time begins at {times[0]:g}, {len(times)} rows"
        raise SceneError(f"{where}: {begins}; expected two rows at least, from 0 on")
    for k in np.flatnonzero(np.diff(times) <= 0.0).tolist()[:1]:
        falls = f"{times[k + 1]:g} after {times[k]:g} s"
        raise SceneError(f"{where}, row {k + 2}: time does not rise ({falls})")
    if times[-1] / dt > MOST_STEPS:
        steps = f"{times[-1] / dt:.2g} steps of {1e3 * dt:g} ms; expected {MOST_STEPS} at most"
        raise SceneError(f"{where}: time ends at {times[-1]:g} s, which are {steps}")


def why_unread(error: Exception) -> str:
    """An error in one line, of the system without its number and the path."""
    return " ".join(str(getattr(error, "strerror", None) or error).split())


def regular(path: str | Path) -> str:
    """The text of a regular file; OSError for another: a pipe may be waited for without end."""
    if Path(path).exists() and not Path(path).is_file():
        raise OSError("it is not a regular file")
    return Path(path).read_text(encoding="utf-8-sig")


def entries_of(path: str | Path) -> list[dict[str, Any]]:
    """The tables [[scene]] of a file; SceneError if it has none, or anything else."""
    try:
        content = tomllib.loads(regular(path))
    except (OSError, ValueError, RecursionError) as error:  # TOML's and Unicode's errors are ValueErrors
        why = "it is nested too deep" if isinstance(error, RecursionError) else why_unread(error)
        raise SceneError(f"{path} is not a TOML file that can be read: {why}") from None
    if others := content.keys() - {"scene"}:
        raise SceneError(f"{path}: {min(others)} is unknown; expected tables [[scene]]")
    entries = content.get("scene")
    if not isinstance(entries, list) or not entries or not all(isinstance(entry, dict) for entry in entries):
        raise SceneError(f"{path} has no array of scenes; expected a table [[scene]] for each")
    return entries


def scene_of(entry: dict[str, Any], robot: Robot) -> Scene:
    """One entry as a scene of the robot; WrongField for a wrong value, ValueError for other keys."""
    values, name = dict(entry), entry.get("name")
    if others := [key for key in entry if key not in KEYS]:
        raise ValueError(f"{others[0]} is unknown; known: {', '.join(KEYS)}")
    if "name" not in entry:
        raise ValueError("it has no name; every scene needs one")
    if "posture" in entry and "q" in entry:
        raise ValueError("both posture and q are given; expected one of them")
    if not isinstance(entry.get("posture", ""), str):
        named = f"one of {', '.join(robot.poses)}; numbers are given as q"
        raise WrongField(name, "posture", entry["posture"], named)
    if "q" in values:
        values["posture"] = with_unit_quaternions(name, values.pop("q"), robot)
    if "duration" in values and "dt" not in values:
        if not is_number(values["duration"]):
            raise WrongField(name, "duration", values["duration"], "a time in s")
        values["dt"] = values["duration"] / STEPS
    scene = Scene(**values, judged=0.0, tags=("own", "user"))
    Case(robot, scene)
    return scene


def with_unit_quaternions(name: object, q: Any, robot: Robot) -> Any:
    """A position with normalized quaternions; WrongField where a length is not nearly 1, or for a text."""
    if isinstance(q, str):
        raise WrongField(name, "posture", q, f"{robot.coordinates.nq} numbers, one per joint")
    if not are_numbers(q) or len(q) != robot.coordinates.nq:
        return q
    position = np.array(q, dtype=float)
    for joint_name, joint in robot.coordinates.by_name.items():
        length = float(np.linalg.norm(position[joint.q])) if joint.kind == "ball" else 1.0
        if not abs(length - 1.0) <= NEARLY_ONE:
            accepted = f"a quaternion of {joint_name} of length 1; its length is {length:.6g}"
            raise WrongField(name, "posture", q, accepted)
        position[joint.q] /= length
    return tuple(position.tolist())


def shown(value: object) -> str:
    """A value in one line, as TOML has it, shortened."""
    text = json.dumps(value, ensure_ascii=False, default=str)
    return text if len(text) <= LONGEST else f"{text[:LONGEST]} ..."
