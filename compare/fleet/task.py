"""The task of a fleet: compare one file, and give its row of the table and its report."""

import hashlib
import os
import shlex
import shutil
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import NamedTuple

from ..core.text import block
from ..engines.mujoco import ModelError, read
from ..experiments import TIMED
from ..report import folder, provenance
from ..report.terminal import Terminal
from ..robots.case import SEED
from ..run import examine as experiment
from ..run.command import applying, write_report
from ..run.reference import SOLUTION, JointsDiffer, compared_with
from .models import unpacked
from .table import DIFFER, REFUSED, FileRow, judge


class FleetOptions(NamedTuple):
    names: tuple[str, ...]  # of experiments
    is_quick: bool = True
    reference: str | None = None  # as given; None: the arm for a file with its hinges, else the model
    solution: str = ""  # its path in the bundle

    def command(self, shown: str) -> str:
        """The command that writes the same report for one file."""
        is_timed = not {*TIMED}.isdisjoint(self.names)
        words = ["fleet", shown] + ["--full"] * (not self.is_quick) + ["--timing"] * is_timed
        words += ["--only", ",".join(self.names)]
        words += ["--reference", self.reference] if self.reference else []
        return shlex.join(["python", "-m", "compare", *words])


class Compared(NamedTuple):
    row: FileRow
    report: dict[str, bytes]  # content by path; empty if nothing can be compared


def compare_file(shown: str, options: FleetOptions, bundle: dict[str, bytes]) -> Compared:
    """Compare the file of a bundle in the current folder."""
    began, top, out = time.process_time(), Path.cwd() / "model", Path.cwd() / "report"
    path = unpacked(bundle, top)
    solution = str(top / options.solution) if options.solution else None
    row = FileRow(file=shown, sha256=hashlib.sha256(next(iter(bundle.values()))).hexdigest(), verdict=REFUSED)
    try:
        compared = compared_with(options.reference, str(path), shown=shown, solution=solution)
        reading = compared.reading or read(compared.mujoco.source)
    except JointsDiffer as error:
        row.verdict, row.reason = DIFFER, error.why
        row.reference = "arm" if options.reference == "arm" else SOLUTION
        return Compared(row, {})
    except ModelError as error:
        why = str(error).replace(str(path), shown).replace(os.path.join(path.parent, ""), "")
        row.reason = why.removeprefix(f"{shown} cannot be compared: ")
        return Compared(row, {})
    names, reasons = applying(options.names, compared.robot)
    row.joints, row.reference = len(compared.robot.joints), compared.reference.kind
    row.file_integrator, row.file_dt = reading.integrator, reading.dt
    if not names:
        row.reason = block("fleet", "nothing_applies", reasons=reasons)
        return Compared(row, {})
    out.mkdir()
    setup = experiment.setup_of(compared, options.is_quick)
    with ThreadPoolExecutor(1) as workers:
        examined = experiment.Run(names, setup, out, Terminal(), workers).examined()
    origin = provenance.provenance(options.command(shown), compared.robot.mjcf, shown, SEED)
    origin["seconds"] = round(time.process_time() - began, 1)
    report = write_report(out, examined, reasons, origin, compared)
    written = {name: (out / name).read_bytes() for name in folder.files(out)}
    shutil.rmtree(top)
    judge(row, report, compared.reference)
    row.seconds, row.has_report = round(time.process_time() - began, 2), True
    return Compared(row, written)
