"""A file as Drake reads it: the plant, its joints, and the masses that they move."""

import logging
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ...robots.coordinates import point_inertia
from .. import Array
from ..outside.model import Body, File, Numbers, OtherJoints, OtherNames


def parsed(file: File, source: Path | str, dt: float) -> tuple[Any, dict[str, float]]:
    """A plant that is not final, without actuators and limits; and the reflected inertia of each joint that has one, by name.

    source: the path of what Drake reads, or MJCF text.
    """
    from pydrake.multibody.parsing import Parser
    from pydrake.multibody.plant import MultibodyPlant

    logging.getLogger("drake").setLevel(logging.CRITICAL)  # set by importing pydrake
    plant = MultibodyPlant(dt)
    parser = Parser(plant)
    is_path = isinstance(source, Path)
    instances = parser.AddModels(str(source)) if is_path else parser.AddModelsFromString(source, "xml")
    if not file.free:  # a URDF's first body, which MuJoCo fixes to the world
        bodies = {body for instance in instances for body in plant.GetBodyIndices(instance)}
        for body in bodies - {joint.child_body().index() for joint in joints_of(plant)}:
            plant.WeldFrames(plant.world_frame(), plant.get_body(body).body_frame())
    rotors = {}
    for actuator in map(plant.get_joint_actuator, plant.GetJointActuatorIndices()):
        # of several the last one counts in M
        rotors[actuator.joint().name()] = actuator.default_reflected_inertia()
        plant.RemoveJointActuator(actuator)
    for constraint in plant.GetConstraintIds():
        plant.RemoveConstraint(constraint)
    for joint in joints_of(plant):
        unlimited = np.full(joint.num_positions(), np.inf)
        joint.set_position_limits(-unlimited, unlimited)
    return plant, rotors


def finished(
    file: File, source: Path | str, dt: float, joints: Mapping[Any, int], numbers: Numbers, rest: Array | None
) -> Any:
    """A final plant with the gravity and armature of `numbers`, and, unless `rest` is None, with its springs."""
    from pydrake.multibody.tree import PrismaticSpring, RevoluteSpring

    plant, springs = parsed(file, source, dt)[0], {"revolute": RevoluteSpring, "prismatic": PrismaticSpring}
    plant.mutable_gravity_field().set_gravity_vector(numbers["gravity"])
    for joint in joints_of(plant):
        if joint.type_name() not in springs:
            continue
        place = file.coordinates.places.joints[joints[joint.index()]]
        if inertia := numbers["armature"][place.qd.start]:
            plant.AddJointActuator(f"rotor of {joint.name()}", joint).set_default_rotor_inertia(inertia)
        if rest is not None and (stiffness := numbers["stiffness"][place.qd.start]):
            plant.AddForceElement(springs[joint.type_name()](joint, rest[place.q.start], stiffness))
    plant.Finalize()
    return plant


def joints_of(plant: Any) -> list[Any]:
    return [plant.get_joint(index) for index in plant.GetJointIndices()]


def joint_numbers(plant: Any, file: File) -> dict[Any, int]:
    """The number in the Tree of each of Drake's joints that move, by its index; of a free body that of its ball."""
    joints = joints_of(plant)
    free = [joint.index() for joint in joints if joint.num_velocities() == 6]  # called as their bodies
    names = {joint.index(): joint.name() for joint in joints if joint.num_velocities() in (1, 3)}
    names |= zip(free, [f"{name} turn" for name in file.free])
    expected = {name: k for k, name in enumerate(file.names)}
    for name in file.free:
        for part in "xyz":
            del expected[f"{name} {part}"]
    if len(free) != len(file.free) or plant.num_velocities() != file.coordinates.nv:
        raise OtherJoints(f"it has {plant.num_velocities()} speeds, the file {file.coordinates.nv}")
    if missing := [name for name in expected if name not in names.values()]:
        raise OtherNames(f"it has no joint {missing[0]!r}")
    return {index: expected[name] for index, name in names.items()}


def bodies_of(plant: Any, joints: Mapping[Any, int]) -> dict[int, list[Any]]:
    """The bodies with mass that move with each joint of the Tree and not with the next one."""
    from pydrake.multibody.tree import BodyIndex

    inboard = {joint.child_body().index(): joint for joint in joints_of(plant)}
    bodies: dict[int, list[Any]] = {k: [] for k in joints.values()}
    for body in (plant.get_body(BodyIndex(i)) for i in range(1, plant.num_bodies())):
        joint = inboard.get(body.index())
        while joint is not None and joint.index() not in joints:
            joint = inboard.get(joint.parent_body().index())
        if joint is not None and body.default_mass():
            bodies[joints[joint.index()]].append(body)
    return bodies


def in_world(context: Any, body: Any) -> Body:
    """What Drake has of a body."""
    inertia, pose = body.CalcSpatialInertiaInBodyFrame(context), body.EvalPoseInWorld(context)
    mass, com, turn = inertia.get_mass(), inertia.get_com(), pose.rotation().matrix()
    about_com = inertia.CalcRotationalInertia().CopyToFullMatrix3() - point_inertia(com, mass)
    return Body(mass, pose.translation() + turn @ com, turn @ about_com @ turn.T)


def set_masses(context: Any, bodies: list[Any], stated: Body) -> dict[Any, Any]:
    """Spatial inertias of bodies that move as one, by their indices: all of it in the first of them."""
    from pydrake.multibody.tree import RotationalInertia, SpatialInertia

    pose = bodies[0].EvalPoseInWorld(context)
    turn = pose.rotation().matrix()
    com, inertia = turn.T @ (stated.com - pose.translation()), turn.T @ stated.inertia @ turn
    tensor = RotationalInertia(*np.diag(inertia), inertia[0, 1], inertia[0, 2], inertia[1, 2])
    together = SpatialInertia.MakeFromCentralInertia(stated.mass, com, tensor)
    return {body.index(): SpatialInertia.Zero() for body in bodies} | {bodies[0].index(): together}


def twists_of(context: Any, joints: Mapping[int, Any]) -> dict[int, tuple[Array, Array, Array]]:
    """ReadModel.twists of joints by their numbers in the Tree."""
    twists = {}
    for k, joint in joints.items():
        pose, kind, none = joint.frame_on_child().CalcPoseInWorld(context), joint.type_name(), np.zeros(3)
        axes = {"revolute": "revolute_axis", "prismatic": "translation_axis"}
        axis = pose.rotation().matrix() @ getattr(joint, axes[kind])() if kind in axes else none
        velocity = (axis, none) if kind == "prismatic" else (none, axis)
        if joint.num_velocities() < 6:  # not of a free body
            twists[k] = *velocity, pose.translation()
    return twists


def fixed_force(plant: Any, context: Any) -> Any:
    """The vector of generalized forces in a context, in Drake's order and axes."""
    port = plant.get_applied_generalized_force_input_port()
    return port.FixValue(context, np.zeros(plant.num_velocities())).GetMutableData().get_mutable_value()


def with_force(plant: Any, force: Callable[[Array], Array]) -> Any:
    """A system of the plant and of a force, (nv,) in Drake's axes, of Drake's q and v, computed in Python at each evaluation."""
    from pydrake.systems.framework import DiagramBuilder, LeafSystem

    def turned(context: Any, output: Any) -> None:
        output.SetFromVector(force(forces.get_input_port().Eval(context)))

    forces, builder = LeafSystem(), DiagramBuilder()
    forces.DeclareVectorInputPort("state", plant.num_multibody_states())
    forces.DeclareVectorOutputPort("force", plant.num_velocities(), turned)
    builder.AddSystem(plant)
    builder.AddSystem(forces)
    builder.Connect(plant.get_state_output_port(), forces.get_input_port())
    builder.Connect(forces.get_output_port(), plant.get_applied_generalized_force_input_port())
    return builder.Build()
