"""No more model than a motion of a file needs: the answer, its tables, its checks, and the file to take away."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

import tmt
from tmt import Tree

from ...core.check import About
from ...core.text import block
from ...engines.mujoco.motion import Simulation, apart, near, stages_of
from ...engines.mujoco.reading import Reading, read
from ...engines.mujoco.smaller import Smaller, finished, of_parts
from ...engines.mujoco.source import Source
from ...judge.agree import worst_of_each
from ...judge.entries import Entries
from ...judge.run import movement_unit
from ...robots.case import SEED
from ...robots.coordinates import Coordinates
from ...stability.answer import Asked, answer
from ...stability.place import postures_of
from ..setup import Setup
from .records import FreeRow, JointRow, LimitRow, PairRow, ReductionResult, StageRow, SubsetRow, UseRow
from .scene import Scene, scene_of
from .search import Answer, Locks, answer_within, frontier, seconds_of, take_out
from .sub_blocks import check_blocks, units_of

TEXT = "reduction_of_file"  # the template
ERROR = 1e-3  # rad or m, if none is asked for
TENFOLD = 10.0  # errors that are asked too: a tenth, and ten times as large
STATES = 5  # random ones, at which the locked models are compared
DEFAULT = "Euler"  # MuJoCo's integrator where a file states none
STILL = 1e-3  # rad or m: where no joint moves more, the robot stands


def add(result: ReductionResult, setup: Setup, reading: Reading) -> None:
    """Rows, checks and findings of a motion of a file, the answer first."""
    allowed = setup.request.error or ERROR
    errors = allowed / TENFOLD, allowed, allowed * TENFOLD
    try:
        scene = scene_of(setup, reading)
    except ValueError as reason:
        result.not_judged("", "a motion with fewer joints", str(reason), about=About.PROGRAM)
        return
    kinds = take_out(scene)
    locks = Locks(scene, kinds[-1][1] if kinds else scene.whole)
    candidates = frontier(scene, locks, errors, setup.quiet)
    rows = [candidate.row for candidate in candidates]
    answers = [answer_within(rows, error) for error in errors]
    for best in answers:
        best.row.best_for = f"{best.row.best_for}, {best.allowed:g}".strip(", ")
    chosen, row = answers[1], answers[1].row
    candidate = next(candidate for candidate in candidates if candidate.row is row)
    locked = locks.positions(candidate.groups)
    small = finished(candidate.small, scene.motion, row.dt, row.integrator)
    found = {
        "answers": answers,
        "chosen": chosen,
        "whole": rows[0],
        "scene": scene.motion,
        "names": list(locked),
        "count": len(scene.use.ranges),
        "moved": max((scene.use.ranges[name] for name in locked), default=0.0),
        "stands": max(scene.use.ranges.values(), default=0.0) <= STILL,
        "unit": movement_unit(scene.coordinates),
        "is_smooth": not scene.use.has_constraints,
        "file": str(reading.source),
        "command": setup.command,
        "write": setup.request.write,
        "meshes": bool(small.spec.meshes or small.spec.hfields),
        "free": [row for row, _ in kinds],
    }
    text = small.text(block(TEXT, "comment", found=found))
    if setup.request.write:
        Path(setup.request.write).write_text(text, encoding="utf-8")
    add_tables(result, scene, locks, list(locked), kinds, small)
    found["digits"] = add_checks(result, scene, locks.free, locked, chosen, small, text)
    result.tables["reduction_frontier"] = rows
    integrators = list(dict.fromkeys((reading.integrator, row.integrator, DEFAULT)))
    for model, file in (("whole", scene.whole), ("smaller", small)):
        result.tables.setdefault("reduction_limits", []).extend(limits_of(scene, file, model, integrators))
    found |= {"limits": result.tables["reduction_limits"], "pairs": result.tables["reduction_near"]}
    texts = "answer", "for_nothing", "gains", "limits"
    result.top[:0] = [result.finding(kind, TEXT, found=found) for kind in texts]


def add_tables(
    result: ReductionResult,
    scene: Scene,
    locks: Locks,
    names: list[str],
    kinds: list[tuple[FreeRow, Smaller]],
    small: Smaller,
) -> None:
    """Stages of a step, what was used, what was taken out and its time, joints, pairs that came near."""
    use = scene.use
    stages = [stages_of(scene.simulation(file)) for file in (scene.whole, locks.free, small)]
    result.tables["reduction_stages"] = [
        StageRow(stage=stage, whole_file=time, free_file=stages[1][stage], smaller_file=stages[2][stage])
        for stage, time in stages[0].items()
    ]
    result.tables["reduction_use"] = use_of(scene)
    runs = [scene.simulation(file) for file in (scene.whole, *(file for _, file in kinds))]
    times = seconds_of(runs)
    for number, (row, _) in enumerate(kinds):
        row.before, row.after = (1e6 * times[place] / runs[0].steps for place in (number, number + 1))
    result.tables["reduction_free"] = [row for row, _ in kinds]
    predicted = {name: group.predicted for group in locks.groups for name in group.names}
    result.tables["reduction_joints"] = [
        JointRow(joint=name, moved=moved, predicted=predicted.get(name), locked=name in names)
        for name, moved in sorted(use.ranges.items(), key=lambda item: item[1])
    ]
    pairs = near(scene.run(scene.whole), use.pairs)
    result.tables["reduction_near"] = [PairRow(*pair, distance) for pair, distance in pairs.items()]


def use_of(scene: Scene) -> list[UseRow]:
    """What the file has and the motion used."""
    use, model = scene.use, scene.whole.model
    collide = (model.geom_contype | model.geom_conaffinity) != 0
    parts = {
        "geoms that touch": (collide.sum(), use.geoms),
        "pairs that touch": (None, {" and ".join(pair) for pair in use.pairs}),
        "limits of joints": (model.jnt_limited.sum(), use.acted["joint"]),
        "limits and friction of tendons": (model.ntendon, use.acted["tendon"]),
        "equalities": (model.neq, use.acted["equality"]),
        "actuators": (len(scene.motion.inputs), use.acted["actuator"]),
        "sensors": (model.nsensor, set()),  # no controller reads them
        "joints that move": (model.njnt, {name for name, moved in use.ranges.items() if moved > STILL}),
    }
    return [
        UseRow(
            part=part,
            in_file=count if count is None else int(count),
            used=len(names),
            names=", ".join(sorted(names)),
        )
        for part, (count, names) in parts.items()
    ]


def add_checks(
    result: ReductionResult,
    scene: Scene,
    free: Smaller,
    locked: Mapping[str, np.ndarray],
    chosen: Answer,
    small: Smaller,
    text: str,
) -> float:
    """What is taken out changes no bit; the written file is within the error; its equations are those of tmt's lock.

    How far the written file, with six digits, is from the model in memory, rad or m.
    """
    motion, unit, row = scene.motion, movement_unit(scene.coordinates), chosen.row
    changed = apart(scene.run(Smaller(free.spec.copy())), scene.run(scene.whole), motion)
    result.check(motion.name, "motion without what is not used", changed, 0.0, unit, rule="equal")
    quantity, exact = "error of the smaller file", scene.finely
    if chosen.at_own_step:
        quantity, exact = "smaller file to the file as it is, by its own step", scene.run
    path = Simulation(read(Source(text)).model, motion, row.dt, row.integrator)()
    note, error = f"{row.locked} joints locked", apart(path, exact(scene.whole), motion)
    result.check(motion.name, quantity, error, chosen.allowed, unit, note, about=About.PREDICTION)
    tree = scene.reading.tree.lock(of_parts(scene.whole.model, locked))
    compare_locked(result, f"{motion.name}, {note}", tree, read(small.model).tree)
    return apart(path, Simulation(small.model, motion, row.dt, row.integrator)(), motion)


def compare_locked(result: ReductionResult, where: str, tree: Tree, smaller: Tree) -> None:
    """Mbar and the bias of a Tree with joints locked, and of the smaller model, at random states."""
    coordinates, rng = Coordinates(tree.joint_names, tree.kind), np.random.default_rng(SEED)
    q, v = coordinates.random(rng, STATES), rng.uniform(-1.0, 1.0, (STATES, coordinates.nv))
    scale = Entries(tree, q, v)
    masses = tmt.mass_matrix(q, model=tree) - tmt.mass_matrix(q, model=smaller)
    biases = tmt.bias(q, v, model=tree) - tmt.bias(q, v, model=smaller)
    compared = (("Mbar", masses, scale.mass_matrix), ("bias", biases, scale.bias))
    for quantity, differences, entries in compared:
        unit, parties = units_of(coordinates)[quantity], "lock of tmt to the smaller model"
        row = SubsetRow(locked="", quantity=quantity, parties=parties, unit=unit)
        check_blocks(result, where, row, *worst_of_each(differences, entries))


def limits_of(scene: Scene, small: Smaller, model: str, integrators: Sequence[str]) -> list[LimitRow]:
    """The step limits of a file, where the robot rests near the start of the motion."""
    start = finished(small, scene.motion, scene.reading.dt, scene.reading.integrator)
    reading = read(Source(start.text()))
    asked = Asked(reading.dt, reading.integrator, integrators, in_runs=False)
    return [
        LimitRow(model, row.integrator, row.limit, row.predicted_dt, row.limiting_joint)
        for row in answer(postures_of(reading)[0], True, reading, asked).rows
    ]
