"""What each engine has read: the numbers that differ from the compiled model, body by body and joint by joint, and why."""

from collections.abc import Sequence

import numpy as np

from ...core.check import About
from ...core.words import some_of
from ...engines import EngineRecord
from ...engines.mujoco.source import Source
from ...engines.outside.bodies import OF_BODIES, OF_JOINTS, size_of
from ...engines.outside.file import File
from ...engines.outside.model import Reading
from ...judge.scale import FACTOR
from ...robots import Robot
from .features import Entry, causes_of
from .tables import EnginesResult, ReadRow

UNITS = {"gravity": "m/s2", "mass": "kg", "com": "m", "com_moved": "m", "inertia": "kg m2", "axis": "",
         "anchor": "m"}  # fmt: skip
OF_SPEEDS = {"armature": {"rad": "kg m2", "m": "kg"}, "damping": {"rad": "N m s/rad", "m": "N s/m"},
             "stiffness": {"rad": "N m/rad", "m": "N/m"}}  # fmt: skip
CHECKED = "mass", "inertia"  # no convention makes these differ
ENTRIES = {"mass": 1, "inertia": 9, "com": 3, "com_moved": 3, "axis": 3, "anchor": 3}  # of a joint
# not listed where one of these differs too
FOLLOWS = {"inertia": ("mass",), "com": ("mass",), "com_moved": ("com", "axis", "anchor", "mass")}
SINGLE = float(np.finfo(np.float32).eps)
ROUNDING = "digits beyond single precision, in which MuJoCo keeps the vertices of meshes"


def compare_numbers(
    result: EnginesResult, robot: Robot, record: EngineRecord, file: File, reading: Reading
) -> None:
    """Rows of what an engine has read differently, and checks of the masses and inertias."""
    label = record.label
    rows = [ReadRow(label, number, "joints") for number in reading.lacking]
    for number in [number for number in CHECKED if number in reading.read]:
        largest = np.abs(reading.read[number] - reading.stated[number]).max(initial=0.0)
        bar = FACTOR * record.eps * size_of(reading.stated, number)
        result.check(label, f"{number} as read", largest, bar, UNITS[number], "", True, about=About.ENGINE)
    listed = [number for number in reading.differing if not {*FOLLOWS.get(number, ())} & {*reading.differing}]
    entries = [entry for number in listed for entry in differing(record, reading, number)]
    causes = causes_of(record, file, reading, entries) if entries else {}
    meshes = Source(file.path, file.floating).mesh_geoms if entries else ()
    is_meshed = any(any(of_body) for _, of_body in meshes)
    for entry in entries:
        number, place = entry
        values, stated = (float(np.ravel(which[number])[place]) for which in (reading.read, reading.stated))
        is_rounding = abs(values - stated) <= FACTOR * SINGLE * size_of(reading.stated, number)
        cause = causes.get(entry, ROUNDING if is_meshed and is_rounding and number in OF_BODIES else None)
        of, unit = owner(robot, number, place)
        rows.append(ReadRow(label, number, of, values, stated, unit, number not in reading.not_set, cause))
    result.tables["engines_read"] += rows
    count = sum(reading.read[name].size for name in reading.read)
    answer = {"numbers": count, "rows": rows, "not_set": reading.not_set, "lacking": reading.lacking}
    result.answers[label] = {"reads": answer}
    for cause in dict.fromkeys(row.cause for row in rows if row.compared is not None):
        of_cause = [row for row in rows if row.cause == cause and row.compared is not None]
        result.find("read_differently", engine=label, rows=of_cause, cause=cause)
    if reading.lacking:
        result.find("lacking", engine=label, numbers=reading.lacking)


def differing(record: EngineRecord, reading: Reading, number: str) -> list[Entry]:
    """The entries of a number that an engine has read differently; of a symmetric inertia the upper triangle."""
    values, stated = (np.array(which[number], float) for which in (reading.read, reading.stated))
    is_wrong = ~(np.abs(values - stated) <= FACTOR * record.eps * size_of(reading.stated, number))
    if number == "inertia":
        is_wrong = np.triu(is_wrong)
    return [Entry(number, place) for place in np.flatnonzero(is_wrong).tolist()]


def owner(robot: Robot, number: str, place: int) -> tuple[str, str]:
    """What an entry of a number belongs to, a body, a joint or an axis of the world; and its unit."""
    if number == "gravity":
        return "xyz"[place], UNITS[number]
    if number in OF_JOINTS:
        coordinates = robot.coordinates
        return coordinates.speeds[place], OF_SPEEDS[number][coordinates.units[place]]
    if number not in ENTRIES:
        return f"entry {place}", ""  # of a field of MuJoCo's own model
    joint = place // ENTRIES[number]
    name = robot.joints[joint] if number in ("axis", "anchor") else some_of(bodies_of(robot)[joint])
    return name or robot.joints[joint], UNITS[number]


def bodies_of(robot: Robot) -> Sequence[Sequence[str]]:
    """The bodies that move with each joint and not with the next one."""
    bodies: list[list[str]] = [[] for _ in robot.joints]
    for body, joint in zip(robot.tree.body_names, robot.tree.body_joint):
        if joint >= 0:
            bodies[joint].append(body)
    return bodies
