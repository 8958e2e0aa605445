"""Errors of both engines: against the true motion, and in the energy; and when a held robot leaves its posture."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from tmt import literal

from ...core.check import About, Result
from ...core.rows import Row, column
from ...engines import LABELS, Dynamics, Engine, compared, one_of_each_scheme, same_scheme
from ...judge.order import ORDER_MARGIN, measured_order
from ...judge.run import LEFT, deviation, moved_from, movement_unit, number_or_none
from ...judge.scale import EPS, FACTOR, gravity_scale
from ...robots import Robot
from ...robots.case import Case
from ...truth.reference import Reference
from .runs import Run, TrajectoryResult

SCHEMES_OF_RK4 = ("rk4", "rk4_mean_speed")
DURATION = 1.0  # s: short enough to measure the order, long enough to move
STEPS = {1: (4096, 8192), 4: (512, 1024)}  # by the order of the method
FEW_STEPS = STEPS | {1: (1024, 2048)}
ROUNDED = 10 * FACTOR * EPS  # of the terms of the energy: a smaller drift may be rounding


def coarsest_runs(result: TrajectoryResult, robot: Robot) -> Iterator[Run]:
    """The run of each scene with the coarsest step of MuJoCo's RK4, held scenes first."""
    for case in sorted(robot.cases, key=lambda case: not case.is_held):
        if run := result.run_of(case, *SCHEMES_OF_RK4):
            yield run


def deviations(run: Run) -> dict[str, float | None]:
    """The largest movement of each engine's run from its start, rad or m; None of a run that has diverged."""
    paths = {engine: path.q for engine, path in run.paths.items()}
    return {engine: number_or_none(deviation(q, q[0], run.case.coordinates)) for engine, q in paths.items()}


def find_errors(result: TrajectoryResult, robot: Robot, references: Mapping[str, Reference]) -> None:
    """The largest errors in each scene: of a held one from rest, else from its reference, if it has one."""
    scenes = []
    for run in coarsest_runs(result, robot):
        name, reference = run.case.name, references.get(run.case.name)
        if run.case.is_held:
            first, second = deviations(run).values()
        elif reference:
            first, second = (number_or_none(reference.error(path.q).max()) for path in run.paths.values())
        else:
            continue
        result.errors[name] = first, second
        about = {"scene": name, "first": first, "second": second, "difference": difference_while_judged(run)}
        scenes.append(about | {"unit": movement_unit(run.case.coordinates)})
    if result.errors:
        result.answer = result.finding("answer", errors=result.errors, steps=coarsest_steps(result))
    if any(name in references for name in result.errors):  # held scenes have their own findings
        labels = [LABELS[engine] for engine in robot.compared]
        result.find("errors", labels=labels, scenes=scenes)


def coarsest_steps(result: TrajectoryResult) -> int | None:
    """The number of the coarsest steps of the scenes with errors, if they all have as many."""
    counts = {min(run.steps for run in result.runs if run.case.name == scene) for scene in result.errors}
    return counts.pop() if len(counts) == 1 else None


def difference_while_judged(run: Run) -> float:
    """The largest difference of the engines while they are judged, rad or m."""
    last = int(np.searchsorted(run.t, run.judged_until * (1 + 1e-9), side="right"))
    first, mujoco = (path.q[: last : run.every] for path in run.paths.values())
    return float(moved_from(first, mujoco, run.case.coordinates).max())


def find_departures(result: TrajectoryResult, robot: Robot) -> None:
    """When each engine leaves the posture of each held scene, and how far it goes."""
    claims = robot.claims.of_scenes if robot.claims else {}
    for run in coarsest_runs(result, robot):
        case = run.case
        if case.is_held:
            farthest = deviations(run)
            engines = [{"label": LABELS[engine], "left": path.left, "farthest": farthest[engine]}
                       for engine, path in run.paths.items()]  # fmt: skip
            about: dict[str, Any] = {"claim": claims.get(case.name), "limit": LEFT, "duration": case.duration}
            about |= {"unit": movement_unit(case.coordinates), "stated": robot.compared[0] == "tmt"}
            result.find("held", scene=robot.scene_begins(case.name), engines=engines, **about)


@dataclass
class EnergyRow(Row):
    """The drift of the energy in a free run."""

    scene: str
    integrator: str
    dt: float = column("s", digits=5)
    engine: str = ""
    drift: float | None = column("J", default=None)
    order: float | None = None


def measure_energy(robot: Robot, engines: Mapping[str, Engine], steps: Mapping[int, Sequence[int]]) -> Result:
    """The drift of the energy in free, undamped runs. steps: by order two counts, of which one is twice the other."""
    result = Result("trajectory")
    rows = result.tables["energy"] = []
    # in a scene of a user's own the order may not show in a second
    free = [case for case in robot.cases if case.is_free and "own" not in case.scene.tags]
    for case in [case for case in free if not any(case.tree.damping)]:
        for method in one_of_each_scheme(engines["mujoco"]):
            order, drifts = method.order or 0, {}
            counts = steps[order]
            for engine, dynamics in compared(engines, case).items():
                name = method.name if engine == method.engine else same_scheme(engines, method, engine).name
                drifts[engine] = [largest_drift(case, dynamics, name, count) for count in counts]
            orders = check_order(result, case, f"{case.name}, {method.name}", order, drifts)
            for engine, (_, drift) in drifts.items():
                numbers = number_or_none(drift), orders.get(engine)
                rows.append(EnergyRow(case.name, method.name, DURATION / counts[-1], engine, *numbers))
    return result


def find_energy(result: TrajectoryResult, mujoco: Engine) -> None:
    """The drift of MuJoCo's energy in the free, undamped scenes of a file or a user, with the coarsest step."""
    for case in {run.case.name: run.case for run in result.runs}.values():
        if not case.is_free or "own" not in case.scene.tags or any(case.tree.damping):
            continue
        runs = [run for run in result.runs if run.case.name == case.name]
        dt = max(run.dt for run in runs)
        by_scheme = {run.scheme: run.paths["mujoco"] for run in runs if run.dt == dt}
        rows = []
        for method in [method for method in mujoco.methods.values() if method.scheme in by_scheme]:
            path = by_scheme[method.scheme]
            drift = drift_of(path.q, path.v, case) if path.ended is None else None
            rows.append(EnergyRow(case.name, method.name, dt, "mujoco", drift))
        result.tables["energy"] += rows
        result.top.append(result.finding("energy", rows=rows, duration=case.duration))


def largest_drift(case: Case, dynamics: Dynamics, method: str, count: int) -> float:
    """The largest change of the energy in a second, J; NaN if the run has diverged."""
    motion = dynamics.run(*case.start, case.tau, DURATION / count, count, method)
    if not np.isfinite(motion.states).all():
        return np.nan
    return drift_of(motion.q, motion.v, case)


def drift_of(q: np.ndarray, v: np.ndarray, case: Case) -> float:
    """The largest change of the energy along a run, J."""
    energy = literal.energy(q, v, case.tree)
    return float(np.abs(energy - energy[0]).max())


def rounding(case: Case) -> float:
    """The largest drift of the energy that may be rounding, J."""
    speed, springs = np.abs(case.v), 0.0
    if case.tree.has_springs:
        stretch = case.coordinates.difference(case.q, np.array(case.tree.rest))
        springs = literal.spring_torque(case.q, case.tree) @ stretch / 2.0
    kinetic = speed @ np.abs(literal.mass_matrix(case.q, case.tree)) @ speed / 2.0
    return ROUNDED * (gravity_scale(case.tree, case.q) + kinetic + springs)


def check_order(
    result: Result, case: Case, where: str, order: int, drifts: Mapping[str, Sequence[float]]
) -> dict[str, float | None]:
    """The measured order of each engine, at least the method's; {} where both drift by rounding alone."""
    if all(finer <= rounding(case) for _, finer in drifts.values()):
        return {}
    orders: dict[str, float | None] = {}  # None: a run has diverged, or does not drift
    least, name = order - ORDER_MARGIN, "order of the drift of energy"
    for engine, of_engine in drifts.items():
        measured = measured_order((2.0, 1.0), of_engine)
        orders[engine] = number_or_none(measured and measured.order)
        place = f"{where}, {LABELS[engine]}, {DURATION:g} s"
        result.check(place, name, orders[engine], least, "", rule="at least", about=About.PREDICTION)
    return orders
