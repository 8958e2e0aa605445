"""Parameters of exported equations: their frames in a file, and the file with other values of them."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from tmt.export.parameters import PAYLOAD, PLACES, Parameters

from ..engines.mujoco import engine, read
from ..engines.mujoco.reading import tree_with_sites
from ..engines.mujoco.smaller import changed
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
