"""Torques that are functions of (t, q, qd): gains of the model where they are linear, else asked at each stage."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from tmt.answers import answered
from tmt.compiled.evaluator import SMALL, Evaluator
from tmt.compiled.trace import Tape
from tmt.derivation.dual import jacobian
from tmt.derivation.form import COMPOSITE
from tmt.derivation.vectors import Values
from tmt.methods.stepping import DIVERGED, Method
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
    nq, nv, nothing = model.nq, model.nv, np.zeros(model.nv)
    first = np.array(model.coordinates.first_positions)
    try:  # the derivatives of a trace are numbers where the function is linear
        tape, zero = Tape(), np.array(model.zero)
        rows = jacobian(lambda x: by_place(torque, x, nq), tape.inputs(*range(1 + nq + nv)))
        by = np.array([[tape.lift(x).number for x in row] for row in rows], dtype=float)
        by_q, by_qd = by[:, 1 + first], by[:, 1 + nq :]
        stated = {"position_gain": (model.position_gain, by_q), "speed_gain": (model.speed_gain, by_qd)}
        gains = {name: np.array(own or np.zeros((nv, nv))) - gain for name, (own, gain) in stated.items()}
        driven = replace(model, **gains)
        constant = checked(model, torque, 0.0, zero, nothing) - by_q @ zero[first]
    except Exception:  # whatever a user's function raises of arguments that are no numbers; gains of a ball
        return model, nothing, torque
    rng = np.random.default_rng(0)
    for _ in range(TRIED):
        x = rng.normal(size=1 + nq + nv)
        expected = constant + by_q @ x[1 + first] + by_qd @ x[1 + nq :]
        found = checked(model, torque, float(x[0]), x[1 : 1 + nq], x[1 + nq :])
        if not np.allclose(found, expected, rtol=ROUNDED, atol=ROUNDED):
            return model, nothing, torque
    return driven, constant, None


def by_place(torque: Torque, x: Values, nq: int) -> Values:
    state = (np.array(part, dtype=object) for part in (x[1 : 1 + nq], x[1 + nq :]))
    return list(np.ravel(torque(x[0], *state)))


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
    times, is_plain = getattr(stepping, "c", (0.0,)), type(stepping).slope is Method.slope
    many = is_plain and len(q) * steps * stepping.stages > SMALL
    evaluator = Evaluator(model, "acceleration") if many else None

    def slope_at(begun: float) -> Callable[[Values, Values], Values]:
        stages = iter(times)

        def slope(q: Values, qd: Values) -> Values:
            nonlocal evaluations
            evaluations += 1
            state = np.array(q, float), np.array(qd, float)
            if not np.isfinite(np.concatenate(state)).all():
                raise OverflowError
            tau = checked(model, torque, begun + next(stages) * dt, *state)
            if not is_plain:
                return stepping.slope(model, q, qd, list(tau), dt, COMPOSITE)
            try:
                of = evaluator.of_one if evaluator else lambda *x: answered("acceleration", model, *x)
                return of(*state, tau).tolist()
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
