"""Rows of speed whose conclusions are known: for test_judge_speed and test_speed_costs."""

from compare.experiments.speed.evaluations import EACH, EQUAL, FORWARD, IN_LANES, MJ_STEP, RK4_STEP, WAITING, WHOLE

NS = {
    (FORWARD, WHOLE, 1, 1): 1000.0, (FORWARD, EQUAL, 1, 1): 500.0, (RK4_STEP, MJ_STEP, 1, 1): 4000.0,
    (FORWARD, WAITING, 1, 1): 50.0, (FORWARD, EACH, 1000, 1): 25.0, (FORWARD, IN_LANES, 1000, 1): 10.0,
    (RK4_STEP, EACH, 1, 1): 200.0, (RK4_STEP, IN_LANES, 1000, 1): 40.0,
}  # fmt: skip


def row(engine, method, error, steps=64, seconds=1e-3, **more):
    """A row of speed: diverged where the error is None."""
    return {
        "scene": "bent, free", "engine": engine, "method": method, "dt_s": 5.0 / steps, "tolerance": None, "steps": steps,
        "evaluations": 4 * steps, "seconds": seconds, "error_rad": error, "worst_error_rad": error, "energy_error_J": error,
        "diverged": error is None, "why_not": None, "early": error, "whole": None,
    } | more  # fmt: skip


def known_rows():
    """MuJoCo's RK4 20 times slower than tmt's; of its integrators Euler is never as near; dopri8 needs fewest steps."""
    rows = []
    for k in range(5):
        steps, error = 64 << k, 2e-2 / 16**k
        rows += [row("mujoco", "RK4", error, steps, 20e-3 * 2**k), row("tmt", "rk4", error, steps, 1e-3 * 2**k)]
        rows += [
            row("mujoco", "Euler", 0.5 / 2**k, steps, 4e-3 * 2**k),
            row("tmt", "dopri8", error**2, steps, 2e-3 * 2**k),
        ]
    return [*rows, row("scipy", "DOP853", 1e-9, 500, 1e-4), row("mujoco", "implicit", None, 64, 1e-9)]
