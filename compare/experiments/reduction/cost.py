"""What each thing that is added to the minimal model costs in MuJoCo, and whether it changes the motion."""

import numpy as np

from . import engine_cost
from .clock import fastest
from .scenes import SCENES

TIMED = 128  # steps of a timed run: short enough to pass between the interruptions of a machine that is in use
INTEGRATORS = ("Euler", "RK4")
SETTLED = 0.5  # N m s/rad, with which the arm comes to rest on the floor


def costs(result, engine, rounds) -> None:
    """A table: time of a step with each thing added, as a ratio to the minimal model, and bits of five seconds."""
    engines = engine_cost.with_additions(engine)
    scene = next(scene for scene in SCENES if scene.name == "bent, free")
    dt, steps = scene.duration / 1024, 1024
    # all are timed from where the arm rests on the floor that is in reach, so that there the contact stays
    on_floor = engines[engine_cost.CONTACT].variant(damping=SETTLED)
    _, *rest = on_floor.trajectory(*scene.start, scene.tau, dt, steps, "Euler")
    rest = [path[-1] for path in rest]
    runs = {
        (name, integrator): engine.runner(*rest, scene.tau, dt, TIMED, integrator)[1]
        for name, engine in engines.items()
        for integrator in INTEGRATORS
    }
    seconds = fastest(runs, rounds)
    paths, touching = {}, {}
    for name, integrator in runs:
        path = engines[name].trajectory(*scene.start, scene.tau, dt, steps, integrator)[1:]
        paths[name, integrator] = np.concatenate(path, axis=1)
        touching[name, integrator] = engine_cost.contacts(engines[name], *rest, scene.tau, dt, TIMED, integrator)
    result.tables["cost_in_mujoco"] = table(seconds, paths, touching)
    judge(result, f"{scene.name}, dt = 5/{steps} s", result.tables["cost_in_mujoco"])


def table(seconds, paths, touching) -> list[dict]:
    """The rows, by integrator, from what is known of each (addition, integrator).

    seconds: of a run of 128 steps; paths: (steps + 1, 2 n), rad and rad/s; touching: contacts in a step.
    """
    rows = []
    for name, integrator in sorted(paths, key=lambda key: INTEGRATORS.index(key[1])):
        path, minimal = paths[name, integrator], paths[engine_cost.NOTHING, integrator]
        apart = np.abs(path - minimal)[:, : path.shape[1] // 2].max()
        taken = seconds[name, integrator]
        rows.append(
            {
                "added": name,
                "integrator": integrator,
                "ns_per_step": 1e9 * taken / TIMED,
                "ratio": taken / seconds[engine_cost.NOTHING, integrator],
                "contacts_per_step": touching[name, integrator],
                "same_bits": np.array_equal(path, minimal),
                "max_difference_rad": float(apart) if np.isfinite(apart) else None,
            }
        )
    return rows


def judge(result, where, rows) -> None:
    """Checks: what exerts no force leaves the bits of the motion, and the floor in reach does not.

    The minimal model itself, which is timed twice, is not compared with its own copy.
    """
    for row in rows:
        changed, scene = int(not row["same_bits"]), f"{where}, {row['integrator']}"
        if row["added"] == engine_cost.CONTACT:
            result.check(scene, f"another motion with {row['added']}", changed, 1, "runs that differ", rule="equal")
        elif row["added"] not in (engine_cost.NOTHING, engine_cost.AGAIN):
            result.check(scene, f"the same bits with {row['added']}", changed, 0, "runs that differ", rule="equal")
