"""MuJoCo as an engine: a compiled model, and what a case changes in it."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import mujoco

import tmt
from tmt.methods import lone_speeds

from ...robots.case import Case
from .. import Method
from .dynamics import MujocoDynamics
from .flags import INTEGRATORS
from .inventory import switch_off
from .lock import locked_model
from .servos import DrivenDynamics

SCHEMES = {  # MuJoCo's integrator: the method of tmt that is the same scheme, where no ball, no spring makes them differ
    "Euler": "semi_implicit_euler",
    "implicitfast": "semi_implicit_euler",
    "discrete": "semi_implicit_euler",
    "implicit": "implicit",
    "RK4": "rk4",
}
FROM_4 = int(mujoco.__version__.split(".")[0]) >= 4


def methods_for(tree: tmt.Tree | None = None) -> dict[str, Method]:
    """MuJoCo's integrators for a Tree, by name, each with the method of tmt that is the same scheme; None: of hinges alone.

    Measured, step by step: a free body that stands alone has its bias implicit in implicitfast and discrete; discrete has
    springs implicit too; and up to 3.17 RK4 turns a ball by the mean of its speeds. There implicitfast takes a midpoint rule
    for a free body alone, which tmt has not: it is left out. The speed gain of actuators is implicit in implicitfast and implicit
    where two joints lie on one path to the world, in discrete everywhere, and there the position gain too; Euler has neither.
    """
    schemes, order = dict(SCHEMES), 4
    if tree is not None:
        lone = bool(lone_speeds(tree))
        if lone or tree.has_gains:
            schemes["implicitfast"] = schemes["discrete"] = "implicitfast"
        if tree.has_springs or tree.has_gains:
            schemes["discrete"] = "discrete"
        if tree.coordinates.balls and not FROM_4:
            schemes["RK4"], order = "rk4_mean_speed", 2
        if lone and not FROM_4:
            del schemes["implicitfast"]
    return {
        name: Method("mujoco", name, order if name == "RK4" else 1, scheme)
        for name, scheme in schemes.items()
        if name in INTEGRATORS
    }


METHODS = methods_for()
MODELS, BYTES = 64, 1e8  # that are kept: those of the cases that were asked for last, so many and so large together


class Mujoco:
    """MuJoCo with one compiled model of given joints.

    bodies: their numbers in the model. source: what the model was read from, a Path or MJCF text; None if it was changed since
    then, so that no joint can be taken out. bare: all that a Tree has not is switched off, see inventory.
    warnings: of MuJoCo's compiler, one line each.
    """

    name = "mujoco"
    methods: Mapping[str, Method] = METHODS

    def __init__(
        self,
        model: mujoco.MjModel,
        joints: Sequence[str],
        bodies: Sequence[int],
        source: Path | str | None,
        bare: bool = False,
        warnings: tuple[str, ...] = (),
        methods: Mapping[str, Method] = METHODS,
    ):
        self.methods = methods
        self.integrator, self.bare = model.opt.integrator, bare  # of the file
        self.model, self.source, self.joints, self.bodies = model, source, tuple(joints), list(bodies)
        self.known, self.warnings = {}, warnings

    def __getstate__(self):
        return self.__dict__ | {"known": {}}

    def unavailable(self) -> str | None:
        return None

    def methods_in(self, case: Case) -> Mapping[str, Method]:
        """Its integrators in a case: where actuators act some are other schemes."""
        return methods_for(case.tree) if case.controller else self.methods

    def of(self, case: Case) -> MujocoDynamics:
        """The file's own numbers with what the case changes: they stay what they are, and nothing of the file is hidden.

        A model with locked joints is compiled from the source again, without them. ModelError if that is not possible.
        """
        changes = tuple(case.locked.items()), case.scene.gravity, case.scene.damping, case.joints
        changes += (case.controller.controls,) if case.controller else ()
        dynamics = self.known.pop(changes, None) or self.dynamics(case)
        self.known[changes] = dynamics
        if len(self.known) > max(1.0, min(MODELS, BYTES / mujoco.mj_sizeModel(self.model))):
            del self.known[next(iter(self.known))]
        return dynamics

    def dynamics(self, case: Case) -> MujocoDynamics:
        """The dynamics of a case, made anew."""
        model = self.changed(case)
        parts = model, case.coordinates, self.bodies, case.tree.zero, self.bare
        dynamics = DrivenDynamics(*parts, case.controller) if case.controller else MujocoDynamics(*parts)
        dynamics.model.dof_damping[dynamics.dofs] += case.added_damping
        return dynamics

    def changed(self, case: Case) -> mujoco.MjModel:
        """The model with what the case changes, except for the damping that it adds."""
        copied = mujoco.MjModel.__copy__
        model = locked_model(self.source, case.locked, self.bare) if case.locked else copied(self.model)
        if self.bare:
            switch_off(model)
        if not case.scene.gravity:
            model.opt.gravity[:] = 0.0
        return model
