"""What each held posture is, what one step of each method does there, and where that is in the method's stability region."""

from collections.abc import Sequence
from itertools import product

import numpy as np

from tmt.methods import METHODS

from ...engines import one_of_each_scheme
from ...engines.mujoco.linear import NUDGE, transition
from ...judge.check import Result
from ...judge.rounding import step_rounding
from ...judge.scale import EPS, FACTOR
from ...judge.words import posture_begins
from ...robots import Robot
from ...truth.linear import Held, held
from ...truth.postures import posture_names
from ...truth.steps import beyond_limit, is_runge_kutta, region
from ..setup import Setup
from .choice import coarsest_case, dampings_of
from .growth import MOST_OF_A_STEP
from .subjects import Subjects, places, subjects_of

FINE_AMPLIFICATION, DAMPED_AMPLIFICATION = (
    1e-2,
    5e-4,
)  # s, of steps whose amplification is compared; the second with much damping


MOST_NAMED = 6  # rates of a posture in a sentence


def check_equilibria(result: Result, setup: Setup) -> None:
    """What each held posture is, and TMT's amplification of a step beside MuJoCo's."""
    robot, mujoco, table, too_long = subjects_of(setup.robot).robot, setup.engines["mujoco"], [], []
    usual = (FINE_AMPLIFICATION, coarsest_case(robot).scene.dt)
    for name in posture_names(robot):
        at = held(robot, name)
        values = at.modes[0]
        table += [
            {"scene": name, "kind": at.kind, "mode": k, "real_per_s": float(v.real), "imaginary_per_s": float(v.imag)}
            for k, v in enumerate(values)
        ]
        result.notes.append(kind_in_words(at))
        for damping, steps in zip(dampings_of(robot), (usual, usual, (DAMPED_AMPLIFICATION,))):
            at = held(robot, name, damping)
            for method, dt in product(one_of_each_scheme(mujoco), steps):
                where = f"{name}, {method.name}, dt = {dt:.4g} s, damping {damping:g}"
                if is_runge_kutta(METHODS[method.scheme]) and at.growth(method.scheme, dt) > MOST_OF_A_STEP:
                    too_long.append(f"{where}, is {beyond_limit(at, method.scheme, dt):.3g} times beyond the limit")
                    continue
                theirs = transition(mujoco.of(at.case), at.q, at.tau, dt, method.name)
                rounded = rounding_of_step(at, method.scheme, dt) if robot.is_read else 0.0
                check_amplification(result, where, at.sizes, at.step(method.scheme, dt), theirs, rounded)
    result.tables["stability_modes"] = table
    if too_long:
        result.notes.append(
            "The amplification of a step is not compared where its later stages are too far away for a difference quotient: "
            f"{'; '.join(too_long)}."
        )


def kind_in_words(at: Held) -> str:
    """What a held posture is, and its modes."""
    values = at.modes[0]
    swings = [f"{v.imag:.3f} rad/s" for v in values if v.imag > 1e-3]
    grows = [f"{v.real:.3f} per second" for v in values if v.real > 1e-3 and v.imag >= 0.0]
    decays = [-v.real for v in values if v.real < -1e-3]
    texts = [f"grows by {few(grows, ' and ')}"] * bool(grows) + [f"swings at {few(swings, ', ')}"] * bool(swings)
    if decays and any(at.tree.damping):
        texts.append(f"decays by {min(decays):.3g} to {max(decays):.4g} per second")
    if at.case.robot.is_read and at.without_stiffness.any():
        zero = at.without_stiffness.sum()
        texts.append(f"{zero} of {len(values)} rates {'is' if zero == 1 else 'are'} zero")
    kind = at.kind if at.kind == "marginal" else f"a {decaying(at) or at.kind}"
    return f"{posture_begins(at.name, at.case.robot)}, held, is {kind}" + (f": {'; '.join(texts)}." if texts else ".")


def decaying(at: Held) -> str | None:
    """What a centre is called of which every mode decays: a stable focus if one swings, else a stable node; None: it is not."""
    values, small = at.modes[0], at.small
    if at.kind != "centre" or not (values.real < -small).all():
        return None
    return "stable focus" if (np.abs(values.imag) > small).any() else "stable node"


def few(texts: Sequence[str], between: str) -> str:
    """The first of many texts, and how many more there are."""
    more = len(texts) - MOST_NAMED
    return between.join(texts[:MOST_NAMED]) + (f" and {more} more" if more > 0 else "")


def rounding_of_step(at: Held, scheme: str, dt: float) -> float:
    """The bound of what rounding adds in one step from a held posture: of movements or of speeds, whichever is more.

    By the scale of the forces, which has the reach: where an anchor is far away, that is more than the last digits of the angles.
    """
    rest = np.zeros((1, at.nv))
    return float(step_rounding(METHODS[scheme], at.tree, at.q[None], rest, at.tau, dt).max())


def check_amplification(
    result: Result, where: str, q: np.ndarray, ours: np.ndarray, theirs: np.ndarray, rounded: float = 0.0
) -> None:
    """The check of one amplification: within what rounding does to a difference quotient.

    rounded: the bound of the rounding of a step, where that may be more: a central quotient takes two steps, each so far off,
    over twice the nudge.
    """
    allowed = max(FACTOR * EPS * (1.0 + np.abs(q).max()) * np.abs(ours).max(), rounded) / NUDGE
    quantity = "amplification of one step, TMT to MuJoCo"
    result.check(where, quantity, np.abs(ours - theirs).max(), allowed, "", rounding=True)


def planes(result: Result, robot: Robot, subjects: Subjects, schemes: Sequence[str]) -> None:
    """The stability region of each method in the plane of eigenvalue times dt, and where the postures are in it."""
    x, y = np.linspace(-7.2, 1.8, 226), np.linspace(-0.6, 6.4, 176)
    z = x[None, :] + 1j * y[:, None]
    grown = {name: region(name, z) for name in schemes}
    alike = {name: next(other for other in grown if np.array_equal(grown[other], grown[name])) for name in schemes}
    result.curves["regions"] = {  # methods that do the same at rest share one
        tuple(name for name in schemes if alike[name] == first): (x, y, grown[first])
        for first in dict.fromkeys(alike.values())
    }
    result.curves["points"] = {
        (name, damping): held(robot, name, damping).modes[0]
        for name, damping in places(subjects.centres[:1], subjects.saddles[:1], dampings_of(robot)[:2])
    }
