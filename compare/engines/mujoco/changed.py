"""A file with other inertial numbers and another gravity, and with a payload."""

from collections.abc import Mapping, Sequence

import mujoco
import numpy as np
from numpy.typing import NDArray

from tmt.export.parameters import PAYLOAD, SIZES, Parameters
from tmt.model.tree import Tree

from .locked import compiled
from .names import element_name
from .source import Source, without_visuals

Array = NDArray[np.float64]
Values = Mapping[str, Array]  # of arguments by name


def changed(source: Source, tree: Tree, parameters: Parameters, values: Values) -> mujoco.MjModel:
    assert source.spec is not None
    spec, model = without_visuals(source.spec), source.model
    state_as_compiled(spec, model, source.bodies)
    bodies = {element_name(model, "body", number): body for body, number in zip(spec.bodies, source.bodies)}
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


def state_as_compiled(spec: mujoco.MjSpec, model: mujoco.MjModel, numbers: Sequence[int]) -> None:
    """State the inertias of all bodies, whose numbers in the model are given, as they were compiled."""
    for body, number in zip(spec.bodies[1:], numbers[1:]):
        state_inertial(body, model.body_mass[number], model.body_ipos[number])
        body.iquat, body.inertia = model.body_iquat[number], model.body_inertia[number]
        body.fullinertia = np.full(6, np.nan)
    spec.compiler.inertiafromgeom = int(mujoco.mjtInertiaFromGeom.mjINERTIAFROMGEOM_FALSE)
    spec.compiler.settotalmass = -1.0


def state_inertial(body: mujoco.MjsBody, mass: float, com: Array) -> None:
    body.mass, body.ipos, body.explicitinertial = mass, com, True
    body.ialt.type = mujoco.mjtOrientation.mjORIENTATION_QUAT
