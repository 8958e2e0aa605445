"""How a small deviation grows in a run: as a whole, and in one step along the mode that grows most."""

from collections.abc import Mapping, Sequence

import numpy as np

from ...engines import Engine, Method
from ...judge.run import deviation, number_or_none
from ...truth.linear import Held

LINEAR_DEVIATION = 1e-6  # rad, at the start
GROWTH_STEPS = 2000  # of a run
# where growth per step is compared: rad, of the deviation; how much it may grow; in at most how many steps
TINY_DEVIATION, TOTAL_GROWTH, MOST_GROWTH_STEPS = 1e-8, 1e3, 200
MOST_OF_A_STEP = (
    100.0  # fold: a step that multiplies a deviation by more takes the run out of the reach of a linear motion
)


def growth_in_run(
    method: Method,
    engines: Mapping[str, Engine],
    at: Held,
    direction: np.ndarray,
    dt: float,
    size: float = LINEAR_DEVIATION,
    steps: int = GROWTH_STEPS,
) -> float:
    """The largest deviation of a run over that at its start, which is size x direction, rad; inf if it diverged."""
    dynamics, start = engines[method.engine].of(at.case), at.moved(size * direction)
    with np.errstate(over="ignore", invalid="ignore"):
        motion = dynamics.run(start, np.zeros(at.nv), at.tau, float(dt), steps, method.name)
        return deviation(at.away(motion.q), 0.0) / size


def growth_per_step(method: Method, engines: Mapping[str, Engine], at: Held, dt: float) -> dict:
    """How much the fastest-growing mode grows in one step: in a run, by its share in the deviation, and predicted."""
    predicted, shape, measure = at.fastest_growing(method.scheme, dt)
    steps = int(np.clip(np.log(TOTAL_GROWTH) / np.log(predicted), 2, MOST_GROWTH_STEPS))
    n, start, dynamics = at.nv, TINY_DEVIATION * shape.real, engines[method.engine].of(at.case)
    with np.errstate(over="ignore", invalid="ignore"):
        motion = dynamics.run(at.moved(start[:n]), start[n:], at.tau, dt, steps, method.name)
        share = np.abs(np.concatenate([at.away(motion.q), motion.v], axis=1) @ measure)
        total = share[-1] / share[0]
    return {
        "scene": at.name, "engine": method.engine, "method": method.name, "dt_s": dt, "mode_per_s": at.rate(shape),
        "predicted_growth": predicted, "observed_growth": number_or_none(total ** (1.0 / steps)),
        "steps": steps, "total_off": float(np.abs(total / predicted**steps - 1.0)),
    }  # fmt: skip


def map_of_growth(
    method: Method, engines: Mapping[str, Engine], at: Held, dts: Sequence[float], steps: int = GROWTH_STEPS
) -> np.ndarray:
    """Growth of the deviation in so many steps along the stiffest mode of a posture, for each dt."""
    direction = stiffest(at)[1]
    return np.array([growth_in_run(method, engines, at, direction, dt, steps=steps) for dt in dts])


def stiffest(at: Held) -> tuple[float, np.ndarray]:
    """Rate, rad/s, and angles (largest 1 rad) of the fastest swinging mode; a rate of 0: no mode swings."""
    values, vectors = at.modes
    n, k = at.nv, int(np.argmax(values.imag))
    angles = (vectors[:n, k] / vectors[np.argmax(np.abs(vectors[:n, k])), k]).real
    return float(values[k].imag), angles / np.abs(angles).max()


def growth_per_step_in_words(rows: list[dict]) -> list[str]:
    """How far the growth of one step is from the predicted one, where a method always fails."""
    if not rows:
        return ["No method fails at every step in these scenes."]
    off = [abs(row["observed_growth"] / row["predicted_growth"] - 1.0) for row in rows if row["observed_growth"]]
    where = ", ".join(dict.fromkeys(row["scene"] for row in rows))
    return [
        f"Where a method fails at every step ({where}), the growth of one step is predicted and measured, {len(rows)} "
        f"times: {f'largest difference {max(off):.1e}, relative' if off else 'no run gives a number'}"
        + (f"; runs without a number: {len(rows) - len(off)}." if off and len(off) < len(rows) else ".")
    ]
