"""What makes a step stable, and what stops a creep: changes of a file, each tried in runs of the same definition."""

import time
from collections.abc import Callable
from typing import NamedTuple

import mujoco

from ..engines.mujoco import changes
from ..engines.mujoco.stepper import Stepper
from .push import WAYS, Pushed
from .search import largest

ITERATIONS = 2, 4, 10, 50  # of the solver
NOSLIP, IMPRATIO = 10, 100.0  # that stop a creep
WITHIN = 1.2  # fold: how closely the least strength of a change is found
PARTS = 2, 4, 10  # of a step, while a program's period stays
TIMED = 200  # steps
Change = Callable[[mujoco.MjModel, float], mujoco.MjModel | None]  # None: the file has nothing to change


class Remedy(NamedTuple):
    """A change that was tried. change: its name; number: its strength; speed: at the end of the run, rad/s or m/s.

    times: of a step before and after it, s, where it costs time.
    """

    change: str
    number: float
    speed: float
    times: tuple[float, float] | None = None


# strengths: the first that is tried, and the most; the least that holds is sought
STRENGTHS: dict[str, tuple[Change, float, float]] = {
    "less_kv": (lambda model, fold: changes.with_kv(model, 1.0 / fold), 1.5, 1e3),
    "armature": (changes.with_armature, 1e-3, 10.0),
    "slower_contacts": (changes.with_slower_contacts, 1.5, 30.0),
    "impratio": (changes.with_impratio, 2.0, 1e3),
}


def remedies(pushed: Pushed) -> list[Remedy]:
    """The changes with which the step in use holds after the push, by the integrator in use: of each kind the least."""
    found, model = list[Remedy](), pushed.motion.model
    before = time_of_step(pushed, model)
    for count in ITERATIONS:
        changed = changes.with_iterations(model, count)
        if changed is not None and (remedy := confirmed(pushed, changed, "iterations", count)):
            found.append(remedy._replace(times=(before, time_of_step(pushed, changed))))
            break
    for name, (change, first, most) in STRENGTHS.items():

        def fails(strength: float, change: Change = change) -> bool:
            changed = change(model, strength)
            return changed is None or not comes_to_rest(pushed, changed)

        _, least = largest(fails, first, first / 100.0, most, WITHIN)
        changed = None if least is None else change(model, least)
        if changed is not None and (remedy := confirmed(pushed, changed, name, least or 0.0)):
            found.append(remedy)
    return found


def shorter_steps(pushed: Pushed) -> list[Remedy]:
    """The longest part of the step in use, in ms, with which the program's period holds, if one does."""
    for dt in (pushed.dt / parts for parts in PARTS):
        verdict = pushed.verdict(pushed.push, dt, pushed.integrator, pushed.period, pushed.delay)
        if verdict.holds:
            return [Remedy("timestep", 1e3 * dt, verdict.speed)]
    return []


def comes_to_rest(pushed: Pushed, model: mujoco.MjModel) -> bool:
    """Whether runs of a changed model at the step in use are as still, or as slow, as the file's fine runs."""
    trial = of_changed(pushed, model)
    for way in range(WAYS):
        run, fine = (
            trial.run(pushed.push, way, pushed.dt, pushed.integrator),
            pushed.fine_run(pushed.push, way),
        )
        if not run.last.max() <= max(pushed.still(pushed.push), fine.last.max()):
            return False
    return True


def confirmed(pushed: Pushed, model: mujoco.MjModel, name: str, number: float) -> Remedy | None:
    """The change, if with it the step holds beside fine runs of the changed model; None: it does not."""
    if not comes_to_rest(pushed, model):
        return None
    trial = of_changed(pushed, model)
    trial.find_truth()
    verdict = trial.verdict(pushed.push, pushed.dt, pushed.integrator)
    borne = trial.survived >= pushed.survived
    return Remedy(name, float(f"{number:.2g}"), verdict.speed) if borne and verdict.holds else None


def of_changed(pushed: Pushed, model: mujoco.MjModel) -> Pushed:
    motion = pushed.motion._replace(model=model, ideal=None)
    return Pushed(motion, pushed.dt, pushed.integrator, pushed.asked, pushed.period, pushed.delay)


def creep_stops(pushed: Pushed, dof: int) -> list[Remedy]:
    """How fast a degree of freedom creeps in the unpushed fine run with less slip of contacts; the slowest first."""
    model, found = pushed.motion.model, []
    tried = (
        ("noslip", NOSLIP, changes.with_noslip(model, NOSLIP)),
        ("impratio", IMPRATIO, changes.changed(model, impratio=IMPRATIO)),
    )
    for name, number, changed in tried:
        trial = of_changed(pushed, changed)
        trial.truth = pushed.truth
        found.append(Remedy(name, number, trial.creep(dof)[0]))
    return sorted(found, key=lambda remedy: remedy.speed)


def time_of_step(pushed: Pushed, model: mujoco.MjModel) -> float:
    """The processor time of a step from the start of the motion, s."""
    stepper = Stepper(model, pushed.dt, pushed.integrator)
    run = stepper.loop(pushed.motion.state, TIMED)
    times = []
    for _ in range(3):
        begun = time.thread_time()
        run()
        times.append(time.thread_time() - begun)
    return min(times) / TIMED
