"""What can be said of one run: how far it went, when it left, when it diverged, how far it is from the true motion."""

import numpy as np

import tmt

from . import reference
from .agreement import EPS, FACTOR, gravity_scale, mass_scale
from .engine_linear import implicit_derivative
from .scenes import SCENES

TWINS = {  # MuJoCo's integrator: the method of tmt that is the same scheme
    "Euler": "semi_implicit_euler",
    "implicitfast": "semi_implicit_euler",
    "discrete": "semi_implicit_euler",
    "implicit": "implicit",
    "RK4": "rk4",
}
SCHEMES = ("Euler", "implicit", "RK4")  # one integrator of MuJoCo for each twin
LEFT = 0.1  # rad: a held arm that is so far from its posture has left it
ORDER_MARGIN = 0.15  # of an order that is measured


def step(scene, steps) -> str:
    """The step of a run in words."""
    return f"dt = {scene.duration:g}/{steps} s"


def farthest(deviation) -> float:
    """The largest deviation of a run, as long as it has not diverged."""
    return float(np.nanmax(np.abs(deviation)))


def departure(t, path) -> float | None:
    """The time at which a hinge is first 0.1 rad from where it started; None: never."""
    away = ~(np.abs(path - path[0]).max(axis=1) <= LEFT)  # a run that is no number has left too
    return float(t[away][0]) if away.any() else None


def diverged_at(scene, t, q, qd) -> float | None:
    """The first time at which a run has stopped, is not finite, or is beyond its physical energy; None: never.

    Energy less the work of the constant torque cannot grow, on the stated arm. The bound is a gain of its whole potential
    range, twice the sum of m g reach, and of the kinetic energy at the start.
    """
    finite = np.isfinite(np.concatenate([q, qd], axis=1)).all(axis=1)
    good = np.where(finite[:, None], q, 0.0), np.where(finite[:, None], qd, 0.0)
    kinetic = tmt.energy(q[0], qd[0], scene.model) - tmt.potential_energy(q[0], scene.model)
    with np.errstate(over="ignore", invalid="ignore"):  # of a run that is about to end
        energy = tmt.energy(*good, scene.model) - (good[0] - q[0]) @ scene.tau
        bad = ~finite | ~(energy - energy[0] <= 2.0 * gravity_scale() + kinetic)
    return float(t[bad][0]) if bad.any() else None


def one_ulp(scene, twin, dt, steps) -> np.ndarray:
    """Hinge angles of a run of TMT whose start is one ulp away in each angle and rate."""
    q, qd = (np.nextafter(start, np.inf) for start in scene.start)
    return tmt.simulate(q, qd, scene.tau, dt, steps, twin, scene.model)[1]


def derivative(result, engine) -> None:
    """The derivative of the bias by the rates that `implicit` uses: TMT's dual numbers against MuJoCo's qDeriv."""
    scene = next(scene for scene in SCENES if scene.damping)
    rng = np.random.default_rng(0)
    engine, damping = scene.engine(engine), np.diag(scene.model.damping)
    states = rng.uniform(-3.0, 3.0, (20, 2, 3))
    ours = [np.array(tmt.method.bias_rates(scene.model, list(q), list(qd))) + damping for q, qd in states]
    theirs = [-implicit_derivative(engine, q, qd) for q, qd in states]
    judge_derivative(result, *states.transpose(1, 0, 2), np.array(ours), np.array(theirs), damping.max())


def judge_derivative(result, q, qd, ours, theirs, damping) -> None:
    """The state that comes closest to 64 eps x (the largest entry of Mbar x the sum of |rates| + the damping)."""
    bar = FACTOR * EPS * (mass_scale(q) * np.abs(qd).sum(axis=1) + damping)
    off = np.abs(ours - theirs).max(axis=(1, 2))
    k = int(np.argmax(off / bar))  # NaN counts as the largest
    result.check("20 random states", "dh/dqd + D, TMT to MuJoCo's -qDeriv", off[k], bar[k], "N m s/rad", rounding=True)


# how far from the true motion


def held_errors(result) -> dict[str, tuple]:
    """How far 64 RK4 steps are from the true motion of each held scene, which is rest: {scene: (TMT, MuJoCo)}, rad.

    The largest angle over the run; None of a run that has diverged.
    """
    scenes = {scene.name: scene for scene in SCENES if scene.torque == "hold" and not any(scene.speed)}
    return {
        name: tuple(worst(path - path[0]) for path in (curve["tmt"][0], curve["mujoco"][0]))
        for (name, twin, steps), curve in result.curves["runs"].items()
        if name in scenes and twin == "rk4" and steps == scenes[name].steps
    }


def free_errors(result) -> dict[str, tuple]:
    """The same of the free scenes whose true motion stands in the table of runs with more than 20 digits."""
    table, errors = reference.read(reference.TABLE), {}
    for scene in SCENES:
        curve = result.curves["runs"].get((scene.name, "rk4", scene.steps))
        if curve and reference.key(scene) in table and scene.steps == reference.RECORDS:
            true = reference.reference(table[reference.key(scene)])
            errors[scene.name] = tuple(worst(true.error(path[0])) for path in (curve["tmt"], curve["mujoco"]))
    return errors


def worst(deviation) -> float | None:
    """The largest deviation of a run; None if it has diverged."""
    largest = float(np.abs(deviation).max())
    return largest if np.isfinite(largest) else None
