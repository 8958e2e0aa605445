"""What is pushed: the motion of a file from a posture, with the controls that it states, recorded ones, or a program's."""

from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

import mujoco
import numpy as np

from ..engines.mujoco.changes import Program, program
from ..engines.mujoco.names import control_of, element_name, number_of_actuators
from ..engines.mujoco.reading import Reading
from ..engines.mujoco.stepper import Stepper
from ..robots.coordinates import Coordinates
from ..robots.file import names_of_keys

PART = 0.25  # s, of a run: between them it is asked whether it goes on
EARLY = 1e-9  # s: a control acts from the step that begins so shortly before it


class Posture(NamedTuple):
    """A posture that is asked for. key: the keyframe, "": qpos0; q: positions instead, (nq,), or ()."""

    name: str
    key: str
    q: tuple[float, ...] = ()


def postures_of(reading: Reading) -> list[Posture]:
    """The keyframes, by the names of their postures; qpos0 if there is none."""
    named = names_of_keys(reading)
    return [Posture(named[key], key) for key in reading.keyframes] or [Posture("qpos0", "")]


def posture_of(asked: str | Sequence[float], reading: Reading) -> Posture:
    """The posture of a name, or positions of all joints (deg, m, quaternions); ValueError, in one line, for neither.

    A name may be numbers separated by commas.
    """
    named = {posture.name: posture for posture in postures_of(reading)} | {"qpos0": Posture("qpos0", "")}
    if isinstance(asked, str) and asked in named:
        return named[asked]
    coordinates = Coordinates(reading.tree.joint_names, reading.tree.kind)
    try:
        numbers = tuple(map(float, asked.split(",") if isinstance(asked, str) else asked))
    except ValueError:
        numbers = ()
    if len(numbers) != len(reading.qpos0) or not np.isfinite(numbers).all():
        choices = f"{', '.join(named)}, or {len(reading.qpos0)} numbers (deg, m, quaternions)"
        raise ValueError(f"posture {asked} is not one of this file: expected {choices}")
    name = asked if isinstance(asked, str) else ",".join(f"{x:g}" for x in numbers)
    return Posture(name, "", tuple(coordinates.from_degrees(numbers, positions=True).tolist()))


class Motion(NamedTuple):
    """A motion of a model from a state of a Stepper.

    controls: who gives them: the "keyframe", "servos" that hold the posture, a "record", a "program", or ""
    where nothing acts. times, recorded: (n,) s and (n, nu). program: it reads at a period, which is that of a
    run; ideal: the same law in actuators of MuJoCo, which act at once.
    """

    model: mujoco.MjModel
    name: str
    state: np.ndarray
    controls: str
    times: np.ndarray = np.zeros(0)
    recorded: np.ndarray = np.zeros((0, 0))
    program: Program | None = None
    ideal: "Motion | None" = None

    def parts(
        self, stepper: Stepper, count: int, period: float, delay: float
    ) -> Iterator[tuple[int, np.ndarray | None]]:
        """The parts of a run of `count` steps: their steps, and their controls, (steps, nu), None: those of the state.

        The stepper's data are at the start of each part. period, delay: of a program, s: it reads so often,
        and its controls act so much later; 0.0: every step, at once.
        """
        dt, done, end, every = stepper.dt, 0, 0, max(1, round(period / stepper.dt))
        late, waiting = int(np.ceil(delay / dt - EARLY)), list[tuple[int, np.ndarray]]()
        controls = self.state[stepper.places["ctrl"]].copy()
        while done < count:
            end, rows = min(count, done + max(20, round(PART / dt))), None
            if len(self.times):
                at = np.searchsorted(self.times, dt * np.arange(done, end) + EARLY, side="right") - 1
                rows = self.recorded[np.maximum(at, 0)]
            if self.program is not None:
                if done % every == 0:
                    mujoco.mj_fwdPosition(stepper.model, stepper.data)
                    mujoco.mj_fwdVelocity(stepper.model, stepper.data)
                    waiting.append((done + late, self.program.controls(stepper.data)))
                while waiting and waiting[0][0] <= done:
                    controls[self.program.places] = waiting.pop(0)[1]
                end = min([count, (done // every + 1) * every, *(acts for acts, _ in waiting[:1])])
                rows = np.tile(controls, (end - done, 1))
            yield end - done, rows
            done = end


def motion_of(
    reading: Reading, posture: Posture, recorded: Mapping[str, np.ndarray] | None = None,
    kp: float | None = None, kv: float | None = None, in_program: bool = False,
) -> Motion:  # fmt: skip
    """The motion of a file from a posture, see Stepper.start for its controls.

    recorded: "time", s, and controls by the names of actuators, each until the next one. in_program: a
    program has the file's servos or, with gains kp, kv, its motors. ValueError: there are none of them.
    """
    model, stepper = reading.model, Stepper(reading.model, reading.dt, reading.integrator)
    state, place = stepper.start(posture.key, q=posture.q or None), stepper.places["ctrl"]
    if recorded:
        columns = np.tile(state[place], (len(recorded["time"]), 1))
        for i in range(number_of_actuators(model)):
            if (name := element_name(model, "actuator", i)) in recorded:
                columns[:, control_of(model, i)[0]] = recorded[name]
        return Motion(model, posture.name, state, "record", recorded["time"], columns)
    holds = reading.drive is not None and reading.drive.feeds_back
    controls = "keyframe" if posture.key and model.key_ctrl.any() else "servos" if holds else ""
    ideal = Motion(model, posture.name, state.copy(), controls)
    if not in_program:
        return ideal
    data = stepper.forward(state)
    law = program(model, state[place], data.actuator_length, kp, kv)
    if law is None and kp is None and kv is None:
        raise ValueError("it has no servo: state --kp and --kv of its motors")
    if law is None:
        has_servos = program(model, state[place], data.actuator_length) is not None
        more = "; a program commands its servos without --kp and --kv"
        raise ValueError("it has no motor" + more * has_servos)
    if kp is not None or kv is not None:
        ideal = ideal._replace(model=with_law(law))
        ideal.state[place][law.places] = 0.0
    state[place][law.places] = law.controls(data)
    return Motion(law.model, posture.name, state, "program", program=law, ideal=ideal)


def with_law(law: Program) -> mujoco.MjModel:
    """The model of a program with its law in the actuators, within the ranges of their controls."""
    model = mujoco.MjModel.__copy__(law.model)
    for place, *terms in zip(law.places, law.u, -law.kp, -law.kv):
        gain = model.actuator_gainprm[place, 0]
        model.actuator_biastype[place] = mujoco.mjtBias.mjBIAS_AFFINE
        model.actuator_biasprm[place, :3] = gain * np.array(terms)
        if model.actuator_ctrllimited[place]:
            ends = np.sort(gain * model.actuator_ctrlrange[place])
            limits = model.actuator_forcerange[place] if model.actuator_forcelimited[place] else ends
            model.actuator_forcerange[place] = np.clip(limits, *ends)
            model.actuator_forcelimited[place] = 1
    return model
