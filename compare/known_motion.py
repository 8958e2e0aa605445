"""Both engines against motions that are known exactly: the swing of the elbow, small oscillations about hanging."""

import numpy as np

import tmt
from tmt.methods import METHODS
from tmt.reference import distance

from .agreement import EPS, FACTOR
from .cost import INTEGRATORS
from .exact_motion import exact_swing, modes, pendulum, small_oscillation, swing
from .motion import ORDER_MARGIN, TWINS
from .scenes import SCENES, posture

SWINGS = (256, 512, 1024, 2048, 4096, 8192)  # steps
AMPLITUDES = (0.16, 0.08, 0.04, 0.02, 0.01)  # rad, each half of the one before
FINE = 8192  # steps, at which the error of RK4 is far below that of the linear modes


def swings(result, engine) -> None:
    """The elbow alone, a physical pendulum: errors against the elliptic function fall at the method's order."""
    scene = next(scene for scene in SCENES if scene.name == "elbow swing")
    (q,), (qd,) = scene.start
    numbers = pendulum(scene.model)
    t = np.linspace(0.0, scene.duration, SWINGS[0] + 1)
    exact = swing(t, q, qd, *numbers)
    off = distance(exact[::8], exact_swing(t[::8], q, qd, *numbers))
    # the angle itself, and what rounding of the argument makes of the fastest rate
    fastest = 2.0 * numbers[1]
    bar = FACTOR * EPS * (np.abs(exact).max() + fastest * scene.duration)
    result.check(scene.name, "elliptic function, scipy to 50 digits", off.max(), bar, "rad", rounding=True)
    errors = {}
    for integrator in INTEGRATORS:
        for steps in SWINGS:
            dt, every = scene.duration / steps, steps // SWINGS[0]
            _, ours, _ = tmt.simulate(*scene.start, scene.tau, dt, steps, TWINS[integrator], scene.model)
            _, theirs, _ = scene.engine(engine).trajectory(*scene.start, scene.tau, dt, steps, integrator)
            for party, path in (("TMT", ours), ("MuJoCo", theirs)):
                error = np.abs(path[::every, 0] - exact).max()
                errors.setdefault((party, integrator), []).append(float(error))
                if steps == 1024:
                    result.curves["apart"][scene.name, party, integrator] = float(error)
    for (party, integrator), values in errors.items():
        order = METHODS[TWINS[integrator]].order
        where = f"{scene.name}, {integrator}, {party}"
        off = abs(np.log2(values[-2] / values[-1]) - order)
        result.check(where, f"order of the error against the elliptic function, from {order}", off, ORDER_MARGIN, "")
    result.curves["swing"] = {"dt": scene.duration / np.array(SWINGS), "errors": errors}
    best = errors["TMT", "RK4"][-1], errors["MuJoCo", "RK4"][-1]
    result.notes.append(
        f"The elbow alone swings as a physical pendulum, small swings at {numbers[1]:.4f} rad/s. With {SWINGS[-1]} steps of RK4 "
        f"TMT is at most {best[0]:.2e} rad from the elliptic function and MuJoCo {best[1]:.2e} rad, in five seconds."
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
