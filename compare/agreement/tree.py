"""A robot's file as a Tree of tmt."""

from __future__ import annotations  # so that help() shows the short names of types

import warnings
from os import PathLike
from typing import Any

import tmt

from ..core.finding import Finding
from ..core.text import say


def tree(mjcf: str | PathLike[str] | Any, *, floating: bool = False) -> tmt.Tree:
    """The Tree of a robot's file: its joints and bodies with the numbers that MuJoCo compiles.

    Joints and bodies have the names and the order of the file; a free joint b is three slides b x, b y, b z
    and a ball b turn, with q, qd and tau as in MuJoCo. The frames of all bodies and sites are its sites, for
    `tmt.frame`.

    Parameters
    ----------
    mjcf : path of MJCF or URDF, MJCF text or MjModel
    floating : give the base of a URDF a free joint: else it is fixed to the world

    Raises
    ------
    ValueError
        For a model that cannot be read, or that has what no Tree can have, such as armature of tendons.

    Warns
    -----
    UserWarning
        One line with all that the file has and the Tree has not: contacts, limits, friction, actuators,
        equalities, tendons, fluid, gravity compensation. One for a fixed base, and one for unread meshes.

    Examples
    --------
    >>> inertia = '<inertial pos="0 0 -0.5" mass="2" diaginertia="0.1 0.1 0.01"/><site name="tip" pos="0 0 -1"/>'
    >>> mjcf = f'<mujoco><worldbody><body><joint name="hip" axis="0 1 0"/>{inertia}</body></worldbody></mujoco>'
    >>> pendulum = compare.tree(mjcf)
    >>> print(tmt.frame(pendulum, "tip", [np.pi / 2]).position.round(9) + 0.0)
    [-1.  0.  0.]
    """
    from ..engines.mujoco import Source, read, tree_with_sites  # here: `import compare` need not wait for it
    from ..engines.mujoco.parameters import of_source
    from ..engines.mujoco.reading import origin_of

    reading = read(Source(origin_of(mjcf), floating))
    for finding in of_source(reading.source):
        if finding.kind in ("missing", "fixed_base"):
            warnings.warn(say(finding), stacklevel=2)
    if off := [item for item in reading.features if item.treatment in ("switched_off", "open_tree")]:
        values = {"model": reading.name or str(reading.source), "features": off}
        warnings.warn(say(Finding("remarks", "left_out", values)), stacklevel=2)
    return tree_with_sites(reading)
