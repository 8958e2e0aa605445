"""A robot that is read from a file: its postures and scenes."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Protocol

import numpy as np

import tmt
from tmt import literal
from tmt.derivation.composite import mass_matrix_and_bias  # literal takes minutes for hundreds of joints
from tmt.model.tree import GAINS

from . import Robot
from .actuators import Drive, controller
from .case import KINDS, Coordinates, Scene, fastest_rates
from .coordinates import free_joints

DURATION = 1.0  # s; longer free motions are chaotic
MIN_STEPS, MAX_STEPS_OF_A_FILE = 64, 8192  # of a scene, with its largest step
COARSER = 4  # largest step / step of the file
OWN_POSTURES = "qpos0", "middle"  # their names
SERVOS_ACT = 0.25  # s, duration of scenes with servos; their fast modes need short steps
MOVED_TARGETS = {"hinge": 6.0, "slide": 0.02, "ball": 0.0}  # deg or m, in a step response
STILL = 1e-6  # rad/s2 or m/s2, acceleration that counts as rest
THROWN_UP, TUMBLING = 2.0, (120.0, 60.0, -90.0)  # m/s, and deg/s about a free body's own axes
SET_GOING = {"hinge": 60.0, "slide": 0.2, "ball": 60.0}  # deg/s or m/s


class Reading(Protocol):
    """A file as it was read, see engines.mujoco.reading."""

    name: str
    source: Path | str
    tree: tmt.Tree
    features: tuple
    keyframes: Mapping[str, np.ndarray]
    qpos0: np.ndarray
    ranges: tuple
    drive: Drive
    dt: float


def robot_of(reading: Reading, shown: str) -> Robot:
    """The robot of a file, called `shown` in reports, with the numbers that MuJoCo compiled."""
    keys = names_of_keys(reading)
    positions = named_positions(reading, keys)
    start = next(name for name in positions if name != "qpos0" or len(positions) == 1)
    drive = replace(reading.drive, controls={keys[name]: u for name, u in reading.drive.controls.items()})
    return Robot(
        name=reading.name or Path(shown).stem or shown,
        mjcf=reading.source if isinstance(reading.source, Path) else Path(shown),
        tree=reading.tree,
        postures={},
        positions=positions,
        ranges=tuple(reading.ranges),
        scenes=scenes_from(reading.tree, start, np.array(positions[start]), reading.dt, drive),
        described=Path(shown).name or shown,
        features=tuple(reading.features),
        drive=drive,
    )


def robot_of_solution(
    reading: Reading, shown: str, solution: Reading, whose: str, names: Sequence[str]
) -> tuple[Robot, Reading]:
    """The robot of a file with the numbers, postures and scenes of a solution, called `whose`; and that solution.

    names: of the file's joints, in the order of the solution's. Actuators do not act: those of the file may differ.
    """
    solution = replace(solution, tree=replace(solution.tree, joint_names=tuple(names)), drive=Drive())
    stated = {"stated_in": whose, "features_stated": tuple(solution.features)}
    of_file = {"mjcf": reading.source, "features": tuple(reading.features)}
    robot = replace(robot_of(solution, shown), **stated, **of_file)
    return robot, solution


def names_of_keys(reading: Reading) -> dict[str, str]:
    """The name of the posture of each keyframe: that of the keyframe, different from OWN_POSTURES."""
    names = {}
    for name in reading.keyframes:
        unique = name
        while unique in OWN_POSTURES or (unique != name and unique in reading.keyframes):
            unique = f"key {unique}"
        names[name] = unique
    return names


def named_positions(reading: Reading, names: Mapping[str, str]) -> dict[str, tuple]:
    """Postures by name, (nq,) each: keyframes, qpos0, the middle of the ranges; of equal postures only the first."""
    coordinates = Coordinates(reading.tree.joint_names, reading.tree.kind)
    middle = np.array(reading.qpos0, dtype=float)
    for joint, limits in zip(coordinates.places.joints, reading.ranges):
        if limits and joint.kind != "ball":
            middle[joint.q] = np.mean(limits)
    own = dict(zip(OWN_POSTURES, (reading.qpos0, middle)))
    positions = {}
    for name, q in ({names[key]: q for key, q in reading.keyframes.items()} | own).items():
        if not any(
            np.abs(coordinates.difference(q, np.array(other))).max() < 1e-9 for other in positions.values()
        ):
            positions[name] = tuple(map(float, q))
    return positions


def scenes_from(
    tree: tmt.Tree, start: str, q: np.ndarray, dt: float, drive: Drive | None = None
) -> tuple[Scene, ...]:
    """The scenes of a robot: held, let go, let go with damping; a free body is thrown too; with servos see servo_scenes.

    Only agreement is expected, as long as rounding allows. A robot that would stay at rest gets an initial speed. Methods are
    compared on a thrown free body, because one that is let go may only fall.
    start, q: the posture, name and (nq,); dt: step of the file, s; drive: its actuators.
    """
    coordinates = Coordinates(tree.joint_names, tree.kind)
    mass_matrix, weight = map(np.array, mass_matrix_and_bias(tree, q.tolist(), [0.0] * coordinates.nv))
    root = np.sqrt(
        np.where(np.diag(mass_matrix) > 0.0, np.diag(mass_matrix), 1.0)
    )  # joints of very different inertia
    inverse = np.linalg.pinv(mass_matrix / np.outer(root, root), hermitian=True) / np.outer(root, root)
    accelerations = inverse @ -(weight + literal.spring_torque(q, tree))
    added = added_damping(inverse, accelerations)
    rests = np.abs(accelerations).max() < STILL
    going = {"speed": tuple(v for kind in tree.kind for v in [SET_GOING[kind]] * KINDS[kind].speeds)}
    how, speed = ("set going", going) if rests else ("let go", {})
    timing = {"duration": DURATION, "dt": DURATION / coarsest(tree, inverse, dt), "judged": 0.0}
    damped = timing | {"dt": DURATION / coarsest(tree, inverse, dt, added)}
    made = [] if rests else [Scene(f"{start}, held", start, "hold", tags=("own",), **timing)]
    tags = ("own", "speed", "regular")
    if free := free_joints(tree):
        made.append(Scene(f"{start}, thrown", start, speed=thrown(tree), tags=tags, **timing))
        turns = np.delete(
            accelerations, [tree.coordinates.joints[i + k].qd.start for i in free for k in range(3)]
        )
        tags = ("own", "speed") if rests or np.abs(turns).max() >= STILL else ("own", "falls")
    made += [
        Scene(f"{start}, {how}", start, tags=tags, **speed, **timing),
        Scene(f"{start}, {how}, damped", start, damping=added, tags=("own", "full only"), **speed, **damped),
    ]
    return (*made, *servo_scenes(tree, start, q, dt, drive or Drive(), inverse))


def servo_scenes(
    tree: tmt.Tree, start: str, q: np.ndarray, dt: float, drive: Drive, inverse: np.ndarray
) -> list[Scene]:
    """The scenes with the robot's own servos, if it has some: held, and step response.

    A robot with a free body has no gravity in them. If a servo is too fast for MAX_STEPS_OF_A_FILE, methods are not compared.
    """
    positions = np.array(q)[tree.coordinates.first_positions]
    acting = controller(drive, start, positions)
    if not acting.position_gain.any():
        return []
    driven = replace(tree, **{name: getattr(acting, name) for name in GAINS})
    count, least = (
        coarsest(driven, inverse, dt, duration=SERVOS_ACT),
        SERVOS_ACT * max(fastest_rates(driven, inverse)),
    )
    free = bool(free_joints(tree))
    settings = {"gravity": not free, "duration": SERVOS_ACT, "dt": SERVOS_ACT / count, "judged": 0.0}
    kinds = (joint.kind for joint in tree.coordinates.joints for _ in tree.axis[joint.qd])
    moved = tuple(MOVED_TARGETS[kind] for kind in kinds)
    followed = ("speed",) if least <= count else ()
    return [
        Scene(f"{start}, held by servos", start, "servos", tags=("own", "full only"), **settings),
        Scene(
            f"{start}, step of the servos",
            start,
            "servos",
            targets=moved,
            tags=("own", "servos", *followed),
            **settings,
        ),
    ]


def added_damping(inverse: np.ndarray, accelerations: np.ndarray) -> tuple[float, ...]:
    """Damping of each speed, (nv,) N m s/rad or N s/m, with which a robot sinks without swinging.

    Every joint, with its inertia 1 / (Mbar^-1)_ii, decays at the same rate: twice the frequency of a swing of 1 rad or 1 m with
    the initial acceleration, at least 1 rad/s2.
    """
    rate = 2.0 * np.sqrt(max(1.0, np.abs(accelerations).max()))
    return tuple(float(rate / ease) for ease in np.diag(inverse))


def coarsest(
    tree: tmt.Tree, inverse: np.ndarray, dt: float, added: tuple = (), duration: float = DURATION
) -> int:
    """The number of steps of a scene, 64, 128 ... 8192: about four times the step of the file.

    No step is longer than 1 / the fastest rate of damping, added damping, springs and servos. inverse: of Mbar, (nv, nv).
    """
    least = duration * max(1.0 / (COARSER * dt), *fastest_rates(tree, inverse, added))
    count = MIN_STEPS
    while count < min(0.999 * least, MAX_STEPS_OF_A_FILE):
        count *= 2
    return count


def thrown(tree: tmt.Tree) -> tuple[float, ...]:
    """Speeds, (nv,) m/s and deg/s, of tumbling free bodies; () if there are none."""
    speed, free = np.zeros(tree.coordinates.nv), free_joints(tree)
    for i in free:
        speed[tree.coordinates.joints[i + 2].qd.start] = THROWN_UP
        speed[tree.coordinates.joints[i + 3].qd] = TUMBLING
    return tuple(map(float, speed)) if free else ()
