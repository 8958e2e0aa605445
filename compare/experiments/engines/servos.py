"""The response to a step of the targets of the robot's servos in each engine, beside the exact one of the same equations."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

import tmt

from ...engines import GRID, LABELS, RECORDS, Array, Dynamics, Engine, Method, Setting
from ...engines.outside import Outside
from ...engines.outside.file import EngineError, TooLong
from ...judge.run import diverged_at
from ...judge.scale import FACTOR
from ...robots.case import Case
from ..followed import follow
from ..setup import Setup
from .motion import brief, reference
from .tables import EnginesResult, ServoRow

SERVOS = "servos"  # a tag of scenes
OWN, HELD, AT_EACH_STAGE = "own actuators", "PD held for each step", "PD at each stage"
# the others: HELD
HOW = dict.fromkeys(("mujoco", "mjx", "mjx_float32", "warp"), OWN) | {"drake RK3": AT_EACH_STAGE}
METHODS = {"mujoco": ("Euler", "implicitfast", "discrete", "RK4"), "mjx": ("implicitfast",), "mjx_float32": ("implicitfast",),
           "drake": ("RK3", "discrete")}  # fmt: skip
HALF = 0.5  # orders that a fall by half of the step may lack
ALIKE = 0.1  # share of a deviation up to which a run of tmt explains it
LARGE = 1e-9  # rad or m: a smaller deviation is not explained


def scene_of(setup: Setup) -> Case | None:
    """The scene with a step of the servos, its beginning if there are many speeds; None: the robot has none."""
    cases = [case for case in setup.robot.cases if SERVOS in case.scene.tags]
    return brief(next(iter(cases), None))


def follow_step(result: EnginesResult, setup: Setup, engine: Engine, reads_another: bool = False) -> None:
    """Rows of the methods of an engine at the file's own step; reads_another: with the numbers that it has read, too."""
    case = scene_of(setup)
    if case is None or engine.name == "tmt":  # it explains the others
        return
    known = engine.methods
    names = METHODS.get(engine.name, tuple(known))
    for method in [known[name] for name in names if name in known and not known[name].adaptive]:
        setup.progress(f"engines: servos, {method.label}")
        try:
            row = add_response(result, setup, case, engine, method)
            if reads_another and isinstance(engine, Outside):
                add_as_read(result, case, engine.as_read(case), method, row)
        except TooLong:
            raise
        except EngineError as error:
            result.find("left_out", what=f"{method.label}, servos", reason=str(error).rstrip("."))
            return


def add_sentences(result: EnginesResult) -> None:
    """Of each explanation the methods and their deviations."""
    rows: dict[str, list[ServoRow]] = {}
    for row in result.tables["engines_servos"]:
        rows.setdefault(row.why if row.deviation is not None else "ended", []).append(row)
    for why, of_why in rows.items():
        result.find("response", why=why, rows=of_why)


def add_response(result: EnginesResult, setup: Setup, case: Case, engine: Engine, method: Method) -> ServoRow:
    steps = steps_of(setup, case)
    how = HOW.get(engine.name) or HOW.get(f"{engine.name} {method.name}", HELD)
    row = ServoRow(
        scene=case.name, engine=LABELS[engine.name], method=method.name, servo=how, dt=case.duration / steps
    )
    q = follow_row(result, case, engine.of(case), method, row)
    if row.deviation and row.deviation > LARGE:
        row.why, row.unexplained = explanation(case, engine, method, steps, q)
    return row


def add_as_read(
    result: EnginesResult, case: Case, dynamics: Dynamics, method: Method, as_set: ServoRow
) -> None:
    """The response with the numbers that an engine has read, which explain it where it is another one."""
    row = replace(as_set, method=f"{method.name}, as read", ended=None)
    follow_row(result, case, dynamics, method, row)
    change = float(np.abs(result.responses[row.label][1] - result.responses[as_set.label][1]).max())
    if not change <= ALIKE * (as_set.deviation or 0.0):
        row.why, row.unexplained = "reading", None


def follow_row(result: EnginesResult, case: Case, dynamics: Dynamics, method: Method, row: ServoRow) -> Array:
    """The positions of a run; its deviation is in the row, which is added."""
    exact = reference(case)
    run = follow(dynamics, case, method, Setting(case.duration, round(case.duration / row.dt)), exact)
    q, deviation = run.motion.q, float(run.error.max())
    ended = run.motion.ended or diverged_at(case, exact.t, q, run.motion.v)
    row.deviation, row.ended = (None, str(ended)) if ended else (deviation, None)
    result.tables["engines_servos"].append(row)
    positions = exact.high[:, : case.coordinates.nq]
    result.responses[row.label] = exact.t, case.coordinates.difference(q, positions)
    return q


def steps_of(setup: Setup, case: Case) -> int:
    """The number of steps of the file's own length, or the scene's; a multiple of GRID."""
    dt = setup.reading.dt if setup.reading else case.duration / case.steps
    return GRID * max(1, round(case.duration / dt / GRID))


def explanation(case: Case, engine: Engine, method: Method, steps: int, q: Array) -> tuple[str, float]:
    """Why a run deviates: the name of a run of tmt that deviates as it does, and their largest difference.

    Without one error_of_the_method, if the deviation falls with half of the step as the order says; else "".
    """
    deviations = {}
    for name, positions in alike(case, steps):
        deviations[name] = float(np.abs(case.coordinates.difference(q, positions)).max())
    name = min(deviations, key=lambda name: np.nan_to_num(deviations[name], nan=np.inf))
    deviation = float(reference(case).error(q).max())
    if deviations[name] <= max(ALIKE * deviation, FACTOR * RECORDS[engine.name].eps):
        return name, deviations[name]
    finer = follow(engine.of(case), case, method, Setting(case.duration, 2 * steps), reference(case))
    falls = method.order and float(finer.error.max()) <= deviation / 2.0 ** (method.order - HALF)
    return ("error_of_the_method" if falls else ""), deviations[name]


def alike(case: Case, steps: int) -> Iterator[tuple[str, Array]]:
    """Positions at the times of a reference by tmt, by what they take explicitly or hold for a step."""
    tree, dt = case.tree, case.duration / steps
    damping = tuple(map(tuple, (np.array(tree.speed_gain) + np.diag(tree.damping)).tolist()))
    no_damping = (0.0,) * len(tree.damping)
    schemes = {
        "damping_of_servo_explicit": ("semi_implicit_euler", tree),
        "damping_explicit": ("semi_implicit_euler", replace(tree, damping=no_damping, speed_gain=damping)),
        "damping_implicit": ("implicitfast", tree), "springs_implicit": ("discrete", tree),
        "error_of_the_method": ("rk4", tree),
    }  # fmt: skip
    for name, (scheme, of_scheme) in schemes.items():
        motion = tmt.simulate(*case.start, case.tau, dt, steps, scheme, of_scheme)
        yield name, motion.q[:: steps // GRID]
    yield "held", held(case, steps)


def held(case: Case, steps: int) -> Array:
    """By order 8 within each step, in which the torque of the servos stays as it was at its beginning."""
    tree, dt = replace(case.tree, position_gain=(), speed_gain=()), case.duration / steps
    gains, first = case.controller, case.coordinates.places.first_positions
    (q, v), path = case.start, [case.q]
    for step in range(1, steps + 1):
        if not np.isfinite(q).all():
            return np.full((GRID + 1, len(q)), np.nan)
        tau = case.tau - gains.position_gain @ q[first] - gains.speed_gain @ v if gains else case.tau
        motion = tmt.simulate(q, v, tau, dt, 1, "rk4", tree)
        q, v = motion.q[-1], motion.qd[-1]
        if step % (steps // GRID) == 0:
            path.append(q)
    return np.array(path)
