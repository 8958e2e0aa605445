"""What each engine has read: the numbers that differ from the compiled model, body by body and joint by joint, and why."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from ...core.check import About
from ...core.words import some_of
from ...engines import EngineRecord
from ...engines.outside.bodies import size_of
from ...engines.outside.file import File, OtherJoints
from ...engines.outside.mjcf_text import REFUSED
from ...engines.outside.model import Reading
from ...judge.scale import FACTOR
from ...robots import Robot
from .causes import FLOAT32, Cause, Entry, causes_of
from .tables import EnginesResult, ReadRow, Share

UNITS = {"gravity": "m/s2", "mass": "kg", "moments": "kg m2", "com": "m", "inertia": "kg m2", "axis": "", "anchor": "m",
         "armature": "kg m2", "damping": "N m s/rad", "stiffness": "N m/rad"}  # fmt: skip
OF_BODIES = "mass", "moments"  # no convention makes these differ
ENTRIES = {"mass": 1, "moments": 3, "com": 3, "inertia": 9, "axis": 3, "anchor": 3}  # of a joint
OF_JOINTS = "axis", "anchor"
# not listed where one of these differs too
FOLLOWS = {
    "inertia": ("moments", "mass"), "com": ("mass",), "axis_moved": ("axis",), "anchor_moved": ("anchor", "axis"),
    "com_moved": ("com", "axis", "anchor", "mass"),
}  # fmt: skip
# in place of a number, by the kind of error for which a copy was read: the file itself, or its joints
OF_COPIES = {REFUSED: ["refused"], OtherJoints.__name__: ["joints"]}
AS_READ = "as read"  # checks of numbers


def compare_numbers(result: EnginesResult, robot: Robot, record: EngineRecord, reading: Reading) -> None:
    """Rows of what an engine has read differently, and checks of the masses and moments of inertia."""
    label, lacking, mended = record.label, list(reading["lacking"]), reading["mended"]
    share = result.readers[label] = Share(reading["way"], reading["unwritten"])
    if reading["copied"]:
        kind, message = reading["copied"]
        result.find("copied", engine=label, error=kind, reason=message.rstrip("."))
        share.differing += OF_COPIES.get(kind, [])
    if lacking:
        result.find("lacking", engine=label, numbers=lacking)
        share.differing += [f"no {number}" for number in lacking]
    for number in [number for number in OF_BODIES if number in reading["read"]]:
        most = np.abs(reading["read"][number] - reading["stated"][number]).max(initial=0.0)
        pair = float(most), tolerance_of(reading, record, number)
        result.check(label, f"{number} {AS_READ}", *pair, UNITS[number], "", True, about=About.ENGINE)
    listed = [number for number in mended if number not in lacking]
    listed = [number for number in listed if not set(FOLLOWS.get(number, ())) & mended.keys()]
    entries = [entry for number in listed for entry in differing(robot, record, reading, number)]
    causes = causes_of(record, file_of(robot), reading, entries)
    for number in listed:
        of_number = {entry: causes.get(entry) for entry in entries if entry.number == number}
        add_differing(result, robot, record, reading, of_number)
    numbers: dict[Cause | None, list[str]] = {}
    for entry in entries:
        numbers.setdefault(causes.get(entry), []).append(entry.number.removesuffix("_moved"))
    for cause, of_cause in numbers.items():
        result.find("cause", engine=label, cause=cause, numbers=list(dict.fromkeys(of_cause)))


def tolerance_of(reading: Reading, record: EngineRecord, number: str) -> float:
    return FACTOR * record.eps * size_of(reading["stated"], number)


def file_of(robot: Robot) -> File:
    return File(Path(robot.mjcf), robot.joints, robot.coordinates.all_kinds)


def differing(robot: Robot, record: EngineRecord, reading: Reading, number: str) -> list[Entry]:
    """The entries of a number that an engine has read differently."""
    values, stated = (np.ravel(reading[which][number]) for which in ("read", "stated"))
    _, joints = named_after(robot, number.removesuffix("_moved"))
    is_right = np.abs(values - stated) <= tolerance_of(reading, record, number)
    bodies = [tuple(names) for names in bodies_of(robot)]
    places = np.flatnonzero(~is_right).tolist()
    return [Entry(number, place, joints[place], bodies[joints[place]]) for place in places]


def add_differing(
    result: EnginesResult, robot: Robot, record: EngineRecord, reading: Reading, causes: Mapping[Entry, Cause | None]
) -> None:  # fmt: skip
    """Rows and a finding of a number that an engine has read differently; causes: of its entries."""
    number = next(iter(causes)).number
    quantity, label, is_set = number.removesuffix("_moved"), record.label, reading["mended"][number]
    values, stated = (np.ravel(reading[which][number]) for which in ("read", "stated"))
    names, rows = named_after(robot, quantity)[0], []
    for entry, cause in causes.items():
        pair = float(values[entry.place]), float(stated[entry.place])
        text = cause and str(cause)
        rows.append(ReadRow(label, number, names[entry.place], *pair, UNITS[quantity], is_set, text))
    result.tables["engines_read"] += rows
    count = len({entry.joint for entry in causes})
    result.find("read_differently", engine=label, rows=rows, number=number, mended=is_set, count=count)
    listed = result.readers[label].differing
    is_rounding = {cause.kind if cause else "" for cause in causes.values()} == {FLOAT32}
    word = "rounding of meshes" if is_rounding else quantity
    listed += [] if word in listed else [word]


def named_after(robot: Robot, number: str) -> tuple[list[str], list[int]]:
    """What each entry of a number belongs to, a body, a joint or an axis, and the joint of the Tree in whose row it is."""
    if number == "gravity":
        return list("xyz"), [0, 0, 0]
    places = robot.coordinates.places.joints
    if number not in ENTRIES:
        joints = [k for k, joint in enumerate(places) for _ in range(joint.qd.stop - joint.qd.start)]
        return list(robot.coordinates.speeds), joints
    of_bodies = [some_of(names) or joint for names, joint in zip(bodies_of(robot), robot.joints)]
    names = list(robot.joints) if number in OF_JOINTS else of_bodies
    joints = np.repeat(np.arange(len(names)), ENTRIES[number]).tolist()
    return [names[joint] for joint in joints], joints


def bodies_of(robot: Robot) -> Sequence[Sequence[str]]:
    """The bodies that move with each joint and not with the next one."""
    bodies: list[list[str]] = [[] for _ in robot.joints]
    for body, joint in zip(robot.tree.body_names, robot.tree.body_joint):
        if joint >= 0:
            bodies[joint].append(body)
    return bodies
