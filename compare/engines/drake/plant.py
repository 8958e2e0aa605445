"""Plants that Drake's parser makes of a robot's file."""

import logging
from pathlib import Path
from typing import Any

import numpy as np


def parsed(source: Path | str, dt: float, is_free: bool) -> tuple[Any, dict[str, float]]:
    """A plant that is not final, without actuators, limits and constraints; and the reflected inertias of joints, by name.

    source: the path of what Drake reads, or MJCF text. is_free: its base is; that of a URDF is fixed to the world otherwise.
    """
    from pydrake.multibody.parsing import Parser
    from pydrake.multibody.plant import MultibodyPlant

    logging.getLogger("drake").setLevel(logging.CRITICAL)  # set by importing pydrake
    plant = MultibodyPlant(dt)
    parser = Parser(plant)
    is_path = isinstance(source, Path)
    instances = parser.AddModels(str(source)) if is_path else parser.AddModelsFromString(source, "xml")
    if not is_free:
        bodies = {body for instance in instances for body in plant.GetBodyIndices(instance)}
        for body in bodies - {joint.child_body().index() for joint in joints_of(plant)}:
            plant.WeldFrames(plant.world_frame(), plant.get_body(body).body_frame())
    rotors = {}
    for actuator in map(plant.get_joint_actuator, plant.GetJointActuatorIndices()):
        rotors[actuator.joint().name()] = actuator.default_reflected_inertia()  # of several the last counts
        plant.RemoveJointActuator(actuator)
    for constraint in plant.GetConstraintIds():
        plant.RemoveConstraint(constraint)
    for joint in joints_of(plant):
        unlimited = np.full(joint.num_positions(), np.inf)
        joint.set_position_limits(-unlimited, unlimited)
    return plant, rotors


def add_passive(plant: Any, joint: Any, armature: float, stiffness: float, rest: float) -> None:
    """Give a hinge or slide a rotor in place of the file's actuators, and a spring: what the parser may have dropped."""
    from pydrake.multibody.tree import PrismaticSpring, RevoluteSpring

    if armature:
        rotor = plant.AddJointActuator(f"rotor of {joint.name()}", joint)
        rotor.set_default_rotor_inertia(armature)
    if stiffness:
        spring = RevoluteSpring if joint.type_name() == "revolute" else PrismaticSpring
        plant.AddForceElement(spring(joint, rest, stiffness))


def joints_of(plant: Any) -> list[Any]:
    return [plant.get_joint(index) for index in plant.GetJointIndices()]


def fixed_force(plant: Any, context: Any) -> Any:
    """The vector of generalized forces in a context, in Drake's order and axes."""
    port = plant.get_applied_generalized_force_input_port()
    return port.FixValue(context, np.zeros(plant.num_velocities())).GetMutableData().get_mutable_value()
