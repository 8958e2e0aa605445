"""Drake's MultibodyPlant of a robot's file; only where pydrake is installed (the extra `drake`).

Each hinge and slide has a rotor in place of the file's actuators, and one of Drake's springs: so Drake's own equations have the
armature and the stiffness that its parser has dropped.
"""

from typing import Any

import numpy as np

from tmt import Tree

from .. import Array, Course, EngineRecord
from ..outside.model import Body, File, Numbers, ReadModel, Unread
from ..outside.order import near, order_of, wrong_masses
from .plant import (
    bodies_of,
    finished,
    fixed_force,
    in_world,
    joint_numbers,
    parsed,
    set_masses,
    with_turned_force,
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
        if file.kinds.count("ball") > len(file.free):
            raise Unread("ball joints become three angles")
        self.file = file
        self.inertias: dict[Any, Any] = {}  # of bodies that are mended
        self.simulators: dict[Any, tuple[Any, Any, Any]] = {}
        plant, rotors = parsed(file, 0.0)
        plant.Finalize()
        self.joints = joint_numbers(plant, file)
        joints = {k: plant.get_joint(index) for index, k in self.joints.items()}
        starts = {k: (joint.position_start(), joint.velocity_start()) for k, joint in joints.items()}
        self.order = order_of(file, starts, (3, 4, 5, 6, 0, 1, 2), (3, 4, 5, 0, 1, 2), in_world=True)
        armature, damping, stiffness = np.zeros((3, file.coordinates.nv))
        for joint in joints.values():
            place = self.order.v[joint.velocity_start() :][: joint.num_velocities()]
            armature[place], damping[place] = rotors.get(joint.name(), 0.0), joint.default_damping_vector()
        self.used = {"gravity": plant.gravity_field().gravity_vector(), "armature": armature, "damping": damping,
                     "stiffness": stiffness}  # fmt: skip
        self.settle()

    def fields(self) -> Numbers:
        return self.used

    def bodies(self) -> list[list[Body]]:
        self.plant.SetPositions(self.context, *self.order.engine(self.stated["reference"]))
        of_joints = bodies_of(self.plant, self.joints)
        joints = range(len(self.file.names))
        return [[in_world(self.context, body) for body in of_joints.get(k, ())] for k in joints]

    def mend(self, name: str, values: Array) -> bool:
        if name in self.used:  # a free body has no rotor and no spring, and its damping is in other axes
            wrong, self.used[name] = values != self.used[name], values
            self.settle()
            return name == "gravity" or not any(wrong[self.order.v[at]].any() for at, _ in self.order.turned)
        joints = wrong_masses(self.numbers(), self.stated)
        for k, bodies in bodies_of(self.plant, self.joints).items():
            if k in joints and bodies:
                stated = Body(self.stated["mass"][k], self.stated["com"][k], self.stated["inertia"][k])
                self.inertias |= set_masses(self.context, bodies, stated)
        self.settle()
        return bool(near(self.numbers()[name], values).all())

    def settle(self) -> None:
        """Make the plant of single states, without damping and springs, which act as part of the force there."""
        self.simulators.clear()
        self.plant = finished(self.file, 0.0, self.joints, self.used, None)
        self.context = self.plant.CreateDefaultContext()
        self.set_numbers(self.plant, self.context, acts=False)
        self.force = fixed_force(self.plant, self.context)
        self.forward_dynamics = self.plant.get_generalized_acceleration_output_port()

    def set_numbers(self, plant: Any, context: Any, acts: bool) -> None:
        """The numbers of a context. acts: damping does."""
        damping = self.used["damping"][self.order.v] * acts
        for joint in map(plant.get_joint, self.joints):
            joint.SetDampingVector(context, damping[joint.velocity_start() :][: joint.num_velocities()])
        for index, inertia in self.inertias.items():
            plant.get_body(index).SetSpatialInertiaInBodyFrame(context, inertia)

    def mass_matrix(self, q: Array) -> Array:
        self.plant.SetPositions(self.context, *self.order.engine(q))
        return self.order.tree_matrix(q, self.plant.CalcMassMatrix(self.context))

    def bias(self, q: Array, v: Array) -> Array:
        self.plant.SetPositionsAndVelocities(self.context, np.concatenate(self.order.engine(q, v)))
        gravity = self.plant.CalcGravityGeneralizedForces(self.context)
        return self.order.tree(q, self.plant.CalcBiasTerm(self.context) - gravity)

    def acceleration(self, q: Array, v: Array, force: Array) -> Array:
        q_drake, v_drake, force = self.order.engine(q, v, force)
        self.plant.SetPositionsAndVelocities(self.context, np.concatenate([q_drake, v_drake]))
        self.force.SetFromVector(force)
        return self.order.tree(q, self.forward_dynamics.Eval(self.context))

    def prepare(self, course: Course) -> None:
        self.simulator(course)

    def simulator(self, course: Course) -> tuple[Any, Any, Any]:
        """A simulator, the plant, and the plant's context in it."""
        from pydrake.systems.analysis import ResetIntegratorFromFlags, Simulator

        tau, method, tolerance = course.tau, course.method, course.tolerance
        dt = course.dt if course.steps else None
        key = method, tuple(tau), dt, tolerance
        if key not in self.simulators:
            of_plant = course.dt if method == "discrete" else 0.0
            plant = finished(self.file, of_plant, self.joints, self.used, self.stated["rest"])
            turns = any(tau[self.order.v[at]].any() for at, _ in self.order.turned)
            system = with_turned_force(plant, self.order, tau) if turns else plant
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

    def run(self, course: Course) -> tuple[Array, int]:
        simulator, plant, context = self.simulator(course)
        q, v = self.order.engine(course.q, course.v)
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
        path = self.order.tree_states(*np.split(np.array(states), [len(q)], axis=1))
        return path, course.steps if is_discrete else evaluations
