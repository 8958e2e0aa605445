"""Both engines against motions that are known exactly: the swing of the elbow, small oscillations about hanging."""

import numpy as np

import tmt
from tmt.methods import METHODS
from tmt.reference import distance

from .agreement import EPS, FACTOR
from .cost import INTEGRATORS
from .exact_motion import exact_swing, modes, pendulum, small_oscillation, swing
from .motion import ORDER_MARGIN, TWINS
from .scenes import posture

SWINGS = (4, 8, 16, 32, 64, 128)  # times the scene's own steps
ROUNDED = 1e-11  # rad: smaller errors are not those of the method alone
COMPARED = 16  # of these, those of the runs in the table
AMPLITUDES = (0.16, 0.08, 0.04, 0.02, 0.01)  # rad, each half of the one before
FINE = 8192  # steps, at which the error of RK4 is far below that of the linear modes


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
    off = distance(exact[::8], exact_swing(t[::8], q, qd, hanging, frequency))
    # rounding of the angle itself, and of the argument times the fastest rate
    bar = FACTOR * EPS * (np.abs(exact).max() + 2.0 * frequency * scene.duration)
    result.check(scene.name, "elliptic function, scipy to 50 digits", off.max(), bar, "rad", rounding=True)
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
    found = {}
    for (party, integrator), values in errors.items():
        order = METHODS[TWINS[integrator]].order
        clear = max(2, sum(value > ROUNDED for value in values))
        found[party, integrator] = np.log2(values[clear - 2] / values[clear - 1])
        off = abs(found[party, integrator] - order)
        where = f"{scene.name}, {integrator}, {party}"
        result.check(where, f"order of the error against the elliptic function, from {order}", off, ORDER_MARGIN, "")
    result.curves["swings"][scene.name] = {
        "dt": scene.duration / scene.steps / np.array(SWINGS),
        "errors": errors,
        "orders": found,
    }
    best = {party: errors[party, "RK4"][-1] for party in ("TMT", "MuJoCo")}
    result.notes.append(
        f"{scene.name}: a physical pendulum, whose small swings have {frequency:.4f} rad/s. With {steps} steps of RK4 TMT "
        f"is at most {best['TMT']:.2e} rad from the elliptic function, and MuJoCo {best['MuJoCo']:.2e} rad, in "
        f"{scene.duration:g} s."
    )


def small_oscillations(result, engine) -> None:
    """The whole arm let go near hanging: relative distance from the linear modes falls with the amplitude squared."""
    q, rest, away = posture("hanging"), np.zeros(3), np.ones(3)
    duration = 5.0
    off = {"TMT": [], "MuJoCo": []}
    for amplitude in AMPLITUDES:
        run = q + amplitude * away, rest, rest, duration / FINE, FINE
        t, ours, _ = tmt.simulate(*run)
        linear = small_oscillation(t, tmt.ARM, q, amplitude * away)
        for party, path in (("TMT", ours), ("MuJoCo", engine.trajectory(*run)[1])):
            off[party].append(float(np.abs(path - linear).max() / amplitude))
    for party, values in off.items():
        power = np.log2(values[-2] / values[-1])
        what = "power of the amplitude with which the distance from the linear modes falls, from 2"
        result.check(f"hanging, {party}", what, abs(power - 2.0), ORDER_MARGIN, "")
    frequencies, _ = modes(tmt.ARM, q)
    result.curves["small"] = {"amplitude": np.array(AMPLITUDES), "off": off, "frequencies": frequencies}
    result.notes.append(
        f"About hanging the linear modes have {', '.join(f'{f:.4f}' for f in frequencies)} rad/s. Let go {AMPLITUDES[-1]} rad "
        f"away in each hinge, TMT's arm is {off['TMT'][-1]:.2e} of that from them at most in five seconds, MuJoCo's "
        f"{off['MuJoCo'][-1]:.2e}."
    )
