"""Ctrl-C, SIGTERM and SIGHUP end a run within a second, in one line, with status 2, whatever it is doing."""

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import psutil
import pytest
from helpers.own_equations import XML
from helpers.runs import ENVIRONMENT, SECOND, command, compare, ended, posix, started

from compare.__main__ import main

ROLLOUT = """
import numpy as np
from compare.process import interrupt

def run():
    from compare.engines.mujoco import parse
    from compare.robots.arm import ARM
    dynamics = parse(ARM.mjcf, ARM.tree).of(ARM.case())
    stepper = dynamics.stepper(1e-4, "RK4")
    run = stepper.loop(stepper.start(), 500_000)
    print("now", flush=True)
    run()  # some seconds in C
    return 0

interrupt.leave(interrupt.ended_by_signals(run))
"""
TESTS = Path(__file__).parents[1]
ALL = command("all", "--quick", "--out", "report")
OWN = [*ALL, "--reference", f"{TESTS / 'helpers' / 'own_equations.py'}:", "--mjcf", "../double.xml"]
ROLLING = [sys.executable, "-c", ROLLOUT]
RUNS = {  # what runs, and what it is sent: as it begins, after its first line, or when its folder is there
    "workers start": (ALL, "SIGTERM"), "a folder": (ALL, "SIGHUP"), "own equations": (OWN, "SIGINT"),
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
        elif what != ROLLING:
            while not any(place.iterdir()):
                assert run.poll() is None
                time.sleep(0.02)
            time.sleep(0.3)  # the folder is registered
        else:
            run.stdout.readline()
        assert run.poll() is None
        end = ended(run, name_of_signal)
        assert end.status == 2 and len(end.lines) == 1 and "interrupted" in end.lines[0]
        assert list(place.iterdir()) == [] and "earlier" not in end.lines[0]
        if end.seconds < SECOND:
            return
    raise AssertionError(f"answered after {end.seconds:.2f} s")


@pytest.mark.parametrize("is_earlier", [True, pytest.param(False, marks=pytest.mark.slow)])
def test_what_is_finished_is_reported_beside_an_earlier_report(tmp_path, is_earlier):
    (tmp_path / "report").mkdir()
    earlier, place = tmp_path / "report" / "results.json", tmp_path / "report"
    if is_earlier:
        earlier.write_text('{"provenance": {"files": ["results.json"]}}')
        place = place / "interrupted"
    run = started(*ALL, cwd=tmp_path)
    while not run.stdout.readline().startswith("mass "):
        assert run.poll() is None
    end = ended(run, "SIGINT")
    assert end.status == 2 and f"{place.relative_to(tmp_path)}/index.html" in end.lines[0]
    assert ("earlier" in end.lines[0]) == is_earlier and (len(earlier.read_text()) < 100) == is_earlier
    results = json.loads((place / "results.json").read_text())
    finished = {check["experiment"] for check in results["checks"]}
    left_out = {skipped["experiment"] for skipped in results["skipped"]}
    assert {"kinematics", "mass"} <= finished and not results["passed"]
    assert "speed" in left_out and not left_out & finished
    assert f"Interrupted: {len(finished)} of " in (place / "report.md").read_text()


OWN_FILE = """
import os, signal, subprocess, sys, time
from helpers.own_equations import acceleration, bias as right, mass_matrix

how, calls = {how!r}, 0
os.chdir("elsewhere")
if how == "child":
    child = subprocess.Popen(["bash", "-c", "trap '' TERM; while true; do sleep 0.1; done"])
    open("child", "w").write(str(child.pid))
if how == "import":
    os._exit(200)


def bias(q, qd):
    global calls
    calls += 1
    if calls == 40 and how in ACTS:
        ACTS[how]()
    if how == "child":
        print("x" * 10_000)
        sys.stderr.write("y" * 10_000)
    return right(q, qd)


ACTS = {{"call": lambda: os._exit(200), "killed": lambda: os.kill(os.getpid(), 9),
        "hangs": lambda: time.sleep(600)}}
"""
ENDS = {"import": "exit status 200", "call": "exit status 200", "killed": "killed by SIGKILL"}


def of_own(how, folder, **more):
    (folder / "elsewhere").mkdir()
    (folder / "double.xml").write_text(XML)
    (folder / "mine.py").write_text(OWN_FILE.format(how=how))
    asked = "acceleration", "--quick", "--mjcf", "double.xml", "--reference", "mine.py:", "--out", "report"
    path = os.pathsep.join([ENVIRONMENT["PYTHONPATH"], str(TESTS)])
    return asked, {"cwd": folder, "env": {"PYTHONPATH": path}}


@posix
@pytest.mark.parametrize("how", ENDS)
def test_own_equations_that_end_the_process_are_seen_and_leave_nothing(tmp_path, how):
    asked, where = of_own(how, tmp_path)
    run = compare(*asked, **where)
    assert (run.returncode, len(run.stderr.splitlines())) == (2, 1) and ENDS[how] in run.stderr
    assert "passed" not in run.stdout and not (tmp_path / "report").exists()


@posix
def test_own_equations_may_change_the_folder_print_much_and_start_what_ends_with_the_run(tmp_path):
    asked, where = of_own("child", tmp_path)
    run = compare(*asked, **where)
    assert run.returncode == 0 and (tmp_path / "report" / "index.html").exists()
    assert len(run.stderr) < 21_000 and "no more is shown" in run.stderr and "xxx" not in run.stdout
    child = int((tmp_path / "elsewhere" / "child").read_text())
    for _ in range(500):  # a process that is killed needs a moment
        if not psutil.pid_exists(child) or psutil.Process(child).status() == psutil.STATUS_ZOMBIE:
            return
        time.sleep(0.01)
    raise AssertionError("what own code has started goes on")


def test_own_equations_that_hang_are_named(tmp_path):
    asked, where = of_own("hangs", tmp_path)
    run = started(*command(*asked), **where)
    assert "waiting for your bias, 10 s" in run.stderr.readline()
    end = ended(run, "SIGINT")
    assert end.status == 2 and "waiting for your bias" in end.lines[-1] and not (tmp_path / "report").exists()


@pytest.mark.slow
def test_the_processes_of_a_run_that_is_killed_end_with_it(tmp_path):
    run = started(*ALL, cwd=tmp_path)
    while not list(tmp_path.glob("report/.new-*")):
        time.sleep(0.01)
    time.sleep(0.5)  # its workers are there
    assert ended(run, "SIGKILL").status == -signal.SIGKILL


@posix
def test_a_signal_that_is_ignored_stays_ignored():
    text = "import os, signal, time\nfrom compare.process import interrupt\n"
    text += "def run(): os.kill(os.getppid(), signal.SIGINT); time.sleep(0.2); print(0); return 0\n"
    text += "interrupt.leave(interrupt.ended_by_signals(run))"
    line = ["bash", "-c", "trap '' INT; exec \"$@\"", "-", sys.executable, "-c", text]
    run = subprocess.run(line, env=ENVIRONMENT, capture_output=True, text=True)
    assert (run.returncode, run.stdout, run.stderr) == (0, "0\n", "")


def test_called_from_python_the_command_line_leaves_signals_alone():
    before = signal.getsignal(signal.SIGINT)
    assert main(["mass", "--out", os.devnull]) == 2
    assert signal.getsignal(signal.SIGINT) is before and signal.set_wakeup_fd(-1) == -1


def test_an_error_that_an_interrupt_becomes_in_a_library_is_the_interrupt(monkeypatch):
    """pybind11 makes an ImportError of it, rich's stack of displays an IndexError."""

    def imported(arguments):
        raise ImportError("initialization failed")

    monkeypatch.setattr("compare.__main__.status_of", imported)
    assert main([]) == 2
    monkeypatch.setattr("compare.process.interrupt.Now.is_interrupted", True)
    with pytest.raises(KeyboardInterrupt):
        main([])
