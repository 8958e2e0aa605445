"""What a trajectory's runs say: claims about held postures, errors beside agreement, the methods of order 1."""

from collections.abc import Iterable, Mapping, Sequence

import numpy as np

from tmt.methods import METHODS

from ...engines import LABELS, WHOSE, Engine, Method, methods_in
from ...engines.mujoco.flags import INTEGRATORS
from ...judge.check import Result
from ...judge.run import moved_from, movement_unit
from ...judge.words import scene_begins
from ...robots import Robot
from ...robots.case import Case
from .errors import coarsest_run, deviations
from .leaving import causes_in_words, left_in_words, stays_in_words
from .runs import MOST_ENTRIES, STEPS_AT_MOST, counts, steps_afforded

SAYS_NOTHING = 100  # times the difference of the engines: an error beyond which their agreement says nothing


def notes(
    result: Result, robot: Robot, engines: Mapping[str, Engine], finer: Sequence[int], entries: int = MOST_ENTRIES
) -> list[str]:
    """All of them, of the runs that these engines have given."""
    runs, cases = result.curves["runs"], {case.name: case for case in robot.cases}
    held = [(case, curve) for case in robot.cases if case.is_held and (curve := coarsest_run(runs, case))]
    return [
        *(of_held(case, engines, curve) for case, curve in held),
        *of_errors(runs, result.curves["errors"], cases),
        *of_first_order(runs, cases),
        f"MuJoCo's integrators here: {', '.join(engines['mujoco'].methods)}.",
        *of_integrators(robot, engines["mujoco"]),
        *of_servos(
            [cases[name] for name in dict.fromkeys(name for name, *_ in runs) if name in cases], engines["mujoco"]
        ),
        *of_left_out(
            [cases[name] for name in dict.fromkeys(name for name, *_ in runs) if name in cases], finer, entries
        ),
    ]


def of_held(case: Case, engines: Mapping[str, Engine], curve: dict) -> str:
    """What a run of a held posture says, of what is claimed of it if it is."""
    claims = case.robot.claims.of_scenes if case.robot.claims else {}
    about = f"Claim: {claims[case.name]}. Here" if case.name in claims else scene_begins(case.name, case.robot)
    unit, named = movement_unit(case.coordinates), WHOSE | {"own": "yours"}
    ours, left = case.robot.compared[0], curve["left"]
    torque = "TMT's torque" if ours == "tmt" else "the torque that holds the compiled model"
    by = " and ".join(f"{named[name]} {rad(value, unit)}" for name, value in deviations(case, curve).items())
    if case.robot.is_read and (stays := stays_in_words(case, engines, left)):
        return f"{about}, under {torque}: {stays}; the farthest is {by}."
    return (
        f"{about}, under {torque}, in {case.duration:g} s {WHOSE[ours]} {case.robot.name} {left_in_words(left[ours], unit)}, "
        f"MuJoCo's {left_in_words(left['mujoco'], unit)}; the farthest is "
        f"{by}. " + " ".join(causes_in_words(case, engines, curve["left"]))
    )


def of_integrators(robot: Robot, mujoco: Engine) -> list[str]:
    """Which integrators are which scheme, of a robot from a file; and which is left out."""
    if not robot.is_read:
        return []
    if robot.own:
        return [
            "Your equations are integrated by this project's RK4: of MuJoCo's integrators RK4 alone is compared with it."
        ]
    methods = mujoco.methods
    lacking = [name for name in INTEGRATORS if name not in methods]
    return [
        f"Their schemes in tmt, for this {robot.noun}: {schemes_in_words(methods)}.",
        *(f"No scheme in tmt is that of MuJoCo's {name} for this {robot.noun}: it is left out." for name in lacking),
    ]


def schemes_in_words(methods: Mapping[str, Method]) -> str:
    """Which integrators are which scheme."""
    schemes = {}
    for method in methods.values():
        schemes.setdefault(method.scheme, []).append(method.name)
    return "; ".join(f"{' and '.join(names)}: {scheme}" for scheme, names in schemes.items())


def of_servos(cases: Sequence[Case], mujoco: Engine) -> list[str]:
    """What acts in the scenes under a robot's own actuators, what of it is implicit, and what is left out there."""
    driven = [case for case in cases if case.controller]
    if not driven:
        return []
    names, first = "; ".join(case.name for case in driven), driven[0]
    left = "; ".join(f"{name}, {why}" for name, why in first.controller.left_out.items())
    return [
        f"The {first.robot.noun}'s own actuators act, under constant controls and without their ranges, in: {names}. "
        f"Their schemes in tmt: {schemes_in_words(methods_in(mujoco, first))}. The velocity gains of two joints on one path to "
        "the world are implicit in implicitfast and implicit, all gains in discrete, none in Euler and RK4."
        + f" Left out in both: {left}."
        * bool(left)
    ]


def rad(value: float | None, unit: str = "rad") -> str:
    """A movement in words; None: the run has diverged."""
    return "no number (it diverged)" if value is None else f"{short(value)} {unit}"


def short(value: float) -> str:
    """A size in words: 0 where it is exactly that."""
    return f"{value:.1e}" if value else "0"


def of_errors(runs: dict, found: dict, cases: Mapping[str, Case]) -> list[str]:
    """How far the coarsest steps of RK4 are from the true motion, beside how far the engines are apart.

    found: {scene: (TMT, MuJoCo)}.
    """
    if not found:
        return []
    lines, says_nothing = [], []
    for name, (ours, theirs) in found.items():
        curve = coarsest_run(runs, cases[name])
        case = cases[name]
        label = LABELS[case.robot.compared[0]]
        apart, unit = agreement(curve, case), movement_unit(case.coordinates)
        true = "rest" if cases[name].is_held else "more than 20 digits"
        lines.append(
            f"{name} (true: {true}): {label} {rad(ours, unit)}, MuJoCo {rad(theirs, unit)}, apart {short(apart)} {unit} in the "
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


def agreement(curve: dict, case: Case) -> float:
    """How far the engines are apart while they are judged, rad or m."""
    last = int(np.searchsorted(curve["t"], curve["judged_until_s"] * (1 + 1e-9), side="right"))
    states = slice(0, last, curve["every"])
    return float(moved_from(*(curve[name][0][states] for name in case.robot.compared), case.coordinates).max())


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


def of_left_out(cases: Sequence[Case], finer: Sequence[int], entries: int = MOST_ENTRIES) -> list[str]:
    """Which scenes are followed with fewer step sizes than others, and which are judged for fewer steps than they have."""
    left_out, said = {}, []
    for case in cases:
        if len(counts(case, finer, entries)) < len(finer):
            left_out.setdefault(min(STEPS_AT_MOST, steps_afforded(case, entries)), []).append(case.name)
    for most, names in left_out.items():
        said.append(f"Runs of more than {most} steps, finer than a scene's own, are left out: {'; '.join(names)}.")
    judged = {case.name: steps_afforded(case, entries) for case in cases if case.steps > steps_afforded(case, entries)}
    if judged:
        which = "; ".join(f"{name}: {steps} steps" for name, steps in judged.items())
        said.append(
            "The band of rounding asks for a Jacobian of each step, and these scenes are judged for no more steps than can be "
            f"afforded: {which}."
        )
    return said


def the_same(values: Iterable) -> object:
    """The value that all are, or None."""
    values = set(values)
    return values.pop() if len(values) == 1 else None
