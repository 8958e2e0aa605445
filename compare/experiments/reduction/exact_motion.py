"""Both engines against motions that are known exactly: the swing of the elbow, small oscillations about hanging."""

import numpy as np

import tmt
from tmt.methods import METHODS
from tmt.reference import DIGITS, distance

from .agreement import EPS, FACTOR
from .cost import INTEGRATORS
from .exact_motion import exact_swing, modes, pendulum, small_oscillation, swing
from .motion import ORDER_MARGIN, TWINS
from .scenes import posture

SWINGS = (4, 8, 16, 32, 64, 128)  # times the scene's own steps
ROUNDED = 1e-11  # rad: smaller errors are not those of the method alone
COMPARED = 16  # of these, those that the table has
AMPLITUDES = (0.16, 0.08, 0.04, 0.02, 0.01)  # rad, each half of the one before
DURATION = 5.0  # s
FINE, LESS_FINE = 8192, 1024  # steps, at which the error of RK4 is far below that of the linear modes


def swings(result, engine, scenes) -> None:
    """Each scene in which one hinge is free, a physical pendulum, against its elliptic function."""
    for scene in scenes:
        if len(scene.hinges) == 1 and scene.torque == "free" and scene.gravity and not scene.damping:
            (q,), (qd,) = scene.start
            if np.isfinite(swing(0.0, q, qd, *pendulum(scene.model))):  # one that turns over is another function
                of_pendulum(result, scene.engine(engine), scene)


def of_pendulum(result, engine, scene) -> None:
    """Errors of both engines against the elliptic function, which fall at the method's order; that function's own."""
    (q,), (qd,) = scene.start
    hanging, frequency = pendulum(scene.model)
    t = np.linspace(0.0, scene.duration, SWINGS[0] * scene.steps + 1)
    exact = swing(t, q, qd, hanging, frequency)
    off = distance(exact[::8], exact_swing(t[::8], q, qd, hanging, frequency)).max()
    # rounding of the angle itself, and of the argument times the fastest rate
    judge_function(result, scene.name, off, np.abs(exact).max() + 2.0 * frequency * scene.duration)
    errors = {}
    for integrator in INTEGRATORS:
        method = TWINS[integrator]
        for finer in SWINGS:
            steps = finer * scene.steps
            arguments = *scene.start, scene.tau, scene.duration / steps, steps
            paths = {
                "TMT": tmt.simulate(*arguments, method, scene.model)[1],
                "MuJoCo": engine.trajectory(*arguments, integrator)[1],
            }
            for party, path in paths.items():
                error = float(np.abs(path[:: finer // SWINGS[0], 0] - exact).max())
                errors.setdefault((party, integrator), []).append(error)
                if finer == COMPARED:
                    result.curves["apart"][scene.name, party, integrator] = error
    orders = judge_orders(result, scene.name, errors)
    result.curves["swings"][scene.name] = {
        "dt": scene.duration / scene.steps / np.array(SWINGS),
        "errors": errors,
        "orders": orders,
    }
    best = {party: errors[party, "RK4"][-1] for party in ("TMT", "MuJoCo")}
    result.notes.append(
        f"{scene.name}: a physical pendulum, whose small swings have {frequency:.4f} rad/s. With {steps} steps of RK4 TMT "
        f"is at most {best['TMT']:.2e} rad from the elliptic function, and MuJoCo {best['MuJoCo']:.2e} rad, in "
        f"{scene.duration:g} s."
    )


def judge_function(result, scene, off, scale) -> None:
    """A check: the elliptic function in doubles is that with 50 digits, but for rounding. off, scale: rad."""
    result.check(scene, f"elliptic function, scipy to {DIGITS} digits", off, FACTOR * EPS * scale, "rad", rounding=True)


def judge_orders(result, scene, errors) -> dict:
    """Checks: errors fall at the method's order. errors, orders: {(engine, integrator): ...}, rad, each step half the last.

    Measured between the last two errors above 1e-11 rad, below which rounding comes in.
    """
    orders = {}
    for (party, integrator), values in errors.items():
        order = METHODS[TWINS[integrator]].order
        clear = max(2, sum(value > ROUNDED for value in values))
        with np.errstate(divide="ignore", invalid="ignore"):
            orders[party, integrator] = float(np.log2(np.divide(values[clear - 2], values[clear - 1])))
        off = abs(orders[party, integrator] - order)
        where = f"{scene}, {integrator}, {party}"
        result.check(where, f"order of the error against the elliptic function, from {order}", off, ORDER_MARGIN, "")
    return orders


def small_oscillations(result, engine, amplitudes=AMPLITUDES, fine=FINE) -> None:
    """The whole arm let go near hanging: relative distance from the linear modes falls with the amplitude squared."""
    q, rest, away = posture("hanging"), np.zeros(3), np.ones(3)
    off = {"TMT": [], "MuJoCo": []}
    for amplitude in amplitudes:
        run = q + amplitude * away, rest, rest, DURATION / fine, fine
        t, ours, _ = tmt.simulate(*run)
        linear = small_oscillation(t, tmt.ARM, q, amplitude * away)
        for party, path in (("TMT", ours), ("MuJoCo", engine.trajectory(*run)[1])):
            off[party].append(float(np.abs(path - linear).max() / amplitude))
    powers = judge_modes(result, off)
    frequencies, _ = modes(tmt.ARM, q)
    result.curves["small"] = {
        "amplitude": np.array(amplitudes), "off": off, "frequencies": frequencies, "powers": powers, "duration": DURATION,
    }  # fmt: skip
    result.notes.append(
        f"About hanging the linear modes have {', '.join(f'{f:.4f}' for f in frequencies)} rad/s. Let go {amplitudes[-1]} rad "
        f"away in each hinge, TMT's arm is {off['TMT'][-1]:.2e} of that from them at most in {DURATION:g} s, MuJoCo's "
        f"{off['MuJoCo'][-1]:.2e}."
    )


def judge_modes(result, off) -> dict:
    """Checks: halving the amplitude divides the relative distance from the linear modes by 4. off, powers: by engine."""
    powers = {}
    for party, values in off.items():
        with np.errstate(divide="ignore", invalid="ignore"):
            powers[party] = float(np.log2(np.divide(values[-2], values[-1])))
        what = "power of the amplitude with which the distance from the linear modes falls, from 2"
        result.check(f"hanging, {party}", what, abs(powers[party] - 2.0), ORDER_MARGIN, "")
    return powers
