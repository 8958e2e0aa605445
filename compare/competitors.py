"""Who takes part in the comparison of speed and accuracy: each follows a scene with one setting, again and again.

A competitor is a value: its engine, its method, its settings, and `prepare(scene, setting)`, which returns two calls:
`run()` follows the motion once more and does nothing else; `read(result)` is what of it is judged.
"""

from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import partial
from typing import NamedTuple

import numpy as np

from tmt import kernels
from tmt.implicit import ImplicitRungeKutta
from tmt.methods import METHODS, AdaptiveRungeKutta

from .engine import INTEGRATORS, Engine
from .motion import SCHEMES, TWINS

GRID = 64  # steps of the coarsest run, and of the grid on which runs are judged
FINEST = {"RK4": 2**17}  # steps beyond which a run would take too long to be timed again and again
FINEST_MUJOCO, FINEST_TMT, FINEST_IMPLICIT = 2**16, 2**18, 2**15
FEW, FEW_OTHERS = {"quick": 5, "small": 7}, 2  # settings of a run that is not full: the coarsest; of SciPy and heyoka
NEARER = slice(3, 7)  # of the settings: coarse ones that come near the reference where the motion is tame
TOLERANCES = tuple(10.0**-k for k in range(2, 15))
SCIPY = {"RK45": 12, "DOP853": 13, "Radau": 6, "LSODA": 12}  # the finest tolerance, 10^-k
ORDERS = {"RK4": 4, "RK45": 5, "DOP853": 8, "Radau": 5}  # of MuJoCo's integrators the others have order 1


class Setting(NamedTuple):
    """A step or a tolerance."""

    steps: int | None = None
    tolerance: float | None = None


class Outcome(NamedTuple):
    """What is judged of a run."""

    q: np.ndarray  # (65, n) rad; NaN from where it diverged
    qd: np.ndarray  # (65, n) rad/s
    steps: int | None
    evaluations: int | None  # of the right-hand side; None where a method has no such thing


@dataclass(frozen=True)
class Competitor:
    """One method of one engine."""

    engine: str  # mujoco, tmt, scipy, heyoka
    method: str
    order: int | None  # None for an adaptive method
    settings: tuple
    prepare: Callable


def competitors(engine: Engine, size: str = "full", which: str = "all") -> list[Competitor]:
    """All that can take part here, heyoka where it is installed; of a run that is not full with coarse settings only.

    A quick run takes MuJoCo and tmt; "same schemes" are one integrator of MuJoCo for each scheme and the same in tmt, with
    a few settings whatever the size.
    """
    result = []
    for name in INTEGRATORS:
        settings = halvings(FINEST.get(name, FINEST_MUJOCO))
        result.append(Competitor("mujoco", name, ORDERS.get(name, 1), settings, partial(mujoco_run, engine, name)))
    for name, stepping in METHODS.items():
        if isinstance(stepping, AdaptiveRungeKutta):
            settings = tuple(Setting(tolerance=tolerance) for tolerance in TOLERANCES)
            result.append(Competitor("tmt", name, None, settings, partial(tmt_run, name)))
        else:
            finest = FINEST_IMPLICIT if isinstance(stepping, ImplicitRungeKutta) else FINEST_TMT
            result.append(Competitor("tmt", name, stepping.order, halvings(finest), partial(tmt_run, name)))
    if which == "same schemes":
        names = [*SCHEMES, *map(TWINS.get, SCHEMES)]
        return [replace(c, settings=c.settings[NEARER]) for c in result if c.method in names]
    if size == "full":
        return result + others()
    more = others() if size == "small" else []
    few = [(c, FEW[size]) for c in result] + [(c, FEW_OTHERS) for c in more]
    return [replace(competitor, settings=competitor.settings[:count]) for competitor, count in few]


def others() -> list[Competitor]:
    """SciPy's methods, and heyoka's where it is installed."""
    result = []
    for name, finest in SCIPY.items():
        settings = tuple(Setting(tolerance=10.0**-k) for k in range(2, finest + 1))
        result.append(Competitor("scipy", name, None, settings, partial(scipy_run, name)))
    with suppress(ImportError):
        from .taylor import taylor_run

        settings = tuple(Setting(tolerance=10.0**-k) for k in range(4, 17))
        result.append(Competitor("heyoka", "Taylor", None, settings, taylor_run))
    return result


def halvings(finest) -> tuple[Setting, ...]:
    """64, 128, ... steps."""
    return tuple(Setting(steps=GRID << k) for k in range((finest // GRID).bit_length()))


def mujoco_run(engine, integrator, scene, setting):
    """MuJoCo's loop in C, with the flags of the model."""
    variant = scene.engine(engine)
    dt, every = scene.duration / setting.steps, setting.steps // GRID
    starts, run = variant.runner(*scene.start, scene.tau, dt, setting.steps, integrator)
    stages = 4 if integrator == "RK4" else 1

    def read(states):
        _, q, qd = variant.path(starts, states, dt)
        return Outcome(q[0, ::every], qd[0, ::every], setting.steps, stages * setting.steps)

    return run, read


def tmt_run(method, scene, setting):
    """The compiled loop of tmt."""
    stepping = METHODS[method]
    steps = setting.steps or GRID
    paths = np.full((2, 1, steps + 1, len(scene.hinges)), np.nan)
    paths[:, 0, 0] = scene.start
    arguments = [*paths, scene.tau[None], scene.duration / steps]
    if setting.tolerance is not None:
        arguments.append(setting.tolerance)
    run = partial(kernels.stepper(scene.model, method), *arguments)

    def read(evaluations):
        taken = steps if setting.steps else evaluations // len(stepping.b)
        return Outcome(*paths[:, 0, :: steps // GRID], taken, evaluations)

    return run, read


def scipy_run(method, scene, setting):
    """SciPy's solve_ivp with the compiled right-hand side."""
    from scipy.integrate import solve_ivp

    rate = kernels.evaluator(scene.model, "forward_dynamics").rate
    start, tau = np.concatenate(scene.start), scene.tau
    grid = np.linspace(0.0, scene.duration, GRID + 1)
    span = (0.0, scene.duration)
    options = {"t_eval": grid, "rtol": max(setting.tolerance, 2.3e-14), "atol": setting.tolerance}

    def run():
        return solve_ivp(lambda t, y: rate(y, tau), span, start, method, **options)

    def read(solution):
        path = np.full((GRID + 1, start.size), np.nan)
        path[: solution.y.shape[1]] = solution.y.T
        return Outcome(*np.split(path, 2, axis=1), None, int(solution.nfev))

    return run, read
