"""No more model than a motion of a file needs: the answer, its tables, its checks, and the file to take away."""

from pathlib import Path

import numpy as np

from tmt import Tree
from tmt.derivation.composite import mass_matrix_and_bias

from ...core.check import About
from ...core.text import block
from ...core.timing import fastest
from ...engines.mujoco.motion import Simulation, apart, near, stages_of
from ...engines.mujoco.names import INTEGRATORS
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
from .records import JointRow, LimitRow, PairRow, ReductionResult, StageRow, SubsetRow
from .scene import Scene, scene_of
from .search import (
    ROUNDS,
    Candidate,
    Kind,
    Locks,
    best_at_own_step,
    best_within,
    frontier,
    groups_of,
    take_out,
)
from .sub_blocks import check_blocks, units_of

TEXT = "reduction_of_file"  # the template
ERROR = 1e-3  # rad or m, if none is asked for
TENFOLD = 10.0  # errors that are asked too: a tenth, and ten times as large
STATES = 5  # random ones, at which the locked models are compared
OWN_STEP = "smaller file to the file as it is, by its own step"  # a check where no step is exact enough
DEFAULT = "Euler"  # MuJoCo's integrator where a file states none
BY_NUMBER = {int(member): name for name, member in INTEGRATORS.items()}


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
    free = kinds[-1].file if kinds else scene.whole
    locks = Locks(scene, free, groups_of(scene, free))
    candidates = frontier(scene, locks, errors, setup.quiet)
    best = [best_within(candidates, error) for error in errors]
    for limit, candidate in zip(errors, best):
        candidate.row.best_for = f"{candidate.row.best_for}, {limit:g}".strip(", ")
    row, names = best[1].row, locks.names(best[1].groups or ())
    small = finished(best[1].small, scene.motion, row.dt, row.integrator)
    about = {
        "row": row,
        "scene": scene.motion,
        "names": names,
        "allowed": allowed,
        "file": str(reading.source),
    }
    text = small.text(block(TEXT, "comment", found=about))
    if setup.request.write:
        Path(setup.request.write).write_text(text, encoding="utf-8")
    add_tables(result, scene, locks, names, kinds, small)
    add_checks(result, scene, locks, best[1], allowed, text)
    limits = [*limits_of(scene, scene.whole, "whole"), *limits_of(scene, small, "smaller")]
    result.tables |= {
        "reduction_frontier": [candidate.row for candidate in candidates],
        "reduction_limits": limits,
    }
    ranges, own_step = scene.use.ranges, best_at_own_step(candidates, allowed)
    about |= {
        "count": len(ranges),
        "own": max((ranges[name] for name in names), default=0.0),
        "unit": movement_unit(scene.coordinates),
        "first": candidates[0].row,
        "own_step": own_step.row,
        "own_apart": own_step.apart,
        "best": dict(zip(errors, (candidate.row for candidate in best))),
        "limits": limits,
        "free": [kind.row for kind in kinds],
        "pairs": result.tables["reduction_near"],
        "is_smooth": not scene.use.has_constraints,
        "write": setup.request.write,
    }
    result.top[:0] = [
        result.finding(kind, TEXT, found=about) for kind in ("answer", "for_nothing", "gains", "limits")
    ]


def add_tables(
    result: ReductionResult, scene: Scene, locks: Locks, names: list[str], kinds: list[Kind], small: Smaller
) -> None:
    """Stages of a step, what was taken out and its time, joints, pairs that came near."""
    use, files = scene.use, {"whole": scene.whole, "free": locks.free, "smaller": small}
    taken = {}
    for name, file in files.items():
        dt, integrator = file.model.opt.timestep, BY_NUMBER[file.model.opt.integrator]
        taken[name] = stages_of(Simulation(file.model, scene.motion, dt, integrator))
    result.tables["reduction_stages"] = [
        StageRow(stage=stage, **{f"{name}_file": 1e6 * taken[name][stage] for name in files})
        for stage in taken["whole"]
    ]
    runs = [scene.simulation(file) for file in (scene.whole, *(kind.file for kind in kinds))]
    times = fastest(dict(enumerate(runs)), ROUNDS)
    for number, kind in enumerate(kinds):
        kind.row.before, kind.row.after = (
            1e6 * times[place] / runs[0].steps for place in (number, number + 1)
        )
    result.tables["reduction_free"] = [kind.row for kind in kinds]
    predicted = {name: group.predicted for group in locks.groups for name in group.names}
    result.tables["reduction_joints"] = [
        JointRow(joint=name, moved=moved, predicted=predicted.get(name), locked=name in names)
        for name, moved in sorted(use.ranges.items(), key=lambda item: item[1])
    ]
    pairs = near(scene.whole.model, scene.run(scene.whole), use.pairs)
    result.tables["reduction_near"] = [
        PairRow(geom=geom, other=other, distance=distance) for (geom, other), distance in pairs.items()
    ]


def add_checks(
    result: ReductionResult, scene: Scene, locks: Locks, chosen: Candidate, allowed: float, text: str
) -> None:
    """What is taken out changes no bit; the written file is within the error; its equations are those of tmt's lock."""
    name, unit, row = scene.motion.name, movement_unit(scene.coordinates), chosen.row
    again = Smaller(locks.free.spec.copy())
    result.check(name, "motion without what is not used", apart(scene.run(again), scene.run(scene.whole), scene.motion), 0.0,
                 unit, rule="equal")  # fmt: skip
    written = read(Source(text))
    path = Simulation(written.model, scene.motion, written.dt, written.integrator)()
    is_exact = row.error <= allowed
    quantity, exact = ("error of the smaller file", scene.finely) if is_exact else (OWN_STEP, scene.run)
    error = apart(path, exact(scene.whole), scene.motion)
    result.check(name, quantity, error, allowed, unit, f"{row.locked} joints locked", about=About.PREDICTION)
    at = of_parts(scene.whole.model, locks.positions(chosen.groups or ()))
    compare_locked(result, f"{name}, {row.locked} joints locked", scene.reading.tree.lock(at), written)


def compare_locked(result: ReductionResult, where: str, tree: Tree, written: Reading) -> None:
    """Mbar and the bias of a Tree with joints locked, and of the written file, at random states."""
    coordinates, rng = Coordinates(tree.joint_names, tree.kind), np.random.default_rng(SEED)
    q, v = coordinates.random(rng, STATES), rng.uniform(-1.0, 1.0, (STATES, coordinates.nv))
    scale, pairs = Entries(tree, q, v), []
    for one, speeds in zip(q.tolist(), v.tolist()):
        pairs.append([mass_matrix_and_bias(model, one, speeds) for model in (tree, written.tree)])
    for number, (quantity, entries) in enumerate((("Mbar", scale.mass_matrix), ("bias", scale.bias))):
        differences = np.array(
            [np.subtract(ours[number], theirs[number]).astype(float) for ours, theirs in pairs]
        )
        unit = units_of(coordinates)[quantity]
        row = SubsetRow(locked="", quantity=quantity, parties="lock of tmt to the smaller file", unit=unit)
        check_blocks(result, where, row, *worst_of_each(differences, entries))


def limits_of(scene: Scene, small: Smaller, model: str) -> list[LimitRow]:
    """The step limits of a file, where the robot rests near the start of the motion, by its integrator and the default."""
    start = finished(small, scene.motion, scene.reading.dt, scene.reading.integrator)
    reading = read(Source(start.text()))
    integrators = list(
        dict.fromkeys((BY_NUMBER[small.model.opt.integrator], scene.reading.integrator, DEFAULT))
    )
    asked = Asked(reading.dt, reading.integrator, integrators, in_runs=False)
    rows = answer(postures_of(reading)[0], True, reading, asked).rows
    return [
        LimitRow(
            model=model,
            integrator=row.integrator,
            limit=row.limit,
            step=row.predicted_dt,
            joint=row.limiting_joint,
        )
        for row in rows
    ]
