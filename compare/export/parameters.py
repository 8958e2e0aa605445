"""Parameters of exported equations: their frames in a file, and the file with other values of them."""

from collections.abc import Mapping
from dataclasses import replace

import mujoco
import numpy as np
from numpy.typing import NDArray

from tmt.export.parameters import PAYLOAD, PLACES, SIZES, Parameters
from tmt.model.tree import Tree

from ..engines.mujoco import Source, engine, read
from ..engines.mujoco.names import element_name
from ..engines.mujoco.reading import tree_with_sites
from ..engines.mujoco.source import without_visuals
from ..engines.mujoco.welded import compiled
from ..robots.case import SEED
from ..robots.file import robot_of
from ..run.reference import Compared

Array = NDArray[np.float64]
Values = Mapping[str, Array]  # of arguments by name
LENGTH = 0.1  # m: how far a mass is moved


def with_sites(compared: Compared) -> Compared:
    """The same, with the frames of the file's bodies and sites as sites of the Tree."""
    if compared.reading is None:
        return compared
    tree = tree_with_sites(compared.reading)
    return compared._replace(robot=replace(compared.robot, tree=tree))


def other_values(parameters: Parameters) -> Values:
    """Random values near the model's; masses of a payload are some kg."""
    rng, values = np.random.default_rng(SEED), {}
    for name, stated in parameters.values.items():
        part, _ = parameters.places.get(name, ("gravity", 0))
        value = np.array(stated)
        if part == "mass":
            value = (value + name.startswith(PAYLOAD)) * rng.uniform(0.5, 1.5)
        elif part == "inertia":
            root = rng.uniform(-LENGTH, LENGTH, (3, 3))  # of the second moment of 1 kg
            second = root @ root.T
            tensor = np.trace(second) * np.eye(3) - second
            value = np.array([tensor[place] for place in PLACES])
        else:
            value = value + rng.uniform(-LENGTH, LENGTH, value.shape)
        values[name] = value
    return values


def with_values(compared: Compared, parameters: Parameters, values: Values) -> Compared:
    """What is compared, from the file with these values."""
    reading = read(changed(compared.mujoco.source, compared.robot.tree, parameters, values))
    shown = compared.robot.name
    return with_sites(Compared(compared.reference, robot_of(reading, shown), engine(reading), reading))


def changed(source: Source, tree: Tree, parameters: Parameters, values: Values) -> mujoco.MjModel:
    assert source.spec is not None
    spec, model = without_visuals(source.spec.copy()), source.model
    for body, number in zip(spec.bodies[1:], source.bodies[1:]):  # as they were compiled
        state_inertial(body, model.body_mass[number], model.body_ipos[number])
        body.iquat, body.inertia = model.body_iquat[number], model.body_inertia[number]
        body.fullinertia = np.full(6, np.nan)
    bodies = {element_name(model, "body", number): body for body, number in zip(spec.bodies, source.bodies)}
    spec.compiler.inertiafromgeom = int(mujoco.mjtInertiaFromGeom.mjINERTIAFROMGEOM_FALSE)
    spec.compiler.settotalmass = -1.0
    if parameters.has_payload:
        carrier = bodies[tree.body_names[parameters.carriers[-1]]]
        load = carrier.add_body(name=PAYLOAD)
        mass, com, inertia = (values[f"{PAYLOAD}_{part}"] for part in SIZES)
        state_inertial(load, mass[0], com)
        load.fullinertia = inertia
    for name, (part, number) in parameters.places.items():
        if number == len(tree.mass):
            continue
        body = bodies[tree.body_names[number]]
        if part == "mass":
            body.mass = values[name][0]
        elif part == "com":
            body.ipos = values[name]
        else:
            body.iquat, body.inertia = [1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 0.0]
            body.fullinertia = values[name]
    if "gravity" in values:
        spec.option.gravity = values["gravity"]
    return compiled(spec)


def state_inertial(body: mujoco.MjsBody, mass: float, com: Array) -> None:
    body.mass, body.ipos, body.explicitinertial = mass, com, True
    body.ialt.type = mujoco.mjtOrientation.mjORIENTATION_QUAT
