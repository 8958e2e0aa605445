"""The task of a fleet: compare one file, and give its row of the table and its report."""

import hashlib
import os
import shlex
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import NamedTuple

from ..core.text import block
from ..engines.mujoco import ModelError, read
from ..experiments.options import Options
from ..report import folder, provenance
from ..report.terminal import Terminal
from ..robots.case import SEED
from ..run import examine as experiment
from ..run.command import applying, write_report
from ..run.reference import SOLUTION, JointsDiffer, compared_with
from .table import DIFFER, REFUSED, FileRow, judge


class FleetOptions(NamedTuple):
    names: tuple[str, ...]  # of experiments
    is_quick: bool = True
    reference: str | None = None  # as given; None: the arm for a file with its hinges, else the model
    solution: str = ""  # its path

    def command(self, shown: str) -> str:
        """The command that writes the same report for one file."""
        words = ["fleet", shown] + ["--full"] * (not self.is_quick) + ["--only", ",".join(self.names)]
        words += ["--reference", self.reference] if self.reference else []
        return shlex.join(["python", "-m", "compare", *words])


def compare_file(shown: str, path: str, place: str, options: FleetOptions) -> FileRow:
    """Compare a file and write its report to a folder, if anything can be compared; its row of the table."""
    began = time.process_time()
    digest = hashlib.sha256(Path(path).read_bytes()).hexdigest()
    row = FileRow(file=shown, sha256=digest, verdict=REFUSED)
    try:
        compared = compared_with(options.reference, path, shown=shown, solution=options.solution or None)
        reading = compared.reading or read(compared.mujoco.source)
    except JointsDiffer as error:
        row.verdict, row.reason = DIFFER, error.why
        row.reference = "arm" if options.reference == "arm" else SOLUTION
        return row
    except ModelError as error:
        why = str(error).replace(path, shown).replace(os.path.join(os.path.dirname(path), ""), "")
        row.reason = why.removeprefix(f"{shown} cannot be compared: ")
        return row
    names, reasons = applying(options.names, compared.robot)
    row.joints, row.reference = len(compared.robot.joints), compared.reference.kind
    row.file_integrator, row.file_dt = reading.integrator, reading.dt
    if not names:
        row.reason = block("fleet", "nothing_applies", reasons=reasons)
        return row
    setup = experiment.setup_of(compared, Options(quick=options.is_quick))
    with folder.new_report(place) as out, ThreadPoolExecutor(1) as workers:
        run = experiment.Run(names, setup, out, Terminal(), workers, few=True).examined()
        origin = provenance.provenance(options.command(shown), compared.robot.mjcf, shown, SEED)
        origin["seconds"] = round(time.process_time() - began, 1)
        report = write_report(out, run, reasons, origin, compared)
    judge(row, report, compared.reference)
    row.seconds, row.has_report = round(time.process_time() - began, 2), True
    return row
