"""Drake's MultibodyPlant of a robot's file; only where pydrake is installed (the extra `drake`).

Each hinge and slide has a rotor in place of the file's actuators, and one of Drake's springs: so Drake's own equations have the
armature and the stiffness that its parser has dropped.
"""

import logging
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from tmt import Tree

from ..robots.coordinates import point_inertia
from . import Array, Course, EngineRecord
from .outside.mjcf_text import original_or_copy
from .outside.model import Body, File, Link, Numbers, OtherJoints, OtherNames, ReadModel
from .outside.order import order_of

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
        self.file, self.rotors = file, dict[str, float]()  # reflected inertias, by the names of joints
        self.inertias: dict[Any, Any] = {}  # of bodies that are set
        self.simulators: dict[Any, tuple[Any, Any, Any]] = {}
        plant, self.source, self.copied = original_or_copy(file.path, self.read)
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
            armature[place], damping[place] = (
                self.rotors.get(joint.name(), 0.0),
                joint.default_damping_vector(),
            )
        gravity = plant.gravity_field().gravity_vector()
        self.used = {"gravity": gravity, "armature": armature, "damping": damping, "stiffness": stiffness}
        self.settle()

    def read(self, path: Path) -> Any:
        """The plant of a file, as it is, and the numbers of its joints in the Tree: of a free body that of its ball."""
        plant, file = self.parsed(path, 0.0), self.file
        plant.Finalize()
        joints = joints_of(plant)
        free = [joint.index() for joint in joints if joint.num_velocities() == 6]  # called as their bodies
        names = {joint.index(): joint.name() for joint in joints if joint.num_velocities() in (1, 3)}
        names |= zip(free, [f"{name} turn" for name in file.free])
        slides = {f"{name} {part}" for name in file.free for part in "xyz"}
        expected = {name: k for k, name in enumerate(file.names) if name not in slides}
        if len(free) != len(file.free) or plant.num_velocities() != file.coordinates.nv:
            raise OtherJoints(f"it has {plant.num_velocities()} speeds, the file {file.coordinates.nv}")
        if missing := [name for name in expected if name not in names.values()]:
            raise OtherNames(f"it has no joint {missing[0]!r}")
        self.joints = {index: expected[name] for index, name in names.items()}
        return plant

    def parsed(self, source: Path | str, dt: float) -> Any:
        """A plant that is not final, without actuators and limits. source: the path of what Drake reads, or MJCF text."""
        from pydrake.multibody.parsing import Parser
        from pydrake.multibody.plant import MultibodyPlant

        logging.getLogger("drake").setLevel(logging.CRITICAL)  # set by importing pydrake
        plant = MultibodyPlant(dt)
        parser = Parser(plant)
        is_path = isinstance(source, Path)
        instances = parser.AddModels(str(source)) if is_path else parser.AddModelsFromString(source, "xml")
        if not self.file.free:  # a URDF's first body, which MuJoCo fixes to the world
            bodies = {body for instance in instances for body in plant.GetBodyIndices(instance)}
            for body in bodies - {joint.child_body().index() for joint in joints_of(plant)}:
                plant.WeldFrames(plant.world_frame(), plant.get_body(body).body_frame())
        for actuator in map(plant.get_joint_actuator, plant.GetJointActuatorIndices()):
            # of several the last one counts in M
            self.rotors[actuator.joint().name()] = actuator.default_reflected_inertia()
            plant.RemoveJointActuator(actuator)
        for constraint in plant.GetConstraintIds():
            plant.RemoveConstraint(constraint)
        for joint in joints_of(plant):
            unlimited = np.full(joint.num_positions(), np.inf)
            joint.set_position_limits(-unlimited, unlimited)
        return plant

    def finished(self, dt: float, has_springs: bool) -> Any:
        """A final plant with the gravity, armature and springs that are used."""
        from pydrake.multibody.tree import PrismaticSpring, RevoluteSpring

        plant, springs = (
            self.parsed(self.source, dt),
            {"revolute": RevoluteSpring, "prismatic": PrismaticSpring},
        )
        plant.mutable_gravity_field().set_gravity_vector(self.used["gravity"])
        for joint in joints_of(plant):
            if joint.type_name() not in springs:
                continue
            place = self.file.coordinates.places.joints[self.joints[joint.index()]]
            if inertia := self.used["armature"][place.qd.start]:
                rotor = plant.AddJointActuator(f"rotor of {joint.name()}", joint)
                rotor.set_default_rotor_inertia(inertia)
            stiffness = self.used["stiffness"][place.qd.start]
            if has_springs and stiffness:
                rest = self.stated["rest"][place.q.start]
                plant.AddForceElement(springs[joint.type_name()](joint, rest, stiffness))
        plant.Finalize()
        return plant

    def settle(self) -> None:
        """Make the plant of single states, without damping and springs, which act as part of the force there."""
        self.simulators.clear()
        self.plant = self.finished(0.0, has_springs=False)
        self.context = self.plant.CreateDefaultContext()
        self.set_numbers(self.plant, self.context, acts=False)
        self.force = fixed_force(self.plant, self.context)
        self.forward_dynamics = self.plant.get_generalized_acceleration_output_port()
        self.dual_plant = self.plant.ToAutoDiffXd()
        self.dual_context = self.dual_plant.CreateDefaultContext()

    def set_numbers(self, plant: Any, context: Any, acts: bool) -> None:
        """The numbers of a context. acts: damping does."""
        damping = self.used["damping"][self.order.v] * acts
        for joint in map(plant.get_joint, self.joints):
            joint.SetDampingVector(context, damping[joint.velocity_start() :][: joint.num_velocities()])
        for index, inertia in self.inertias.items():
            plant.get_body(index).SetSpatialInertiaInBodyFrame(context, inertia)

    def in_drake(self, q: Array, *vectors: Array) -> list[Array]:
        """q, and vectors of speeds or forces, as Drake has them: of a ball roll, pitch, yaw."""
        placed = self.order.engine(q, *vectors)
        for angles, quaternion, _ in self.balls:
            placed[0][angles] = Rotation.from_quat(np.roll(q[quaternion], -1)).as_euler("xyz")
        return placed

    def in_tree(self, q: Array, v: Array) -> Array:
        """A state of Drake as that of the Tree, q and v side by side."""
        placed = self.order.positions(q)
        for angles, quaternion, _ in self.balls:
            placed[quaternion] = np.roll(Rotation.from_euler("xyz", q[angles]).as_quat(), 1)
        return np.concatenate([placed, self.order.tree(placed, v)])

    def fields(self) -> Numbers:
        return self.used

    def set_field(self, name: str, values: Array) -> bool:
        """A free body has no rotor and no spring, and its damping is in other axes; as a ball's rotor."""
        wrong, self.used[name] = values != self.used[name], values
        self.settle()
        balls = [speeds for *_, speeds in self.balls] if name == "damping" else []
        turned = [at for at, _ in self.order.turned if at not in balls]
        return name == "gravity" or not any(wrong[self.order.v[at]].any() for at in turned)

    def links(self, q: Array) -> list[Link]:
        from pydrake.multibody.tree import BodyIndex

        self.plant.SetPositions(self.context, *self.in_drake(q))
        inboard = {int(joint.child_body().index()): joint for joint in joints_of(self.plant)}
        links = []
        for index in range(1, self.plant.num_bodies()):
            body, joint = self.plant.get_body(BodyIndex(index)), inboard.get(index)
            inertia, pose = (
                body.CalcSpatialInertiaInBodyFrame(self.context),
                body.EvalPoseInWorld(self.context),
            )
            mass, com = inertia.get_mass(), inertia.get_com()
            about_com = inertia.CalcRotationalInertia().CopyToFullMatrix3() - point_inertia(com, mass)
            parent = int(joint.parent_body().index()) if joint else None
            number = self.joints.get(joint.index()) if joint else None
            place = pose.rotation().matrix(), pose.translation()
            links.append(Link(index, parent, number, *place, Body(mass, com, about_com)))
        return links

    def set_body(self, link: Link, body: Body) -> None:
        from pydrake.multibody.tree import BodyIndex, RotationalInertia, SpatialInertia

        inertia, axes = SpatialInertia.Zero(), np.triu_indices(3, 1)
        if body.mass:
            tensor = RotationalInertia(*np.diag(body.inertia), *body.inertia[axes])
            inertia = SpatialInertia.MakeFromCentralInertia(body.mass, body.com, tensor)
        self.inertias[BodyIndex(link.name)] = inertia
        self.set_numbers(self.plant, self.context, acts=False)

    def mass_matrix(self, q: Array) -> Array:
        self.plant.SetPositions(self.context, *self.in_drake(q))
        return self.order.tree_matrix(q, self.plant.CalcMassMatrix(self.context))

    def bias(self, q: Array, v: Array) -> Array:
        self.plant.SetPositionsAndVelocities(self.context, np.concatenate(self.in_drake(q, v)))
        gravity = self.plant.CalcGravityGeneralizedForces(self.context)
        return self.order.tree(q, self.plant.CalcBiasTerm(self.context) - gravity)

    def acceleration(self, q: Array, v: Array, force: Array) -> Array:
        *state, force = self.in_drake(q, v, force)
        self.plant.SetPositionsAndVelocities(self.context, np.concatenate(state))
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
        plant, context = self.dual_plant, self.dual_context
        context.SetTimeStateAndParametersFrom(self.context)
        plant.SetPositionsAndVelocities(context, values[: 2 * n])
        plant.get_applied_generalized_force_input_port().FixValue(context, values[2 * n :])
        accelerations = plant.get_generalized_acceleration_output_port().Eval(context)
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
        if key in self.simulators:
            return self.simulators[key]
        self.simulators.clear()
        plant = self.finished(course.dt if method == "discrete" else 0.0, has_springs=True)
        turns = any(tau[self.order.v[at]].any() for at, _ in self.order.turned)
        depends = turns or course.servos is not None
        simulator = Simulator(self.with_force(plant, course) if depends else plant)
        context = plant.GetMyMutableContextFromRoot(simulator.get_mutable_context())
        self.set_numbers(plant, context, acts=True)
        if not depends:
            fixed_force(plant, context).SetFromVector(tau[self.order.v])
        if method != "discrete":
            scheme = SCHEMES[method.removesuffix(" adaptive")][1]
            integrator = ResetIntegratorFromFlags(simulator, scheme, dt or LONGEST)
            integrator.set_fixed_step_mode(tolerance is None)
            if tolerance or method in ITERATES:
                integrator.set_target_accuracy(tolerance or ITERATED)
        self.simulators[key] = simulator, plant, context
        return self.simulators[key]

    def with_force(self, plant: Any, course: Course) -> Any:
        """A system of the plant and of the force of a course, in Drake's axes, computed in Python at each evaluation."""
        from pydrake.systems.framework import DiagramBuilder, LeafSystem

        nq = plant.num_positions()

        def set_force(context: Any, output: Any) -> None:
            state = forces.get_input_port().Eval(context)
            q, v = np.split(self.in_tree(state[:nq], state[nq:]), [self.file.coordinates.nq])
            output.SetFromVector(self.in_drake(q, course.force(q, v))[1])

        forces, builder = LeafSystem(), DiagramBuilder()
        forces.DeclareVectorInputPort("state", plant.num_multibody_states())
        forces.DeclareVectorOutputPort("force", plant.num_velocities(), set_force)
        builder.AddSystem(plant)
        builder.AddSystem(forces)
        builder.Connect(plant.get_state_output_port(), forces.get_input_port())
        builder.Connect(forces.get_output_port(), plant.get_applied_generalized_force_input_port())
        return builder.Build()

    def run(self, course: Course) -> tuple[Array, int]:
        simulator, plant, context = self.simulator(course)
        q, v = self.in_drake(course.q, course.v)
        simulator.get_mutable_context().SetTime(0.0)
        plant.SetPositionsAndVelocities(context, np.concatenate([q, v]))
        simulator.get_mutable_integrator().ResetStatistics()
        simulator.Initialize()
        states, is_discrete = [self.in_tree(q, v)], course.method == "discrete"
        for t in course.times[1:]:
            try:  # the last of the discrete steps up to t begins at t - dt
                simulator.AdvanceTo(t - 0.5 * course.dt if is_discrete else t)
            except RuntimeError:  # it finds no step, or no solution of its equations
                break
            states.append(self.in_tree(plant.GetPositions(context), plant.GetVelocities(context)))
        evaluations = simulator.get_integrator().get_num_derivative_evaluations()
        return np.array(states), course.steps if is_discrete else evaluations


def joints_of(plant: Any) -> list[Any]:
    return [plant.get_joint(index) for index in plant.GetJointIndices()]


def fixed_force(plant: Any, context: Any) -> Any:
    """The vector of generalized forces in a context, in Drake's order and axes."""
    port = plant.get_applied_generalized_force_input_port()
    return port.FixValue(context, np.zeros(plant.num_velocities())).GetMutableData().get_mutable_value()
