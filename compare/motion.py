"""What can be said of runs: divergence, departure, drift, growth of errors, many digits, the published claims."""

from functools import partial

import mpmath
import numpy as np

import tmt
from tmt.methods import METHODS, one_step
from tmt.reference import DIGITS, distance

from .agreement import EPS, FACTOR, gravity_scale
from .band import growth
from .engine import INTEGRATORS
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
LONG = 60.0  # s, for the growth of errors
LONG_STEPS = 6144  # of RK4
DRIFT = 1.0  # s, over which the drift of a free run is taken: short enough for the order to show, long enough to move
DRIFT_STEPS = {"Euler": (2048, 4096, 8192), "implicit": (2048, 4096, 8192), "RK4": (256, 512, 1024)}
ORDER_MARGIN = 0.15
EXACT_STEPS = 64  # of the runs with many digits
FAST = 1e4  # rad/s: a run with many digits that is faster has diverged


def step(scene, steps) -> str:
    """The step of a run in words."""
    return f"dt = {scene.duration:g}/{steps} s"


def farthest(deviation) -> float:
    """The largest deviation of a run, as long as it has not diverged."""
    return float(np.nanmax(np.abs(deviation)))


def departure(t, path) -> float | None:
    """The time at which a hinge is first 0.1 rad from where it started; None: never."""
    away = np.abs(path - path[0]).max(axis=1) > LEFT
    return float(t[away][0]) if away.any() else None


def diverged_at(scene, t, q, qd) -> float | None:
    """The first time at which a run has stopped, is not finite, or is beyond its physical energy; None: never.

    Energy less the work of the constant torque cannot grow. The bound is a gain of the arm's whole potential range,
    2 x 9.42 J, and of the kinetic energy at the start.
    """
    finite = np.isfinite(np.concatenate([q, qd], axis=1)).all(axis=1)
    good = np.where(finite[:, None], q, 0.0), np.where(finite[:, None], qd, 0.0)
    energy = tmt.energy(*good, scene.model) - (good[0] - q[0]) @ scene.tau
    kinetic = tmt.energy(q[0], qd[0], scene.model) - tmt.potential_energy(q[0], scene.model)
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
    engine = scene.engine(engine)
    worst, bar = 0.0, FACTOR * EPS * 9.0  # the rates sum to at most 9 rad/s, and |Mbar| is below 1 kg m2
    for q, qd in rng.uniform(-3.0, 3.0, (20, 2, 3)):
        ours = np.array(tmt.method.bias_rates(scene.model, list(q), list(qd))) + np.diag(scene.model.damping)
        worst = max(worst, np.abs(ours + implicit_derivative(engine, q, qd)).max())
    result.check("20 random states", "dh/dqd + D, TMT to MuJoCo's -qDeriv", worst, bar, "N m s/rad", rounding=True)


def drift(result, engine) -> None:
    """Energy and, without gravity, alpha-momentum along runs: drift falls with dt at the method's order."""
    drifts = {}  # (scene, quantity, unit): integrator: party: a value for each of the steps
    for scene in (scene for scene in SCENES if scene.torque == "free" and not scene.damping):
        party_of = {"TMT": tmt_run, "MuJoCo": partial(mujoco_run, scene.engine(engine))}
        quantities = {("energy", "J"): partial(tmt.energy, model=scene.model)}
        if not scene.gravity and "alpha" in scene.hinges:
            quantities["alpha-momentum", "N m s"] = partial(alpha_momentum, scene.model)
        for integrator, steps in DRIFT_STEPS.items():
            for party, run in party_of.items():
                paths = [run(scene, integrator, DRIFT / count, count) for count in steps]
                for name, quantity in quantities.items():
                    values = [quantity(*path) for path in paths]
                    of_scene = drifts.setdefault((scene.name, *name), {}).setdefault(integrator, {})
                    of_scene[party] = [float(np.abs(v - v[0]).max()) for v in values]
    for (scene, quantity, _), of_scene in drifts.items():
        for integrator, parties in of_scene.items():
            for party, values in parties.items():
                where = f"{scene}, {integrator}, {party}, {DRIFT:g} s"
                order = METHODS[TWINS[integrator]].order
                off = abs(np.log2(values[-2] / values[-1]) - order)
                result.check(where, f"order of the drift of {quantity}, from {order}", off, ORDER_MARGIN, "")
                if integrator == "RK4":  # with an eighth of the steps
                    ratio = values[-1] / of_scene["Euler"][party][-1]
                    result.check(where, f"drift of {quantity} over that of Euler", ratio, 1e-3, "")
    result.curves["drift"] = drifts


def tmt_run(scene, integrator, dt, steps) -> list:
    """q and qd of the twin."""
    return tmt.simulate(*scene.start, scene.tau, dt, steps, TWINS[integrator], scene.model)[1:]


def mujoco_run(engine, scene, integrator, dt, steps) -> list:
    """q and qd of MuJoCo."""
    return engine.trajectory(*scene.start, scene.tau, dt, steps, integrator)[1:]


def alpha_momentum(model, q, qd) -> np.ndarray:
    """Angular momentum about the first hinge along a run, N m s."""
    return np.einsum("sj,sj->s", tmt.mass_matrix(q, model)[:, 0], qd)


def grown(scene) -> np.ndarray:
    """log10 of the growth of a small difference over a minute of RK4, every 5/32 s."""
    dt = LONG / LONG_STEPS
    _, *path = tmt.simulate(*scene.start, scene.tau, dt, LONG_STEPS, "rk4", scene.model)
    return growth(METHODS["rk4"], scene.model, *path, scene.tau, dt, every=16)


def growth_of_errors(result, scenes, curves) -> None:
    """log10 of the growth of a small difference over 5 s and 60 s, scene by scene, told in words."""
    if not scenes:
        return
    t = np.linspace(0.0, LONG, LONG_STEPS // 16 + 1)
    curves = {scene.name: curve for scene, curve in zip(scenes, curves)}
    five = np.searchsorted(t, 5.0)
    told = "; ".join(f"{name}: 10^{g[five]:.1f} and 10^{g[-1]:.1f}" for name, g in curves.items())
    horizons = {digits: reach(t, curves["ball catch, free"], digits) for digits in (16, 30)}
    result.notes.append(
        f"Growth of a small difference of the state over 5 s and 60 s (RK4, exact Jacobians): {told}. Beyond "
        "its horizon the figure of a chaotic scene depends on the step and on the last bits."
    )
    result.notes.append(
        f"So ball catch, free, has a horizon: {horizons[16]} for doubles (16 digits) and {horizons[30]} for 30 digits."
    )
    result.curves["growth"] = {"t": t, "curves": curves}


def reach(t, grown, digits) -> str:
    """When a difference of 10^-digits has grown to 1 rad, in words."""
    beyond = grown > digits
    return f"about {t[beyond][0]:.0f} s" if beyond.any() else f"more than {t[-1]:.0f} s"


def many_digits(result, engine, scenes, runs) -> None:
    """Both runs against a run of the same scheme with many digits: which party carries the rounding."""
    for scene, integrator, exact in runs_by(scenes, runs):
        variant = scene.engine(engine)
        curve = result.curves["runs"][(scene.name, TWINS[integrator], EXACT_STEPS)]
        dt = scene.duration / EXACT_STEPS
        last = round(curve["judged_until_s"] / dt)
        _, *theirs = variant.trajectory(*scene.start, scene.tau, dt, EXACT_STEPS, integrator)
        bar = curve["band"][: last + 1]
        where = f"{scene.name}, {integrator}, {step(scene, EXACT_STEPS)}"
        off = {}
        for party, path in (("TMT", curve["tmt"]), ("MuJoCo", theirs)):
            apart = distance(path[0][: last + 1], exact[: last + 1]).max(axis=1)
            ratio = np.divide(apart, bar, out=np.zeros_like(apart), where=bar > 0)
            k, off[party] = int(np.argmax(ratio)), apart.max()
            result.check(
                where, f"{party} to many digits of its own scheme", apart[k], bar[k], "rad", f"t = {k * dt:.3f} s", True
            )
        result.notes.append(
            f"Against {DIGITS} digits of the same scheme ({where}, to {curve['judged_until_s']:.2f} s): TMT is at most "
            f"{off['TMT']:.1e} rad off, MuJoCo {off['MuJoCo']:.1e} rad."
        )


def runs_by(scenes, runs):
    """(scene, integrator, run) for the runs of `exact_runs`, scene by scene."""
    for scene, of_scene in zip(scenes, runs):
        for integrator, run in of_scene.items():
            yield scene, integrator, run


def exact_runs(scene) -> dict:
    """Hinge angles of each scheme on mpmath numbers, by its integrator."""
    return {name: exact_run(scene, TWINS[name], EXACT_STEPS, scene.duration / EXACT_STEPS) for name in SCHEMES}


def exact_run(scene, twin, steps, dt) -> np.ndarray:
    """Hinge angles of the same scheme on mpmath numbers, from the same doubles: (steps + 1, 3), fewer if it diverges."""
    with mpmath.workdps(DIGITS):
        q, qd = ([mpmath.mpf(float(v)) for v in values] for values in scene.start)
        tau, dt = [mpmath.mpf(float(v)) for v in scene.tau], mpmath.mpf(dt)
        path = [q]
        for _ in range(steps):
            q, qd = one_step(METHODS[twin], scene.model, q, qd, tau, dt)
            path.append(q)
            if max(map(abs, qd)) > FAST:  # diverged: its sines would ask for millions of digits of pi
                break
    return np.array(path, dtype=object)


def published_claims(result) -> list[str]:
    """What these runs say of the assignment's claims about its Figures 2 and 3."""
    curve = result.curves["runs"][("ball catch, held", "rk4", 64)]
    left = ", ".join(
        f"{party}'s arm {'stays within 0.1 rad' if at is None else f'is 0.1 rad away at {at:.2f} s'}"
        for party, at in curve["left"].items()
    )
    bent = result.curves["runs"][("bent, held", "rk4", 64)]
    moved = farthest(bent["mujoco"][0] - bent["mujoco"][0][0])
    return [
        "Claim: held at ball catch with dt = 5/64 s, the arm leaves after about 4.5 s, by rounding in an unstable posture. "
        f"Here, under TMT's torque, {left}. Rounding is the cause: the torque is off by its last bits, and what they start "
        "grows by e^7.5 a second. An engine whose own bias is the torque bit for bit has nothing to start from.",
        f"Claim: held at bent, the arm does not move. Here it moves by at most {moved:.1e} rad in five seconds.",
        f"MuJoCo's integrators here: {', '.join(INTEGRATORS)}.",
    ]
