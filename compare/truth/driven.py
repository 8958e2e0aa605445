"""A robot under its own servos at a posture: its rest, and the equation of small deviations there."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property, partial

import numpy as np

import tmt
from tmt.derivation.composite import mass_matrix_and_bias  # the sum over bodies takes long for tens of joints
from tmt.methods import by_speed, lone_speeds

from ..robots import Robot
from ..robots.actuators import Rows
from ..robots.coordinates import free_joints
from .rest import carries
from .servos import Driven, constraint_terms
from .step_limits import SYMMETRIC, Small


@dataclass(frozen=True)
class Posture:
    """A named posture of a robot under the controls u, and its rest near it.

    ask: see Driven. A floating robot has no gravity, as it has no rest with it. rows: Rows at q, a step and an integrator, None:
    no constraints. dt, integrator: those of the rest, which only discrete changes. begin: where the search
    for the rest starts, by default the posture.
    """

    robot: Robot
    name: str
    ask: Callable | None = None
    rows: Callable | None = None
    dt: float = 0.0
    begin: tuple[float, ...] | None = None
    integrator: str = "Euler"

    def __getstate__(self) -> dict:
        return dict(self.__dict__)  # a copy: a thread may pickle it while more is computed of it

    @cached_property
    def driven(self) -> Driven:
        """The tree with its drive. A free body on its own has no effect on the others: it gets no weight."""
        tree, drive = self.robot.tree, self.robot.drive
        if self.lone:
            parts = list(drive.compensation or (0.0,) * len(tree.mass))
            for body, hinge in enumerate(tree.body_joint):
                if hinge >= 0 and tree.coordinates.joints[hinge].qd.start in self.lone:
                    parts[body] = 1.0
            drive = replace(drive, compensation=tuple(parts))
        rows = self.rows and partial(self.rows, dt=self.dt, integrator=self.integrator)
        return Driven(tree, drive, self.ask, weightless=bool(self.base), rows=rows)

    @property
    def start(self) -> np.ndarray:
        """The posture itself, (nq,)."""
        return self.robot.posture(self.name)

    @cached_property
    def u(self) -> np.ndarray:
        """Controls of the actuators, see Drive.control."""
        return self.robot.drive.control(self.name, self.driven.along(self.start).lengths)

    @cached_property
    def rest(self) -> tuple[np.ndarray, float]:
        """The posture at rest, (nq,), and the residual force, N m or N; 0.0: it rests."""
        return self.driven.at_rest(self.start if self.begin is None else np.array(self.begin), self.u)

    @property
    def q(self) -> np.ndarray:
        return self.rest[0]

    def away(self, other: np.ndarray) -> float:
        """The largest movement of a joint from another position (nq,) to the rest, rad or m."""
        return float(np.abs(self.robot.coordinates.difference(self.q, other)).max())

    @cached_property
    def lone(self) -> list[int]:
        """The speeds of free bodies on their own that no actuator or tendon moves."""
        alone = lone_speeds(self.robot.tree)
        moments = Driven(self.robot.tree, self.robot.drive, self.ask).along(self.start).moments
        pulled = set(np.flatnonzero(moments.any(axis=0)).tolist())
        lone = [body for body in floating(self.robot.tree) if alone.issuperset(body) and not pulled & {*body}]
        return [k for body in lone for k in body]

    @cached_property
    def base(self) -> list[int]:
        """The speeds of free joints that carry the robot, or parts of it, and that no servo or spring of their own holds."""
        tree, drive = self.robot.tree, self.robot.drive
        held = np.array(by_speed(tree, tree.stiffness)) != 0.0
        for actuator in drive.actuators:
            if actuator.is_servo and actuator.moment:
                held = held | np.array(actuator.moment, bool)
        return [k for body in floating(tree) if not held[body].any() for k in body if k not in self.lone]

    @property
    def is_tied(self) -> bool:
        """Whether an equality holds a free body from outside: it is violated where the body is displaced."""
        if self.rows is None:
            return False
        slides = [k for body in floating(self.robot.tree) for k in body[:3]]
        jacobian = self.rows(self.start, self.dt, self.integrator).jacobian[:, slides]
        return bool(np.abs(jacobian).max(initial=0.0) > SYMMETRIC)

    @property
    def beyond(self) -> float:
        """How far the rest is beyond the range of a joint, rad or m."""
        joints = zip(self.robot.coordinates.places.joints, self.robot.ranges)
        limited = [
            (self.q[joint.q.start], limits) for joint, limits in joints if limits and joint.kind != "ball"
        ]
        return float(max((max(low - q, q - high) for q, (low, high) in limited), default=0.0))

    @property
    def base_kind(self) -> str:
        """fixed: to the world; free: it floats without gravity."""
        return "free" if self.base else "fixed"

    @cached_property
    def cut(self) -> dict[int, float]:
        """The forces that ranges cut at rest, by actuator."""
        return self.driven.cut(self.q, self.u)

    @cached_property
    def whole(self) -> Small:
        """Small deviations of all speeds, without the steps of constraints."""
        tree, drive = self.robot.tree, self.robot.drive
        slopes, joint = self.driven.slopes(self.q, self.u), by_speed(tree, range(len(tree.parent)))
        speeds = np.array(tree.damping) * (not drive.explicit_damping)
        filters = [act for act in drive.actuators if act.acts and act.dynamics in ("filter", "filterexact")]
        on_path = carries(tree) | carries(tree).T
        turning = constraint_terms(self.driven.rows, self.robot.coordinates, self.q)[2]
        turning[self.base] = turning[:, self.base] = 0.0  # what holds joints together turns with the base
        return Small(
            names=self.robot.coordinates.speeds,
            M=np.array(mass_matrix_and_bias(tree, self.q.tolist(), [0.0] * len(speeds))[0]),
            K=slopes.K + turning,
            D=slopes.D,
            damping=speeds,
            springs=slopes.springs,
            brakes=slopes.brakes,
            on_path=on_path[np.ix_(joint, joint)],
            poles=tuple((act.name, act.time_constant, act.dynamics == "filterexact") for act in filters),
        )

    @property
    def kept(self) -> list[int]:
        """The speeds of `small`: with a free base those that do not follow from the others."""
        return [k for k, name in enumerate(self.whole.names) if name in self.small.names]

    @cached_property
    def small(self) -> Small:
        """Small deviations, without free bodies on their own."""
        small = self.whole.locked(self.lone)
        base = [self.whole.names[k] for k in self.base]
        small = small.free([k for k, name in enumerate(small.names) if name in base])
        kept = [k for k, name in enumerate(self.whole.names) if name in small.names]
        if self.rows and self.rows(self.q, self.dt, "Euler").jacobian[:, kept].any():
            return replace(small, couple=partial(self.couple, kept))
        return small

    def couple(self, kept: list[int], dt: float, integrator: str) -> Rows:
        """The Rows of some speeds at rest."""
        rows = self.rows(self.q, dt, integrator)
        return rows._replace(jacobian=rows.jacobian[:, kept])


def floating(tree: tmt.Tree) -> list[list[int]]:
    """The six speeds of each free joint: three slides that carry nothing else, and a ball, from the world."""
    joints, free = tree.coordinates.joints, [i for i in free_joints(tree) if tree.parent[i] == -1]
    alone = [i for i in free if not {i, i + 1, i + 2} & {*tree.body_joint}]
    return [list(range(joints[i].qd.start, joints[i + 3].qd.stop)) for i in alone]
