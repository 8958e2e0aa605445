"""The pieces of one file: it is read; each experiment computes; what all of them found becomes its report and its row."""

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
from ..experiments.setup import Setup, engines
from ..judge.check import ENDS, About, Result
from ..judge.timing import vectors
from ..process.clock import Clock
from ..report import files, folder, provenance, verdict
from ..report.parts import Parts
from ..report.text import say
from ..robots.case import SEED
from ..run import examine as experiment
from ..run.drawing import quiet
from ..run.reference import SOLUTION, Compared, JointsDiffer, compared_with
from .models import unpacked
from .row import row_of_file

UNPACKED = 4  # models of which a process keeps the files


class Asked(NamedTuple):
    """What is asked of each file."""

    names: tuple[str, ...]  # of experiments
    is_quick: bool
    reference: str | None = None  # arm, model or a solution, as it is given; None: the arm where a file has its hinges
    solution: str = ""  # where the solution is among the files that are sent
    solution_hash: str = ""

    @property
    def alike(self) -> tuple:
        """What a result follows from, besides the file and the experiment."""
        return self.is_quick, self.reference, self.solution_hash

    def command(self, shown: str) -> str:
        """The command that makes the report of one file alone."""
        if set(self.names) >= set(EXPERIMENTS):
            words = ["all", *["--quick"] * self.is_quick, "--mjcf", shown]
        else:
            words = ["fleet", shown, *["--full"] * (not self.is_quick), "--only", ",".join(self.names)]
        words += ["--reference", self.reference] if self.reference else []
        return shlex.join(["python", "-m", "compare", *words])


class Known(NamedTuple):
    """What is known of a file that was read."""

    refused: str  # why it cannot be compared; "": it can
    experiments: tuple[str, ...] = ()  # those that serve it
    reasons: tuple[tuple[str, str], ...] = ()  # the others, and why not
    joints: int | None = None
    integrator: str | None = None
    dt: float | None = None  # s
    reference: str = ""  # what it is compared with, the kind of a Reference
    differs: str = ""  # which joints are not those of the reference, so that nothing else can be compared
    why_itself: str = ""  # see Reference


places = {}  # where models are unpacked, and in which folder, by their bundles; the one that was used last at the end


def unpacked_at(bundle: bytes) -> Path:
    """A file with what it needs, unpacked."""
    if bundle not in places:
        top = Path(tempfile.mkdtemp(dir=Path.cwd()))
        places[bundle] = unpacked(pickle.loads(bundle), top), top
    places[bundle] = places.pop(bundle)
    while len(places) > UNPACKED:
        shutil.rmtree(places.pop(next(iter(places)))[1], ignore_errors=True)
    return places[bundle][0]


def compared_file(shown: str, asked: Asked, bundle: bytes) -> Compared:
    """A file as it is compared. ModelError if it cannot be."""
    file = str(unpacked_at(bundle))
    solution = str(places[bundle][1] / asked.solution) if asked.solution else None
    return compared_with(asked.reference, file, shown=shown, solution=solution)


def read_file(shown: str, asked: Asked, bundle: bytes) -> Known:
    """What is known of a file, and which experiments serve it."""
    try:
        known = compared_file(shown, asked, bundle)
        reading = known.reading or read(unpacked_at(bundle))
    except JointsDiffer as error:
        return Known("", differs=error.why, reference="arm" if asked.reference == "arm" else SOLUTION)
    except ModelError as error:
        return Known(
            as_given(str(error), shown, bundle)
            .removeprefix(f"{shown} cannot be compared: ")
            .replace(f" {shown}:", " it:")
            .replace(f"{shown} is ", "it is ")
        )
    reasons = {name: say(reason) for name in asked.names if (reason := skipped(name, known.robot))}
    serving = tuple(name for name in asked.names if name not in reasons)
    about = len(known.robot.joints), reading.integrator, reading.dt, known.reference.kind
    return Known("", serving, tuple(reasons.items()), *about, why_itself=known.reference.why_itself)


def as_given(text: str, shown: str, bundle: bytes) -> str:
    """A text in which a file is called as it was given, not by where it was unpacked."""
    return text.replace(str(unpacked_at(bundle)), shown).replace(f"{unpacked_at(bundle).parent}/", "")


def setup_of(known: Compared, asked: Asked) -> Setup:
    make = Setup.quick if asked.is_quick else Setup
    return make(known.robot, engines(known.mujoco), reading=known.reading)


def untimed_part(name: str, shown: str, asked: Asked, bundle: bytes) -> bytes:
    """What of an experiment is no timing, packed."""
    setup = setup_of(compared_file(shown, asked, bundle), asked)
    with quiet(setup.robot):
        module(name).begin(setup)
        return zlib.compress(pickle.dumps(done(setup.background[name])), 1)


def done(work: object) -> object:
    """Work under way, come to its end."""
    return tuple(map(done, work)) if isinstance(work, tuple) else list(work) if isinstance(work, Iterator) else work


def findings(name: str, work: bytes | None, shown: str, asked: Asked, bundle: bytes) -> tuple[bytes, str]:
    """What an experiment finds, or that it broke off: see experiment.computed, packed; and the first check that differs, or "".

    work: its `untimed_part`.
    """
    setup = setup_of(compared_file(shown, asked, bundle), asked)
    if work:
        setup.background[name] = pickle.loads(zlib.decompress(work))
    found = experiment.computed(name, module(name), setup)
    for result in filter(None, found):
        result.notes = [as_given(say(note), shown, bundle) for note in result.notes]
        result.checks = [replace(check, note=as_given(check.note, shown, bundle)) for check in result.checks]
    if work and found[0]:
        found[0].notes.append(f"Timed on {platform.node()} ({vectors()}), by a worker that did nothing else.")
    section = verdict.Section(name, "", "", "", found[0] or found[1])
    return zlib.compress(pickle.dumps(found), 1), next(map(str, verdict.failures([section])[0]), "")


def broken(name: str, why: str) -> tuple[None, Result]:
    """What stands for an experiment that gave nothing: one failed check."""
    result = Result(name, shown=[])
    result.check("", ENDS, None, 0.0, "", why, rule="equal", about=About.PROGRAM)
    return None, result


def reported(
    found: Mapping[str, bytes | str],
    left_out: Sequence[tuple[str, str]],
    seconds: float,
    shown: str,
    asked: Asked,
    bundle: bytes,
) -> tuple[dict, dict[str, bytes]]:
    """The row of a file, and its own report: {path: content}.

    found: what experiments found, see `findings`, or in words why one gave nothing; left_out: others, with the reason; seconds:
    what they took.
    """
    began = time.process_time()
    known = compared_file(shown, asked, bundle)
    setup, names = setup_of(known, asked), [name for name in asked.names if name in found or name == "diagnosis"]
    have = {
        name: broken(name, value) if isinstance(value, str) else pickle.loads(zlib.decompress(value))
        for name, value in found.items()
    }
    with tempfile.TemporaryDirectory(dir=Path.cwd()) as place_of_report:
        out, clock = Path(place_of_report), Clock()
        sections, causes, needless = experiment.examine(names, setup, out, Silent(), Here(), clock, have)
        parts, count = Parts(), len(EXPERIMENTS) - len(needless)
        outcome = sections, count, causes, known.reference.compared, known.robot.name
        words = parts.made("the verdict", "No verdict could be made.", verdict.verdict, *outcome)
        origin = provenance.provenance(asked.command(shown), known.robot.mjcf, shown, SEED)
        seconds += time.process_time() - began
        origin["seconds"] = round(seconds, 1)
        skips = [*left_out, *needless.items()]
        files.write(out, verdict.Report(sections, known.robot, origin, words, causes, skips, known.reference), parts)
        written = {name: (out / name).read_bytes() for name in folder.files(out)}
        shutil.rmtree(out / "figures", ignore_errors=True)
    return row_of_file(sections, causes, parts.lines, known.reference) | {"seconds": round(seconds, 2)}, written


class Silent:
    """A terminal that says nothing."""

    def say(self, text: str = "", style: str = "") -> None:
        pass


class Here:
    """Workers that do at once what they are asked to do, in this process."""

    def submit(self, function, /, *arguments, **named) -> Future:
        future = Future()
        try:
            future.set_result(function(*arguments, **named))
        except Exception as error:
            future.set_exception(error)
        return future
