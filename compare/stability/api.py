"""compare.step_limits: which step is stable, for scripts."""

from __future__ import annotations  # so that help() shows the short names of types

from collections.abc import Mapping, Sequence
from os import PathLike
from typing import TYPE_CHECKING, Any

import numpy as np

from ..core.finding import Finding
from ..core.text import screen
from ..engines.mujoco.names import INTEGRATORS, integrator_by_name
from ..engines.mujoco.reading import origin_of, read
from ..robots.scene import is_number
from ..robots.scene_file import check_controls, read_controls
from .answer import Question, StepLimitRow, answer
from .motion import posture_of, postures_of

if TYPE_CHECKING:
    import pandas as pd

__all__ = ["StepLimitRow", "StepLimits", "step_limits"]


class StepLimits(list[StepLimitRow]):
    """The rows of `step_limits`: a list, also by the name of an integrator. print() shows the table."""

    def __getitem__(self, key: Any) -> Any:
        """limits["Euler"], limits[0], limits[:2]."""
        if not isinstance(key, str):
            return super().__getitem__(key)
        found = {row.integrator: row for row in self}
        if key not in found:
            raise KeyError(f"{key!r} was not asked for: expected one of {', '.join(found)}")
        return found[key]

    def __repr__(self) -> str:
        return "\n".join(screen(Finding("step_limits", "limits", {"rows": [*self]})))

    def to_frame(self) -> pd.DataFrame:
        """The rows as a DataFrame of pandas, a column for each field."""
        import pandas  # it takes long to load

        return pandas.DataFrame([row.record() for row in self])


def step_limits(
    mjcf: str | PathLike[str] | object,
    *,
    posture: str | Sequence[float] | None = None,
    push: float | None = None,
    error: float | None = None,
    control_period: float | None = None,
    delay: float | None = None,
    kp: float | None = None,
    kv: float | None = None,
    controls: Mapping[str, Sequence[float]] | str | PathLike[str] | None = None,
    integrators: Sequence[str] | None = None,
) -> StepLimits:
    """Return the longest stable step of each integrator of MuJoCo: at which a push is survived.

    Everything acts as the file has it. The robot starts where the file does, every speed is changed by the
    push, in four patterns of signs, and a step holds if the runs of 3 s end as still as runs of fine steps
    do, and where they do.

    Parameters
    ----------
    mjcf : str, path or mujoco.MjModel
        A path, MJCF text, or a compiled model, of which a copy is taken: change gains in a loop.
    posture : str or (nq,) numbers, optional
        The name of a keyframe, "qpos0", or positions (deg, m, quaternions). By default the first keyframe,
        else qpos0.
    push : float, optional
        rad/s or m/s, of every speed. By default 0.1, or the largest smaller one that is survived at fine
        steps.
    error : float, optional
        rad or m: `within_error_s` is the longest stable step that stays so near the run of fine steps.
    control_period, delay : float, optional
        s: a program has the servos, reads every period, and acts a delay later; `stable_up_to_s` is the
        longest period.
    kp, kv : float, optional
        Gains of a program that drives the motors: control kp (posture - length) - kv speed.
    controls : mapping or path, optional
        "time" (s, from 0 on) and controls by the names of actuators, or a CSV file of these: the step is
        judged along it.
    integrators : sequence of str, optional
        Such as ("Euler", "implicitfast"). By default all of MuJoCo's.

    Returns
    -------
    StepLimits
        A row for each integrator: limits["implicitfast"].stable_up_to_s, see StepLimitRow; to_frame() for
        pandas.

    Raises
    ------
    ValueError
        If MuJoCo makes no model of it, nothing moves, for an unknown posture, integrator or actuator, or a
        number that is none or that nothing takes.

    Examples
    --------
    >>> model = mujoco.MjModel.from_xml_path("robot.xml")              # doctest: +SKIP
    >>> for kv in (1.0, 3.0, 10.0):                                    # doctest: +SKIP
    ...     model.actuator_biasprm[:, 2] = -kv
    ...     print(kv, compare.step_limits(model, integrators=["Euler"])["Euler"].stable_up_to_s)
    """
    reading = read(origin_of(mjcf))  # ModelError for what is no model
    if isinstance(integrators, str):
        raise ValueError(f"expected a sequence of names; not {integrators!r}")
    numbers = {"push": push, "error": error, "control_period": control_period}
    for name, number in numbers.items():
        if number is not None and not (is_number(number) and number > 0.0):
            raise ValueError(f"{name} is {number!r}: expected a number above 0")
    of_program = {"delay": delay, "kp": kp, "kv": kv}
    for name, number in of_program.items():
        if number is not None and control_period is None:
            raise ValueError(f"{name} is of a program with a control_period")
        if number is not None and not (is_number(number) and number >= 0.0):
            raise ValueError(f"{name} is {number!r}: expected a number from 0 on")
    recorded: Mapping[str, Any] | None = None
    names = reading.drive.names if reading.drive else ()
    if isinstance(controls, Mapping):
        recorded = {name: np.atleast_1d(np.asarray(values, float)) for name, values in controls.items()}
        check_controls("controls", recorded, names, reading.dt, recorded)
    elif controls is not None:
        recorded = read_controls(str(controls), names, reading.dt)
    question = Question(
        reading.dt, reading.integrator, [integrator_by_name(name) for name in integrators or INTEGRATORS],
        push, error, recorded, control_period, delay, kp, kv,
    )  # fmt: skip
    place = posture_of(posture, reading) if posture is not None else postures_of(reading)[0]
    return StepLimits(answer(reading, place, question).rows)
