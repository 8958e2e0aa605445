"""A scene as it is drawn in motion: the stick figures of both engines at about 128 times, and what is to be seen, in words."""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from ...engines import LABELS, Dynamics, Engine, compared
from ...judge.check import Result
from ...judge.run import LEFT, departure, diverged_at, movement_unit, step_in_words
from ...judge.words import capital
from ...robots import Robot
from ...robots.case import Case
from ...robots.stick import as_seen, stick_figure
from .errors import SCHEMES_OF_RK4
from .leaving import accelerations_left, predicted_leaving
from .runs import follow

FRAMES = 128  # of a scene, at most about, its start excepted
SEEN_AFTER = 0.1  # of a scene's duration: so long a motion is shown after the posture is left


class Drawn(NamedTuple):
    """The motion of one scene as it is drawn."""

    scene: str
    run: str  # of which method and step, in words
    t: np.ndarray  # (frames,) s
    points: dict  # of each engine (frames, points, 2): to the right and up, m; NaN from where it has diverged on
    links: list  # pairs of points that a stick joins
    apart: np.ndarray  # (frames,): the largest distance of the engines in any joint; NaN where one has diverged
    unit: str  # of that
    ended: dict  # of each engine: when it diverged, s, or None
    left: dict  # of each engine: when a held robot left its posture, s, or None
    seen: str  # what is to be seen, with its numbers, in sentences
    fixed: bool  # whether the first point stands still, as the first joint only turns


def follow_and_draw(
    case: Case, engines: Mapping[str, Engine], finer: Sequence[int], entries: int
) -> tuple[Result, Drawn | None]:
    """What `follow` finds of a case, and its motion as it is drawn."""
    result = follow(case, engines, finer, entries=entries)
    with np.errstate(over="ignore", invalid="ignore"):
        return result, drawn_motion(case, engines, result.curves)


def drawn_motion(case: Case, engines: Mapping[str, Engine], runs: Mapping[tuple, dict]) -> Drawn | None:
    """The motion of a case by RK4, which may be any scheme of RK4; None where there is no such run.

    What is held is shown by the scene's own step, as when it leaves depends on the step; else by the finest that was run. Where
    only one engine has left its posture at the scene's end, both are followed on until both have, for as long again at most.
    """
    found = [key for key in runs if key[0] == case.name and key[1] in SCHEMES_OF_RK4]
    if not found:
        return None
    key = (min if case.is_held else max)(found, key=lambda key: key[2])
    _, scheme, steps = key
    curve, dynamics = runs[key], compared(engines, case)
    dt, methods = case.duration / steps, dict(zip(dynamics, (scheme, curve["integrator"])))
    t, paths, ended, left = followed_on(case, dynamics, methods, curve, steps)
    every, parts = -(-steps // FRAMES), 1 if case.robot.own else max(1, FRAMES // steps)
    times = t[::every] if parts == 1 else np.arange(parts * (len(t) - 1) + 1) * (dt / parts)
    seen, points, links = {}, {}, []
    for name, path in paths.items():
        few = [part[::every] for part in path]
        q = with_parts_of_steps(dynamics[name], few, case.tau, dt, parts, methods[name])
        alive = np.isfinite(q).all(axis=1) & (times < (np.inf if ended[name] is None else ended[name]))
        whole = case.whole_positions(np.where(alive[:, None], q, case.q))
        of_robot, links = stick_figure(case.robot, whole, crosses=True)
        points[name] = np.where(alive[:, None, None], as_seen(of_robot), np.nan)
        seen[name] = np.where(alive[:, None], q, np.nan)
    apart = np.abs(case.coordinates.difference(*seen.values())).max(axis=1)
    run = f"{curve['integrator']}, {step_in_words(case, steps)}"
    words = what_is_seen(case, engines, t, paths, ended, left, apart)
    if parts > 1:
        words += f" Between two states of a run its own method's steps of dt/{parts} are drawn."
    fixed = case.robot.tree.kind[0] != "slide"
    return Drawn(
        case.name, run, times, points, links, apart, movement_unit(case.coordinates), ended, left, words, fixed
    )


def followed_on(
    case: Case, dynamics: Mapping[str, Dynamics], methods: Mapping[str, str], curve: dict, steps: int
) -> tuple[np.ndarray, dict, dict, dict]:
    """Times of a run (times,) s, and of both engines the states, when they diverged, and when a held robot left its posture.

    Those of the run; or, where only one engine has left at its end, of one with the same steps that goes on until both have.
    """
    t, paths, ended = curve["t"], {name: curve[name] for name in dynamics}, curve["ended"]
    left = curve["left"] if case.is_held else dict.fromkeys(dynamics)  # what is let go has no posture to leave
    if len({time is None for time in left.values()}) == 1 or any(ended.values()) or case.robot.own:
        return t, paths, ended, left
    dt = case.duration / steps
    motions = {name: of.run(*case.start, case.tau, dt, 2 * steps, methods[name]) for name, of in dynamics.items()}
    leaving = {name: departure(motion.t, motion.q, case.coordinates) for name, motion in motions.items()}
    if None in leaving.values():
        return t, paths, ended, left
    last = max(leaving.values()) + SEEN_AFTER * case.duration
    longer = next(iter(motions.values())).t
    t = longer[longer <= last]
    paths = {name: [motion.q[: len(t)], motion.v[: len(t)]] for name, motion in motions.items()}
    return t, paths, {name: diverged_at(case, t, *path) for name, path in paths.items()}, leaving


def in_order(drawn: Sequence[Drawn], robot: Robot) -> list[Drawn]:
    """Scenes in the order in which they are shown: one that is held, and left where one is; one let go from there; the others."""
    cases = {case.name: case for case in robot.cases}
    held = [one for one in drawn if cases[one.scene].is_held]
    first = sorted(held, key=lambda one: not any(one.left.values()))[:1]
    at = [cases[one.scene].scene.posture for one in first]
    free = [one for one in drawn if cases[one.scene].is_free]
    then = sorted(free, key=lambda one: cases[one.scene].scene.posture not in at)[:1]
    chosen = [one.scene for one in first + then]
    return first + then + [one for one in drawn if one.scene not in chosen]


def with_parts_of_steps(
    dynamics: Dynamics, path: Sequence[np.ndarray], tau: np.ndarray, dt: float, parts: int, method: str
) -> np.ndarray:
    """Positions of a run, (times, nq), with those between its states: a part of a step from each, by its own method.

    dt: s, of its steps; parts: into how many each is divided.
    """
    q, v = path
    alive = int(np.argmin(np.append(np.isfinite(np.concatenate(path, axis=1)).all(axis=1), False)))
    found = np.full((parts * (len(q) - 1) + 1, q.shape[1]), np.nan)
    found[::parts] = q
    if alive > 1:
        for k in range(1, parts):
            moved = dynamics.run(q[: alive - 1], v[: alive - 1], tau, dt * k / parts, 1, method).q[:, 1]
            found[k::parts][: alive - 1] = moved
    return found


def what_is_seen(
    case: Case, engines: Mapping[str, Engine], t: np.ndarray, paths: dict, ended: dict, left: dict, apart: np.ndarray
) -> str:
    """What is to be seen of a scene: who leaves when and where to, how far the engines are apart, who has diverged."""
    unit, noun, end = movement_unit(case.coordinates), case.robot.noun, float(t[-1])
    said = []
    if case.is_held and any(left.values()):
        longer = case.changed(duration=2.0 * case.duration)
        pushes = accelerations_left(case, engines)
        for name, time in sorted(left.items(), key=lambda one: one[1] or np.inf):
            at = predicted_leaving(longer, pushes[name]) if np.isfinite(pushes[name]).all() else None
            when = f"stays within {LEFT} {unit}" if time is None else f"leaves at {time:.2f} s"
            said.append(f"in {LABELS[name]} the {noun} {when} (predicted: {f'{at:.2f} s' if at else 'it stays'})")
        side = left_to_in_words(case, t, paths, left) if all(left.values()) else ""
        said = [f"{capital(', '.join(said))}{side}."]
        said.append(f"It has left where a joint has moved by {LEFT} {unit}; predicted is that by RK4's linear map.")
        if end > case.duration * (1.0 + 1e-9):
            said.append(f"Both are followed beyond the scene's {case.duration:g} s until both have left.")
    elif np.isfinite(apart).any():
        stay = f"Both stay within {LEFT} {unit} of the posture; they" if case.is_held else "The engines"
        said.append(f"{stay} are at most {np.nanmax(apart):.2g} {unit} apart in {end:g} s.")
    for name, time in ended.items():
        if time is not None:
            said.append(f"{capital(LABELS[name])} has diverged at {time:.2f} s and is drawn no longer.")
    return " ".join(said)


def left_to_in_words(case: Case, t: np.ndarray, paths: dict, left: dict) -> str:
    """To which sides of the posture both engines leave, behind a comma."""
    gone, coordinates = {}, case.coordinates
    for name, time in left.items():
        k = int(np.searchsorted(t, time))
        gone[name] = coordinates.difference(paths[name][0][k], case.q)
    ours, theirs = gone.values()
    if not np.isfinite([ours, theirs]).all():
        return ""
    i = int(np.argmax(np.abs(ours)))
    unit, joint = coordinates.units[i], case.robot.symbol(coordinates.speeds[i])
    sides = "the same side" if ours @ theirs > 0.0 else "different sides"
    by = " and ".join(f"{moved[i]:+.2f} {unit} in {LABELS[name]}" for name, moved in gone.items())
    return f", to {sides}: {joint} has then moved by {by}"
