"""Scenes of a user's own, from a TOML file with a table [[scene]] for each."""

import tomllib
from pathlib import Path

from .case import TORQUES, Case, Scene, are_numbers, shorten
from .robots import Robot

KEYS = ("name", "posture", "q", "speed", "torque", "gravity", "damping", "locked", "duration", "dt")
UNITS = {  # of what is given for each joint: of hinges, slides and balls
    "q": {"hinge": "deg", "slide": "m", "ball": "quaternions"},
    "speed": {"hinge": "deg/s", "slide": "m/s", "ball": "deg/s"},
    "torque": {"hinge": "N m", "slide": "N", "ball": "N m"},
}
WORDS = {"torque": TORQUES}
STEPS = 64  # of a scene that states no dt


class SceneError(ValueError):
    """A file that does not describe scenes of the robot; the message is one line with file and entry."""


def read_scenes(path: str | Path, robot: Robot) -> tuple[Scene, ...]:
    """The scenes of a file, of a robot: angles in deg, speeds in deg/s, torques in N m, damping in N m s/rad, times in s.

    Of slides m, m/s and N; of a ball a quaternion w, x, y, z, and three speeds and torques. Each needs a name; it starts at rest
    with all joints at their reference, free, if nothing else is said. SceneError for a file that
    cannot be read, an unknown key, a value that cannot be, a name that is given twice.
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
        raise SceneError(f"{path} has no list of scenes; a table [[scene]] for each is expected")
    scenes, names = [], {scene.name: f"a scene of {robot.name}" for scene in robot.scenes}
    for number, entry in enumerate(entries, start=1):
        named = f" ({shorten(repr(entry['name']))})" if "name" in entry else ""
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
        raise SceneError(f"{where}: name is {shorten(repr(entry['name']))}; a text in one line is expected")
    if "name" not in entry:
        raise SceneError(f"{where}: it has no name; every scene needs one")
    if "posture" in entry and "q" in entry:
        raise SceneError(f"{where}: posture and q are both given; one of them is expected")
    values = {key: tuple(value) if isinstance(value, list) else value for key, value in entry.items()}
    for key, value in values.items():
        if key == "posture" and not isinstance(value, str):
            raise SceneError(f"{where}: posture is {shorten(repr(value))}; one of {', '.join(robot.poses)} is expected")
        if key not in UNITS or value in WORDS.get(key, ()):
            continue
        each = robot.coordinates.positions if key == "q" else robot.coordinates.speeds
        if not (are_numbers(value) and len(value) == len(each)):
            units = ", ".join(dict.fromkeys(UNITS[key][kind] for kind in robot.tree.kind))
            count = f"{len(each)} numbers, one per joint ({', '.join(each)}), in {units}"
            accepted = f"free, hold, or {count}" if key == "torque" else count
            raise SceneError(f"{where}: {key} is {shorten(repr(entry[key]))}; {accepted} is expected")
    if "q" in values:
        values["posture"] = values.pop("q")
    try:
        if "duration" in values and "dt" not in values:
            values["dt"] = values["duration"] / STEPS
        scene = Scene(**values, judged=0.0, tags=("own",))
        Case(robot, scene)
        return scene
    except TypeError:
        found = shorten(repr(values["duration"]))
        raise SceneError(f"{where}: duration is {found}; a time in s above 0 is expected") from None
    except ValueError as error:
        reason = str(error).split(": ", 1)[1] if str(error).startswith("scene ") else str(error)
        raise SceneError(f"{where}: {' '.join(reason.split())}") from None
