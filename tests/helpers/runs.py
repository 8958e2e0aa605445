"""For tests of whole runs: the command line in a pipe, on a terminal, and ended by a signal."""

import os
import re
import signal
import struct
import subprocess
import sys
import time
from contextlib import suppress
from pathlib import Path
from types import SimpleNamespace

import pytest

ROOT = Path(__file__).resolve().parents[2]
ENVIRONMENT = os.environ | {"PYTHONPATH": str(ROOT)}
SECOND = 1.0  # an interrupt is answered within
IS_POSIX = os.name == "posix"
posix = pytest.mark.skipif(not IS_POSIX, reason="needs POSIX: its signals, limits or shell")


def command(*arguments):
    return [sys.executable, "-m", "compare", *map(os.fspath, arguments)]


def compare(*arguments, cwd, env=None, **options):
    options = {"capture_output": True, "text": True} | options
    return subprocess.run(command(*arguments), cwd=cwd, env=ENVIRONMENT | (env or {}), **options)


def in_shell(text, cwd):
    """A line of a shell, in which `compare` stands for the command line; its exit status is that of `compare`."""
    if not IS_POSIX:
        pytest.skip("needs bash")
    text = text.replace("compare", f"{sys.executable} -m compare")
    return subprocess.run(["bash", "-c", text], cwd=cwd, env=ENVIRONMENT, capture_output=True, text=True)


def on_terminal(arguments, columns, term, cwd, interrupt_at=None):
    """A run on a pseudo-terminal: status, output. interrupt_at: what stands in the output when the key Ctrl-C is pressed."""
    fcntl, pty, termios = map(pytest.importorskip, ("fcntl", "pty", "termios"))
    ours, theirs = pty.openpty()
    fcntl.ioctl(theirs, termios.TIOCSWINSZ, struct.pack("HHHH", 24, columns, 0, 0))

    def own_terminal():
        os.setsid()
        fcntl.ioctl(0, termios.TIOCSCTTY, 0)

    streams = dict.fromkeys(("stdin", "stdout", "stderr"), theirs)
    environment = ENVIRONMENT | {"TERM": term}
    run = subprocess.Popen(command(*arguments), cwd=cwd, env=environment, preexec_fn=own_terminal, **streams)
    os.close(theirs)
    output = b""
    with suppress(OSError):  # the other side is closed
        while True:
            output += os.read(ours, 65536)
            if interrupt_at and interrupt_at in output:
                os.write(ours, b"\x03")
                interrupt_at = None
    status = run.wait(timeout=60)
    os.close(ours)
    return SimpleNamespace(status=status, output=output.decode(), columns=columns)


def words(lines) -> str:
    return " ".join(" ".join(lines).split())


def readable_lines(run) -> list[str]:
    """The screen in the end: nothing of the progress, which is in a line that is emptied, is left, and the cursor is back."""
    assert re.findall(r"\x1b\[\?25[lh]", run.output)[-1:] in ([], ["\x1b[?25h"])
    shown = re.sub(r"\x1b\[(\?25[lh]|[\d;]*m)", "", run.output.replace("\r\n", "\n"))
    lines = re.sub(r"[^\n]*(\n\r\x1b\[1A|\r)\x1b\[2K(\r(\x1b\[2K)?)?", "", shown).split("\n")
    assert all(len(line) <= run.columns for line in lines) and not re.search("[\x1b\r]", "".join(lines))
    for left in ("Traceback", "imports", "(1 of 1)", "figures"):
        assert left not in words(lines)
    return lines


def started(*arguments, cwd, env=None):
    """A run in a process group of its own, as a terminal's, that hears Ctrl-C."""

    if not IS_POSIX:
        pytest.skip("needs process groups")

    def hearing():  # a shell starts what runs in its background deaf to Ctrl-C
        signal.signal(signal.SIGINT, signal.SIG_DFL)

    options = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True, "start_new_session": True}
    return subprocess.Popen(arguments, cwd=cwd, env=ENVIRONMENT | (env or {}), preexec_fn=hearing, **options)


def ended(run, name):
    """A run that gets this signal: status, lines on stderr, seconds until it ended; all of its processes end with it."""
    sent = time.perf_counter()
    os.killpg(run.pid, getattr(signal, name))
    status = run.wait(timeout=60)
    seconds = time.perf_counter() - sent
    lines = run.communicate()[1].splitlines()
    with pytest.raises(ProcessLookupError):  # in the end no process is there
        for _ in range(500):
            os.killpg(run.pid, 0)
            time.sleep(0.01)
    return SimpleNamespace(status=status, lines=lines, seconds=seconds)
