"""What each engine has read: the numbers that differ from the compiled model, body by body and joint by joint, and why."""

from collections.abc import Sequence
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
from .causes import Cause, Entry, Text, cause_of
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
    """Rows of what the engine has read differently, and checks of the masses and moments of inertia."""
    label, lacking, mended = record.label, list(reading["lacking"]), reading["mended"]
    share = result.readers[label] = Share(reading["way"], reading["unwritten"])
    if reading["copied"]:
        kind, message = reading["copied"]
        result.find("copied", engine=label, error=kind, reason=message.rstrip("."))
        share.differing += OF_COPIES.get(kind, [])
    if lacking:
        result.find("lacking", engine=label, numbers=lacking)
        share.differing += [f"no {number}" for number in lacking]
    for number in reading["read"]:
        if number in OF_BODIES:
            most = np.abs(reading["read"][number] - reading["stated"][number]).max(initial=0.0)
            pair = float(most), tolerance_of(reading, record, number)
            result.check(label, f"{number} {AS_READ}", *pair, UNITS[number], "", True, about=About.ENGINE)
        follows = any(cause in mended for cause in FOLLOWS.get(number, ()))
        if number in mended and number not in lacking and not follows:
            add_differing(result, robot, record, reading, number)


def tolerance_of(reading: Reading, record: EngineRecord, number: str) -> float:
    return FACTOR * record.eps * size_of(reading["stated"], number)


def add_differing(
    result: EnginesResult, robot: Robot, record: EngineRecord, reading: Reading, number: str
) -> None:
    """Rows and a finding of a number that an engine has read differently, with the cause of each entry."""
    values, stated = (np.ravel(reading[which][number]) for which in ("read", "stated"))
    quantity, label, is_set = number.removesuffix("_moved"), record.label, reading["mended"][number]
    names, joints = named_after(robot, quantity)
    differs = ~(np.abs(values - stated) <= tolerance_of(reading, record, number))
    places = np.flatnonzero(differs).tolist()
    wrong, bodies = {joints[place] for place in places}, bodies_of(robot)
    file = File(Path(robot.mjcf), robot.joints, robot.coordinates.all_kinds)
    text, rows = Text(file), []
    causes: dict[Cause | None, str] = {}
    for place in places:
        joint = joints[place]
        cause = cause_of(Entry(text, reading, number, robot.joints, joint, bodies[joint], place, wrong))
        causes.setdefault(cause, names[place])
        pair = float(values[place]), float(stated[place])
        rows.append(
            ReadRow(label, number, names[place], *pair, UNITS[quantity], is_set, cause and str(cause))
        )
    result.tables["engines_read"] += rows
    result.find("read_differently", engine=label, rows=rows, number=number, mended=is_set, count=len(wrong))
    for cause in causes:
        result.find("cause", engine=label, cause=cause, number=quantity)
    differing = result.readers[label].differing
    differing += [] if quantity in differing else [quantity]


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
