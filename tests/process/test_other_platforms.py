"""Where POSIX is missing, as on Windows: every module is imported, and runs, a fleet and an interrupt end as they do elsewhere.

Each process of a run executes `sitecustomize.py` at its start, which takes away what Windows does not have.
SIGKILL, which Python itself needs here, and the paths of POSIX stay.
"""

import json
import os
import sys

import pytest
from helpers.runs import ROOT, command, compare, ended, posix, started
from models import PATHS

MODULES = "fcntl grp pty pwd resource termios tty"
SIGNALS = "SIGHUP SIGQUIT SIGUSR1 SIG_BLOCK alarm pthread_kill pthread_sigmask setitimer sigwait"
FUNCTIONS = "fork forkpty geteuid getloadavg getuid killpg listxattr mkfifo sched_getaffinity setsid sysconf"
WITHOUT = f"""
import os, signal, sys

sys.modules |= dict.fromkeys("{MODULES}".split())
for module, names in (signal, "{SIGNALS}"), (os, "{FUNCTIONS}"):
    for name in names.split():
        if hasattr(module, name):
            delattr(module, name)
"""
IMPORTS = """
import importlib, os, pkgutil, compare, tmt

assert not hasattr(os, "fork")
for package in (compare, tmt):
    for module in pkgutil.walk_packages(package.__path__, package.__name__ + ".", onerror=lambda name: None):
        try:
            importlib.import_module(module.name)
        except ImportError as error:
            assert error.name and error.name.split(".")[0] in OPTIONAL, (module.name, error)
"""
OPTIONAL = {
    "heyoka", "jax", "mujoco_warp", "newton", "pinocchio", "pydrake", "sympy", "warp",
    "distributed",
}  # fmt: skip

pytestmark = [pytest.mark.slow, posix]  # the others have no need of it


@pytest.fixture
def elsewhere(tmp_path):
    """The environment of a platform without POSIX."""
    (tmp_path / "platform").mkdir()
    (tmp_path / "platform" / "sitecustomize.py").write_text(WITHOUT)
    paths = os.pathsep.join(map(str, (tmp_path / "platform", ROOT)))
    return {"PYTHONPATH": paths, "TMT_CACHE": str(tmp_path / "cache")}


def test_every_module_is_imported_and_a_fleet_passes(elsewhere, tmp_path):
    program = IMPORTS.replace("OPTIONAL", repr(OPTIONAL))
    run = started(sys.executable, "-c", program, cwd=tmp_path, env=elsewhere)
    assert run.communicate()[1] == "" and run.returncode == 0
    words = ("fleet", PATHS["pendulum_ball"], "--out", "fleet", "--only", "mass")
    run = compare(*words, cwd=tmp_path, env=elsewhere)
    assert run.returncode == 0 and "1 file" in run.stdout, run.stderr


def test_a_run_passes_and_an_interrupt_ends_one(elsewhere, tmp_path):
    run = compare("mass", "--quick", "--out", "report", cwd=tmp_path, env=elsewhere)
    results = json.loads((tmp_path / "report" / "results.json").read_text(encoding="utf-8"))
    assert run.returncode == 0 and results["passed"], run.stderr
    assert list((tmp_path / "cache").glob("*.o"))  # compiled code is stored
    run = started(*command("all", "--quick", "--out", "new"), cwd=tmp_path, env=elsewhere)
    run.stdout.readline()
    end = ended(run, "SIGINT")
    assert end.status == 2 and len(end.lines) == 1 and "interrupted" in end.lines[0]
    assert not list(tmp_path.glob("new/.new-*"))  # nothing half written
