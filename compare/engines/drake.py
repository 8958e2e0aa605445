"""Drake's MultibodyPlant of a robot's file; only where pydrake is installed (the extra `drake`)."""

import logging
from typing import Any

import numpy as np

from tmt import Tree

from ..robots.coordinates import point_inertia
from . import Array, Course
from .outside.bodies import Body, Link
from .outside.file import EngineError, File, OtherJoints, OtherNames
from .outside.model import ReadModel
from .outside.order import ANGLES, Order, State, of_free

SCHEMES = {"RK2": (2, "runge_kutta2"), "RK3": (3, "runge_kutta3"), "RK5": (5, "runge_kutta5"),
           "implicit Euler": (1, "implicit_euler"), "Radau3": (3, "radau3")}  # fmt: skip
ADAPTIVE, DISCRETE = " adaptive", "discrete"  # of some schemes; the plant's own step
ITERATES, ITERATED = ("implicit Euler", "Radau3"), 1e-12  # relative accuracy of iterations at fixed steps
LONGEST = 0.1  # s, of a step of a method that chooses its own: Drake's default
METHODS: dict[str, tuple[int | None, str]] = {
    **{name: (order, f"drake_{scheme}") for name, (order, scheme) in SCHEMES.items()},
    **{name + ADAPTIVE: (None, f"drake_{SCHEMES[name][1]}_adaptive") for name in ("RK3", "RK5", "Radau3")},
    DISCRETE: (1, "semi_implicit_euler"),
}


def methods_for(tree: Tree) -> dict[str, tuple[int | None, str]]:
    """discrete adds dt times the rate of a quaternion, and normalizes."""
    return METHODS | ({DISCRETE: (1, "drake_discrete")} if tree.coordinates.balls else {})


class Model(ReadModel):
    """Plants of the file: one without damping and springs, which are part of the force there, for single states."""

    def __init__(self, file: File, precision: str):
        self.file = file
        self.inertias: dict[Any, Any] = {}  # of bodies that are set
        plant, rotors = self.parsed(0.0)
        plant.Finalize()
        joints = joints_of(plant)
        free = [joint.index() for joint in joints if joint.num_velocities() == 6]  # called as their bodies
        names = {joint.index(): joint.name() for joint in joints if joint.num_velocities() in (1, 3)}
        names |= zip(free, [f"{name} turn" for name in file.free])
        slides = {f"{name} {part}" for name in file.free for part in "xyz"}
        expected = {name: k for k, name in enumerate(file.names) if name not in slides}
        if len(free) != len(file.free) or plant.num_velocities() != file.coordinates.nv:
            raise OtherJoints(plant.num_velocities(), file.coordinates.nv)
        if missing := [name for name in expected if name not in names.values()]:
            raise OtherNames(f"it has no joint {missing[0]!r}")
        # the numbers of its joints in the Tree: of a free body that of its ball
        self.joints = {index: expected[name] for index, name in names.items()}
        starts: dict[int, tuple[int, int]] = {}
        armature, damping = np.zeros((2, file.coordinates.nv))
        for joint, k in zip(map(plant.get_joint, self.joints), self.joints.values()):
            q, v = joint.position_start(), joint.velocity_start()
            starts |= of_free(k, (q + 4, v + 3), (q, v)) if file.is_free(k) else {k: (q, v)}
        self.order = Order(file, starts, ball=ANGLES, angular_in_world=True, balls_in_parent=True)
        for joint in map(plant.get_joint, self.joints):
            place = self.order.v[joint.velocity_start() :][: joint.num_velocities()]
            armature[place] = rotors.get(joint.name(), 0.0)
            damping[place] = joint.default_damping_vector()
        gravity, stiffness = plant.gravity_field().gravity_vector(), np.zeros_like(armature)
        self.used = {"gravity": gravity, "armature": armature, "damping": damping, "stiffness": stiffness}
        self.rest = np.zeros(file.coordinates.nq)
        self.settle()

    def parsed(self, dt: float) -> tuple[Any, dict[str, float]]:
        """A plant that is not final, without actuators, limits and constraints; and the rotors of joints, by name."""
        from pydrake.multibody.parsing import Parser
        from pydrake.multibody.plant import MultibodyPlant

        logging.getLogger("drake").setLevel(logging.CRITICAL)  # set by importing pydrake
        plant, path, kind = MultibodyPlant(dt), self.file.path, "urdf" if self.file.is_urdf else "xml"
        parser, is_known = Parser(plant), path.suffix == f".{kind}"  # Drake knows a URDF by its name alone
        text = "" if is_known else path.read_text(encoding="utf-8")
        instances = parser.AddModels(str(path)) if is_known else parser.AddModelsFromString(text, kind)
        if not self.file.free:  # Drake would free the base of a URDF
            bodies = {body for instance in instances for body in plant.GetBodyIndices(instance)}
            for body in bodies - {joint.child_body().index() for joint in joints_of(plant)}:
                plant.WeldFrames(plant.world_frame(), plant.get_body(body).body_frame())
        rotors = {}
        for actuator in map(plant.get_joint_actuator, plant.GetJointActuatorIndices()):
            # of several the last counts
            rotors[actuator.joint().name()] = actuator.default_reflected_inertia()
            plant.RemoveJointActuator(actuator)
        for constraint in plant.GetConstraintIds():
            plant.RemoveConstraint(constraint)
        for joint in joints_of(plant):
            unlimited = np.full(joint.num_positions(), np.inf)
            joint.set_position_limits(-unlimited, unlimited)
        return plant, rotors

    def plant_of(self, dt: float, has_springs: bool) -> Any:
        """A final plant with the gravity, rotors and springs that are used."""
        from pydrake.multibody.tree import PrismaticSpring, RevoluteSpring

        plant, _ = self.parsed(dt)
        plant.mutable_gravity_field().set_gravity_vector(self.used["gravity"])
        for index, k in self.joints.items():
            place = self.file.coordinates.places.joints[k]
            if place.kind == "ball":  # a free joint is there only once the plant is final
                continue
            joint = plant.get_joint(index)
            speed = place.qd.start
            armature, stiffness = float(self.used["armature"][speed]), float(self.used["stiffness"][speed])
            if armature:
                plant.AddJointActuator(f"rotor of {joint.name()}", joint).set_default_rotor_inertia(armature)
            if stiffness and has_springs:
                spring = RevoluteSpring if joint.type_name() == "revolute" else PrismaticSpring
                plant.AddForceElement(spring(joint, self.rest[place.q.start], stiffness))
        plant.Finalize()
        return plant

    def settle(self) -> None:
        """Make the plant of single states."""
        self.simulated: tuple[object, ...] = ()  # what the last simulation is of
        self.plant = self.plant_of(0.0, has_springs=False)
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

    def set(self, name: str, values: Array) -> None:
        """Balls have no rotor and no spring, and the damping of a free body is in other axes: they are left as they are."""
        is_left = np.zeros(np.shape(values), bool)
        if name != "gravity":
            is_left = self.order.of_free | (self.order.of_ball & (name != "damping"))
        self.rest = self.stated["rest"]
        self.used[name] = np.where(is_left, self.used[name], values)
        self.settle()

    def links(self, at: State) -> list[Link]:
        from pydrake.multibody.tree import BodyIndex

        self.plant.SetPositions(self.context, at.x)
        inboard = {int(joint.child_body().index()): joint for joint in joints_of(self.plant)}
        movers: dict[int, int | None] = {0: None}  # the joints of the Tree, by the indices of bodies

        def mover(index: int) -> int | None:
            if index not in movers:
                joint = inboard[index]
                number = self.joints.get(joint.index())
                movers[index] = mover(int(joint.parent_body().index())) if number is None else number
            return movers[index]

        links = []
        for index in range(1, self.plant.num_bodies()):
            body = self.plant.get_body(BodyIndex(index))
            inertia = body.CalcSpatialInertiaInBodyFrame(self.context)
            mass, com, pose = inertia.get_mass(), inertia.get_com(), body.EvalPoseInWorld(self.context)
            about_com = inertia.CalcRotationalInertia().CopyToFullMatrix3() - point_inertia(com, mass)
            place = pose.rotation().matrix(), pose.translation()
            links.append(Link(index, mover(index), *place, Body(mass, com, about_com)))
        return links

    def set_body(self, link: Link, body: Body) -> None:
        from pydrake.multibody.tree import BodyIndex, RotationalInertia, SpatialInertia

        inertia = SpatialInertia.Zero()
        if body.mass:
            tensor = RotationalInertia(*np.diag(body.inertia), *body.inertia[np.triu_indices(3, 1)])
            inertia = SpatialInertia.MakeFromCentralInertia(body.mass, body.com, tensor)
        self.inertias[BodyIndex(link.name)] = inertia
        self.set_numbers(self.plant, self.context, acts=False)

    def dynamics(self, at: State, force: Array) -> tuple[Array, Array, Array]:
        plant, context = self.plant, self.context
        plant.SetPositionsAndVelocities(context, np.concatenate([at.x, at.u]))
        self.force.SetFromVector(force)
        bias = plant.CalcBiasTerm(context) - plant.CalcGravityGeneralizedForces(context)
        return plant.CalcMassMatrix(context), bias, np.array(self.forward_dynamics.Eval(context))

    def prepare(self, course: Course) -> None:
        """Make the simulator of a course, with its force and integrator; the last one is kept."""
        from pydrake.systems.analysis import ResetIntegratorFromFlags, Simulator

        key = course.method, course.dt, course.steps, course.tolerance, course.tau.tobytes()
        if key == self.simulated:
            return
        if course.tau[self.order.of_free | self.order.of_ball].any():
            raise EngineError("a torque on a ball or a free body would turn with it, as Drake's axes do not")
        plant = self.plant_of(course.dt if course.method == DISCRETE else 0.0, has_springs=True)
        simulator = Simulator(plant)
        context = plant.GetMyMutableContextFromRoot(simulator.get_mutable_context())
        self.set_numbers(plant, context, acts=True)
        fixed_force(plant, context).SetFromVector(course.tau[self.order.v])
        if course.method != DISCRETE:
            scheme = SCHEMES[course.method.removesuffix(ADAPTIVE)][1]
            integrator = ResetIntegratorFromFlags(simulator, scheme, course.dt if course.steps else LONGEST)
            integrator.set_fixed_step_mode(course.tolerance is None)
            if course.tolerance or course.method in ITERATES:
                integrator.set_target_accuracy(course.tolerance or ITERATED)
        self.simulated, self.simulation = key, (plant, context, simulator)

    def run(self, course: Course) -> tuple[Array, int]:
        self.prepare(course)
        (plant, context, simulator), is_discrete = self.simulation, course.method == DISCRETE
        start = self.order.state(course.q, course.v)
        simulator.get_mutable_context().SetTime(0.0)
        plant.SetPositionsAndVelocities(context, np.concatenate([start.x, start.u]))
        simulator.get_mutable_integrator().ResetStatistics()
        simulator.Initialize()
        states = [course.start]
        for t in course.times[1:]:
            try:  # the last of the discrete steps up to t begins at t - dt
                simulator.AdvanceTo(t - 0.5 * course.dt if is_discrete else t)
            except RuntimeError:  # it finds no step, or no solution of its equations
                break
            reached = self.order.tree_state(plant.GetPositions(context), plant.GetVelocities(context))
            states.append(np.concatenate(reached))
        evaluations = simulator.get_integrator().get_num_derivative_evaluations()
        return np.array(states), course.steps if is_discrete else evaluations


def fixed_force(plant: Any, context: Any) -> Any:
    """The vector of generalized forces in a context, in Drake's order and axes."""
    port = plant.get_applied_generalized_force_input_port()
    return port.FixValue(context, np.zeros(plant.num_velocities())).GetMutableData().get_mutable_value()


def joints_of(plant: Any) -> list[Any]:
    return [plant.get_joint(index) for index in plant.GetJointIndices()]
