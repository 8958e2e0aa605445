"""Runs the experiments one after the other; long work and drawing go to other processes."""

import importlib
from collections.abc import Callable, Sequence
from concurrent.futures import Executor, Future
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Self, TypeVar

from ..core.cause import Cause
from ..core.check import ENDS, About, Result
from ..core.errors import described
from ..core.finding import Finding
from ..core.text import block, say
from ..engines import RECORDS
from ..engines.own import Problem
from ..experiments import EXPERIMENTS, TIMED, Experiment, functions, module
from ..experiments.options import Options, asked_alone
from ..experiments.setup import Setup, engines
from ..process import interrupt
from ..process.workers import Clock, Current, WorkerEnded, Workers, give_back_memory
from ..report.terminal import Terminal
from ..report.verdict import Figure, Section, failures, has_failed
from ..robots import Robot
from ..robots.states import MOST_SPEEDS
from .drawing import draw, quiet, results_needed
from .reference import Compared

Value = TypeVar("Value")
START, END = "start", "figures"  # tasks of the clock: before the first experiment, and after the last
SHOWN = 3  # causes on the terminal
VALID = "returns valid values"  # of a function of the user's own
# the numbers on which Mbar and h depend, by their names in `parameters`
IN_EQUATIONS = ["order", "parent", "ref", "axis", "anchor", "offset", "com", "mass", "inertia", "gravity"]
IN_EQUATIONS += ["armature", "flag gravity"]


def setup_of(compared: Compared, options: Options, **more: Any) -> Setup:
    """What the experiments need. more: further fields of Setup."""
    make, of_run = Setup.quick if options.quick else Setup, engines(compared.mujoco, compared.reference.own)
    known, chosen = [name for name, record in RECORDS.items() if record.reads_file], options.get("engines")
    names = chosen.split(",") if chosen else known
    of_run = {name: engine for name, engine in of_run.items() if name in names or name not in known}
    return make(compared.robot, of_run, reading=compared.reading, options=options, **more)


@dataclass
class Run:
    """The experiments of one run. clock: of the workers, it measures each experiment.

    An experiment that raises is one failed check; the others go on. The diagnosis runs, among others, only if
    one of them fails. Of several each has a line on the terminal; from the first that differs on they wait
    for the causes.
    """

    names: Sequence[str]
    setup: Setup
    folder: Path  # for the folder of figures
    terminal: Terminal
    workers: Executor | Workers
    clock: Clock = field(default_factory=lambda: Current.clock)
    sections: list[Section] = field(default_factory=list)  # in the end in the order of the names
    causes: list[Cause] = field(default_factory=list)  # of failing checks
    needless: dict[str, str] = field(default_factory=dict)  # experiments that were left out, and why
    work: dict[str, Any] = field(default_factory=dict)  # that was begun, of each experiment
    crashed: dict[str, Result] = field(default_factory=dict)
    told: set[int] = field(default_factory=set)  # problems of the user's own equations, by their numbers
    unsaid: list[Section] = field(default_factory=list)  # whose lines wait
    mended: int = 0  # states at which M and h agree without the causes; 0: that is not known
    few: bool = False  # figures of a quick run where checks fail too: those of the first screen alone
    drawings: list[tuple[Section, Future[list[Figure]]]] = field(default_factory=list)

    def __post_init__(self) -> None:
        # the first answers come before any long work
        is_large, last = self.setup.robot.coordinates.nv > MOST_SPEEDS, ("trajectory", "diagnosis", *TIMED)
        self.order = sorted(self.names, key=(("kinematics", *last) if is_large else last).__contains__)
        self.early = () if is_large else [name for name in self.order if not self.too_long(name)]

    def examined(self) -> Self:
        """The experiments, one after the other."""
        (self.folder / "figures").mkdir()
        for name in self.early:
            if begin := functions(name).begin:
                with self.clock.of(name):
                    self.work[name] = self.attempt(name, begin, self.setup)
        self.clock.ends(START)
        for name in self.order:
            if reason := self.why_needless(name):
                self.needless[name] = reason
                self.clock.ends(name)
            else:
                self.examine(name)
        self.causes, self.mended = self.attempt("causes", causes, self.setup, self.sections) or ([], 0)
        self.say_outcomes()
        self.finish_drawings()
        self.sections.sort(key=lambda section: self.names.index(section.name))
        return self

    def finished(self) -> Self:
        """What is finished after an interrupt, without the figures that were not drawn."""
        for section, drawing in self.drawings:
            if drawing.done() and not drawing.exception():
                section.figures = drawing.result()
        self.sections = [section for section in self.sections if section.name in self.clock.ended]
        self.sections.sort(key=lambda section: self.names.index(section.name))
        self.needless = {}
        drawn = {figure.path for section in self.sections for figure in section.figures}
        for path in (self.folder / "figures").iterdir():
            if path.name not in drawn:  # perhaps a part of a file
                path.unlink()
        return self

    def attempt(self, name: str, act: Callable[..., Value], *arguments: Any) -> Value | None:
        """act(*arguments); if it raises, None, and the experiment has crashed."""
        try:
            with quiet(self.setup.robot):
                return act(*arguments)
        except WorkerEnded:
            raise
        except Exception as error:
            if name not in self.crashed:
                self.crashed[name] = Result(name, shown=[])
                add_crash(self.crashed[name], ENDS, error)
            return None

    def why_needless(self, name: str) -> str:
        """Why an experiment is left out of a run of several; "" if it is not."""
        is_needed = EXPERIMENTS[name].compares or len(self.names) == 1 or failures(self.sections)["differing"]
        return self.too_long(name) if is_needed else block("run", "nothing_failed")

    def too_long(self, name: str) -> str:
        """Why an experiment is left out of a quick run of several; "" if it is not."""
        most, robot = EXPERIMENTS[name].quick_speeds, self.setup.robot
        is_small = most is None or robot.coordinates.nv <= most
        is_asked = asked_alone(name, self.setup.options)
        if is_small or is_asked or self.setup.alone or not self.setup.is_quick:
            return ""
        return block("run", "not_quick", name=name, most=most)

    def examine(self, name: str) -> None:
        give_back_memory()  # what the one before, or the reading of the file, needs no more
        self.clock.under_way = name
        with self.clock.of(name):
            self.setup.progress(block(name, "summary"))
            section = self.section_of(name)
            self.sections.append(section)
            if self.setup.own:
                add_problems(section.result, self.setup.own.equations.problems, self.told)
        self.clock.ends(name)
        interrupt.tell("keeps")  # this, if the run is ended
        if name not in TIMED:  # no drawing delays a timing
            self.draw(section)
        self.unsaid.append(section)
        if not failures(self.sections)["differing"]:
            self.say_outcomes()

    def say_outcomes(self) -> None:
        """The lines of experiments of a run of several; the causes beneath the first that differs, else its first check."""
        waiting, self.unsaid = self.unsaid if len(self.names) > 1 else [], []
        is_said = False
        for section in waiting:
            failing = failures([section])
            about = {"checks": len(section.result.checks), "failed": len(section.failed), "failing": failing}
            style = "red" if section.failed else "yellow" if failing["not_judged"] else ""
            seconds = self.clock.seconds_of(section.name)
            self.terminal.say(block("run", "outcome", name=section.name, seconds=seconds, **about), style)
            if failing["differing"] and not is_said:
                lines = [line for cause in self.causes[:SHOWN] for line in lines_of(cause)]
                if (more := len(self.causes) - SHOWN) > 0:
                    lines.append(f"  {block('run', 'more', count=more)}")
                is_first = not lines or failing["differing"][0].quantity.endswith(VALID)
                for line in [f"  first: {failing['differing'][0]}"] * is_first + lines:
                    self.terminal.say(line)
                is_said = True

    def section_of(self, name: str) -> Section:
        """The section of an experiment, which is run for it; of one that raises with the error alone."""
        rows, work = functions(name).rows, [self.work[name]] if name in self.work else []
        result = None if name in self.crashed else self.attempt(name, rows, self.setup, *work)
        about = name, result, self.setup.robot, len(self.names) == 1
        section = self.attempt(name, section_with, *about) if result else None
        return section or Section(name, name, "", "", self.crashed[name])

    def draw(self, section: Section) -> None:
        if section.name not in self.crashed:
            is_short = self.few or not has_failed([section])
            few = self.setup.is_quick and not self.setup.alone and is_short
            others = results_needed(section.name, self.order, self.sections)
            arguments = section.name, section.result, self.setup.robot, self.folder / "figures", others, few
            with self.clock.of(END):
                self.drawings.append((section, self.workers.submit(draw, *arguments)))

    def finish_drawings(self) -> None:
        for section in self.sections:
            if section.name in TIMED:
                self.draw(section)
        with self.clock.of(END):
            self.setup.progress("figures")
            importlib.import_module("compare.report.files")  # it takes long; meanwhile workers draw
            for section, drawing in self.drawings:
                try:
                    section.figures = drawing.result()
                except OSError:  # of the disk
                    raise
                except Exception as error:
                    add_crash(section.result, "figures are drawn", error)
        self.clock.ends(END)


def section_with(name: str, result: Result, robot: Robot, is_alone: bool = False) -> Section:
    """The section of an experiment; of a run of several the first screen has the answers alone."""
    experiment = functions(name)
    title, record = block(name, "title", robot=robot), EXPERIMENTS[name]
    result.headline = result.headline or experiment.headline(result)
    if not is_alone:
        top = [text for text in result.top if text.kind in record.first_screen]
        result.notes = [text for text in result.top if text not in top] + result.notes
        result.top = top
    of_robot = {"robot": robot, "values": experiment.claim_values(robot)}
    claim, tolerance = say(Finding(name, "claim", of_robot)), block(name, "tolerance", **of_robot)
    return Section(name, title, claim, tolerance, result, record=record)


def add_problems(result: Result, problems: Sequence[Problem], told: set[int]) -> None:
    """Add a failed check for each problem of a user's own equations that is not told, before the others."""
    others, result.checks = result.checks, []
    asked = EXPERIMENTS.get(result.experiment, Experiment()).asks_of_own
    for number, problem in enumerate(problems):
        if number not in told and (asked is None or problem.quantity in asked):
            told.add(number)
            result.check("", f"{problem.quantity} {VALID}", None, 0.0, "", problem.text, rule="equal")
    result.checks += others


def lines_of(cause: Cause) -> list[str]:
    """A cause on the terminal; others that explain the same, a line each."""
    first, *others = cause.text.split("; or ")
    return [f"  CAUSE {first}", *(f"     or {other}" for other in others)]


def causes(setup: Setup, sections: Sequence[Section]) -> tuple[list[Cause], int]:
    """What explains that experiments differ, searched for once; the states at which M and h agree without it, 0: not known.

    Where numbers are stated they are those that differ; one convention, number or slip that explains those in
    M and h stands in their place. Else they are what the search finds, and the numbers at other places.
    """
    if not failures(sections)["differing"]:
        return [], 0
    numbers = list[Cause]()
    if not setup.robot.own:
        known = [section.result for section in sections if section.name == "parameters"]
        numbers = (known or [functions("parameters").rows(setup)])[0].causes
    others = [cause for cause in numbers if cause.quantity not in IN_EQUATIONS]
    in_equations = sum(cause.owners for cause in numbers if cause not in others)
    if setup.robot.is_stated and numbers and in_equations < 2:
        return numbers, 0
    found = module("diagnosis").diagnosed(setup)
    is_explained = bool(found.why.diagnosis.causes)
    if setup.robot.is_stated and numbers:
        is_one = is_explained and found.why.diagnosis.causes[0].rank < 3
        return ([found.said[0], *others], 0) if is_one else (numbers, 0)
    searched = [cause for cause in found.said if cause.place not in {each.place for each in numbers}]
    has_problems = bool(setup.own and setup.own.equations.problems)  # what is not finite stays so
    is_known = is_explained and not has_problems
    return searched + numbers, found.states * is_known


def add_crash(result: Result, quantity: str, error: Exception) -> None:
    result.check("", quantity, None, 0.0, "", described(error), rule="equal", about=About.PROGRAM)


def progress(clock: Clock, names: Sequence[str]) -> list[str]:
    """How far a run of these experiments is: "4 of 11", "acceleration"."""
    number = 1 + sum(name in clock.ended for name in names if name != clock.under_way)
    return [f"{number} of {len(names)}", clock.under_way] if clock.under_way in names else []
