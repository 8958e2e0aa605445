"""Ctrl-C, SIGTERM and SIGHUP end a run within a second, in one line, with status 2, whatever it is doing."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from own_equations import XML
from runs import ENVIRONMENT, SECOND, command, compare, ended, posix, started

from compare.__main__ import main

ROLLOUT = """
import numpy as np
from compare.engines.mujoco import parse
from compare.robots.arm import ARM

dynamics = parse(ARM.mjcf, ARM.tree).of(ARM.case())
stepper = dynamics.stepper(1e-4, "RK4")
run = stepper.loop(stepper.start(), 500_000)
print("now", flush=True)
run()  # some seconds in C
"""
LISTENING = "from compare.process import interrupt; interrupt.listen()\n"
TESTS = Path(__file__).parents[1]
ALL = command("all", "--quick", "--out", "report")
OWN = [*ALL, "--reference", f"{TESTS / 'own_equations.py'}:", "--mjcf", "../double.xml"]
ROLLING = [sys.executable, "-c", LISTENING + ROLLOUT]
RUNS = {  # what runs, and what it is sent: as it begins, or after its first line
    "workers start": (ALL, "SIGTERM"), "a line": (ALL, "SIGHUP"), "own equations": (OWN, "SIGINT"),
    "a rollout": (ROLLING, "SIGINT"),
}  # fmt: skip


@pytest.mark.parametrize("name", RUNS)
def test_an_interrupt_is_answered_within_a_second(tmp_path, name):
    what, name_of_signal = RUNS[name]
    (tmp_path / "double.xml").write_text(XML)
    for attempt in range(2):  # the machine may be busy
        (place := tmp_path / f"{attempt}").mkdir()
        run = started(*what, cwd=place, env={"TMT_CACHE": str(tmp_path / "cache")})
        if name == "workers start":
            time.sleep(0.8)
        else:
            run.stdout.readline()
        assert run.poll() is None
        end = ended(run, name_of_signal)
        assert end.status == 2 and len(end.lines) == 1 and "Traceback" not in end.lines[0]
        assert list(place.iterdir()) == []
        if end.seconds < SECOND:
            return
    raise AssertionError(f"answered after {end.seconds:.2f} s")


LEAVING = """
import os
from own_equations import mass_matrix

def bias(q, qd):
    os._exit(0) if leaving else os.kill(os.getpid(), 9)
"""


@posix
@pytest.mark.parametrize("leaving, how", [(True, "exit status 0"), (False, "killed by SIGKILL")])
def test_own_equations_that_end_the_process_are_seen(tmp_path, leaving, how):
    (tmp_path / "double.xml").write_text(XML)
    (tmp_path / "mine.py").write_text(f"leaving = {leaving}{LEAVING}")
    path = os.pathsep.join([ENVIRONMENT["PYTHONPATH"], str(TESTS)])
    asked = "mass", "--quick", "--mjcf", "double.xml", "--reference", "mine.py:"
    run = compare(*asked, cwd=tmp_path, env={"PYTHONPATH": path})
    assert (run.returncode, run.stdout, len(run.stderr.splitlines())) == (2, "", 1) and how in run.stderr


@pytest.mark.slow
def test_the_processes_of_a_run_that_is_killed_end_with_it(tmp_path):
    run = started(*ALL, cwd=tmp_path)
    while not list(tmp_path.glob("report/.new-*")):
        time.sleep(0.01)
    time.sleep(0.5)  # its workers are there
    assert ended(run, "SIGKILL").status == -signal.SIGKILL


@posix
def test_a_signal_that_is_ignored_stays_ignored():
    text = LISTENING + "import os, signal; os.kill(os.getpid(), signal.SIGINT); print('well')"
    line = ["bash", "-c", "trap '' INT; exec \"$@\"", "-", sys.executable, "-c", text]
    run = subprocess.run(line, env=ENVIRONMENT, capture_output=True, text=True)
    assert (run.returncode, run.stdout, run.stderr) == (0, "well\n", "")


def test_called_from_python_the_command_line_leaves_signals_alone():
    before = signal.getsignal(signal.SIGINT)
    assert main(["mass", "--out", os.devnull]) == 2
    assert signal.getsignal(signal.SIGINT) is before and signal.set_wakeup_fd(-1) == -1
