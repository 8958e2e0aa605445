"""heyoka's Taylor method on the same equations of motion; only where heyoka is installed (the extra `taylor`)."""

from collections.abc import Iterable, Mapping
from functools import lru_cache
from typing import Any

import numpy as np

from tmt import Tree
from tmt.compiled import Evaluator
from tmt.derivation import composite
from tmt.derivation.method import acceleration
from tmt.derivation.vectors import cos, sign, sin, sqrt

from ..robots.case import Case
from . import Course, Engine, Method, Motion, Prepared
from .scipy import ScipyDynamics, of_length_1

FULL = 1e-15  # tolerance: all digits of a double
# of the accelerations: heyoka's compilation takes longer than in proportion, 15 s for 290 of them, 266 s for
# 2479
MOST_OPERATIONS = 600
MOST_JOINTS = 12  # for more the operations are not counted


class Heyoka(Engine):
    name = "heyoka"
    methods: Mapping[str, Method] = {"Taylor": Method("heyoka", "Taylor", None, "Taylor", adaptive=True)}

    def too_long(self, tree: Tree) -> str | None:
        if len(tree.axis) <= MOST_JOINTS and Evaluator(tree, "acceleration").operations <= MOST_OPERATIONS:
            return None
        return f"with {len(tree.axis)} speeds its compilation would take minutes"

    def of(self, case: Case) -> "HeyokaDynamics":
        return HeyokaDynamics(case)


def engine(schemes: Iterable[str]) -> Heyoka:
    return Heyoka()


class HeyokaDynamics(ScipyDynamics):
    def prepared(self, course: Course) -> Prepared:
        torque = tuple(np.asarray(course.tau, float).tolist())
        stepper = integrator(self.tree, torque, FULL if course.tolerance is None else course.tolerance)

        def run() -> Any:
            stepper.time, stepper.state[:] = 0.0, course.start
            return stepper.propagate_grid(course.times)

        def read(outcome: Any) -> Motion:
            why, *_, steps, _, path = outcome
            motion = course.motion(path, f"heyoka stops: {why}")
            return motion._replace(q=of_length_1(self.coordinates, motion.q), steps=int(steps))

        return run, read


@lru_cache(maxsize=32)
def integrator(tree: Tree, tau: tuple[float, ...], tolerance: float) -> Any:
    import heyoka

    for function, own in ((sin, heyoka.sin), (cos, heyoka.cos), (sqrt, heyoka.sqrt)):
        function.register(heyoka.expression, own)
    one = heyoka.expression(1.0)
    sign.register(heyoka.expression, lambda x: heyoka.select(heyoka.lt(x, 0.0), one * -1.0, one))
    sizes = {"q": tree.coordinates.nq, "qd": tree.coordinates.nv}
    q, qd = ([heyoka.make_vars(f"{name}{i}") for i in range(size)] for name, size in sizes.items())
    qdd = acceleration(tree, q, qd, list(tau), composite.mass_matrix_and_bias)
    rates = tree.coordinates.component_rates(q, qd)
    return heyoka.taylor_adaptive([*zip(q, rates), *zip(qd, qdd)], [0.0] * (len(q) + len(qd)), tol=tolerance)
