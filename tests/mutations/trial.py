"""One run of tests in a copy of the project, and its end with all that it has started."""

import os
import re
import signal
import subprocess
import sys
import threading
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple


class Stage(NamedTuple):
    """Tests that run together."""

    files: list[str]
    options: tuple = ()


class Runs:
    """Runs of pytest that end, with all that they have started, when this is ended."""

    def __init__(self):
        self.change, self.under_way, self.ended = threading.Lock(), set(), False

    def failed(self, copy: Path, cache: Path, stage: Stage, limit: float) -> tuple[str, str]:
        """What failed first, empty if nothing did, and the end of the output. copy: of the project, in a folder of its own."""
        tests = [f"--basetemp={copy.parent / 'tests'}", *stage.options, *stage.files]
        command = [sys.executable, "-m", "pytest", "-x", "-q", "-rfE", *tests]
        scratch = copy.parent / "scratch"
        scratch.mkdir(exist_ok=True)
        others = filter(None, os.environ.get("PYTHONPATH", "").split(os.pathsep))
        path = [str(copy), *(other for other in others if not Path(other, "compare").is_dir())]
        changed = {
            "PYTHONPATH": os.pathsep.join(path),
            "TMT_CACHE": str(cache),
            "TMPDIR": str(scratch),
            "COLUMNS": "200",
        }
        with (copy.parent / "output").open("w+", errors="replace") as output:
            streams = {"stdin": subprocess.DEVNULL, "stdout": output, "stderr": output}
            with self.change:
                if self.ended:
                    raise InterruptedError
                process = subprocess.Popen(
                    command, cwd=copy, env=os.environ | changed, start_new_session=True, **streams
                )
                self.under_way.add(process)
            try:
                process.wait(timeout=limit)
            except subprocess.TimeoutExpired:
                return f"no end after {limit:.0f} s", ""
            finally:
                end(process)
                self.under_way.discard(process)
            output.seek(0)
            lines = output.read().splitlines()[-30:]
        named = [found[1] for line in lines if (found := re.match(r"(?:FAILED|ERROR) (.*?)(?: - .*)?$", line))]
        otherwise = [f"status {process.returncode}: {(lines or ['no output'])[-1]}"] * bool(process.returncode)
        return [*named, *otherwise, ""][0], "\n".join(lines)

    def end(self) -> None:
        with self.change:
            self.ended = True
            for process in [*self.under_way]:
                end(process)


def end(process: subprocess.Popen) -> None:
    """End a process and all that it has started, which may be in other groups."""
    parents = {}
    for stat in Path("/proc").glob("[0-9]*/stat"):
        with suppress(OSError):  # it has ended meanwhile
            parents[int(stat.parent.name)] = int(stat.read_text().rpartition(")")[2].split()[1])
    family = [process.pid] if process.returncode is None else []
    for parent in family:
        family += [child for child, of in parents.items() if of == parent]
    for number in family:
        with suppress(ProcessLookupError):
            os.kill(number, signal.SIGKILL)
    with suppress(ProcessLookupError, PermissionError):
        os.killpg(process.pid, signal.SIGKILL)
    process.wait()
