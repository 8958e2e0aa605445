"""A robot that is read from a file: its postures and scenes."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np

from tmt import Tree, literal
from tmt.derivation.composite import mass_matrix_and_bias  # literal takes minutes for hundreds of joints
from tmt.model.tree import GAINS

from ..core.finding import Finding
from .actuators import Drive
from .case import Range, Robot
from .coordinates import Coordinates, fastest_rates, free_joints
from .printed import Feature
from .scene import Scene

Array = np.ndarray
DURATION = 1.0  # s; longer free motions are chaotic
MIN_STEPS, MAX_STEPS_OF_A_FILE = 64, 8192  # of a scene, with its largest step
MOST_ENTRIES = 1_400_000  # of all Jacobians of a run, which take the time where it is compared
COARSER = 4  # largest step / step of the file
OWN_POSTURES = "qpos0", "middle"  # their names
SAME_POSTURE = 1e-9  # rad or m
SERVOS_ACT = 0.25  # s, duration of scenes with servos; their fast modes need short steps
MOVED_TARGETS = {"hinge": 6.0, "slide": 0.02, "ball": 0.0}  # deg or m, in a step response
STILL = 1e-6  # rad/s2 or m/s2, acceleration that counts as rest
THROWN_UP, TUMBLING = 2.0, (120.0, 60.0, -90.0)  # m/s, and deg/s about a free body's own axes
SET_GOING = {"hinge": 60.0, "slide": 0.2, "ball": 60.0}  # deg/s or m/s


@dataclass(frozen=True)
class RobotFile:
    """The numbers of a file as they were compiled."""

    name: str  # of the model, "": it has none that can be printed in a line
    path: Path | None  # None: the model is a text, or was compiled elsewhere
    tree: Tree
    features: tuple[Feature, ...]  # in a fixed order
    keyframes: Mapping[str, Array]  # positions of the Tree, (nq,), by the key's name or `key 0`
    qpos0: Array  # (nq,)
    ranges: tuple[Range, ...]  # of each joint; a ball's of the angle of its turn
    integrator: str  # by MuJoCo's name
    dt: float  # s
    drive: Drive | None  # its actuators; controls by the names of `keyframes`


def robot_of(file: RobotFile, shown: str) -> Robot:
    """The robot of a file, called `shown` in reports, with the numbers that MuJoCo compiled."""
    keys = names_of_keys(file)
    positions = named_positions(file, keys)
    start = next(name for name in positions if name != "qpos0" or len(positions) == 1)
    drive = file.drive and file.drive.called(keys)
    return Robot(
        name=file.name or Path(shown).stem or shown,
        mjcf=file.path or Path(shown),
        tree=file.tree,
        postures=positions,
        ranges=file.ranges,
        scenes=scenes_from(file.tree, start, np.array(positions[start]), file.dt, drive),
        described=Path(shown).name or shown,
        features=file.features,
        drive=drive,
    )


def robot_of_solution(file: RobotFile, shown: str, solution: RobotFile, whose: str) -> Robot:
    """The robot of a file with the numbers, postures, scenes and names of a solution, called `whose`."""
    robot = robot_of(solution, shown)
    mjcf, stated = file.path or robot.mjcf, solution.features
    return replace(robot, mjcf=mjcf, features=file.features, stated_in=whose, features_stated=stated)


def not_compared(file: RobotFile, solution: RobotFile, names: Sequence[str]) -> list[Finding]:
    """The limits and actuators that are not those of a solution. names: its joints as in the file."""
    ranges = dict(zip(file.tree.joint_names, file.ranges))
    called = dict(zip(solution.tree.joint_names, names))
    limits = [name for name, limit in zip(names, solution.ranges) if rounded(ranges[name]) != rounded(limit)]
    laws, stated = laws_of(file.drive, {}), laws_of(solution.drive, called)
    actuators = [name for law, name in (laws | stated).items() if law not in laws or law not in stated]
    values = {"limits": limits, "actuators": list(dict.fromkeys(actuators))}
    return [Finding("remarks", "not_compared", values)] if limits or actuators else []


def laws_of(drive: Drive | None, joints: Mapping[str, str]) -> dict[tuple[str, tuple[str, ...]], str]:
    """The names of actuators by joint and numbers. joints: other names of joints."""
    laws = drive.laws.items() if drive else ()
    return {(joints.get(joint, joint), rounded(numbers)): name for name, (joint, numbers) in laws}


def rounded(numbers: Sequence[float] | None) -> tuple[str, ...]:
    return tuple(f"{x:.9g}" for x in numbers or ())


def names_of_keys(file: RobotFile) -> dict[str, str]:
    """The name of the posture of each keyframe: that of the keyframe, different from OWN_POSTURES."""
    return {name: f"key {name}" if name in OWN_POSTURES else name for name in file.keyframes}


def named_positions(file: RobotFile, names: Mapping[str, str]) -> dict[str, tuple[float, ...]]:
    """Postures by name, (nq,): keyframes, qpos0, the middle of the ranges; of equal ones only the first."""
    coordinates = Coordinates(file.tree.joint_names, file.tree.kind)
    middle = np.array(file.qpos0, dtype=float)
    for joint, limits in zip(coordinates.places.joints, file.ranges):
        if limits and joint.kind != "ball":
            middle[joint.q] = np.mean(limits)
    postures = {names[key]: q for key, q in file.keyframes.items()}
    postures |= dict(zip(OWN_POSTURES, (file.qpos0, middle)))
    positions: dict[str, tuple[float, ...]] = {}
    for name, q in postures.items():
        tangents = [coordinates.difference(q, np.array(other)) for other in positions.values()]
        if all(np.abs(tangent).max() >= SAME_POSTURE for tangent in tangents):
            positions[name] = tuple(map(float, q))
    return positions


def scenes_from(tree: Tree, start: str, q: Array, dt: float, drive: Drive | None) -> tuple[Scene, ...]:
    """The scenes of a robot: held, let go, with damping too; a free body is thrown; then servo_scenes.

    Only agreement is expected, as long as rounding allows. A robot that would stay at rest gets an initial
    speed. Methods are compared on a thrown free body, because one that is let go may only fall. start, q: the
    posture, name and (nq,); dt: step of the file, s; drive: its actuators.
    """
    coordinates, free = Coordinates(tree.joint_names, tree.kind), free_joints(tree)
    mass_matrix, weight = map(np.array, mass_matrix_and_bias(tree, q.tolist(), [0.0] * coordinates.nv))
    # joints may have very different inertia
    root = np.sqrt(np.where(np.diag(mass_matrix) > 0.0, np.diag(mass_matrix), 1.0))
    inverse = np.linalg.pinv(mass_matrix / np.outer(root, root), hermitian=True) / np.outer(root, root)
    accelerations = inverse @ -(weight + literal.spring_torque(tree, q))
    damping = added_damping(inverse, accelerations)
    longest = DURATION / coarsest(tree, inverse, dt)
    let_go = partial(Scene, posture=start, duration=DURATION, dt=longest, judged=0.0)
    scenes = []
    turns, is_at_rest = accelerations, np.abs(accelerations).max() < STILL
    if not is_at_rest:
        scenes.append(let_go(f"{start}, held", torque="hold", tags=("own",)))
    if free:
        scenes.append(let_go(f"{start}, thrown", speed=thrown(tree), tags=("own", "speed", "regular")))
        slides = [tree.coordinates.joints[i + k].qd.start for i in free for k in range(3)]
        turns = np.delete(accelerations, slides)
    how, tags = f"{start}, let go", ("own", "speed") if free else ("own", "speed", "regular")
    if is_at_rest:
        how = f"{start}, set going"
        let_go = partial(let_go, speed=tuple(SET_GOING[kind] for kind in coordinates.kinds_of_speeds))
    elif free and np.abs(turns).max() < STILL:
        tags = ("own", "falls")
    scenes.append(let_go(how, tags=tags))
    longest = DURATION / coarsest(tree, inverse, dt, damping)
    scenes.append(let_go(f"{how}, damped", damping=damping, tags=("own", "full only"), dt=longest))
    return (*scenes, *(servo_scenes(tree, start, q, dt, drive, inverse) if drive else ()))


def servo_scenes(tree: Tree, start: str, q: Array, dt: float, drive: Drive, inverse: Array) -> list[Scene]:
    """The scenes with the robot's own servos, if it has some: held, and step response.

    A robot with a free body has no gravity in them. If a servo is too fast for MAX_STEPS_OF_A_FILE, methods
    are not compared.
    """
    acting = drive.controller(start, np.array(q))
    if not acting.position_gain.any():
        return []
    driven = replace(tree, **{name: getattr(acting, name) for name in GAINS})
    count = coarsest(driven, inverse, dt, duration=SERVOS_ACT)
    least = SERVOS_ACT * max(fastest_rates(driven, inverse))
    acted = partial(Scene, posture=start, torque="servos", gravity=not free_joints(tree), judged=0.0)
    timed = partial(acted, duration=SERVOS_ACT, dt=SERVOS_ACT / count)
    held = timed(f"{start}, held by servos", tags=("own", "full only"))
    kinds = Coordinates(tree.joint_names, tree.kind).kinds_of_speeds
    moved = tuple(MOVED_TARGETS[kind] for kind in kinds)
    tags = ("own", "servos", "speed") if least <= count else ("own", "servos")
    return [held, replace(held, name=f"{start}, step of the servos", targets=moved, tags=tags)]


def added_damping(inverse: Array, accelerations: Array) -> tuple[float, ...]:
    """Damping of each speed, (nv,) N m s/rad or N s/m, with which a robot sinks without swinging.

    Every joint, with its inertia 1 / (Mbar^-1)_ii, decays at the same rate: twice the frequency of a swing of
    1 rad or 1 m with the initial acceleration, at least 1 rad/s2.
    """
    rate = 2.0 * np.sqrt(max(1.0, np.abs(accelerations).max()))
    return tuple(float(rate / ease) for ease in np.diag(inverse))


def coarsest(
    tree: Tree, inverse: Array, dt: float, added: Sequence[float] = (), duration: float = DURATION
) -> int:
    """The number of steps of a scene, 64, 128 ... 8192: about four times the step of the file.

    No step is longer than 1 / the fastest rate of damping, added damping, springs and servos, unless that
    were more steps than are afforded. inverse: of Mbar, (nv, nv).
    """
    least = duration * max(1.0 / (COARSER * dt), *fastest_rates(tree, inverse, added))
    count, most = MIN_STEPS, min(MAX_STEPS_OF_A_FILE, steps_afforded(len(inverse)))
    while count < 0.999 * least and 2 * count <= most:
        count *= 2
    return count


def steps_afforded(nv: int) -> int:
    """The steps of a run that is compared to its end: each has a Jacobian of (2 nv)^2 entries."""
    return MOST_ENTRIES // (2 * nv) ** 2


def thrown(tree: Tree) -> tuple[float, ...]:
    """Speeds, (nv,) m/s and deg/s, of tumbling free bodies; zero of all else."""
    speed = np.zeros(tree.coordinates.nv)
    for i in free_joints(tree):
        speed[tree.coordinates.joints[i + 2].qd.start] = THROWN_UP
        speed[tree.coordinates.joints[i + 3].qd] = TUMBLING
    return tuple(speed.tolist())
