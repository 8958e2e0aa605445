"""Read scenes from a TOML file, one table [[scene]] each, and recorded controls from a CSV file."""

import csv
import tomllib
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from .case import Case, Scene
from .robot import Robot
from .validation import WrongField, are_numbers, is_number, shorten

KEYS = (
    "name", "posture", "q", "speed", "torque", "targets", "gravity", "damping", "locked", "duration", "dt"
)  # fmt: skip
STEPS = 64  # of a scene without dt
NEARLY_ONE = 1e-3  # accepted deviation of the length of a quaternion from 1, for few digits


class SceneError(ValueError):
    """A file has no scenes of the robot; the message is one line with file and entry."""


def read_scenes(path: str | Path, robot: Robot) -> tuple[Scene, ...]:
    """The scenes of a file for a robot; a scene needs a name, all else has the defaults of a Scene.

    Units: deg, deg/s, N m, N m s/rad, s; of slides m, m/s, N. A ball has a quaternion w, x, y, z, which is normalized, and three
    speeds and torques. SceneError: the file cannot be read; unknown key, wrong value, repeated name.
    """
    if Path(path).exists() and not Path(path).is_file():  # a pipe may be waited for without end
        raise SceneError(f"{path} is not a regular file; expected a TOML file")
    try:
        with open(path, "rb") as file:
            content = tomllib.load(file)
    except OSError as error:
        raise SceneError(f"cannot read {path}: {error.strerror}; expected a TOML file") from None
    except RecursionError:
        raise SceneError(f"{path} is nested too deep; expected tables [[scene]]") from None
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise SceneError(f"{path} is not TOML: {' '.join(str(error).split())}") from None
    for key in content:
        if key != "scene":
            raise SceneError(f"{path}: {key} is unknown; expected tables [[scene]]")
    entries = content.get("scene")
    if not isinstance(entries, list) or not entries or not all(isinstance(entry, dict) for entry in entries):
        raise SceneError(f"{path} has no array of scenes; expected a table [[scene]] for each")
    scenes: list[Scene] = []
    names = {scene.name: f"a scene of {robot.name}" for scene in robot.scenes}
    for number, entry in enumerate(entries, start=1):
        named = f" ({in_toml(entry['name'])})" if "name" in entry else ""
        where = f"{path}, scene {number}{named}"
        scene = scene_of(where, entry, robot)
        if scene.name in names:
            raise SceneError(f"{where}: the name is used by {names[scene.name]}")
        names[scene.name] = f"scene {number}"
        scenes.append(scene)
    return tuple(scenes)


def read_controls(path: str | Path, actuators: Sequence[str]) -> dict[str, np.ndarray]:
    """The columns of a CSV file: time, s, from 0 on, and controls by the names of actuators. SceneError, in one line."""
    try:
        with open(path, encoding="utf-8", newline="") as file:
            names, *lines = [line for line in csv.reader(file) if line]
        table = np.array(lines, dtype=float).reshape(-1, len(names)).T
    except (OSError, ValueError) as error:
        raise SceneError(f"cannot read the controls of {path}: {' '.join(str(error).split())}") from None
    columns = dict(zip(names, table))
    if unknown := [name for name in names if name not in ("time", *actuators)]:
        raise SceneError(
            f"{path}: there is no actuator {unknown[0]}; expected time and {', '.join(actuators)}"
        )
    times = columns.get("time", np.zeros(0))
    rises = len(times) > 1 and times[0] == 0.0 and bool((np.diff(times) > 0.0).all())
    if not (rises and len(columns) > 1 and np.isfinite(table).all()):
        raise SceneError(
            f"{path}: expected a column time that rises from 0, and numbers of at least one actuator"
        )
    return columns


def scene_of(where: str, entry: dict[str, Any], robot: Robot) -> Scene:
    """One entry as a scene of the robot."""
    values = dict(entry)

    def refused(key: str, accepted: str) -> SceneError:
        value = in_toml(entry.get(key, values.get(key)))
        return SceneError(f"{where}: {key} is {value}; expected {accepted}")

    for key in entry:
        if key not in KEYS:
            raise SceneError(f"{where}: {key} is unknown; known: {', '.join(KEYS)}")
    if "name" not in entry:
        raise SceneError(f"{where}: it has no name; every scene needs one")
    if not isinstance(entry["name"], str) or not entry["name"].isprintable():
        raise refused("name", "a string in one line")
    if "posture" in entry and "q" in entry:
        raise SceneError(f"{where}: both posture and q are given; expected one of them")
    if not isinstance(entry.get("posture", ""), str):
        raise refused("posture", f"one of {', '.join(robot.poses)}; numbers are given as q")
    if isinstance(entry.get("q"), str):
        raise refused("q", f"{robot.coordinates.nq} numbers, one per joint")
    if "q" in values:
        values["posture"] = with_unit_quaternions(where, values.pop("q"), robot)
    if "duration" in values and "dt" not in values:
        if not is_number(values["duration"]):
            raise refused("duration", "a time in s")
        values["dt"] = values["duration"] / STEPS
    try:
        scene = Scene(**values, judged=0.0, tags=("own", "user"))
        Case(robot, scene)
    except WrongField as error:
        is_q = error.field == "posture" and "q" in entry
        raise refused("q" if is_q else error.field, error.accepted) from None
    except ValueError as error:
        raise SceneError(f"{where}: {' '.join(str(error).split())}") from None
    return scene


def with_unit_quaternions(where: str, q: Any, robot: Robot) -> Any:
    """A position with normalized quaternions; SceneError if the length of one is not nearly 1."""
    if not are_numbers(q) or len(q) != robot.coordinates.nq:
        return q
    position = np.array(q, dtype=float)
    for name, joint in robot.coordinates.by_name.items():
        length = float(np.linalg.norm(position[joint.q])) if joint.kind == "ball" else 1.0
        if not abs(length - 1.0) <= NEARLY_ONE:
            text = f"q is {in_toml(q)}; the quaternion of {name} has length {length:.6g}, expected 1"
            raise SceneError(f"{where}: {text}")
        position[joint.q] /= length
    return tuple(position.tolist())


def in_toml(value: object) -> str:
    """A value in the syntax of TOML, in one line, shortened."""
    return shorten(" ".join(all_in_toml(value).split()))


def all_in_toml(value: object) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, list | tuple):
        return f"[{', '.join(map(all_in_toml, value))}]"
    if isinstance(value, dict):
        parts = [f"{key} = {all_in_toml(part)}" for key, part in value.items()]
        return f"{{{', '.join(parts)}}}"
    return repr(value) if isinstance(value, str | float | int) else str(value)
