"""What else acts in accelerations than Mbar and h: a torque of the opposite sign, damping, springs, friction.

For given accelerations the force  r = tau - D qd - k (q - rest) - h - Mbar qdd  is left over, with Mbar and h
of the same source: zero if nothing else acts.
"""

from collections.abc import Iterator
from functools import cached_property
from itertools import product

import numpy as np
from numpy import ndarray

import tmt
from tmt import literal

from ..core.cause import Cause
from ..core.finding import Finding
from ..core.text import say
from ..judge.agree import share_of
from ..judge.entries import Entries
from .cause import TEMPLATE, ranked
from .fit import Search, explaining
from .hypothesis import Hypothesis, cost, factor, option
from .kinds.numbers import forces
from .layout import ROUNDED, Values
from .model import Equations
from .pairs import of_numbers

SHARPER = 4.0  # times the tolerance: accelerations are rounded before Mbar is multiplied by them


class LeftOver:
    """The force r that is left over by accelerations qdd (states, nv) under torques tau (states, nv).

    force, tolerance: (states, nv). rounding: of the scale of an entry.
    """

    def __init__(self, tree: tmt.Tree, values: Values, tau: ndarray, qdd: ndarray, rounding: float = ROUNDED):
        self.tree, self.values, self.tau = tree, values, tau
        q, qd, M, h, _ = values
        self.of_speed = [i for i, joint in enumerate(tree.coordinates.joints) for _ in tree.axis[joint.qd]]
        self.damping, self.springs = np.array(tree.damping) * qd, literal.spring_torque(tree, q)
        self.force = tau - self.damping - self.springs - h - np.einsum("sij,sj->si", M, qdd)
        scale = Entries(tree, q, qd)
        self.tolerance = SHARPER * rounding * scale.residual(scale.force(tau), qdd)

    @property
    def ratio(self) -> float:
        """Of the force to its tolerance, the largest; inf if one is not a number."""
        return float(share_of(np.abs(self.force), self.tolerance).max())

    @cached_property
    def causes(self) -> tuple[Cause, ...]:
        """What explains the force: all causes of the first rank that has one."""
        if not (np.isfinite(self.force).all() and np.isfinite(self.tolerance).all()):
            return ()
        nothing = np.zeros((1, *self.force.shape))
        search = Search(lambda changes: nothing, self.force, self.tolerance)
        if np.abs(search.off).max() <= 1.0:
            return ()
        options, places = list(self.options()), list(forces(self.tree, self.values.q, self.values.qd))
        numbers = search.expanded([one for one in places if one.cause.kind == "number"])
        fits = explaining(search.alone(search.expanded(options)))
        fits = fits or explaining(search.alone(search.expanded([*places, *self.weights()])))
        causes = [fit.cause for fit in fits or of_numbers(search, [numbers])]
        equations = Equations(self.tree, self.values.q, self.values.qd)
        return ranked(sorted(causes, key=lambda cause: cost(cause, equations)))

    def sentence(self) -> str:
        """The causes in words; "" if there is none."""
        return say(Finding(TEMPLATE, "forces", {"list": self.causes})) if self.causes else ""

    def weights(self) -> Iterator[Hypothesis]:
        """The factor of the gravity of each body."""
        equations = Equations(self.tree, self.values.q, self.values.qd)
        for body, added in zip(self.tree.body_names, equations.terms["gravity"]):
            yield factor("term", f"gravity of {body} in the acceleration", added[:, equations.in_h])

    def options(self) -> Iterator[Hypothesis]:
        """Each option, and the force that is left over with it."""
        nothing = 0.0 * self.force
        terms = {"torque": ("tau", -self.tau), "bias": ("- h", self.values.bias)}
        terms |= {"damping": ("- D qd", self.damping), "springs": ("- k (q - rest)", self.springs)}
        factors = {"left out": -1.0, "of the other sign": -2.0, "twice": 1.0}
        for (name, (stated, term)), explains in product(terms.items(), factors):
            place = f"{name} in the acceleration"
            if term.any():
                yield option(nothing, place, stated, explains, factors[explains] * term)
        if self.springs.any():
            place, q = "springs in the acceleration", self.values.q[:, self.tree.coordinates.first_positions]
            slack = np.array(self.tree.stiffness)[self.of_speed] * q
            yield option(nothing, place, "- k (q - rest)", "at rest at zero", slack - self.springs)
        h, M = self.values.bias, self.values.mass_matrix
        for inside, force in {"(tau - D qd)": h, "tau": h + self.damping + self.springs}.items():
            solved = np.einsum("sij,sj->si", M, force) - force
            wrong = f"inv(M) {inside} - h: h is not multiplied by inv(M)"
            place = "how you solve for the acceleration"
            yield option(nothing, place, "inv(M) (tau - D qd - h)", wrong, solved)
