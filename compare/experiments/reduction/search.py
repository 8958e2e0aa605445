"""What a scene does not need: what goes for nothing, and the joints that can be locked for an error."""

from collections.abc import Sequence
from pathlib import Path as File
from typing import NamedTuple

import numpy as np

from ...core.text import block
from ...engines.mujoco.motion import Path, joints
from ...engines.mujoco.names import kind_of
from ...engines.mujoco.smaller import FREE, Smaller, finished, locked, tied_joints
from ...engines.mujoco.source import Source
from ...engines.mujoco.written import write
from .records import FreeRow, JointRow
from .scene import Scene

TEXT = "reduction"  # the template
DOES = {"slide": 0.02}  # m: a joint that moves more is what the scene is about
DOES_TURN = 0.1  # rad, of all others
SAMPLES = 25  # states of a motion


def take_out(scene: Scene) -> list[FreeRow]:
    """Take one kind after the other out of what is left of a scene, if the motion is the same to the last bit."""
    rows = list[FreeRow]()
    for kind, edit in FREE.items():
        trial = Smaller(scene.left.spec.copy())
        try:
            count = edit(trial, scene.use)
            trial = Smaller(trial.spec)
        except ValueError:  # something else refers to it
            continue
        if count:
            is_same = same_bits(scene.run(trial), scene.paths)
            scene.left = trial if is_same else scene.left
            rows.append(FreeRow(kind, count, is_same))
    return rows


def same_bits(paths: Sequence[Path], others: Sequence[Path]) -> bool:
    bits = [[(path.q.tobytes(), path.v.tobytes()) for path in run] for run in (paths, others)]
    return bits[0] == bits[1]


class Locks(NamedTuple):
    """Joints that can be locked, and the way there. rows: of all joints, with the reasons of those that stay."""

    rows: list[JointRow]
    names: list[str]  # in the order in which they are locked
    models: list[tuple[list[str], Smaller, float]]  # with the first of them, and the error, rad or m


def lockable(scene: Scene, allowed: float) -> Locks:
    """Lock joints of what is left, those of least error first, until an error, rad or m, of those that stay.

    Those that a tendon or an equality ties are locked together, each at the middle of its movement. One that
    moves more than DOES is not locked, nor is a free base.
    """
    use, model, costs = scene.use, scene.left.model, dict[tuple[str, ...], float]()
    kinds = {name: kind_of(model, number) for number, name in enumerate(joints(model))}
    for tied in tied_joints(model):
        costs[tuple(tied)] = error_of(scene, tied)[1]
    chosen, models = list[str](), [(list[str](), scene.left, 0.0)]
    for group in sorted(costs, key=lambda group: costs[group]):
        if all(use.moved[name] <= DOES.get(kinds[name], DOES_TURN) for name in group):
            trial, error = error_of(scene, [*chosen, *group])
            if trial and error <= allowed:
                chosen += group
                models.append((list(chosen), trial, error))
    alone, rows = {name: cost for group, cost in costs.items() for name in group}, list[JointRow]()
    for name, (speed, at_start, later) in starts(scene).items():
        error, moved, lasts = alone.get(name, np.inf), use.moved[name], scene.duration
        row = JointRow(scene.name, name, moved, max(at_start, later), error if np.isfinite(error) else None)
        row.locked, is_last = name in chosen, len(chosen) == len(kinds) - 1 and moved <= allowed
        if not row.locked and not is_last:  # of a scene in which nothing moves
            far = lasts * speed, 0.5 * lasts**2 * at_start, 0.5 * lasts**2 * later
            why = next((number for number, moves in enumerate(far) if moves > allowed), len(far))
            about = {"kind": kinds[name], "at_start": at_start, "later": later}
            row.why_needed = block(TEXT, "why", row=row, why=why, **about)
        rows.append(row)
    return Locks(rows, chosen, models)


def error_of(scene: Scene, names: Sequence[str]) -> tuple[Smaller | None, float]:
    """What is left with joints locked and its error, rad or m; inf: something refers to one, or none moves then."""
    try:
        trial = locked(scene.left, {name: scene.use.middle[name] for name in names})
    except ValueError:
        return None, np.inf
    return trial, scene.error(trial) if trial.model.nv else np.inf


def starts(scene: Scene) -> dict[str, tuple[float, ...]]:
    """The largest speed of each joint at the start, and acceleration there, and when the others move: rad, m, s.

    Then the joint is where it starts and at rest, and the others are at states of the motion.
    """
    stepper, of_joints = scene.stepper, joints(scene.whole.model)
    places, largest = stepper.places, np.zeros((len(of_joints), 3))
    for roll, path in zip(scene.rolls, scene.paths):
        first = np.abs(stepper.forward(roll.state).qacc)
        for row, (of_q, of_v) in zip(largest, of_joints.values()):
            row[:2] = np.maximum(row[:2], [np.abs(path.v[0, of_v]).max(), first[of_v].max()])
            for k in np.linspace(0, len(path.q) - 1, SAMPLES).astype(int):
                state = roll.state.copy()
                state[places["qpos"]], state[places["qvel"]] = path.q[k], path.v[k]
                state[places["qpos"]][of_q], state[places["qvel"]][of_v] = path.q[0, of_q], 0.0
                if roll.controls is not None:
                    state[places["ctrl"]] = roll.controls[min(k, roll.steps - 1)]
                row[2] = max(row[2], np.abs(stepper.forward(state).qacc[of_v]).max())
    return {name: tuple(row) for name, row in zip(of_joints, largest.tolist())}


def written(scene: Scene, names: Sequence[str], path: File, comment: str) -> Smaller:
    """Write what is left with joints locked, with the starts of the motions as keyframes; what is read again."""
    small = locked(scene.left, {name: scene.use.middle[name] for name in names})
    write(finished(small, scene.carried(small)).spec, path, comment)
    return Smaller.whole(Source(path))
