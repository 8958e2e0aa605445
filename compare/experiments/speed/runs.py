"""The runs of speed's scenes without their times: of each method by each of its settings, how far it is from the true motion."""

from collections.abc import Iterator, Mapping, Sequence
from functools import partial

import numpy as np

from tmt import literal

from ...engines import Engine, Method, Setting
from ...judge.run import diverged_at
from ...robots.case import Case
from ...truth.reference import Reference, references
from ...truth.smallest import reduced
from ..setup import Setup
from . import accuracy, advice
from .floors import floor
from .settings import methods, settings_of, too_long_next

# who follows the smaller model of a scene too, where there is one
SMALLER, SMALLER_STEPS = (("mujoco", "RK4"), ("tmt", "rk4"), ("tmt", "dopri8")), 1024


def measured(setup: Setup, cases: Sequence[Case], which: str = "all") -> tuple[Sequence[Case], Iterator[tuple]]:
    """The scenes, and for each what `scene` returns. Those of unlike models come first: side by side they compile other code."""
    trees = [case.tree for case in cases]
    unlike_first = sorted(cases, key=lambda case: trees[: cases.index(case)].count(case.tree))
    return cases, setup.map(partial(scene, engines=setup.engines, size=setup.size, which=which), unlike_first)


def scene(case: Case, engines: Mapping[str, Engine], size: str, which: str) -> tuple:
    """The name of a scene, its reference, its rows without times, and the error that rounding leaves in it, rad."""
    known = references([case])
    return case.name, known[case.name], *rows_of_scene(case, engines, known, size, which)


def rows_of_scene(
    case: Case, engines: Mapping[str, Engine], known: Mapping[str, Reference], size: str, which: str
) -> tuple[list[dict], float]:
    """The rows of one scene without times; and the error that rounding leaves in it, rad."""
    reference = known[case.name]
    # beyond the digits of the reference nothing is known
    found, left = [], max(floor(case, engines["tmt"].of(case)), reference.apart)
    taking, energy = methods(engines, size, which, case.robot, case), true_energy(case, reference)
    for method in taking:
        best, last = np.inf, 0
        for setting in settings_of(method, case, size, which):
            found.append(row_of_run(case, case, engines, method, setting, reference, left, energy))
            now, work = accuracy.error(found[-1]), found[-1]["evaluations"] or found[-1]["steps"]
            if accuracy.gained_nothing(now, work, best, last, left) or too_long_next(method, case, work, size):
                break
            best, last = min(best, now), work
    smaller = None if case.robot.is_read else reduced(case)
    few = [method for method in taking if smaller and (method.engine, method.name) in SMALLER]
    setting = Setting(case.duration, SMALLER_STEPS)
    runs = [row_of_run(smaller, case, engines, method, setting, reference, energy=energy) for method in few]
    return found + runs, left


def true_energy(case: Case, reference: Reference) -> np.ndarray:
    """The energy of the reference of a scene at its times, J, (times,)."""
    nq = case.coordinates.nq
    return literal.energy(reference.high[:, :nq], reference.high[:, nq:], case.tree)


def row_of_run(
    case: Case,
    whole: Case,
    engines: Mapping[str, Engine],
    method: Method,
    setting: Setting,
    reference: Reference,
    left: float = 0.0,
    energy: np.ndarray | None = None,
) -> dict:
    """A row: one run of a scene, or of the smaller model that has the motion of the whole one.

    left: the least error that a reference in doubles shows; a smaller one is not known, and has this value. energy: that of the
    reference, J, (times,), where it is known.
    """
    joints, tree = [whole.joints.index(name) for name in case.joints], whole.tree
    places, nq = whole.coordinates.places, whole.coordinates.nq
    free = [[k for i in joints for k in range(*getattr(places.joints[i], part).indices(size))]
            for part, size in (("q", nq), ("qd", places.nv))]  # fmt: skip
    true = reference.high[:, :nq], reference.high[:, nq:]
    energy = true_energy(whole, reference) if energy is None else energy
    run, read = engines[method.engine].of(case).prepare(*case.start, case.tau, setting, method.name)
    with np.errstate(all="ignore"):
        motion = read(run())
        ended = diverged_at(case, reference.t, motion.q, motion.v) is not None
        error = reference.error(motion.q, joints)
        error = np.maximum(error, left) if reference.why else error
        states = [part.copy() for part in true]
        for state, part, own in zip(states, (motion.q, motion.v), free):
            if not ended:  # a run that diverged has no quaternions of length 1
                state[:, own] = part
        off = np.abs(literal.energy(*states, tree) - energy).max()
    return {
        "scene": case.name, "engine": method.engine, "method": method.name,
        "dt_s": setting.duration / setting.steps if setting.steps else None, "tolerance": setting.tolerance,
        "steps": motion.steps, "evaluations": motion.evaluations, "seconds": None,
        "error_rad": None if ended else float(error[-1]), "worst_error_rad": None if ended else float(error.max()),
        "energy_error_J": None if ended else float(off), "diverged": ended,
        "early": float(error[reference.t <= advice.EARLY].max()), "run": (case, method, setting),
        "whole": None if case is whole else whole.name,
    }  # fmt: skip
