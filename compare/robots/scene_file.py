"""Scenes of a user's own, from a TOML file with a table [[scene]] for each."""

import tomllib
from pathlib import Path

import numpy as np

from . import Robot
from .case import TORQUES, Case, Scene
from .given import WrongField, are_numbers, is_number, shorten, some

KEYS = ("name", "posture", "q", "speed", "torque", "targets", "gravity", "damping", "locked", "duration", "dt")
UNITS = {  # of what is given for each joint: of hinges, slides and balls
    "q": {"hinge": "deg", "slide": "m", "ball": "quaternions"},
    "speed": {"hinge": "deg/s", "slide": "m/s", "ball": "deg/s"},
    "torque": {"hinge": "N m", "slide": "N", "ball": "N m"},
    "targets": {"hinge": "deg", "slide": "m", "ball": "deg"},
}
WORDS = {"torque": TORQUES}
STEPS = 64  # of a scene that states no dt
NEARLY_ONE = 1e-3  # how far the length of a quaternion may be from 1, which is written with few digits
IN_TOML = {  # what is accepted, where a file has other words for it
    "True, the model's own, or False, none": "true, the model's own, or false, none",
    "a tuple of": "an array of",
    "at least 0 N m s/rad": "a number of at least 0 N m s/rad, or an array with one per joint",
}


class SceneError(ValueError):
    """A file that does not describe scenes of the robot; the message is one line with file and entry."""


def read_scenes(path: str | Path, robot: Robot) -> tuple[Scene, ...]:
    """The scenes of a file, of a robot: angles in deg, speeds in deg/s, torques in N m, damping in N m s/rad, times in s.

    torque may be "servos": the robot's own actuators act, with `targets` moved by one number for all joints or one for each.

    Of slides m, m/s and N; of a ball a quaternion w, x, y, z, whose length is made 1 if it is within 0.001 of it, and three
    speeds and torques. Each needs a name; it starts at rest with all joints at their reference, free, if nothing else is
    said. SceneError for a file that cannot be read, an unknown key, a value that cannot be, a name that is given twice.
    """
    try:
        with open(path, "rb") as file:
            content = tomllib.load(file)
    except OSError as error:
        raise SceneError(f"cannot read {path}: {error.strerror}; a TOML file is expected") from None
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise SceneError(f"{path} is not TOML: {' '.join(str(error).split())}") from None
    for key in content:
        if key != "scene":
            raise SceneError(f"{path}: {key} is unknown; tables [[scene]] are expected")
    entries = content.get("scene")
    if not isinstance(entries, list) or not entries or not all(isinstance(entry, dict) for entry in entries):
        raise SceneError(f"{path} has no array of scenes; a table [[scene]] for each is expected")
    scenes, names = [], {scene.name: f"a scene of {robot.name}" for scene in robot.scenes}
    for number, entry in enumerate(entries, start=1):
        named = f" ({in_toml(entry['name'])})" if "name" in entry else ""
        where = f"{path}, scene {number}{named}"
        scene = scene_of(where, entry, robot)
        if scene.name in names:
            raise SceneError(f"{where}: the name is that of {names[scene.name]}; another is expected")
        names[scene.name] = f"scene {number}"
        scenes.append(scene)
    return tuple(scenes)


def scene_of(where: str, entry: dict, robot: Robot) -> Scene:
    """One entry as a scene of the robot."""
    for key in entry:
        if key not in KEYS:
            raise SceneError(f"{where}: {key} is unknown; known are {', '.join(KEYS)}")
    if not isinstance(entry.get("name", ""), str) or not entry.get("name", " ").isprintable():
        raise SceneError(f"{where}: name is {in_toml(entry['name'])}; a string in one line is expected")
    if "name" not in entry:
        raise SceneError(f"{where}: it has no name; every scene needs one")
    if "posture" in entry and "q" in entry:
        raise SceneError(f"{where}: posture and q are both given; one of them is expected")
    values = {key: tuple(value) if isinstance(value, list) else value for key, value in entry.items()}
    for key, value in values.items():
        if key == "posture" and not isinstance(value, str):
            raise SceneError(
                f"{where}: posture is {in_toml(value)}; one of {', '.join(robot.poses)} is expected, numbers as q"
            )
        if key not in UNITS or value in WORDS.get(key, ()) or (key == "targets" and is_number(value)):
            continue
        each = robot.coordinates.positions if key == "q" else robot.coordinates.speeds
        if not (are_numbers(value) and len(value) == len(each)):
            units = ", ".join(dict.fromkeys(UNITS[key][kind] for kind in robot.tree.kind))
            count = f"{len(each)} numbers, one per joint ({some(each)}), in {units}"
            accepted = f"free, hold, servos, or {count}" if key == "torque" else count
            raise SceneError(f"{where}: {key} is {in_toml(entry[key])}; {accepted} is expected")
    if "q" in values:
        values["posture"] = with_unit_quaternions(where, entry["q"], values.pop("q"), robot)
    try:
        if "duration" in values and "dt" not in values:
            values["dt"] = values["duration"] / STEPS
        scene = Scene(**values, judged=0.0, tags=("own",))
        Case(robot, scene)
        return scene
    except TypeError:
        found = in_toml(values["duration"])
        raise SceneError(f"{where}: duration is {found}; a time in s above 0 is expected") from None
    except WrongField as error:
        key = "q" if error.field == "posture" and "q" in entry else error.field
        accepted = error.accepted
        for ours, theirs in IN_TOML.items():
            accepted = accepted.replace(ours, theirs)
        found = in_toml(entry[key]) if key in entry else in_toml(values[key])
        raise SceneError(f"{where}: {key} is {found}; {' '.join(accepted.split())} is expected") from None
    except ValueError as error:
        raise SceneError(f"{where}: {' '.join(str(error).split())}") from None


def with_unit_quaternions(where: str, given: list, q: tuple, robot: Robot) -> tuple:
    """A position with every quaternion at length 1; SceneError if one is further from it than what few digits leave."""
    q = np.array(q, dtype=float)
    for name, (kind, at, _) in zip(robot.joints, robot.coordinates.places.joints):
        if kind == "ball":
            length = float(np.linalg.norm(q[at]))
            if not abs(length - 1.0) <= NEARLY_ONE:
                raise SceneError(
                    f"{where}: q is {in_toml(given)}; the quaternion of {name} has the length {length:.6g}, "
                    f"1 within {NEARLY_ONE:g} is expected"
                )
            q[at] /= length
    return tuple(map(float, q))


def in_toml(value: object) -> str:
    """A value as it may stand in a file, in one line, shortened."""

    def whole(value):
        if isinstance(value, bool):
            return str(value).lower()
        if isinstance(value, list | tuple):
            return f"[{', '.join(map(whole, value))}]"
        if isinstance(value, dict):
            return f"{{{', '.join(f'{key} = {whole(part)}' for key, part in value.items())}}}"
        return repr(value) if isinstance(value, str | float | int) else str(value)

    return shorten(" ".join(whole(value).split()))
