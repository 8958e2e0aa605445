"""A robot under its own servos at a posture: its rest, and the equation of small deviations there."""

from collections.abc import Callable
from dataclasses import dataclass, fields, replace
from functools import cached_property, partial

import numpy as np

import tmt
from tmt.equations.composite import mass_matrix_and_bias  # the sum over bodies takes long for tens of joints
from tmt.methods import by_speed, lone_speeds

from ..robots.actuators import Cut, Rows
from .deviations import Deviations
from .servos import Driven, turning
from .step_limits import LIMIT_UP_TO, Small, upwards

NEARLY = 0.3  # of the limit with rigid constraints: from there on steps with soft constraints are tried one by one
COARSELY = 1e-6  # the relative accuracy of a limit with soft constraints
DEPENDENT = 1e-8  # of the largest singular value of the Jacobian of constraints: less is zero
BEYOND = 1e-3  # rad or m beyond a range: soft limits yield by less


@dataclass(frozen=True)
class Posture:
    """A named posture of a robot under the controls u, and its rest near it.

    ask: see Driven. A floating robot has no gravity, as it has no rest with it. rows: Rows at q, a step and an integrator, None:
    no constraints. dt, integrator: those of the rest, which only discrete changes. aside: speeds that are locked because nothing
    holds them. begin: where the search for the rest starts, by default the posture.
    """

    robot: object  # a robots.Robot
    name: str
    ask: Callable | None = None
    rows: Callable | None = None
    dt: float = 0.0
    aside: tuple[int, ...] = ()
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
            for body, hinge in enumerate(tree.body_hinge):
                if hinge >= 0 and tree.coordinates.joints[hinge].qd.start in self.lone:
                    parts[body] = 1.0
            drive = replace(drive, compensation=tuple(parts))
        rows = self.rows and partial(self.rows, dt=self.dt, integrator=self.integrator)
        return Driven(tree, drive, self.ask, weightless=bool(self.base), rows=rows, locked=self.aside)

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

    @cached_property
    def limits(self) -> tuple[int, ...]:
        """The joints of the model that rest at their limits, if limits are among its rows."""
        return self.rows(self.q, self.dt, self.integrator).limits if self.rows else ()

    def beyond(self, by: float = BEYOND) -> tuple[str, ...]:
        """The hinges and slides that rest beyond their ranges by more than this, rad or m."""
        coordinates = self.robot.coordinates
        return tuple(
            name
            for name, (kind, at, _), limits in zip(coordinates.names, coordinates.places.joints, self.robot.ranges)
            if limits and kind != "ball" and not limits[0] - by <= self.q[at.start] <= limits[1] + by
        )

    @property
    def moved(self) -> float:
        """The largest movement of a joint from the posture to the rest, rad or m."""
        return float(np.abs(self.robot.coordinates.difference(self.q, self.start)).max())

    @cached_property
    def lone(self) -> list[int]:
        """The speeds of free bodies on their own that no actuator or tendon moves."""
        alone, pulled = lone_speeds(self.robot.tree), self.pulled
        return [
            k for body in floating(self.robot.tree) if alone.issuperset(body) and not pulled & {*body} for k in body
        ]

    @cached_property
    def pulled(self) -> set[int]:
        """The speeds at which an actuator or a tendon acts at the posture."""
        moments = Driven(self.robot.tree, self.robot.drive, self.ask).along(self.start).moments
        return set(np.flatnonzero(moments.any(axis=0)).tolist())

    @cached_property
    def base(self) -> list[int]:
        """The speeds of free joints that carry the robot, or parts of it, and that no servo or spring of their own holds."""
        tree, drive = self.robot.tree, self.robot.drive
        held = np.any([servo.moment for servo in drive.servos if servo.moment] or [[False] * len(tree.axis)], axis=0)
        held = held | np.repeat(np.array(tree.stiffness or [0.0] * len(tree.kind)) != 0.0, widths(tree))
        return [k for body in floating(tree) if not held[body].any() for k in body if k not in self.lone]

    @property
    def bases(self) -> tuple[str, ...]:
        """The bases to which limits apply: "fixed" to the world, "free" (floating without gravity), "locked" (held)."""
        if not self.base:
            return ("fixed",)
        return ("free", "locked") if len(self.base) + len(self.lone) < len(self.robot.tree.axis) else ("free",)

    @cached_property
    def cut(self) -> Cut:
        """The forces that ranges cut at rest."""
        return self.driven.cut(self.q, self.u)

    @cached_property
    def whole(self) -> Small:
        """Small deviations of all speeds."""
        tree, drive = self.robot.tree, self.robot.drive
        slopes = self.driven.slopes(self.q, self.u)
        speeds = np.add(tree.damping, drive.damping or 0.0) * (not drive.explicit_damping)
        filters = [act for act in drive.actuators if act.acts and act.dynamics in ("filter", "filterexact")]
        return Small(
            names=self.robot.coordinates.speeds,
            M=np.array(mass_matrix_and_bias(tree, self.q.tolist(), [0.0] * len(speeds))[0]),
            K=slopes.K + turning(self.driven.rows, self.robot.coordinates, self.q),
            D=slopes.D,
            damping=speeds,
            uncut=slopes.uncut,
            springs=np.diag(by_speed(tree, tree.stiffness or [0.0] * len(tree.kind)))
            if drive.joints_alone
            else slopes.springs,
            brakes=np.diag(speeds) if drive.joints_alone else slopes.brakes,
            on_path=on_one_path(tree),
            poles=tuple((act.name, act.time_constant, act.dynamics == "filterexact") for act in filters),
        )

    def small(self, base: str) -> Small:
        """Small deviations with one of `bases`, without free bodies on their own."""
        still = {*self.lone, *self.aside}
        if base == "free":
            names = [self.whole.names[k] for k in self.base]
            kept = self.whole.locked(sorted(still))
            small = kept.free([k for k, name in enumerate(kept.names) if name in names])
        else:
            small = self.whole.locked(sorted(still | {*(self.base if base == "locked" else ())}))
        kept = [k for k, name in enumerate(self.whole.names) if name in small.names]
        if self.rows and self.rows(self.q, self.dt, "Euler").jacobian[:, kept].any():
            return Coupled(**of_small(small), couple=partial(self.couple, kept))
        return small

    def couple(self, kept: list[int], dt: float, integrator: str) -> Rows:
        """The Rows of some speeds at rest."""
        rows = self.rows(self.q, dt, integrator)
        return rows._replace(jacobian=rows.jacobian[:, kept])

    @cached_property
    def unheld(self) -> tuple[int, ...]:
        """The speeds without servo or spring, also through constraints, except those of a base or of free bodies on their own."""
        tree, drive = self.robot.tree, self.robot.drive
        along = self.driven.along(self.start)
        pulling = [act.is_servo for act in drive.actuators] + [tendon.stiffness != 0.0 for tendon in drive.tendons]
        springs = np.array(by_speed(tree, tree.stiffness or [0.0] * len(tree.kind)))
        held = along.moments[pulling].any(axis=0) | (springs != 0.0)
        rows = self.rows(self.start, self.dt, "Euler").jacobian != 0.0 if self.rows else np.zeros((0, len(held)), bool)
        for _ in rows:
            held = held | rows[(rows & held).any(axis=1)].any(axis=0)
        return tuple(k for k in np.flatnonzero(~held).tolist() if k not in (*self.base, *self.lone))


def floating(tree: tmt.Tree) -> list[list[int]]:
    """The six speeds of each free joint: three slides that carry nothing else, and a ball, from the world."""
    bodies = []
    for i in range(3, len(tree.kind)):
        chain = [i - 3, i - 2, i - 1, i]
        free = tuple(tree.kind[j] for j in chain) == ("slide",) * 3 + ("ball",)
        if free and [tree.parent[j] for j in chain] == [-1, *chain[:3]] and not {*chain[:3]} & {*tree.body_hinge}:
            joints = tree.coordinates.joints
            bodies.append(list(range(joints[i - 3].qd.start, joints[i].qd.stop)))
    return bodies


def widths(tree: tmt.Tree) -> list[int]:
    """The number of speeds of each joint."""
    return [by.stop - by.start for _, _, by in tree.coordinates.joints]


def on_one_path(tree: tmt.Tree) -> np.ndarray:
    """Whether the joints of two speeds are on one path to the root, (nv, nv)."""
    n = len(tree.parent)
    before = np.eye(n, dtype=bool)
    for i, parent in enumerate(tree.parent):
        if parent >= 0:
            before[i] |= before[parent]
    joints = np.repeat(np.arange(n), widths(tree))
    return (before | before.T)[np.ix_(joints, joints)]


# constraints


@dataclass(frozen=True)
class Rigid(Small):
    """Small deviations in the coordinates that rigid constraints leave free."""

    soft: "Coupled | None" = None

    def braking(self, integrator):
        N = self.soft.meeting
        return N.T @ self.soft.braking(integrator) @ N


@dataclass(frozen=True)
class Coupled(Small):
    """Small deviations with equalities, or limits at which joints rest: MuJoCo's soft constraints. K includes their rotation.

    Modes, growth and drift are those of rigid constraints. A step is MuJoCo's: the force of the soft constraints is computed
    without the implicit part of an integrator (discrete: with it), so that its limit differs from that of rigid ones.
    couple: the Rows at a step size and an integrator, of all these speeds.
    """

    couple: Callable[[float, str], Rows] | None = None
    is_coupled = True
    refined = COARSELY

    @cached_property
    def meeting(self) -> np.ndarray:
        """Movements that the constraints allow, x = N y, (nv, m)."""
        jacobian = self.couple(1e-3, "Euler").jacobian
        _, sizes, directions = np.linalg.svd(jacobian)
        return directions[int((sizes > DEPENDENT * sizes.max(initial=0.0)).sum()) :].T

    @cached_property
    def rigid(self) -> "Rigid":
        """The same in these coordinates: N' M N y'' + N' D N y' + N' K N y = 0."""
        N = self.meeting
        square = {name: N.T @ getattr(self, name) @ N for name in ("M", "K", "D", "springs")}
        names, base = tuple(map(str, range(N.shape[1]))), tuple(np.flatnonzero(N[list(self.base)].any(axis=0)).tolist())
        return Rigid(**of_small(self) | square | {"names": names, "base": base}, soft=self)

    def of_all(self, moves: np.ndarray) -> np.ndarray:
        """Movements of `rigid` in the units of its M as those of all speeds in the units of M."""
        return self.root.T @ self.meeting @ self.rigid.unrooted.T @ moves

    @cached_property
    def modes(self):
        values, moves = self.rigid.modes
        return values, self.of_all(moves)

    @cached_property
    def growing(self):
        growing = self.rigid.growing if self.meeting.size else None
        return growing and (growing[0], self.of_all(growing[1]))

    @cached_property
    def drifts(self):
        return bool(self.meeting.size) and self.rigid.drifts

    def steps_tried(self, integrator):
        """A few up to well below the limit of rigid constraints, as each takes a forward pass and eigenvalues; then all."""
        near = NEARLY * (self.rigid.limit(integrator).dt or LIMIT_UP_TO)
        return np.concatenate([np.geomspace(near / 100.0, near, 5)[:-1], upwards(near)])

    def has_closed_form(self, integrator):
        return False

    def constrained(self, integrator, dt, stiff, damped, matrix):
        rows = self.couple(dt, integrator)
        J, metric = rows.jacobian @ self.unrooted.T, matrix if integrator == "discrete" else np.eye(len(self.M))
        eased = np.linalg.solve(metric, J.T).T
        pull = np.linalg.solve(eased @ J.T + np.diag(rows.softness), J).T
        stiff = stiff - pull @ (eased @ stiff - rows.stiffness[:, None] * J)
        damped = damped - pull @ (eased @ damped - rows.damping[:, None] * J)
        return stiff, damped, np.eye(len(self.M)) - pull @ eased


def of_small(small: Small) -> dict:
    """The fields of Deviations by name."""
    return {field.name: getattr(small, field.name) for field in fields(Deviations)}
