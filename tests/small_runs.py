"""Small runs that several tests look at, which the fixture `shared` computes once.

Used by conftest.py (`small`), test_own_reference, test_drawn_figures, test_second_robot, report/test_terminal and
experiments/diagnosis/test_judge_diagnosis.
"""

import os
from concurrent.futures import ThreadPoolExecutor
from functools import cache, partial
from pathlib import Path
from tempfile import TemporaryDirectory
from types import SimpleNamespace

from crane import crane
from drawn_flaws import flaws
from runs import in_shell, on_terminal

from compare import experiment
from compare.engines.mujoco import load
from compare.experiments import EXPERIMENTS, module, skipped
from compare.fleet.file_pieces import Here
from compare.report import files, verdict
from compare.robots.arm import ARM


@cache
def of_arm(name):
    """The result of an experiment on the arm, every path with few states and steps."""
    return module(name).rows(experiment.Setup.small(ARM, experiment.engines(load(ARM.mjcf, ARM.tree))))


class Lines(list):
    """A terminal that keeps what is said."""

    def say(self, text="", style=""):
        self.append(text)


def of_crane():
    """Of the robot of four hinges: sections, reasons for what is skipped, lines, report.md, results.json, sizes of figures."""
    with TemporaryDirectory() as place:
        folder, lines = Path(place), Lines()
        robot = crane(folder)
        setup = experiment.Setup.small(robot, experiment.engines(load(robot.mjcf, robot.tree)))
        reasons = {name: reason for name in EXPERIMENTS if (reason := skipped(name, robot))}
        sections, causes, _ = experiment.examine(
            [n for n in EXPERIMENTS if n not in reasons], setup, folder, lines, Here()
        )
        words = verdict.verdict(sections, len(EXPERIMENTS), causes)
        report = verdict.Report(sections, robot, {"command": "c"}, words, causes, list(reasons.items()))
        files.write(folder, report)
        texts = {name: (folder / name).read_text(encoding="utf-8") for name in ("report.md", "results.json")}
        sizes = {path.name.removesuffix(".png"): path.stat().st_size for path in (folder / "figures").iterdir()}
    for section in sections:
        section.result.curves = {}  # which need not be sent
    return SimpleNamespace(sections=sections, reasons=reasons, lines=lines, texts=texts, sizes=sizes)


def flaws_of_arm():
    """What is wrong with each figure of matplotlib of all experiments on the arm, as it is drawn: {its name: in words}."""
    calls = (call for name in EXPERIMENTS for call in module(name).figures(of_arm(name), ARM))
    return {name: flaws(figure) for name, figure, _ in (call() for call in calls) if hasattr(figure, "axes")}


def runs_on_terminals(plain, umlauts):
    """Runs that wait for nothing of each other: of the arm and of a heavy one, on terminals and in a shell, in two folders."""
    plain.mkdir()
    umlauts.mkdir(parents=True)
    for name in (umlauts / "Käfer.xml", umlauts / os.fsdecode(b"\xff.xml")):
        name.write_bytes(ARM.mjcf.read_bytes())
    (plain / "heavy.xml").write_text(ARM.mjcf.read_text().replace('mass="1.5"', 'mass="1.6"'))
    arm, heavy = ("mass", "--quick", "--out"), ("mass", "--quick", "--mjcf", "heavy.xml", "--out")
    old = "LC_ALL=C PYTHONUTF8=0 PYTHONCOERCECLOCALE=0"
    calls = {("arm", *at): partial(on_terminal, [*arm, f"arm{at}"], *at, plain) for at in [(40, "xterm"), (80, "dumb")]}
    calls |= {
        ("heavy", *at): partial(on_terminal, [*heavy, f"heavy{at}"], *at, plain) for at in [(80, "xterm"), (40, "dumb")]
    }
    calls |= {
        "ascii, head": partial(in_shell, "PYTHONIOENCODING=ascii compare published --quick --mjcf Käfer.xml --out Öl | head -1;"
                               "exit ${PIPESTATUS[0]}", umlauts),
        "C": partial(in_shell, f"{old} compare published --quick --mjcf Käfer.xml --out 'Öl im C'", umlauts),
        "bytes, full": partial(in_shell, f"{old} compare mass --quick --mjcf $'\\xff.xml' --out $'\\xfe'"
                               " >/dev/full 2>&1", umlauts),
        "closed": partial(in_shell, "compare mass --quick --mjcf heavy.xml --out closed <&- >&- 2>&-", plain),
    }  # fmt: skip
    with ThreadPoolExecutor(2) as pool:
        under_way = {name: pool.submit(call) for name, call in calls.items()}
    return {name: run.result() for name, run in under_way.items()}


def terminal_folders(folder) -> tuple[Path, Path]:
    """Where `runs_on_terminals` runs."""
    return folder / "plain", folder / "Zoë" / "Über"
