"""Drake's MultibodyPlant of a robot's file; only where pydrake is installed (the extra `drake`).

Each hinge and slide has a rotor in place of the file's actuators, and one of Drake's springs: so Drake's own equations have the
armature and the stiffness that its parser has dropped.
"""

from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from tmt import Tree

from .. import Array, Course, EngineRecord
from ..outside.mjcf_text import original_or_copy
from ..outside.model import Body, File, Numbers, ReadModel
from ..outside.order import near, order_of, wrong_masses
from .plant import (
    bodies_of,
    finished,
    fixed_force,
    in_world,
    joint_numbers,
    parsed,
    set_masses,
    twists_of,
    with_force,
)

ENGINE = EngineRecord(
    order=50, label="Drake", colour="#D55E00", marker="P", package="pydrake", reads_file=True
)
SCHEMES = {"RK2": (2, "runge_kutta2"), "RK3": (3, "runge_kutta3"), "RK5": (5, "runge_kutta5"),
           "implicit Euler": (1, "implicit_euler"), "Radau3": (3, "radau3")}  # fmt: skip
METHODS: dict[str, tuple[int | None, str]] = {
    name: (order, f"drake_{scheme}") for name, (order, scheme) in SCHEMES.items()
}
for name in ("RK3", "RK5", "Radau3"):
    METHODS[f"{name} adaptive"] = None, f"drake_{SCHEMES[name][1]}_adaptive"
METHODS["discrete"] = 1, "semi_implicit_euler"
ITERATES = "implicit Euler", "Radau3"
ITERATED = 1e-12  # relative accuracy of their iterations at fixed steps
LONGEST = 0.1  # s, of a step of a method that chooses its own: Drake's default


def methods_for(tree: Tree) -> dict[str, tuple[int | None, str]]:
    """discrete adds dt times the rate of a quaternion, and normalizes."""
    return METHODS | ({"discrete": (1, "drake_discrete")} if tree.coordinates.balls else {})


class Model(ReadModel):
    has_places = True

    def __init__(self, file: File, precision: str):
        self.file = file
        self.inertias: dict[Any, Any] = {}  # of bodies that are mended
        self.simulators: dict[Any, tuple[Any, Any, Any]] = {}
        read, self.source, self.copied = original_or_copy(file.path, self.plant_of)
        plant, rotors, self.joints = read
        joints = {k: plant.get_joint(index) for index, k in self.joints.items()}
        starts = {k: (joint.position_start(), joint.velocity_start()) for k, joint in joints.items()}
        free, balls = ((3, 4, 5, 6, 0, 1, 2), (3, 4, 5, 0, 1, 2)), (0, 1, 2)
        self.order = order_of(file, starts, *free, in_world=True, ball_q=balls, turned_balls=True)
        places = file.coordinates.places.joints
        # of each ball: its angles in Drake's q, its quaternion in the Tree's, its speeds
        self.balls = [
            (slice(q, q + 3), places[k].q, slice(v, v + 3)) for k, (q, v) in starts.items()
            if places[k].kind == "ball" and not file.is_free(k)
        ]  # fmt: skip
        armature, damping, stiffness = np.zeros((3, file.coordinates.nv))
        for joint in joints.values():
            place = self.order.v[joint.velocity_start() :][: joint.num_velocities()]
            armature[place], damping[place] = rotors.get(joint.name(), 0.0), joint.default_damping_vector()
        self.used = {"gravity": plant.gravity_field().gravity_vector(), "armature": armature, "damping": damping,
                     "stiffness": stiffness}  # fmt: skip
        self.settle()

    def plant_of(self, path: Path) -> tuple[Any, dict[str, float], dict[Any, int]]:
        plant, rotors = parsed(self.file, path, 0.0)
        plant.Finalize()
        return plant, rotors, joint_numbers(plant, self.file)

    def in_drake(self, q: Array, *vectors: Array) -> list[Array]:
        """q, and vectors of speeds or forces, as Drake has them: of a ball roll, pitch, yaw."""
        placed = self.order.engine(q, *vectors)
        for angles, quaternion, _ in self.balls:
            placed[0][angles] = Rotation.from_quat(np.roll(q[quaternion], -1)).as_euler("xyz")
        return placed

    def in_tree(self, q: Array) -> Array:
        """Drake's positions (nq,) as those of the Tree."""
        placed = np.zeros(self.file.coordinates.nq)
        placed[self.order.q] = q
        for angles, quaternion, _ in self.balls:
            placed[quaternion] = np.roll(Rotation.from_euler("xyz", q[angles]).as_quat(), 1)
        for _, quaternion in self.order.turned:
            placed[quaternion] /= np.linalg.norm(placed[quaternion])
        return placed

    def fields(self) -> Numbers:
        return self.used

    def bodies(self, q: Array) -> list[list[Body]]:
        self.plant.SetPositions(self.context, *self.in_drake(q))
        of_joints = bodies_of(self.plant, self.joints)
        joints = range(len(self.file.names))
        return [[in_world(self.context, body) for body in of_joints.get(k, ())] for k in joints]

    def twists(self, q: Array) -> dict[int, tuple[Array, Array, Array]]:
        self.plant.SetPositions(self.context, *self.in_drake(q))
        return twists_of(self.context, {k: self.plant.get_joint(index) for index, k in self.joints.items()})

    def mend(self, name: str, values: Array) -> bool:
        if (
            name in self.used
        ):  # a free body has no rotor and no spring, and its damping is in other axes; as a ball's rotor
            wrong, self.used[name] = values != self.used[name], values
            self.settle()
            balls = [speeds for *_, speeds in self.balls] if name == "damping" else []
            turned = [at for at, _ in self.order.turned if at not in balls]
            return name == "gravity" or not any(wrong[self.order.v[at]].any() for at in turned)
        joints = wrong_masses(self.numbers(), self.stated)
        self.bodies(self.stated["reference"])  # places them there
        for k, bodies in bodies_of(self.plant, self.joints).items():
            if k in joints and bodies:
                stated = Body(self.stated["mass"][k], self.stated["com"][k], self.stated["inertia"][k])
                self.inertias |= set_masses(self.context, bodies, stated)
        self.settle()
        return bool(near(self.numbers()[name], values).all())

    def settle(self) -> None:
        """Make the plant of single states, without damping and springs, which act as part of the force there."""
        self.simulators.clear()
        self.plant = finished(self.file, self.source, 0.0, self.joints, self.used, None)
        self.context = self.plant.CreateDefaultContext()
        self.set_numbers(self.plant, self.context, acts=False)
        self.force = fixed_force(self.plant, self.context)
        self.forward_dynamics = self.plant.get_generalized_acceleration_output_port()
        self.dual_plant = self.plant.ToAutoDiffXd()
        self.dual_context = self.dual_plant.CreateDefaultContext()
        self.dual_context.SetTimeStateAndParametersFrom(self.context)

    def set_numbers(self, plant: Any, context: Any, acts: bool) -> None:
        """The numbers of a context. acts: damping does."""
        damping = self.used["damping"][self.order.v] * acts
        for joint in map(plant.get_joint, self.joints):
            joint.SetDampingVector(context, damping[joint.velocity_start() :][: joint.num_velocities()])
        for index, inertia in self.inertias.items():
            plant.get_body(index).SetSpatialInertiaInBodyFrame(context, inertia)

    def mass_matrix(self, q: Array) -> Array:
        self.plant.SetPositions(self.context, *self.in_drake(q))
        return self.order.tree_matrix(q, self.plant.CalcMassMatrix(self.context))

    def bias(self, q: Array, v: Array) -> Array:
        self.plant.SetPositionsAndVelocities(self.context, np.concatenate(self.in_drake(q, v)))
        gravity = self.plant.CalcGravityGeneralizedForces(self.context)
        return self.order.tree(q, self.plant.CalcBiasTerm(self.context) - gravity)

    def acceleration(self, q: Array, v: Array, force: Array) -> Array:
        q_drake, v_drake, force = self.in_drake(q, v, force)
        self.plant.SetPositionsAndVelocities(self.context, np.concatenate([q_drake, v_drake]))
        self.force.SetFromVector(force)
        return self.order.tree(q, self.forward_dynamics.Eval(self.context))

    @property
    def lacks(self) -> tuple[str, ...]:
        """Quaternions do not move like numbers, nor do the angles of a ball."""
        return ("derivatives",) if self.order.turned else ()

    def derivatives(self, q: Array, v: Array, force: Array) -> Array:
        """By AutoDiffXd, Drake's dual numbers."""
        from pydrake.autodiffutils import ExtractGradient, InitializeAutoDiff

        n, values = self.order.v.size, InitializeAutoDiff(np.concatenate(self.in_drake(q, v, force)))[:, 0]
        self.dual_plant.SetPositionsAndVelocities(self.dual_context, values[: 2 * n])
        self.dual_plant.get_applied_generalized_force_input_port().FixValue(
            self.dual_context, values[2 * n :]
        )
        accelerations = self.dual_plant.get_generalized_acceleration_output_port().Eval(self.dual_context)
        by = np.zeros((3, n, n))
        by[:, self.order.v[:, None], self.order.v] = np.split(ExtractGradient(accelerations), 3, axis=1)
        return by

    def prepare(self, course: Course) -> None:
        self.simulator(course)

    def simulator(self, course: Course) -> tuple[Any, Any, Any]:
        """A simulator, the plant, and the plant's context in it."""
        from pydrake.systems.analysis import ResetIntegratorFromFlags, Simulator

        tau, method, tolerance = course.tau, course.method, course.tolerance
        dt = course.dt if course.steps else None
        key = method, tuple(tau), dt, tolerance, bool(course.servos)
        if key not in self.simulators:
            of_plant = course.dt if method == "discrete" else 0.0
            plant = finished(self.file, self.source, of_plant, self.joints, self.used, self.stated["rest"])
            turns = bool(course.servos) or any(tau[self.order.v[at]].any() for at, _ in self.order.turned)
            system = with_force(plant, partial(self.force_at, course)) if turns else plant
            simulator = Simulator(system)
            context = plant.GetMyMutableContextFromRoot(simulator.get_mutable_context())
            self.set_numbers(plant, context, acts=True)
            if not turns:
                fixed_force(plant, context).SetFromVector(tau[self.order.v])
            if method != "discrete":
                scheme = SCHEMES[method.removesuffix(" adaptive")][1]
                integrator = ResetIntegratorFromFlags(simulator, scheme, dt or LONGEST)
                integrator.set_fixed_step_mode(tolerance is None)
                if tolerance or method in ITERATES:
                    integrator.set_target_accuracy(tolerance or ITERATED)
            self.simulators[key] = simulator, plant, context
        return self.simulators[key]

    def force_at(self, course: Course, state: Array) -> Array:
        """The force of a course at Drake's q and v, which on a free body is in world axes."""
        nq = self.plant.num_positions()
        q = self.in_tree(state[:nq])
        force: Array = self.in_drake(q, course.force(q, self.order.tree(q, state[nq:])))[1]
        return force

    def run(self, course: Course) -> tuple[Array, int]:
        simulator, plant, context = self.simulator(course)
        q, v = self.in_drake(course.q, course.v)
        simulator.get_mutable_context().SetTime(0.0)
        plant.SetPositionsAndVelocities(context, np.concatenate([q, v]))
        simulator.get_mutable_integrator().ResetStatistics()
        simulator.Initialize()
        states, is_discrete = [np.concatenate([q, v])], course.method == "discrete"
        for t in course.times[1:]:
            try:  # the last of the discrete steps up to t begins at t - dt
                simulator.AdvanceTo(t - 0.5 * course.dt if is_discrete else t)
            except RuntimeError:  # it finds no step, or no solution of its equations
                break
            states.append(plant.GetPositionsAndVelocities(context))
        evaluations = simulator.get_integrator().get_num_derivative_evaluations()
        of_drake, path = np.split(np.array(states), [len(q)], axis=1), []
        for x, speeds in zip(*of_drake):
            q = self.in_tree(x)
            path.append(np.concatenate([q, self.order.tree(q, speeds)]))
        return np.array(path), course.steps if is_discrete else evaluations
