"""What a trajectory's runs say, in words: the assignment's claims, errors against agreement, the methods of order 1."""

import numpy as np

from . import leaving
from .engine import INTEGRATORS
from .motion import worst
from .scenes import SCENES

FAR = 100  # times the difference of the engines: an error beyond which their agreement says nothing


def notes(result, engine) -> list[str]:
    """All of it; `engine` is the one that the scenes were run with."""
    runs, scenes = result.curves["runs"], {scene.name: scene for scene in SCENES}
    return [
        *(
            claim(scenes[name], engine, runs[name, "rk4", scenes[name].steps])
            for name in ("ball catch, held", "bent, held")
        ),
        *errors(runs, result.curves["errors"], scenes),
        *first_order(runs, scenes),
        f"MuJoCo's integrators here: {', '.join(INTEGRATORS)}.",
    ]


def claim(scene, engine, curve) -> str:
    """What a run of a held posture says of the assignment's claim about its figure."""
    claims = {
        "ball catch, held": "held at ball catch with dt = 5/64 s, the arm leaves after about 4.5 s, by rounding in an "
        "unstable posture",
        "bent, held": "held at bent, the arm does not move",
    }
    moved = [worst(path - path[0]) for path in (curve["tmt"][0], curve["mujoco"][0])]
    by = " and ".join(f"{name}'s {rad(value)}" for name, value in zip(("TMT", "MuJoCo"), moved))
    return (
        f"Claim: {claims[scene.name]}. Here, under TMT's torque, in {scene.duration:g} s TMT's arm "
        f"{leaving.words(curve['left']['TMT'])}, MuJoCo's {leaving.words(curve['left']['MuJoCo'])}; the farthest is {by}. "
        + " ".join(leaving.told(scene, scene.engine(engine), curve["left"]))
    )


def rad(value) -> str:
    """An angle in words; None: the run has diverged."""
    return "no number (it diverged)" if value is None else f"{value:.1e} rad"


def errors(runs, found, scenes) -> list[str]:
    """How far 64 RK4 steps are from the true motion, beside how far the engines are apart; {scene: (TMT, MuJoCo)}."""
    if not found:
        return []
    lines, says_nothing = [], []
    for name, (ours, theirs) in found.items():
        curve = runs[name, "rk4", scenes[name].steps]
        apart = agreement(curve)
        true = "rest" if scenes[name].torque == "hold" else "more than 20 digits"
        lines.append(
            f"{name} (true: {true}): TMT {rad(ours)}, MuJoCo {rad(theirs)}, apart {apart:.1e} rad in the "
            f"{curve['judged_until_s']:.2f} s that are judged"
        )
        if None not in (ours, theirs) and max(ours, theirs) > FAR * apart:
            says_nothing.append(name)
    return [
        f"Agreement is not truth. Largest error of {next(iter(scenes.values())).steps} steps of RK4 over the whole scene: "
        f"{'; '.join(lines)}.",
        f"The error is more than {FAR} times the difference of the engines in these scenes: {'; '.join(says_nothing)}. There "
        "their agreement, as long as it is judged, says nothing of the error."
        if says_nothing
        else f"In none of these scenes is the error more than {FAR} times the difference of the engines.",
    ]


def agreement(curve) -> float:
    """How far the engines are apart while they are judged, rad."""
    last = int(np.searchsorted(curve["t"], curve["judged_until_s"] * (1 + 1e-9), side="right"))
    return float(np.abs(curve["tmt"][0][:last] - curve["mujoco"][0][:last])[:: curve["every"]].max())


def first_order(runs, scenes) -> list[str]:
    """For how long the methods of order 1 are judged at the coarsest step in the scenes that are let go, and how they end."""
    lines, shortest = [], None
    for name, scene in scenes.items():
        for twin in ("semi_implicit_euler", "implicit"):
            curve = runs.get((name, twin, scene.steps))
            if curve is None or scene.torque != "free":
                continue
            until, ended = curve["judged_until_s"], curve["ended"]
            if shortest is None or until < shortest[0]:
                shortest = until, f"{name}, {curve['integrator']}", scene.dt
            if until < scene.duration:
                how = ", ".join(
                    f"{engine} {'never' if at is None else f'at {at:.2f} s'}" for engine, at in ended.items()
                )
                diverges = "nothing diverges" if not any(ended.values()) else f"diverges: {how}"
                lines.append(f"{name}, {curve['integrator']}: judged for {until:.2f} s, {diverges}")
    if shortest is None:
        return []
    if not lines:
        return [
            f"At the coarsest step the methods of order 1 are judged all along in every free scene ({shortest[1]} too)."
        ]
    return [
        f"Order 1 at dt = {shortest[2]:.4g} s. The shortest time that can be judged, before rounding grows beyond the tolerance "
        f"or a run diverges, is {shortest[0]:.2f} s ({shortest[1]}). {'; '.join(lines)}."
    ]
