"""The command: write the equations, run and compare them, say the outcome in the files and the terminal."""

import argparse
import hashlib
import os
import re
import time
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import tmt
from tmt.export import is_word
from tmt.export.parameters import Parameters

from ..cli.command_line import EQUATIONS, command_parser
from ..core.errors import Refused
from ..core.finding import Finding
from ..core.options import Option, expected, seconds
from ..core.text import block, screen
from ..core.words import in_one_line
from ..report.provenance import installed
from ..report.terminal import Terminal
from ..robots.arm import ARM

FILES = {  # of each language: the endings of the files, and what tmt.equations calls their languages
    "c": {".c": "c", ".h": "c header"},
    "python": {".py": "python"},
    "matlab": {".m": "matlab"},
    "casadi": {".py": "casadi"},
    "jax": {".py": "jax"},
    "latex": {".tex": "latex", ".html": "html", ".py": "sympy"},
}
QUANTITIES = {"latex": "mass_matrix,bias,gravity_balance"}
OF_MOST = "mass_matrix,bias,acceleration"
STATES = 1000
OPTIONS = {
    "--to": Option(metavar="LANGUAGE", default="c"),
    "--mjcf": Option(metavar="FILE"),
    "--floating": Option(None),
    "--quantity": Option(metavar="LIST"),
    "--name": Option(metavar="NAME"),
    "--parameters": Option(metavar="LIST"),
    "--float": Option(None),
    "--limit": Option(seconds(1e6), "S", 60.0),
    "--out": Option(metavar="DIR"),
}


def equations_status(arguments: Sequence[str], command: str) -> int:
    """Run the command; the exit status. SystemExit: help, wrong arguments. Refused: it cannot be done."""
    parser = command_parser(EQUATIONS, "--out DIR", "export", OPTIONS)
    options, unknown = parser.parse_known_args(arguments)
    if options.help:
        parser.print_help()
        raise SystemExit(0)
    if unknown and unknown[0].startswith("-"):
        parser.refuse_option(unknown[0], [*OPTIONS, "--help"])
    if unknown:
        parser.error(f"unexpected argument {unknown[0]!r}")
    if options.to not in FILES:
        near = expected(options.to, dict(zip(FILES, FILES)), ", ".join(FILES))
        parser.error(f"--to: {options.to!r} is not a language; {near}")
    if not options.out:
        parser.error("expected a new folder: --out DIR")
    if Path(options.out).exists():
        parser.error(f"--out: {options.out} exists; expected the name of a new folder")
    above = next(path for path in Path(options.out).absolute().parents if path.exists())
    if not (above.is_dir() and os.access(above, os.W_OK)):
        parser.error(f"--out: {above} is not a folder that can be written to")
    return write_equations(options, command)


def write_equations(options: argparse.Namespace, command: str) -> int:
    """Write and check the files; the exit status."""
    started, terminal = time.perf_counter(), Terminal()
    from ..engines.mujoco import ModelError  # imports are slow
    from ..run.reference import compared_with
    from . import checks, programs

    path, words = options.mjcf, (options.parameters or "").replace(", ", ",")
    try:
        reference = "model" if path or words else None
        compared = compared_with(reference, path or str(ARM.mjcf), floating=options.floating)
        compared = checks.with_sites(compared)
    except ModelError as error:
        raise Refused(error) from None
    robot, name = compared.robot, options.name or identifier(Path(options.mjcf or "arm").stem)
    terminal.say_lines(compared.reference.lines if options.mjcf else ())
    quantities = (options.quantity or QUANTITIES.get(options.to, OF_MOST)).replace(" ", "").split(",")
    named = words.split(",") if words else []
    more: dict[str, Any] = {"parameters": named, "limit": options.limit}

    def written(*head: str) -> dict[str, str]:
        text = partial(tmt.equations, robot.tree, name=name, single=options.float, head=head)
        files = FILES[options.to].items()
        try:
            return {f"{name}{ending}": text(to, quantities, **more) for ending, to in files}
        except ValueError as error:
            raise Refused(error) from None

    with terminal.progress("writes the equations"), TemporaryDirectory() as folder:
        texts = written()
        kilobytes, seconds = sum(map(len, texts.values())) / 1000, time.perf_counter() - started
        terminal.say(block("export", "written", names=list(texts), kilobytes=kilobytes, seconds=seconds))
        for file, text in texts.items():
            Path(folder, file).write_text(text, encoding="utf-8")
        terminal.show(f"runs what was written, at {STATES} states")
        chosen = Parameters(robot.tree, named)
        arguments = Path(folder), name, robot.tree, quantities, options.float, chosen
        make = partial(programs.PROGRAMS[options.to], *arguments)
        outcome, program = checks.checked(compared, make, quantities, STATES, options.float, chosen)
        times = checks.times(compared, program, quantities, STATES)
    facts = {"outcome": outcome, "times": times, "states": STATES, "features": robot.features}
    facts |= {"name": in_one_line(robot.name), "command": in_one_line(command), "mujoco": installed("mujoco")}
    facts["sha256"] = hashlib.sha256(Path(robot.mjcf).read_bytes()).hexdigest()[:16]
    texts = written(*block("export", "head", **facts).splitlines())
    paths = [Path(options.out, file) for file in texts]
    try:
        Path(options.out).mkdir(parents=True)
        for path, text in zip(paths, texts.values()):
            path.write_text(text, encoding="utf-8")
    except OSError as error:
        raise Refused(f"cannot write to {options.out}: {error.strerror}") from None
    tables = {"differences": outcome.rows, "times": times}
    for table in [Finding("export", kind, {"rows": rows}) for kind, rows in tables.items() if rows]:
        terminal.say_lines(screen(table))
    style = "bold green" if outcome.passed else "bold" if outcome.not_run else "bold red"
    terminal.say(block("export", "verdict", outcome=outcome, states=STATES), style)
    terminal.say(block("export", "files", paths=paths, seconds=time.perf_counter() - started))
    return 0 if outcome.passed or outcome.not_run else 1


def identifier(stem: str) -> str:
    name = re.sub(r"\W", "_", stem, flags=re.ASCII).strip("_")[:50]
    return name if name[:1].isalpha() and not is_word(name) else f"robot_{name}".rstrip("_")
