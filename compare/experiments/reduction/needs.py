"""What a case needs of its model, in words; and its motion by the smallest model beside that by the whole one."""

from collections.abc import Sequence

import numpy as np

import tmt
from tmt.reference import DIGITS

from ...case import Case
from ...engines import LABELS
from ...judge.check import Result, closest
from ...judge.rounding import NARROW, band
from ...judge.run import check_movement, deviation, required_time, step_in_words
from ...judge.words import capital
from ...setup import Setup
from ...truth.smallest import Needed, needed, reduced
from .times import FINER_RUNS, TWO_INTEGRATORS, method_of, scheme_of


def of_case(result: Result, case: Case, setup: Setup, integrators: Sequence[str] = TWO_INTEGRATORS) -> list:
    """What the case needs, in words; runs of it and of a smaller model; the models to be timed, None for none at all."""
    need = needed(case)
    smaller = reduced(case, need)
    stays = len(need.stays) == len(case.joints)
    models = [(case.name, case.changed(locked=()))]
    if smaller or case.locked or stays:
        models.append((case.name, None if stays else smaller or case))
    result.curves["needs"][case.name] = {"locked": case.scene.locked, "stays": need.stays}
    result.notes.append(need_in_words(case, need))
    if smaller or stays:
        for integrator in integrators:
            compare_smaller(result, case, smaller, setup, integrator)
    return models


def need_in_words(case: Case, need: Needed) -> str:
    """What a case needs and why, in a sentence."""
    names, locked = case.joints, case.scene.locked
    why = "; ".join(need.moves.values())
    if need.undecided:
        why += f"; of {', '.join(need.undecided)} it is not decided: the acceleration does not fold to 0"
    why = capital(why)
    if len(need.stays) == len(names):
        torque = " under the exact torque that holds" if case.scene.torque == "hold" else ""
        return (
            f"{case.name}: no hinge and no integrator. At the start and at rest every acceleration folds to 0{torque}, and is "
            f"0 with {DIGITS} digits: the exact solution stays."
        )
    declared = f" ({' and '.join(locked)} declared locked)" if locked else ""
    if not need.stays:
        count = "the one hinge that is free" if len(names) == 1 else f"all {len(names)} hinges"
        return f"{case.name}: {count}{declared}. {why}."
    left, stays = (" and ".join(some) for some in ([name for name in names if name not in need.stays], need.stays))
    never, vanish = "never moves: at its start and at rest its acceleration folds", "and is"
    if len(need.stays) > 1:
        never, vanish = "never move: at their start and at rest their accelerations fold", "and are"
    return (
        f"{case.name}: {left}{declared}. {capital(stays)} {never} to 0 for all values of the others, {vanish} 0 "
        f"with {DIGITS} digits at random ones. {why}."
    )


def compare_smaller(result: Result, case: Case, smaller: Case | None, setup: Setup, integrator: str) -> None:
    """Runs of the case and of the smaller one (None: it stays), by the same method, within the band of rounding."""
    scheme, n, steps = scheme_of(setup.engines, integrator), len(case.joints), FINER_RUNS * case.steps
    dt = case.duration / steps
    paths = states_of_run(case, setup, integrator)
    references = states_of_run(smaller, setup, integrator) if smaller else dict.fromkeys(paths)
    width = band(tmt.METHODS[scheme], case.tree, *np.split(paths["tmt"], 2, axis=1), case.tau, dt, FINER_RUNS)
    t = dt * FINER_RUNS * np.arange(len(width))
    until = None
    for engine, path in paths.items():
        where = f"{case.name}, {LABELS[engine]}, {integrator}, {step_in_words(case, steps)}"
        reference = np.tile(np.concatenate(case.start), (steps + 1, 1))
        if smaller:
            free = [case.joints.index(name) for name in smaller.joints]
            reference[:, free + [n + i for i in free]] = references[engine]
            if "own" not in case.scene.tags:  # of a user's own nothing is expected
                check_movement(result, where, deviation(path[:, :n], path[0, :n]))
        apart = np.abs(path - reference)[::FINER_RUNS]
        until = check_smaller(result, where, case.joints, t, apart, width, required_time(case, scheme, dt))
        result.curves["apart"][case.name, engine, integrator] = float(apart[t <= until, :n].max())
    if not smaller:
        moved = {LABELS[engine]: result.curves["apart"][case.name, engine, integrator] for engine in paths}
        words = " and ".join(f"that of {engine} by {m:.1e} rad" if np.isfinite(m) else f"{engine} diverges"
                             for engine, m in moved.items())  # fmt: skip
        result.notes.append(
            f"{case.name}, {integrator}, with the torque in doubles: in the {until:.2f} s that are judged, the largest angle "
            f"moves: {words}."
        )


def check_smaller(
    result: Result,
    where: str,
    joints: Sequence[str],
    t: np.ndarray,
    apart: np.ndarray,
    width: np.ndarray,
    required: float,
) -> float:
    """Checks: the runs stay within the band of rounding while it is narrow, and that is long enough; until when, s.

    apart, width: (times, 2 n), rad and rad/s, the distance of the smaller model's run from the whole one's, and the band.
    """
    n = len(joints)
    judged = np.cumsum(~(width[:, :n].max(axis=1) < NARROW)) == 0
    apart, width = apart[judged], width[judged]
    k, i = closest(apart, width)
    place, unit = f"{joints[i % n]} at t = {t[k]:.3f} s", ("rad", "rad/s")[i // n]
    result.check(where, "smallest model to whole", apart[k, i], width[k, i], unit, place, True)
    until = float(t[judged][-1])
    result.check(where, "time judged", until, required, "s", rule="at least")
    return until


def states_of_run(case: Case, setup: Setup, integrator: str) -> dict[str, np.ndarray]:
    """Positions and speeds of the case's joints by engine, each (steps + 1, 2 n)."""
    steps, paths = FINER_RUNS * case.steps, {}
    for engine, dynamics in setup.compared(case).items():
        method = method_of(setup.engines, integrator, engine)
        paths[engine] = dynamics.run(*case.start, case.tau, case.duration / steps, steps, method).states
    return paths
