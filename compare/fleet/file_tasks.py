"""The tasks of one file: read it, run each experiment, write the report and the row of the table."""

import pickle
import platform
import shlex
import shutil
import tempfile
import time
import zlib
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import Future
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

from ..engines.mujoco import ModelError, read
from ..experiments import EXPERIMENTS, module, skipped
from ..judge.check import ENDS, About, Result
from ..judge.timing import vectors
from ..process.clock import Clock
from ..report import folder, provenance
from ..report.text import block, say
from ..robots.case import SEED
from ..run import examine as experiment
from ..run.command import write_report
from ..run.drawing import quiet
from ..run.reference import SOLUTION, Compared, JointsDiffer, compared_with
from .models import unpacked
from .table import row_of_file

MAX_UNPACKED = 4  # models whose files a process keeps


class FleetOptions(NamedTuple):
    names: tuple[str, ...]  # of experiments
    is_quick: bool
    reference: str | None = (
        None  # arm, model or a solution, as given; None: the arm for a file with its hinges, else the model
    )
    solution: str = ""  # path of the solution in the bundle
    solution_hash: str = ""

    @property
    def key(self) -> tuple:
        """What the result of an experiment depends on, besides the file."""
        return self.is_quick, self.reference, self.solution_hash

    def command(self, shown: str) -> str:
        """The command that writes the same report for one file."""
        if set(self.names) >= set(EXPERIMENTS):
            words = ["all", *["--quick"] * self.is_quick, "--mjcf", shown]
        else:
            words = ["fleet", shown, *["--full"] * (not self.is_quick), "--only", ",".join(self.names)]
        words += ["--reference", self.reference] if self.reference else []
        return shlex.join(["python", "-m", "compare", *words])


class FileInfo(NamedTuple):
    """Properties of a file that was read."""

    refused: str  # why it cannot be compared; "": it can
    experiments: tuple[str, ...] = ()  # those that apply to it
    reasons: tuple[tuple[str, str], ...] = ()  # the others, and why they do not
    joints: int | None = None
    integrator: str | None = None
    dt: float | None = None  # s
    reference: str = ""  # the kind of its Reference
    differs: str = ""  # joints that differ from those of the reference, so that nothing else can be compared
    why_itself: str = ""  # see Reference


places = {}  # by bundle: path of the model, temporary folder; the last used is the last one


def unpacked_at(bundle: bytes) -> Path:
    if bundle not in places:
        top = Path(tempfile.mkdtemp(dir=Path.cwd()))
        places[bundle] = unpacked(pickle.loads(bundle), top), top
    places[bundle] = places.pop(bundle)
    while len(places) > MAX_UNPACKED:
        shutil.rmtree(places.pop(next(iter(places)))[1], ignore_errors=True)
    return places[bundle][0]


def compared_file(shown: str, options: FleetOptions, bundle: bytes) -> Compared:
    """The robot of a file and its reference. ModelError if it cannot be compared."""
    file = str(unpacked_at(bundle))
    solution = str(places[bundle][1] / options.solution) if options.solution else None
    return compared_with(options.reference, file, shown=shown, solution=solution)


def read_file(shown: str, options: FleetOptions, bundle: bytes) -> FileInfo:
    try:
        compared = compared_file(shown, options, bundle)
        reading = compared.reading or read(unpacked_at(bundle))
    except JointsDiffer as error:
        return FileInfo("", differs=error.why, reference="arm" if options.reference == "arm" else SOLUTION)
    except ModelError as error:
        return FileInfo(
            as_given(str(error), shown, bundle)
            .removeprefix(f"{shown} cannot be compared: ")
            .replace(f" {shown}:", " it:")
            .replace(f"{shown} is ", "it is ")
        )
    reasons = {name: say(reason) for name in options.names if (reason := skipped(name, compared.robot))}
    names = tuple(name for name in options.names if name not in reasons)
    numbers = len(compared.robot.joints), reading.integrator, reading.dt, compared.reference.kind
    return FileInfo("", names, tuple(reasons.items()), *numbers, why_itself=compared.reference.why_itself)


def as_given(text: str, shown: str, bundle: bytes) -> str:
    """A text with the path of the file as given, not where it was unpacked."""
    return text.replace(str(unpacked_at(bundle)), shown).replace(f"{unpacked_at(bundle).parent}/", "")


def untimed_part(name: str, shown: str, options: FleetOptions, bundle: bytes) -> bytes:
    """The part of a timed experiment that measures no time, packed."""
    setup = experiment.setup_of(compared_file(shown, options, bundle), options.is_quick)
    with quiet(setup.robot):
        module(name).begin(setup)
        return zlib.compress(pickle.dumps(awaited(setup.background[name])), 1)


def awaited(work: object) -> object:
    """The values of background work: tuples of tuples, iterators and values."""
    return tuple(map(awaited, work)) if isinstance(work, tuple) else list(work) if isinstance(work, Iterator) else work


def result_of(name: str, work: bytes | None, shown: str, options: FleetOptions, bundle: bytes) -> bytes:
    """The result of an experiment, or its exception: see examine.computed; packed. work: its `untimed_part`."""
    setup = experiment.setup_of(compared_file(shown, options, bundle), options.is_quick)
    if work:
        setup.background[name] = pickle.loads(zlib.decompress(work))
    results = experiment.computed(name, module(name), setup)
    for result in filter(None, results):
        result.notes = [as_given(say(note), shown, bundle) for note in result.notes]
        result.checks = [replace(check, note=as_given(check.note, shown, bundle)) for check in result.checks]
    if work and results[0]:
        results[0].notes.append(block("fleet", "timed_on", machine=platform.node(), vectors=vectors()))
    return zlib.compress(pickle.dumps(results), 1)


def broken(name: str, why: str) -> tuple[None, Result]:
    """The result of an experiment whose task broke off: one failed check."""
    result = Result(name, shown=[])
    result.check("", ENDS, None, 0.0, "", why, rule="equal", about=About.PROGRAM)
    return None, result


def reported(
    results: Mapping[str, bytes | str],
    left_out: Sequence[tuple[str, str]],
    seconds: float,
    shown: str,
    options: FleetOptions,
    bundle: bytes,
) -> tuple[dict, dict[str, bytes]]:
    """The row of a file, and its report: {path: content}.

    results: of the experiments, see `result_of`, or why one broke off; left_out: other experiments, with the reason; seconds:
    processor time so far.
    """
    began = time.process_time()
    compared = compared_file(shown, options, bundle)
    setup = experiment.setup_of(compared, options.is_quick)
    names = [name for name in options.names if name in results or name == "diagnosis"]
    have = {
        name: broken(name, value) if isinstance(value, str) else pickle.loads(zlib.decompress(value))
        for name, value in results.items()
    }
    with tempfile.TemporaryDirectory(dir=Path.cwd()) as place_of_report:
        out, clock = Path(place_of_report), Clock()
        outcome = experiment.examine(names, setup, out, NoTerminal(), InProcess(), clock, have)
        origin = provenance.provenance(options.command(shown), compared.robot.mjcf, shown, SEED)
        seconds += time.process_time() - began
        origin["seconds"] = round(seconds, 1)
        report, parts = write_report(out, *outcome, left_out, origin, compared)
        written = {name: (out / name).read_bytes() for name in folder.files(out)}
        shutil.rmtree(out / "figures", ignore_errors=True)
    return row_of_file(report.sections, report.causes, parts.lines, compared.reference) | {
        "seconds": round(seconds, 2)
    }, written


class NoTerminal:
    def say(self, text: str = "", style: str = "") -> None:
        pass


class InProcess:
    """Runs functions at once, in this process; see process.workers."""

    def submit(self, function, /, *arguments, **named) -> Future:
        future = Future()
        try:
            future.set_result(function(*arguments, **named))
        except Exception as error:
            future.set_exception(error)
        return future
