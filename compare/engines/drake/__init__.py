"""Drake's MultibodyPlant of a robot's file; only where pydrake is installed (the extra `drake`)."""

from pathlib import Path
from typing import Any

import numpy as np

from tmt import Tree

from ...robots.coordinates import point_inertia
from .. import Array, Course, EngineRecord
from ..outside.bodies import Body, Link
from ..outside.file import File, OtherJoints, OtherNames
from ..outside.mjcf_text import original_or_copy
from ..outside.model import ReadModel
from ..outside.order import ANGLES, Order, State, of_free
from .plant import add_passive, fixed_force, joints_of, parsed
from .simulation import DISCRETE, SCHEMES, Simulation

ENGINE = EngineRecord(
    order=50, label="Drake", colour="#D55E00", marker="P", package="pydrake", reads_file=True
)
METHODS: dict[str, tuple[int | None, str]] = {
    name: (order, f"drake_{scheme}") for name, (order, scheme) in SCHEMES.items()
}
for name in ("RK3", "RK5", "Radau3"):
    METHODS[f"{name} adaptive"] = None, f"drake_{SCHEMES[name][1]}_adaptive"
METHODS[DISCRETE] = 1, "semi_implicit_euler"


def methods_for(tree: Tree) -> dict[str, tuple[int | None, str]]:
    """discrete adds dt times the rate of a quaternion, and normalizes."""
    return METHODS | ({DISCRETE: (1, "drake_discrete")} if tree.coordinates.balls else {})


class Model(ReadModel):
    has_links = True

    def __init__(self, file: File, precision: str):
        self.file = file
        self.inertias: dict[Any, Any] = {}  # of bodies that are set
        self.simulated: tuple[object, ...] | None = None  # what the last simulation is of
        self.dual: tuple[Any, Any] | None = None  # the plant over dual numbers, and a context
        plant, self.source, self.copied = original_or_copy(file.path, self.read)
        joints = {k: plant.get_joint(index) for index, k in self.joints.items()}
        starts = {k: (joint.position_start(), joint.velocity_start()) for k, joint in joints.items()}
        for k, (q, v) in list(starts.items()):
            starts |= of_free(k, (q + 4, v + 3), (q, v)) if file.is_free(k) else {}
        self.order = Order(file, starts, ball=ANGLES, angular_in_world=True, balls_in_parent=True)
        armature, damping = np.zeros((2, file.coordinates.nv))
        for joint in joints.values():
            place = self.order.v[joint.velocity_start() :][: joint.num_velocities()]
            armature[place] = self.rotors.get(joint.name(), 0.0)
            damping[place] = joint.default_damping_vector()
        gravity, stiffness = plant.gravity_field().gravity_vector(), np.zeros_like(armature)
        self.used = {"gravity": gravity, "armature": armature, "damping": damping, "stiffness": stiffness}
        self.settle()

    def read(self, path: Path) -> Any:
        """The plant of a file, as it is, and the numbers of its joints in the Tree: of a free body that of its ball."""
        file = self.file
        plant, self.rotors = parsed(path, 0.0, bool(file.free))
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
        self.joints = {index: expected[name] for index, name in names.items()}
        return plant

    def plant_of(self, dt: float, has_springs: bool) -> Any:
        """A final plant with the gravity, armature and springs that are used."""
        plant, _ = parsed(self.source, dt, bool(self.file.free))
        plant.mutable_gravity_field().set_gravity_vector(self.used["gravity"])
        for index, k in self.joints.items():
            place = self.file.coordinates.places.joints[k]
            if place.kind != "ball":
                armature, stiffness = (
                    float(self.used[name][place.qd.start]) for name in ("armature", "stiffness")
                )
                spring = (stiffness, self.stated["rest"][place.q.start]) if has_springs else (0.0, 0.0)
                add_passive(plant, plant.get_joint(index), armature, *spring)
        plant.Finalize()
        return plant

    def settle(self) -> None:
        """Make the plant of single states, without damping and springs, which act as part of the force there."""
        self.simulated = self.dual = None
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

    def apply(self, name: str) -> None:
        self.settle()

    def unable(self, name: str) -> Array:
        """Balls have no rotor and no spring, and the damping of a free body is in other axes."""
        is_of_ball = np.array(self.file.coordinates.kinds_of_speeds) == "ball"
        return self.order.is_of_free() | (is_of_ball & (name != "damping"))

    def links(self, at: State) -> list[Link]:
        from pydrake.multibody.tree import BodyIndex

        self.plant.SetPositions(self.context, at.x)
        inboard = {int(joint.child_body().index()): joint for joint in joints_of(self.plant)}
        links = []
        for index in range(1, self.plant.num_bodies()):
            body, joint = self.plant.get_body(BodyIndex(index)), inboard.get(index)
            inertia = body.CalcSpatialInertiaInBodyFrame(self.context)
            mass, com, pose = inertia.get_mass(), inertia.get_com(), body.EvalPoseInWorld(self.context)
            about_com = inertia.CalcRotationalInertia().CopyToFullMatrix3() - point_inertia(com, mass)
            parent = int(joint.parent_body().index()) if joint else None
            number = self.joints.get(joint.index()) if joint else None
            place = pose.rotation().matrix(), pose.translation()
            links.append(Link(index, parent, number, *place, Body(mass, com, about_com)))
        return links

    def set_body(self, link: Link, body: Body) -> bool:
        from pydrake.multibody.tree import BodyIndex, RotationalInertia, SpatialInertia

        inertia, axes = SpatialInertia.Zero(), np.triu_indices(3, 1)
        if body.mass:
            tensor = RotationalInertia(*np.diag(body.inertia), *body.inertia[axes])
            inertia = SpatialInertia.MakeFromCentralInertia(body.mass, body.com, tensor)
        self.inertias[BodyIndex(link.name)] = inertia
        self.set_numbers(self.plant, self.context, acts=False)
        return True

    def mass_matrix(self, at: State) -> Array:
        self.plant.SetPositions(self.context, at.x)
        return np.array(self.plant.CalcMassMatrix(self.context))

    def bias(self, at: State) -> Array:
        self.plant.SetPositionsAndVelocities(self.context, np.concatenate([at.x, at.u]))
        gravity = self.plant.CalcGravityGeneralizedForces(self.context)
        return np.asarray(self.plant.CalcBiasTerm(self.context) - gravity)

    def acceleration(self, at: State, force: Array) -> Array:
        self.plant.SetPositionsAndVelocities(self.context, np.concatenate([at.x, at.u]))
        self.force.SetFromVector(force)
        return np.array(self.forward_dynamics.Eval(self.context))

    @property
    def quantities(self) -> tuple[str, ...]:
        """Quaternions do not move like numbers, nor do the angles of a ball."""
        return super().quantities + ("derivatives",) * (not self.file.coordinates.has_balls)

    def derivatives(self, at: State, force: Array) -> Array:
        """By AutoDiffXd, Drake's dual numbers."""
        from pydrake.autodiffutils import ExtractGradient, InitializeAutoDiff

        n, values = at.u.size, InitializeAutoDiff(np.concatenate([at.x, at.u, force]))[:, 0]
        if self.dual is None:
            plant = self.plant.ToAutoDiffXd()
            self.dual = plant, plant.CreateDefaultContext()
        plant, context = self.dual
        context.SetTimeStateAndParametersFrom(self.context)
        plant.SetPositionsAndVelocities(context, values[: 2 * n])
        plant.get_applied_generalized_force_input_port().FixValue(context, values[2 * n :])
        accelerations = plant.get_generalized_acceleration_output_port().Eval(context)
        return np.array(np.split(ExtractGradient(accelerations), 3, axis=1))

    def prepare(self, course: Course) -> None:
        self.simulation(course)

    def simulation(self, course: Course) -> Simulation:
        """That of a course; the last one is kept."""
        setting = course.method, course.dt, course.steps, course.tolerance
        key = *setting, course.tau.tobytes(), course.servos is None
        if key != self.simulated:
            dt = course.dt if course.method == DISCRETE else 0.0
            plant = self.plant_of(dt, has_springs=True)
            self.simulated, self.last = key, Simulation(plant, self.order, course)
            self.set_numbers(plant, self.last.context, acts=True)
        return self.last

    def run(self, course: Course) -> tuple[Array, int]:
        return self.simulation(course).run(course)
