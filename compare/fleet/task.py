"""The task of a fleet: compare one file, and give its row of the table and its report."""

import hashlib
import os
import shlex
import shutil
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import NamedTuple

from ..core.text import say
from ..engines.mujoco import ModelError, read
from ..experiments import TIMED, skipped
from ..process.workers import Clock
from ..report import folder, provenance
from ..report.terminal import Terminal
from ..robots.case import SEED
from ..run import examine as experiment
from ..run.command import write_report
from ..run.reference import SOLUTION, JointsDiffer, compared_with
from .models import unpacked
from .table import DIFFER, REFUSED, row_of_file


class FleetOptions(NamedTuple):
    names: tuple[str, ...]  # of experiments
    is_quick: bool = True
    reference: str | None = None  # as given; None: the arm for a file with its hinges, else the model
    solution: str = ""  # its path in the bundle

    def command(self, shown: str) -> str:
        """The command that writes the same report for one file."""
        words = [
            "fleet",
            shown,
            *["--full"] * (not self.is_quick),
            *["--timing"] * bool({*TIMED} & {*self.names}),
        ]
        words += ["--only", ",".join(self.names)]
        words += ["--reference", self.reference] if self.reference else []
        return shlex.join(["python", "-m", "compare", *words])


def compare_file(
    shown: str, options: FleetOptions, bundle: dict[str, bytes]
) -> tuple[dict, dict[str, bytes]]:
    """The row of a file, and its report: {path: content}, empty if nothing can be compared."""
    began, top, out = time.process_time(), Path.cwd() / "model", Path.cwd() / "report"
    path = unpacked(bundle, top)
    solution = str(top / options.solution) if options.solution else None
    row = {"sha256": hashlib.sha256(next(iter(bundle.values()))).hexdigest()}
    try:
        compared = compared_with(options.reference, str(path), shown=shown, solution=solution)
        reading = compared.reading or read(path)
    except JointsDiffer as error:
        reference = "arm" if options.reference == "arm" else SOLUTION
        return row | {"verdict": DIFFER, "reason": error.why, "reference": reference}, {}
    except ModelError as error:
        reason = str(error).replace(str(path), shown).replace(os.path.join(path.parent, ""), "")
        return row | {"verdict": REFUSED, "reason": reason.removeprefix(f"{shown} cannot be compared: ")}, {}
    reasons = {name: say(reason) for name in options.names if (reason := skipped(name, compared.robot))}
    names = [name for name in options.names if name not in reasons]
    left_out = list(reasons.items())
    row |= {
        "joints": len(compared.robot.joints), "file_integrator": reading.integrator, "file_dt_s": reading.dt,
        "reference": compared.reference.kind,
    }  # fmt: skip
    if not names:
        return row | {
            "verdict": REFUSED,
            "reason": f"no experiment applies: {'; '.join(map(': '.join, left_out))}",
        }, {}
    out.mkdir()
    setup = experiment.setup_of(compared, options.is_quick)
    with ThreadPoolExecutor(1) as workers:
        examined = experiment.examine(names, setup, out, Terminal(), workers, Clock())
    origin = provenance.provenance(options.command(shown), compared.robot.mjcf, shown, SEED)
    origin["seconds"] = round(time.process_time() - began, 1)
    report, parts = write_report(out, examined, left_out, origin, compared)
    written = {name: (out / name).read_bytes() for name in folder.files(out)}
    shutil.rmtree(top)
    row |= row_of_file(report.sections, report.causes, parts.lines, compared.reference)
    return row | {"seconds": round(time.process_time() - began, 2), "has_report": True}, written
