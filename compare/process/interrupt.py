"""A run in a child process, and its end by Ctrl-C, SIGTERM or SIGHUP with status 2, whatever it is doing.

The parent hears the signals at once, also while the child computes in C. It passes them on as SIGTERM, which
is a KeyboardInterrupt in the child: that writes what is finished and clears up. A child that does not answer
is killed, with all that a user's own code has started. That it has come to its end is a message, which an
exit status cannot forge.
"""

import os
import shutil
import signal
import sys
import threading
import time
from collections.abc import Callable
from contextlib import ExitStack, suppress
from math import inf
from multiprocessing import get_context, parent_process
from multiprocessing.connection import Connection
from typing import Any

from ..core.errors import how_ended
from . import streams
from .files import remove_empty

SIGNALS = [getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)]
POLL = 0.1  # s
PATIENCE = 10.0  # s in a user's own function after which a log names it; a terminal shows it sooner
ANSWER, ENDING = 0.5, 60.0  # s for a child to answer a signal, and then to write what is finished
at_end = ExitStack()  # what ends and clears up a run; last first


class Now:
    """The state of this process."""

    is_listening = False  # a signal ends what the command line runs
    is_interrupted = False
    outcome = "nothing was written"
    waits: tuple[str, float] | None = None  # a user's own function that is running, and since when
    parent: Connection | None = None


# in the parent


def ended_by_signals(run: Callable[[], int], is_own: bool = False) -> int:
    """The exit status of a run in a child; 2, with a line, after a signal, or if the child ends otherwise.

    is_own: a user's own code runs there. Signals that are ignored (nohup, background) stay ignored.
    """
    can_fork = sys.platform == "linux" and hasattr(os, "fork")
    context = get_context("fork") if can_fork else get_context("spawn")
    ours, theirs = context.Pipe()
    told, is_interrupted = dict[str, Any](outcome=Now.outcome), False
    heard = [number for number in SIGNALS if signal.getsignal(number) is not signal.SIG_IGN]
    child = context.Process(target=as_child, args=(run, theirs, is_own))

    def handle(action: Any) -> None:
        for number in heard:
            signal.signal(number, action)

    def hear(kinds: set[str], seconds: float) -> None:
        """Take what the child tells, up to one of these or the last, for so long, while it is there."""
        until = time.monotonic() + seconds
        with suppress(EOFError, OSError):
            while not told.keys() & {*kinds, "end"} and time.monotonic() < until:
                is_there = child.is_alive()
                if ours.poll(POLL):
                    told.update([ours.recv()])
                elif not is_there:
                    return

    handle(signal.SIG_IGN)  # the child begins deaf to what a terminal sends to all processes
    child.start()
    theirs.close()
    try:
        handle(signal.default_int_handler)
        hear(set(), inf)
    except KeyboardInterrupt:
        is_interrupted = True
        with suppress(KeyboardInterrupt):  # a second one
            child.terminate()
            hear({"ending", "interrupted"}, ENDING if "keeps" in told else ANSWER)
            hear(set(), ENDING if told.keys() & {"ending", "interrupted"} else 0.0)
    handle(signal.SIG_IGN)
    if "end" in told:
        child.join(ANSWER)
    if is_own:
        end_group(child.pid or 0)
    child.kill()
    child.join()
    if told.get("end") is not None:
        return int(told["end"])
    if "end" not in told and "folder" in told:
        unfinished, made = told["folder"]
        shutil.rmtree(unfinished, ignore_errors=True)
        remove_empty(made)
    how = f"the run ended before its end{', perhaps by your equations' * is_own}: {how_ended(child.exitcode or 0)}"
    if is_interrupted or "interrupted" in told:
        how = f"interrupted{told.get('interrupted', '')}"
        with suppress(OSError):
            os.write(2, b"\r\x1b[2K\x1b[?25h" * os.isatty(2))  # over ^C; the cursor is back
    streams.say_error(f"{how}; {told['outcome']}")
    return 2


def end_group(leader: int = 0) -> None:
    """Kill a process group; 0: that of this process."""
    with suppress(OSError, AttributeError):
        os.killpg(leader, signal.SIGKILL)


# in the child


def as_child(run: Callable[[], int], parent: Connection, is_own: bool) -> None:
    if is_own and hasattr(os, "setpgrp"):
        os.setpgrp()
    Now.parent = parent
    end_with_parent(end_group if is_own else None)
    streams.prepare()
    status = None
    try:
        listen()
        status = run()
    except KeyboardInterrupt:
        with suppress(BaseException):
            at_end.close()
    tell("end", status)
    leave(0)


def listen() -> None:
    """From now on SIGTERM is a KeyboardInterrupt, once."""

    def heard(*_: object) -> None:
        if Now.is_interrupted:
            return
        name, seconds = waited_for()
        Now.is_interrupted = True
        tell("interrupted", f" while waiting for {name}, {seconds:.0f} s" if name else "")
        raise KeyboardInterrupt

    signal.signal(signal.SIGTERM, heard)
    Now.is_listening = True


def settle() -> None:
    """From now on a signal is too late: it does not change the exit status."""
    if Now.is_listening:
        signal.signal(signal.SIGTERM, signal.SIG_IGN)
    tell("ending")


def waited_for() -> tuple[str, float]:
    """A user's own function that is running, and for how long, s."""
    waits = Now.waits
    return (waits[0], time.monotonic() - waits[1]) if waits else ("", 0.0)


def tell(kind: str, what: object = None) -> None:
    """Tell the process that waits for this one; see `ended_by_signals`."""
    if Now.parent:
        with suppress(OSError):
            Now.parent.send((kind, what))


def on_interrupt(outcome: str) -> None:
    """What will be said of the results after a signal."""
    Now.outcome = outcome
    tell("outcome", outcome)


def is_interrupt(error: BaseException) -> bool:
    """Whether an exception is Ctrl-C; else a user's own code raised it."""
    return isinstance(error, KeyboardInterrupt) and (Now.is_interrupted or not Now.is_listening)


def end_with_parent(act: Callable[[], object] | None = None) -> None:
    """From now on this process ends when its parent has, after a last act. A log has for what it waits."""

    def watch() -> None:
        parent, told = parent_process(), ""
        while parent and parent.is_alive():
            parent.join(POLL if Now.parent else None)
            name, seconds = waited_for()
            if seconds > PATIENCE and name != told and not os.isatty(2):
                streams.say_error(f"waiting for {name}, {seconds:.0f} s")
                told = name
        if act:
            act()
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()


def leave(status: int) -> None:
    """End this process at once; what comes after main could end with another status."""
    for stream in (sys.stdout, sys.stderr):
        streams.Stream(stream).flush()
    os._exit(status)
