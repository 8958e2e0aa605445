"""The options of each experiment on the command line, and whether a robot's file has what they ask for.

`--help` imports this module: what takes long to load is imported where options are validated.
"""

import argparse
import os
from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

from ..core.errors import Refused
from ..core.options import ROBOT, expected, name_of, number, option, options_in, seconds
from ..core.text import block

if TYPE_CHECKING:
    from numpy import ndarray

    from ..engines.mujoco.reading import Reading

WHOLE = 1e-6  # of a step: a period so near to a multiple of it is one
GAIN = number("gain", 0.0, 1e12)
FILES = "scenes", "controls", "write"  # options that name a file
SOLUTIONS = ".xml", ".mjcf", ".urdf"
TABLES = ".csv", ".npz", ".npy", ".mat", ".txt"


def stated_reference(text: str) -> str:
    """What a model is compared with; a text with a colon is read later. FILE.py is all of the file, as FILE.py:."""
    if text.endswith(".py"):
        return f"{text}:"
    file = text.rpartition(":")[0]
    if file.lower().endswith(SOLUTIONS):
        why = f"{text!r}: the file of a robot takes no name after a colon; expected {file}"
        raise argparse.ArgumentTypeError(why)
    if text in ("arm", "model") or ":" in text or text.lower().endswith(SOLUTIONS):
        return text
    choices = "arm, model, FILE.xml or .urdf, FILE.py, FILE.py:OBJECT or MODULE:OBJECT"
    if text.lower().endswith(TABLES):
        choices += "; a table of values is compared in Python, see help(compare.assert_agrees)"
    hint = expected(text, ("arm", "model"), choices)
    raise argparse.ArgumentTypeError(f"{text!r} is not a reference; {hint}")


def engine_names(text: str) -> str:
    """Names of engines that read a robot's file, with commas."""
    from ..engines import RECORDS
    from . import ALWAYS

    known = [name for name, record in RECORDS.items() if record.reads_file]
    for name in text.split(","):
        if name not in (*ALWAYS, *known):
            raise argparse.ArgumentTypeError(block("run", "no_engine", name=name, known=known))
    return text


@dataclass(frozen=True, kw_only=True)
class Options:
    """The options of every experiment."""

    out: str = option(metavar="DIR", default="reports/latest")
    quick: bool = option(None)
    open: bool = option(None)
    json: bool = option(None)
    mjcf: str | None = option(metavar="FILE")
    floating: bool = option(None)
    reference: str | None = option(stated_reference, "WHAT")

    def get(self, name: str) -> Any:
        """The value of an option; None if it is not one of this experiment."""
        return getattr(self, name, None)

    def absolute(self) -> Self:
        """The same with absolute paths of files: a user's own code may change the current folder."""
        return replace(self, **{name: os.path.abspath(path) for name in FILES if (path := self.get(name))})

    @property
    def given(self) -> list[str]:
        """The words of the options that ask about a robot's file."""
        known = options_in(type(self))
        return [word for word in known if known[word].of_file and self.get(name_of(word)) is not None]

    def validated(self, reading: "Reading | None", name: str) -> Self:
        """The options with what they name in the file of a robot of this name; None: its numbers are stated.

        Refused, in one line: what they ask for is not there.
        """
        if self.given and reading is None:
            need = f"{' and '.join(self.given)} {'needs' if len(self.given) == 1 else 'need'} a robot's file"
            raise Refused(f"{need}; the numbers of {name} are stated")
        return self


@dataclass(frozen=True, kw_only=True)
class EquationOptions(Options):
    """Of experiments that compare a user's own equations."""

    joints: str | None = option(metavar="LIST", example=f"{ROBOT} --reference my_equations.py")


@dataclass(frozen=True, kw_only=True)
class TrajectoryOptions(EquationOptions):
    scenes: str | None = option(metavar="FILE", example=" --scenes my.toml")


@dataclass(frozen=True, kw_only=True)
class EngineOptions(Options):
    engines: str | None = option(engine_names, "LIST", example=f"{ROBOT} --engines drake,mjx")


@dataclass(frozen=True, kw_only=True)
class SpeedOptions(EngineOptions):
    scenes: str | None = option(metavar="FILE", example=" --scenes my.toml")


@dataclass(frozen=True, kw_only=True)
class WriteOptions(Options):
    write: str | None = option(metavar="FILE", of_file=True, example=f"{ROBOT} --write small.xml")

    def validated(self, reading: "Reading | None", name: str) -> Self:
        """As Options.validated; write: a new file, or one that reduction wrote."""
        options = super().validated(reading, name)
        if self.write is None or reading is None:
            return options
        from ..engines.mujoco import Source
        from ..engines.mujoco.written import MARK
        from ..process.files import assets_of, why_not
        from ..report.folder import OWN

        reference = self.reference or ""
        other = [Source(Path(reference))] if reference.lower().endswith(SOLUTIONS) else []
        needed = [file for source in (reading.source, *other) for file in source.files]
        path, reserved = Path(self.write).absolute(), [Path(self.out, name) for name in OWN]
        if why := why_not(path, needed, reserved, MARK):
            about = {"path": self.write, "why": why, "assets": assets_of(path).name}
            raise Refused(block("run", "not_writable", **about))
        return replace(options, write=str(path))


@dataclass(frozen=True, kw_only=True)
class MotionOptions(Options):
    """Of what a robot does: posture: a name, or numbers with commas; recorded: by names of actuators, and times."""

    posture: str | None = option(metavar="NAME|NUMBERS", of_file=True)
    controls: str | None = option(metavar="CSV", of_file=True, example=f"{ROBOT} --controls recorded.csv")
    recorded: "Mapping[str, ndarray] | None" = None  # times and controls, of the file of --controls

    def validated(self, reading: "Reading | None", name: str, dt: float | None = None) -> Self:
        """As Options.validated, with the controls that are recorded. dt: s, the step that is asked for."""
        from ..robots.scene_file import read_controls
        from ..stability.motion import posture_of

        options = super().validated(reading, name)
        if reading is None:
            return options
        if self.posture:
            try:
                posture_of(self.posture, reading)
            except ValueError as error:
                raise Refused(f"{' '.join(self.given)}: {error}") from None
        if not self.controls:
            return options
        if self.get("scenes"):
            raise Refused("--controls and --scenes both say what the robot does")
        names = reading.drive.names if reading.drive else ()
        return replace(options, recorded=read_controls(self.controls, names, dt or reading.dt))


@dataclass(frozen=True, kw_only=True)
class StabilityOptions(MotionOptions):
    """dt: s; push: rad/s or m/s, of every speed; control_period, delay: s, of a program that commands the actuators,
    with the gains kp and kv of motors; error: rad or m."""

    dt: float | None = option(
        seconds(5.0), "S", of_file=True, example=f"{ROBOT} --integrator Euler --dt 0.001"
    )
    integrator: str | None = option(metavar="NAME", of_file=True)
    push: float | None = option(number("push in rad/s or m/s", 1e-9, 1e3), "P", of_file=True)
    error: float | None = option(number("error", 1e-12, 1.0), "E", of_file=True, text="apart")
    control_period: float | None = option(
        seconds(1.0), "S", of_file=True, example=f"{ROBOT} --control-period 0.02"
    )
    delay: float | None = option(number("time in s", 0.0, 1.0), "S", of_file=True)
    kp: float | None = option(GAIN, "KP", of_file=True)
    kv: float | None = option(GAIN, "KV", of_file=True)

    def validated(self, reading: "Reading | None", name: str, dt: float | None = None) -> Self:
        """As Options.validated; dt and integrator are the file's where one of them alone is asked for."""
        options = super().validated(reading, name, self.dt)
        if reading is None:
            return options
        for word in ("delay", "kp", "kv"):
            if getattr(self, word) is not None and not self.control_period:
                raise Refused(f"--{word} is of a program with a --control-period")
        step, period = self.dt or reading.dt, self.control_period
        if period and abs(period / step - max(1, round(period / step))) > WHOLE:
            raise Refused(f"--control-period {period:g} is no multiple of the step, {step:g} s")
        if self.dt is None and self.integrator is None:
            return options
        from ..engines.mujoco.names import integrator_by_name

        try:
            return replace(
                options, dt=step, integrator=integrator_by_name(self.integrator or reading.integrator)
            )
        except ValueError as error:
            raise Refused(f"{' '.join(self.given)}: {error}") from None


@dataclass(frozen=True, kw_only=True)
class ReductionOptions(MotionOptions, WriteOptions):
    """error: rad or m, that is allowed; points: names of bodies or sites, with commas."""

    scenes: str | None = option(metavar="FILE", example=" --scenes my.toml")
    error: float | None = option(
        number("error", 1e-12, 1.0), "E", of_file=True, example=f"{ROBOT} --error 0.001"
    )
    points: str | None = option(metavar="NAMES", of_file=True)

    def validated(self, reading: "Reading | None", name: str, dt: float | None = None) -> Self:
        options = super().validated(reading, name)
        if self.points and reading is not None:
            from ..engines.mujoco.smaller import spec_with_points

            try:
                spec_with_points(reading.source, self.points.split(","))
            except ValueError as error:
                raise Refused(f"{' '.join(self.given)}: {error}") from None
        return options


@dataclass(frozen=True, kw_only=True)
class AllOptions(TrajectoryOptions, EngineOptions, WriteOptions):
    """Of `all`."""


OF_EXPERIMENTS: dict[str, type[Options]] = dict.fromkeys(
    ("kinematics", "mass", "gravity", "acceleration", "diagnosis"), EquationOptions
)
OF_EXPERIMENTS |= {
    "all": AllOptions, "trajectory": TrajectoryOptions, "speed": SpeedOptions, "engines": EngineOptions,
    "stability": StabilityOptions, "reduction": ReductionOptions,
}  # fmt: skip


def options_of(experiment: str) -> type[Options]:
    return OF_EXPERIMENTS.get(experiment, Options)


def asked_alone(experiment: str, options: Options) -> bool:
    """Whether one of a run's options is of this experiment: of the engines, or of the file to write."""
    names = {field.name for field in fields(options_of(experiment))} & {"engines", "write"}
    return any(options.get(name) for name in names)
