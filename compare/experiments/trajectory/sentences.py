"""What a trajectory's runs say: claims about held postures, errors beside agreement, the methods of order 1."""

from collections.abc import Iterable, Mapping, Sequence

import numpy as np

from tmt.methods import METHODS

from ...case import Case
from ...engines import LABELS, Engine
from ...judge.check import Result
from ...judge.run import deviation, number_or_none
from ...judge.words import capital
from ...robots import Robot
from .leaving import causes_in_words, left_in_words
from .runs import STEPS_AT_MOST, counts

SAYS_NOTHING = 100  # times the difference of the engines: an error beyond which their agreement says nothing


def notes(result: Result, robot: Robot, engines: Mapping[str, Engine], finer: Sequence[int]) -> list[str]:
    """All of them, of the runs that these engines have given."""
    runs, cases = result.curves["runs"], {case.name: case for case in robot.cases}
    held = [case for case in robot.cases if case.is_held and (case.name, "rk4", case.steps) in runs]
    return [
        *(of_held(case, engines, runs[case.name, "rk4", case.steps]) for case in held),
        *of_errors(runs, result.curves["errors"], cases),
        *of_first_order(runs, cases),
        f"MuJoCo's integrators here: {', '.join(engines['mujoco'].methods)}.",
        *of_left_out([cases[name] for name in dict.fromkeys(name for name, *_ in runs) if name in cases], finer),
    ]


def of_held(case: Case, engines: Mapping[str, Engine], curve: dict) -> str:
    """What a run of a held posture says, of what is claimed of it if it is."""
    claims = case.robot.claims.of_scenes if case.robot.claims else {}
    about = f"Claim: {claims[case.name]}. Here" if case.name in claims else capital(case.name)
    moved = {name: number_or_none(deviation(curve[name][0], curve[name][0][0])) for name in ("tmt", "mujoco")}
    by = " and ".join(f"{LABELS[name]}'s {rad(value)}" for name, value in moved.items())
    return (
        f"{about}, under TMT's torque, in {case.duration:g} s TMT's {case.robot.name} "
        f"{left_in_words(curve['left']['tmt'])}, MuJoCo's {left_in_words(curve['left']['mujoco'])}; the farthest is {by}. "
        + " ".join(causes_in_words(case, engines, curve["left"]))
    )


def rad(value: float | None) -> str:
    """An angle in words; None: the run has diverged."""
    return "no number (it diverged)" if value is None else f"{value:.1e} rad"


def of_errors(runs: dict, found: dict, cases: Mapping[str, Case]) -> list[str]:
    """How far the coarsest steps of RK4 are from the true motion, beside how far the engines are apart.

    found: {scene: (TMT, MuJoCo)}.
    """
    if not found:
        return []
    lines, says_nothing = [], []
    for name, (ours, theirs) in found.items():
        curve = runs[name, "rk4", cases[name].steps]
        apart = agreement(curve)
        true = "rest" if cases[name].is_held else "more than 20 digits"
        lines.append(
            f"{name} (true: {true}): TMT {rad(ours)}, MuJoCo {rad(theirs)}, apart {apart:.1e} rad in the "
            f"{curve['judged_until_s']:.2f} s that are judged"
        )
        if None not in (ours, theirs) and max(ours, theirs) > SAYS_NOTHING * apart:
            says_nothing.append(name)
    steps = the_same(cases[name].steps for name in found)
    return [
        f"Agreement is not truth. Largest error of {steps or 'the coarsest'} steps of RK4 over the whole scene: "
        f"{'; '.join(lines)}.",
        f"The error is more than {SAYS_NOTHING} times the difference of the engines in these scenes: "
        f"{'; '.join(says_nothing)}. There their agreement, as long as it is judged, says nothing of the error."
        if says_nothing
        else f"In none of these scenes is the error more than {SAYS_NOTHING} times the difference of the engines.",
    ]


def agreement(curve: dict) -> float:
    """How far the engines are apart while they are judged, rad."""
    last = int(np.searchsorted(curve["t"], curve["judged_until_s"] * (1 + 1e-9), side="right"))
    return float(np.abs(curve["tmt"][0][:last] - curve["mujoco"][0][:last])[:: curve["every"]].max())


def of_first_order(runs: dict, cases: Mapping[str, Case]) -> list[str]:
    """For how long the methods of order 1 are judged at the coarsest step in the scenes that are let go, and how they end."""
    schemes = dict.fromkeys(scheme for _, scheme, _ in runs if METHODS[scheme].order == 1)
    free = [case for case in cases.values() if case.is_free]
    found = [(case, curve) for case in free for s in schemes if (curve := runs.get((case.name, s, case.steps)))]
    if not found:
        return []
    case, curve = min(found, key=lambda pair: pair[1]["judged_until_s"])
    shortest, until = f"{case.name}, {curve['integrator']}", curve["judged_until_s"]
    lines = [
        f"{case.name}, {curve['integrator']}: judged for {curve['judged_until_s']:.2f} s, {ends_in_words(curve['ended'])}"
        for case, curve in found
        if curve["judged_until_s"] < case.duration
    ]
    if not lines:
        return [
            f"At the coarsest step the methods of order 1 are judged all along in every free scene ({shortest} too)."
        ]
    dt = the_same(case.scene.dt for case, _ in found)
    return [
        f"Order 1 at {f'dt = {dt:.4g} s' if dt else 'the coarsest step'}. The shortest time that can be judged, before rounding "
        f"grows beyond the tolerance or a run diverges, is {until:.2f} s ({shortest}). {'; '.join(lines)}."
    ]


def ends_in_words(ended: Mapping[str, float | None]) -> str:
    """When the runs of both engines diverge."""
    if not any(ended.values()):
        return "nothing diverges"
    at = (f"{LABELS[name]} {'never' if time is None else f'at {time:.2f} s'}" for name, time in ended.items())
    return f"diverges: {', '.join(at)}"


def of_left_out(cases: Sequence[Case], finer: Sequence[int]) -> list[str]:
    """Which scenes are followed with fewer step sizes than others."""
    names = [case.name for case in cases if len(counts(case, finer)) < len(finer)]
    return (
        [f"Runs of more than {STEPS_AT_MOST} steps, finer than a scene's own, are left out: {', '.join(names)}."]
        if names
        else []
    )


def the_same(values: Iterable) -> object:
    """The value that all are, or None."""
    values = set(values)
    return values.pop() if len(values) == 1 else None
