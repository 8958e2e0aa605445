"""Both engines against motions that are known exactly: swings of a single free joint, small oscillations about an equilibrium."""

from collections.abc import Mapping, Sequence

import numpy as np

import tmt
from tmt import literal
from tmt.exact.values import DIGITS, distance

from ...engines import LABELS
from ...judge.check import About, Result
from ...judge.run import MOVES, ORDER_MARGIN
from ...judge.scale import EPS, FACTOR, gravity_scale, mass_scale
from ...robots import Robot
from ...robots.case import SEED, Case
from ...truth.linear import held, modes, small_oscillation
from ...truth.pendulum import exact_swing, pendulum, swing
from ..setup import Setup
from .times import TWO_INTEGRATORS, method_of

SWING_STEPS = (4, 8, 16, 32, 64, 128)  # times the case's own steps
MOST_SWING_STEPS = 2**20  # finer steps show rounding and no order
DIGITS_AT = 32  # equal times at which the elliptic function is compared with that of many digits
ROUNDED = 1e-11  # rad: smaller errors are not those of the method alone
MUCH, NO_FORCE = 0.1, 1e-9  # of the largest torque of a swing, that at its start: above, below
IN_TABLE = 16  # of the SWING_STEPS, those that the table has
AMPLITUDES = (0.16, 0.08, 0.04, 0.02, 0.01)  # rad, each half of the one before
OSCILLATION, MOST_TURNED = 5.0, 60.0  # s; rad, by which the fastest mode may turn in it at most
MOST_MODES = 12  # hinges: runs of more take long
OSCILLATION_STEPS, LESS_FINE = 8192, 1024  # at which the error of RK4 is far below that of the linear modes


# a single free joint


def swings(result: Result, setup: Setup, cases: Sequence[Case]) -> None:
    """Each case in which one joint is free, a physical pendulum, against its elliptic function."""
    for case in pendulums(cases):
        t = times_of(case)
        exact = elliptic(case, t)
        if reason := not_compared(case, exact):
            result.notes.append(f"{case.name}: not compared with an elliptic function, for {reason}.")
        else:
            of_pendulum(result, setup, case, t, exact)


def pendulums(cases: Sequence[Case]) -> list[Case]:
    """The cases in which one hinge is free and nothing but gravity acts."""
    found = []
    for case in cases:
        tree, alone = case.tree, len(case.joints) == 1 and case.coordinates.all_kinds == ("hinge",)
        if alone and case.is_free and case.scene.gravity and not any(tree.damping) and not tree.has_springs:
            found.append(case)
    return found


def is_compared(case: Case) -> bool:
    """Whether a pendulum shows something beside its exact motion."""
    return not_compared(case, elliptic(case, times_of(case))) is None


def times_of(case: Case) -> np.ndarray:
    """The times at which a pendulum is compared with its elliptic function, s."""
    return np.linspace(0.0, case.duration, SWING_STEPS[0] * case.steps + 1)


def elliptic(case: Case, t: np.ndarray) -> np.ndarray:
    """The exact angle at times t in s, rad; NaN of one that turns over."""
    (q,), (v,) = case.start
    hanging, frequency = pendulum(case.tree)
    return swing(t, q, v, hanging, frequency) if frequency else np.full_like(t, np.nan)


def not_compared(case: Case, exact: np.ndarray) -> str | None:
    """Why a pendulum shows nothing beside its exact motion, (times,) rad, or None."""
    if not np.isfinite(exact).all():
        return "it turns over"
    if np.ptp(exact) < MOVES:
        return f"it moves by {np.ptp(exact):.1e} rad only"
    if SWING_STEPS[-1] * case.steps > MOST_SWING_STEPS:
        return f"its {case.steps} steps are so fine that rounding hides the order"
    return None


def of_pendulum(result: Result, setup: Setup, case: Case, t: np.ndarray, exact: np.ndarray) -> None:
    """Errors of both engines against the elliptic function, which fall at the method's order; that function's own."""
    (q,), (v,) = case.start
    hanging, frequency = pendulum(case.tree)
    few = slice(None, None, len(t) // DIGITS_AT)
    off = distance(exact[few], exact_swing(t[few], q, v, hanging, frequency)).max()
    # rounding of the angle itself, and of the argument times the fastest rate
    check_function(result, case.name, off, np.abs(exact).max() + 2.0 * frequency * case.duration)
    engines, errors, stated = setup.compared(case), {}, {}
    for integrator in TWO_INTEGRATORS:
        stated[integrator] = order_from(setup.engines["mujoco"].methods[integrator].order, exact - hanging)
        for finer in SWING_STEPS:
            steps = finer * case.steps
            for engine, dynamics in engines.items():
                method = method_of(setup.engines, integrator, engine)
                path = dynamics.run(*case.start, case.tau, case.duration / steps, steps, method).q
                error = float(np.abs(path[:: finer // SWING_STEPS[0], 0] - exact).max())
                errors.setdefault((engine, integrator), []).append(error)
                if finer == IN_TABLE:
                    result.curves["apart"][case.name, engine, integrator] = error
    orders = check_falling(result, case.name, errors, stated)
    dt = case.duration / case.steps / np.array(SWING_STEPS)
    result.curves["swings"][case.name] = {"dt": dt, "errors": errors, "orders": orders, "stated": stated}
    ours, theirs = (errors[engine, "RK4"][-1] for engine in ("tmt", "mujoco"))
    result.notes.append(
        f"{case.name}: a physical pendulum, whose small swings have {frequency:.4f} rad/s. With {steps} steps of RK4 TMT "
        f"is at most {ours:.2e} rad from the elliptic function, and MuJoCo {theirs:.2e} rad, in {case.duration:g} s."
    )


def order_from(order: int, angles: np.ndarray) -> int | None:
    """The order of the error that a method of an order shows in a swing, of angles from where it hangs, (times,) rad.

    Semi-implicit Euler is leapfrog, of order 2, except for half a kick at the start: where no force acts there, its error has
    that order; where little does, none, for one part is as large as the other (None).
    """
    force = np.abs(np.sin(angles))
    if order > 1 or force[0] >= MUCH * force.max():
        return order
    return 2 if force[0] <= NO_FORCE * force.max() else None


def check_function(result: Result, scene: str, off: float, scale: float) -> None:
    """A check: the elliptic function in doubles is that with 50 digits, except for rounding. off, scale: rad."""
    what = f"elliptic function, scipy to {DIGITS} digits"
    result.check(scene, what, off, FACTOR * EPS * scale, "rad", rounding=True, about=About.PREDICTION)


def check_falling(
    result: Result, scene: str, errors: Mapping[tuple, Sequence[float]], stated: Mapping[str, int | None]
) -> dict:
    """Checks: errors fall at the method's order. errors: {(engine, integrator): rad, each step half the last}; orders found.

    stated: the order of each integrator, None where it has none. Measured between the last two errors above 1e-11 rad, below
    which rounding comes in; where there are no two, no order can be measured.
    """
    orders = {}
    for (engine, integrator), values in errors.items():
        clear = np.argmin([*(not value <= ROUNDED for value in values), False])  # so many, from the first on
        where, order = f"{scene}, {integrator}, {LABELS[engine]}", stated[integrator]
        if order is None:
            result.notes.append(f"{where}: the error has no order, for the torque at the start is small and not zero.")
            continue
        if clear < 2:
            result.notes.append(f"{where}: no order can be measured, the errors of so fine steps are rounding.")
            continue
        with np.errstate(divide="ignore", invalid="ignore"):
            orders[engine, integrator] = float(np.log2(np.divide(values[clear - 2], values[clear - 1])))
        off = abs(orders[engine, integrator] - order)
        what = f"order of the error against the elliptic function, from {order}"
        result.check(where, what, off, ORDER_MARGIN, "", about=About.PREDICTION)
    return orders


# an equilibrium


def small_oscillations(
    result: Result, setup: Setup, amplitudes: Sequence[float] = AMPLITUDES, steps: int = OSCILLATION_STEPS
) -> None:
    """The whole robot let go near an equilibrium: relative distance from the linear modes falls with the amplitude squared."""
    robot, tree = setup.robot, setup.robot.tree
    posture = equilibrium(robot)
    if posture is None:
        why = not_linear(tree) or "no named posture is stable without a torque"
        result.notes.append(f"Small oscillations of the {robot.noun} are not compared with its linear modes: {why}.")
        return
    q, rest, away = robot.posture(posture), np.zeros(len(robot.joints)), np.ones(len(robot.joints))
    frequencies, _ = modes(tree, q)
    duration = min(OSCILLATION, MOST_TURNED / frequencies[-1])
    sides, dt = (1.0,) if odd(tree, q) else (1.0, -1.0), duration / steps
    off = {"tmt": [], "mujoco": []}
    for amplitude in amplitudes:
        linear = small_oscillation(dt * np.arange(steps + 1), tree, q, amplitude * away)
        for engine, dynamics in setup.compared().items():
            method = method_of(setup.engines, "RK4", engine)
            starts = [q + side * amplitude * away for side in sides]
            paths = [dynamics.run(start, rest, rest, dt, steps, method).q for start in starts]
            path = paths[0] if len(paths) == 1 else q + (paths[0] - paths[1]) / 2.0
            off[engine].append(float(np.abs(path - linear).max() / amplitude))
    powers = check_modes(result, posture, off)
    result.curves["small"] = {
        "posture": posture, "amplitude": np.array(amplitudes), "off": off, "frequencies": frequencies, "powers": powers,
        "duration": duration, "sides": len(sides),
    }  # fmt: skip
    result.notes.append(
        f"About {posture} the linear modes have {', '.join(f'{f:.4f}' for f in frequencies)} rad/s. Let go {amplitudes[-1]} rad "
        f"away in each hinge, TMT's {robot.name} is {off['tmt'][-1]:.2e} of that from them at most in {duration:.3g} s, MuJoCo's "
        f"{off['mujoco'][-1]:.2e}."
    )


def equilibrium(robot: Robot) -> str | None:
    """The named posture that needs no torque and is stable, the one of least potential energy; None: there is none.

    None of a robot whose modes are not those of `truth.linear` either.
    """
    tree = robot.tree
    if not_linear(tree):
        return None
    names = [*robot.postures, *robot.positions]
    torques = {name: np.abs(literal.gravity_balance(robot.posture(name), tree)).max() for name in names}
    rest = [name for name, torque in torques.items() if torque <= FACTOR * EPS * gravity_scale(tree)]
    stable = [name for name in rest if held(robot, name).kind == "centre"]
    return min(stable, key=lambda name: float(literal.potential_energy(robot.posture(name), tree)), default=None)


def not_linear(tree: tmt.Tree) -> str | None:
    """Why small oscillations of a Tree are not compared with its linear modes, or None."""
    if any(tree.damping):
        return "it has damping"
    if set(tree.kind) != {"hinge"} or tree.has_springs:
        return "it has other joints than hinges, or springs"
    return f"it has {len(tree.axis)} joints" if len(tree.axis) > MOST_MODES else None


def odd(tree: tmt.Tree, q: np.ndarray) -> bool:
    """Whether a motion about q, (n,) rad, that starts on the other side is the mirrored one: its distance from the linear modes
    goes with the amplitude squared. Else half the difference of the two motions does.

    That is, whether Mbar is the same and the torque of gravity the opposite on the other side, at random places.
    """
    away = np.random.default_rng(SEED).uniform(-1.0, 1.0, (3, len(q)))
    masses, torques = (
        [f(q + side * away, tree) for side in (1, -1)] for f in (literal.mass_matrix, literal.gravity_balance)
    )
    same = np.abs(masses[0] - masses[1]).max(axis=(1, 2)) <= FACTOR * EPS * mass_scale(tree, q + away)
    opposite = np.abs(torques[0] + torques[1]).max(axis=1) <= FACTOR * EPS * gravity_scale(tree)
    return bool(same.all() and opposite.all())


def check_modes(result: Result, posture: str, off: Mapping[str, Sequence[float]]) -> dict:
    """Checks: halving the amplitude divides the relative distance from the linear modes by 4. off, powers: by engine."""
    powers = {}
    for engine, values in off.items():
        with np.errstate(divide="ignore", invalid="ignore"):
            powers[engine] = float(np.log2(np.divide(values[-2], values[-1])))
        what = "power of the amplitude with which the distance from the linear modes falls, from 2"
        where, off = f"{posture}, {LABELS[engine]}", abs(powers[engine] - 2.0)
        result.check(where, what, off, ORDER_MARGIN, "", about=About.PREDICTION)
    return powers
