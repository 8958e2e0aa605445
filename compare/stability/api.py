"""compare.step_limits: which step is stable, for scripts."""

from __future__ import annotations  # so that help() shows the short names of types

from collections.abc import Sequence
from os import PathLike
from pathlib import Path
from typing import Any, cast

import numpy as np

from ..engines.mujoco.names import integrator_by_name
from ..engines.mujoco.reading import read
from .answer import Asked, StepLimitRow, answers, integrators_at_rest
from .place import posture_of, postures_of

__all__ = ["StepLimitRow", "step_limits"]


def step_limits(
    mjcf: str | PathLike[str] | object,
    *,
    posture: str | Sequence[float] | None = None,
    dt: float | None = None,
    integrators: Sequence[str] | None = None,
    in_runs: bool = False,
) -> list[StepLimitRow]:
    """Return the largest stable step of each integrator of MuJoCo, for the robot as it stands and in the air.

    Contacts, limits, dry friction, equalities, fluid, gravity and all actuators act as the file has them. The robot
    sinks to its rest, where the derivative of MuJoCo's own step, by central differences, tells whether a small
    deviation grows.

    Parameters
    ----------
    mjcf : str, path or mujoco.MjModel
        A path, MJCF text, or a compiled model, of which a copy is taken: change gains in a loop.
    posture : str or (nq,) numbers, optional
        The name of a keyframe, "qpos0", or positions (deg, m, quaternions). By default the first keyframe, else qpos0.
    dt : float, optional
        The step in use, s: where the search begins, and at which `growth` is told. By default the file's.
    integrators : sequence of str, optional
        Such as ("Euler", "implicitfast"). By default all but implicit, which at rest is implicitfast.
    in_runs : bool, optional
        Also run MuJoCo just below and above each limit, and after pushes (seconds instead of tenths of a second).

    Returns
    -------
    list of StepLimitRow
        One for each surroundings ("contact" or "free", then "air" where that differs) and integrator: `predicted_dt`
        (s; None with limit "none", "saddle" or "no_rest"), `limiting_joint`, `limiting_contact`, `growth`, `moved` ...

    Raises
    ------
    ValueError
        If MuJoCo makes no model of it, or for an unknown posture or integrator.

    Examples
    --------
    >>> model = mujoco.MjModel.from_xml_path("robot.xml")              # doctest: +SKIP
    >>> for kv in (1.0, 3.0, 10.0):                                    # doctest: +SKIP
    ...     model.actuator_biasprm[:, 2] = -kv
    ...     print(kv, compare.step_limits(model, integrators=["Euler"])[0].predicted_dt)
    """
    if isinstance(mjcf, str | PathLike) and not str(mjcf).lstrip().startswith("<"):
        mjcf = Path(mjcf)
    reading = read(cast(Any, mjcf))  # ModelError for what is no model
    if isinstance(integrators, str) or (dt is not None and not 0.0 < dt < np.inf):
        raise ValueError(f"expected a sequence of names and a step above 0 s; not {integrators!r}, {dt!r}")
    names = [integrator_by_name(name) for name in integrators or integrators_at_rest()]
    asked = Asked(dt or reading.dt, reading.integrator, names, in_runs=in_runs)
    place = posture_of(posture, reading) if posture is not None else postures_of(reading)[0]
    return [row for found in answers(place, reading, asked) for row in found.rows]
