"""Torques that are functions of (t, q, qd): gains of the model where they are linear, else asked at each stage."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from tmt.answers import answered
from tmt.compiled.evaluator import SMALL, Evaluator
from tmt.compiled.trace import Expression, Tape
from tmt.derivation.vectors import Values
from tmt.methods.derivatives import COMPOSITE
from tmt.methods.stepping import DIVERGED, Dynamics, Method
from tmt.model.tree import Tree
from tmt.model.values import real_numbers, shown

Array = np.ndarray
Torque = Callable[[float, Array, Array], ArrayLike]
TRIED = 3  # states at which gains are compared with the function
ROUNDED = 1e-9  # relative: as near the gains are then


def as_gains(model: Tree, torque: Torque) -> tuple[Tree, Array, Torque | None]:
    """The model with a torque that is linear in q and qd as its gains, the constant part (nv,), and None.

    Else the model as it is, zeros, and the torque.
    """
    driven = with_gains(model, torque)
    return (*driven, None) if driven else (model, np.zeros(model.nv), torque)


def with_gains(model: Tree, torque: Torque) -> tuple[Tree, Array] | None:
    try:
        law = linear(model, torque)
    except Exception:  # whatever a user's function raises of arguments that are no numbers
        return None
    if law is None:
        return None
    constant, by_q, by_qd = law
    first = np.array(model.coordinates.first_positions)
    of_balls = [k for joint in model.coordinates.balls for k in range(joint.q.start, joint.q.stop)]
    if by_q[:, of_balls].any():
        return None
    nothing = np.zeros((model.nv, model.nv))
    gains = {"position_gain": by_q[:, first], "speed_gain": by_qd}
    try:
        stated = {name: np.array(getattr(model, name) or nothing) - gain for name, gain in gains.items()}
        driven = replace(model, **stated)
    except ValueError:  # of the speeds of a ball
        return None
    rng = np.random.default_rng(0)
    for _ in range(TRIED):
        t, (q, qd) = float(rng.normal()), rng.normal(size=(2, model.nq))
        expected = constant + by_q @ q + by_qd @ qd[: model.nv]
        found = checked(model, torque, t, q, qd[: model.nv])
        if not np.allclose(found, expected, rtol=ROUNDED, atol=ROUNDED):
            return None
    return driven, constant


def linear(model: Tree, torque: Torque) -> tuple[Array, Array, Array] | None:
    """The constant part and the factors of q and qd, from a trace of the function; None where it is not linear."""
    tape, nq, nv = Tape(), model.nq, model.nv
    inputs = tape.inputs(*range(1 + nq + nv))
    arrays = (np.array(part, dtype=object) for part in (inputs[1 : 1 + nq], inputs[1 + nq :]))
    rows = [factors(tape, tape.lift(x), len(inputs)) for x in np.ravel(torque(inputs[0], *arrays))]  # type: ignore[arg-type]
    if any(row is None for row in rows) or len(rows) != nv:
        return None
    matrix = np.array(rows)
    return None if matrix[:, 1].any() else (matrix[:, 0], matrix[:, 2 : 2 + nq], matrix[:, 2 + nq :])


def factors(tape: Tape, x: Expression, inputs: int) -> Array | None:
    """A constant and the factor of each input, (1 + inputs,), of a linear expression; else None."""
    operation, arguments = tape.nodes[x.i]
    row = np.zeros(1 + inputs)
    if operation == "number":
        row[0] = arguments[0]
        return row
    if operation == "input":
        row[1 + arguments[0]] = 1.0
        return row
    if operation not in ("+", "-", "neg", "*", "/"):
        return None
    parts = [factors(tape, Expression(tape, i), inputs) for i in arguments]
    rows = [part for part in parts if part is not None]
    if len(rows) < len(parts):
        return None
    if operation in ("*", "/"):
        numbers = [k for k, part in enumerate(rows) if not part[1:].any()]
        if not numbers or (operation == "/" and 1 not in numbers):
            return None
        number = rows[numbers[-1]][0]
        return rows[1 - numbers[-1]] * (number if operation == "*" else 1.0 / number)
    return {"neg": np.negative, "+": np.add, "-": np.subtract}[operation](*rows)


def checked(model: Tree, torque: Torque, t: float, q: Array, qd: Array) -> Array:
    """The torque at a state, (nv,); ValueError for what is none."""
    given = torque(t, q, qd)
    tau = real_numbers(given)
    if tau is None or tau.shape != (model.nv,):
        expected = f"numbers of shape ({model.nv},) are expected"
        raise ValueError(f"tau(t, q, qd) is {shown(given)}; {expected}")
    return tau


def follow(
    model: Tree, stepping: Method, torque: Torque, q: Array, qd: Array, dt: float, every: int
) -> tuple[Array, int]:
    """Fill the paths q (runs, records, nq) and qd step by step: why and where each run ended, evaluations.

    As Runner.follow; the function is asked with one state at a time, at each stage of a step.
    """
    steps, codes, evaluations = (q.shape[1] - 1) * every, np.zeros((len(q), 2), np.int64), 0
    times = getattr(stepping, "c", (0.0,))
    is_plain = type(stepping).slope is Method.slope
    many = is_plain and len(q) * steps * stepping.stages > SMALL
    evaluator, dynamics = Evaluator(model, "acceleration") if many else None, Dynamics(COMPOSITE)

    def slope_at(begun: float) -> Callable[[Values, Values], Values]:
        stages = iter(times)

        def slope(q: Values, qd: Values) -> Values:
            nonlocal evaluations
            evaluations += 1
            state = np.array(q, float), np.array(qd, float)
            if not (np.isfinite(state[0]).all() and np.isfinite(state[1]).all()):
                raise OverflowError
            tau = checked(model, torque, begun + next(stages) * dt, *state)
            if not is_plain:
                return stepping.slope(model, q, qd, list(tau), dt, dynamics)
            try:
                result = (
                    evaluator.of_one(*state, tau)
                    if evaluator
                    else answered("acceleration", model, *state, tau)
                )
                return result.tolist()
            except (ValueError, AttributeError):  # not finite, or Mbar is singular
                raise OverflowError from None

        return slope

    for run in range(len(q)):
        state = q[run, 0].tolist(), qd[run, 0].tolist()
        q[run, 1:], qd[run, 1:] = np.nan, np.nan
        for step in range(steps):
            try:
                state = stepping.step(slope_at(step * dt), *state, dt, model.coordinates)
            except (OverflowError, ZeroDivisionError):
                codes[run] = DIVERGED, step
                break
            if (step + 1) % every == 0:
                q[run, (step + 1) // every], qd[run, (step + 1) // every] = state
    return codes, evaluations
