"""What makes a step stable, and what stops a creep: changes of a file, each tried in runs of the same definition."""

import time
from collections.abc import Callable
from typing import NamedTuple

import mujoco

from ..engines.mujoco import changes
from ..engines.mujoco.stepper import Stepper
from .push import SURELY, Pushed
from .runs import WAYS, Trial
from .search import largest

ITERATIONS = 2, 4, 10, 50  # of the solver
NOSLIP, IMPRATIO = 10, 100.0  # that stop a creep
WITHIN = 1.2  # fold: how closely the least strength of a change is found
STRONGER = 1.0, 1.5  # fold: tried where further pushes show the least strength to be too little
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
    for count in ITERATIONS:
        if remedy := confirmed(pushed, changes.with_iterations(model, count), "iterations", count):
            found.append(remedy)
            break
    for name, (change, first, most) in STRENGTHS.items():

        def fails(strength: float, change: Change = change) -> bool:
            changed = change(model, strength)
            return changed is None or not comes_to_rest(pushed, changed)

        _, least = largest(fails, first, first / 100.0, most, WITHIN)
        for strength in [fold * least for fold in STRONGER] if least is not None else ():
            if remedy := confirmed(pushed, change(model, strength), name, strength):
                found.append(remedy)
                break
    return found


def shorter_steps(pushed: Pushed) -> list[Remedy]:
    """The longest part of the step in use, in ms, with which the program's period holds, if one does."""
    for dt in (pushed.dt / parts for parts in PARTS):
        verdict = pushed.verdict(Trial(pushed.push, dt, pushed.integrator, pushed.period))
        if verdict.holds:
            return [Remedy("timestep", 1e3 * dt, verdict.speed)]
    return []


def comes_to_rest(pushed: Pushed, model: mujoco.MjModel) -> bool:
    """Whether runs of a changed model at the step in use are as still, or as slow, as the file's fine runs."""
    changed, trial = of_changed(pushed, model), Trial(pushed.push, pushed.dt, pushed.integrator)
    most = max(pushed.still(pushed.push), *(fine.speed for fine in pushed.fine_runs(pushed.push)))
    ways = {*range(WAYS), pushed.verdict(trial).way}  # it may fail after a further pattern alone
    return all(changed.run(trial, way, lasts=SURELY * pushed.lasts).speed <= most for way in ways)


def confirmed(pushed: Pushed, model: mujoco.MjModel | None, name: str, number: float) -> Remedy | None:
    """The change, if with it the step holds beside fine runs of the changed model; None: it does not."""
    if model is None or not comes_to_rest(pushed, model):
        return None
    changed = of_changed(pushed, model)
    changed.find_truth()
    trial = Trial(pushed.push, pushed.dt, pushed.integrator)
    changed.sure(trial)
    verdict = changed.verdict(trial)
    borne = changed.survived >= pushed.survived
    if not (borne and verdict.holds):
        return None
    costs = name == "iterations"
    times = (time_of_step(pushed, pushed.model), time_of_step(pushed, model)) if costs else None
    return Remedy(name, float(f"{number:.2g}"), verdict.speed, times)


def of_changed(pushed: Pushed, model: mujoco.MjModel) -> Pushed:
    motion = pushed.motion._replace(model=model, ideal=None)
    return Pushed(motion, pushed.dt, pushed.integrator, pushed.asked, pushed.period, pushed.delay)


def creep_stops(pushed: Pushed, dof: int) -> list[Remedy]:
    """How fast a degree of freedom creeps in the unpushed fine run with less slip of contacts; the slowest first."""
    found = []
    for name, field, number in (("noslip", "noslip_iterations", NOSLIP), ("impratio", "impratio", IMPRATIO)):
        trial = of_changed(pushed, changes.changed(pushed.motion.model, **{field: number}))
        trial.truth = pushed.truth
        found.append(Remedy(name, number, trial.creep(dof)[0]))
    return sorted(found, key=lambda remedy: remedy.speed)


def time_of_step(pushed: Pushed, model: mujoco.MjModel) -> float:
    """The processor time of a step from the start of the motion, s."""
    run, times = Stepper(model, pushed.dt, pushed.integrator).loop(pushed.motion.state, TIMED), []
    for _ in range(3):
        begun = time.thread_time()
        run()
        times.append(time.thread_time() - begun)
    return min(times) / TIMED
