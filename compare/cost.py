"""What each thing that is added to the minimal model costs in MuJoCo, and whether it changes the motion."""

import numpy as np

from . import engine_cost
from .clock import fastest
from .scenes import SCENES

TIMED = 128  # steps of a timed run: short enough to pass between the interruptions of a machine that is in use
ROUNDS, QUICK_ROUNDS = 160, 16  # of the timing
INTEGRATORS = ("Euler", "RK4")
SETTLED = 0.5  # N m s/rad, with which the arm comes to rest on the floor


def costs(result, setup) -> None:
    """A table: time of a step with each thing added, as a ratio to the minimal model, and bits of five seconds."""
    engines = engine_cost.with_additions(setup.engine)
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
    seconds = fastest(runs, QUICK_ROUNDS if setup.is_quick else ROUNDS)
    rows = result.tables["cost_in_mujoco"] = []
    for integrator in INTEGRATORS:
        paths = {
            name: np.concatenate(engine.trajectory(*scene.start, scene.tau, dt, steps, integrator)[1:])
            for name, engine in engines.items()
        }
        minimal = paths[engine_cost.NOTHING]
        for name, path in paths.items():
            apart = np.abs(path - minimal)[: steps + 1].max()
            same = np.array_equal(path, minimal)
            rows.append(
                {
                    "added": name,
                    "integrator": integrator,
                    "ns_per_step": 1e9 * seconds[name, integrator] / TIMED,
                    "ratio": seconds[name, integrator] / seconds[engine_cost.NOTHING, integrator],
                    "contacts_per_step": engine_cost.contacts(engines[name], *rest, scene.tau, dt, TIMED, integrator),
                    "same_bits": same,
                    "max_difference_rad": float(apart) if np.isfinite(apart) else None,
                }
            )
            where = f"{scene.name}, {integrator}, dt = 5/{steps} s"
            if name == engine_cost.CONTACT:
                result.check(where, f"{name}: the motion is the same as without", same, 0.0, "runs")
            elif name != engine_cost.NOTHING:
                result.check(where, f"{name}: not the same bits as without", not same, 0.0, "runs")
