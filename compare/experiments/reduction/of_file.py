"""No more model than a motion of a file needs: the answer, tables, checks, the file to take away."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np

import tmt
from tmt import Tree

from ...core.check import About, Result
from ...core.text import block
from ...engines.mujoco.motion import near, stages_of
from ...engines.mujoco.names import number_of_actuators
from ...engines.mujoco.reading import Reading, read
from ...engines.mujoco.smaller import Smaller, assets_of, files_of, finished, of_parts
from ...engines.mujoco.source import Source
from ...judge.agree import closest, worst_of_each
from ...judge.entries import Entries
from ...judge.run import movement_unit, number_or_none
from ...judge.scale import EPS, FACTOR
from ...robots.case import SEED
from ...robots.coordinates import Coordinates
from ..setup import Setup
from .records import FreeRow, JointRow, PairRow, StageRow, UseRow
from .scene import Scene, scene_of
from .search import Answer, Locks, compared_limits, frontier, seconds_of, stable_answers, take_out
from .written import draft_of, move

TEXT = "reduction_of_file"  # the template
ERROR = 1e-3  # rad or m, if none is asked for
TENFOLD = 10.0  # errors that are asked too: a tenth, and ten times as large
STATES = 5  # random ones, at which the locked models are compared
DEFAULT = "Euler"  # MuJoCo's integrator where a file states none
STILL = 1e-3  # rad or m: where no joint moves more, the robot stands


def add(result: Result, setup: Setup, reading: Reading) -> None:
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
    answers = stable_answers(scene, candidates, errors)
    for best in answers:
        best.row.best_for = f"{best.row.best_for}, {best.allowed:g}".strip(", ")
    chosen, row = answers[1], answers[1].row
    candidate = next(candidate for candidate in candidates if candidate.row is row)
    locked = locks.positions(candidate.groups)
    small = finished(candidate.small, scene.motions, row.dt, row.integrator)
    stay = {actuator.name for actuator in small.spec.actuators}
    facts = {
        "answers": answers,
        "chosen": chosen,
        "whole": rows[0],
        "scene": {"name": scene.name, "duration": scene.duration},
        "names": list(locked),
        "actuators": [each.name for each in scene.whole.spec.actuators if each.name not in stay],
        "of_actuators": number_of_actuators(scene.whole.model),
        "count": len(scene.use.ranges),
        "moved": max((scene.use.ranges[name] for name in locked), default=0.0),
        "stands": max(scene.use.ranges.values(), default=0.0) <= STILL,
        "unit": movement_unit(scene.coordinates),
        "is_smooth": not scene.use.has_constraints,
        "file": str(reading.source),
        "command": setup.command,
        "write": setup.request.write,
        "free": [row for row, _ in kinds],
    }
    add_tables(result, scene, locks, list(locked), kinds, small)
    path = Path(setup.request.write) if setup.request.write else None
    with draft_of(path) as draft:
        facts["assets"] = assets_of(draft).name if files_of(small.spec) else ""
        small.write(draft, block(TEXT, "comment", facts=facts))
        written = Smaller.whole(Source(draft))
        facts["digits"] = add_checks(result, scene, locks.free, locked, chosen, small, written)
        facts["is_written"] = path and all(check.passed for check in result.checks)
        if path and facts["is_written"]:
            move(draft, path)
    result.tables["reduction_frontier"] = rows
    integrators = list(dict.fromkeys((reading.integrator, row.integrator, DEFAULT)))
    result.tables["reduction_limits"] = compared_limits(scene, small, integrators)
    facts |= {"limits": result.tables["reduction_limits"], "pairs": result.tables["reduction_near"]}
    texts = "answer", "for_nothing", "gains", "limits"
    result.top[:0] = [result.finding(kind, TEXT, facts=facts) for kind in texts]


def add_tables(
    result: Result, scene: Scene, locks: Locks, names: list[str], kinds: list[tuple[FreeRow, Smaller]],
    small: Smaller,
) -> None:  # fmt: skip
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
    joints = {name: JointRow(name, moved, locked=name in names) for name, moved in use.ranges.items()}
    for number, group in enumerate(locks.groups):
        for name in group.names:
            joints[name].predicted = group.predicted
            joints[name].error_alone = number_or_none(locks.error_alone(number))
    result.tables["reduction_joints"] = sorted(joints.values(), key=lambda joint: joint.moved)
    pairs = near(scene.whole.model, scene.positions(scene.whole), use.pairs)
    result.tables["reduction_near"] = [PairRow(*pair, distance) for pair, distance in pairs.items()]


def use_of(scene: Scene) -> list[UseRow]:
    """What the file has and the motion used."""
    use, model = scene.use, scene.whole.model
    parts: list[tuple[str, int | None, set[str]]] = [
        ("geoms that touch", int(((model.geom_contype | model.geom_conaffinity) != 0).sum()), use.geoms),
        ("pairs that touch", None, {" and ".join(pair) for pair in use.pairs}),
        ("limits of joints", int(model.jnt_limited.sum()), use.acted["joint"]),
        ("limits and friction of tendons", model.ntendon, use.acted["tendon"]),
        ("equalities", model.neq, use.acted["equality"]),
        ("actuators", number_of_actuators(model), use.acted["actuator"]),
        ("sensors", model.nsensor, set()),  # no controller reads them
        ("joints that move", model.njnt, {name for name, moved in use.ranges.items() if moved > STILL}),
    ]
    return [UseRow(part, count, len(names), ", ".join(sorted(names))) for part, count, names in parts]


def add_checks(
    result: Result, scene: Scene, free: Smaller, locked: Mapping[str, np.ndarray], chosen: Answer,
    small: Smaller, written: Smaller,
) -> float:  # fmt: skip
    """What is taken out changes no bit; the written file is within the error and has tmt's locked equations.

    How far the written file, with six digits, is from the model in memory, rad or m.
    """
    unit, row = movement_unit(scene.coordinates), chosen.row
    changed = scene.apart(scene.run(Smaller(free.spec.copy())), scene.run(scene.whole))
    result.check(scene.name, "motion without what is not used", changed, 0.0, unit, rule="equal")
    quantity, exact = "error of the smaller file", scene.finely
    if chosen.at_own_step:
        quantity, exact = "smaller file to the file as it is, by its own step", scene.run
    paths, note = scene.run(written, row.dt, row.integrator), f"joints locked: {row.locked}"
    for motion, path, other in zip(scene.motions, paths, exact(scene.whole)):
        error = scene.apart([path], [other])
        result.check(motion.name, quantity, error, chosen.allowed, unit, note, about=About.PREDICTION)
    tree = scene.reading.tree.lock(of_parts(scene.whole.model, locked))
    compare_locked(result, f"{scene.name}, {note}", tree, read(small.model).tree)
    return scene.apart(paths, scene.run(small, row.dt, row.integrator))


def compare_locked(result: Result, where: str, tree: Tree, smaller: Tree) -> None:
    """Mbar and the bias of a Tree with joints locked, and of the smaller model, at random states."""
    coordinates, rng = Coordinates(tree.joint_names, tree.kind), np.random.default_rng(SEED)
    q, v = coordinates.random(rng, STATES), rng.uniform(-1.0, 1.0, (STATES, coordinates.nv))
    bodies, others = tree.body_joint, smaller.body_joint
    fused = np.array([bodies.count(joint) - others.count(joint) + 1 for joint in bodies])
    scale = Entries(tree, q, v, np.maximum(1, fused))
    mass = [tmt.mass_matrix(q, model=model) for model in (tree, smaller)]
    bias = [tmt.bias(q, v, model=model) for model in (tree, smaller)]
    is_mixed = "slide" in coordinates.all_kinds
    for name, unit, (locked, other), scales in (
        ("Mbar", "kg m2, kg m or kg" if is_mixed else "kg m2", mass, scale.mass_matrix),
        ("bias", "N m or N" if is_mixed else "N m", bias, scale.bias),
    ):
        apart, largest = worst_of_each(locked - other, scales)
        (worst,) = closest(apart, largest)
        tolerance = FACTOR * EPS * largest[worst]
        result.check(
            where, f"{name}, lock of tmt to the smaller model", apart[worst], tolerance, unit, rounding=True
        )
