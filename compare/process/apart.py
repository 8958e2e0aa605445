"""A run in a child process, where a user's own code may end, hang or start what it wants.

The child leads a process group, which ends with it. That it has come to its end is a message, which an exit
status cannot forge.
"""

import os
import shutil
import signal
import time
from collections.abc import Callable
from contextlib import suppress
from math import inf
from multiprocessing import get_context
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from typing import Any

from ..core.errors import how_ended
from . import interrupt, streams
from .files import remove_empty

ANSWER, ENDING = 1.0, 60.0  # s for a child to answer an interrupt, and then to write what is finished


def in_child(run: Callable[[], int]) -> int:
    """The exit status of a run in a child; 2, with a line, if the child ends otherwise or does not answer."""
    context, is_interrupted = get_context("spawn"), False
    ours, theirs = context.Pipe()
    child = context.Process(target=as_child, args=(run, theirs))
    told: dict[str, Any] = {"outcome": interrupt.Now.outcome}
    interrupt.shield()
    child.start()
    theirs.close()
    try:
        interrupt.shield(False)
        hear(ours, child, told, "end", inf)
    except KeyboardInterrupt:
        is_interrupted = True
        with suppress(KeyboardInterrupt):
            child.terminate()  # it hears that as Ctrl-C
            hear(ours, child, told, "ending", ANSWER)
            hear(ours, child, told, "end", ENDING if "ending" in told else 0.0)
    if "end" in told:
        child.join(ANSWER)
    end_group(child.pid or 0)
    child.kill()
    child.join()
    if "end" in told:
        return int(told["end"])
    if "folder" in told:
        unfinished, made = told["folder"]
        shutil.rmtree(unfinished, ignore_errors=True)
        remove_empty(made)
    how = "interrupted"
    if not is_interrupted:
        how = f"the run ended before its end, perhaps by your equations: {how_ended(child.exitcode or 0)}"
    streams.say_error(f"{how}; {told['outcome']}")
    return 2


def hear(pipe: Connection, child: BaseProcess, told: dict[str, Any], kind: str, seconds: float) -> None:
    """Add what a child tells, up to a message of this kind or the last one, for so long, while it is there."""
    until = time.monotonic() + seconds
    with suppress(EOFError, OSError):
        while not told.keys() & {kind, "end"} and time.monotonic() < until:
            is_there = child.is_alive()
            if pipe.poll(interrupt.POLL):
                name, what = pipe.recv()
                told[name] = what
            elif not is_there:
                return


def as_child(run: Callable[[], int], parent: Connection) -> None:
    if hasattr(os, "setpgrp"):
        os.setpgrp()
    interrupt.end_with_parent(end_group)
    interrupt.Now.parent = parent
    streams.prepare()
    interrupt.listen()
    interrupt.shield(False)  # it has been started deaf
    interrupt.tell("end", interrupt.answered(run))
    interrupt.leave(0)


def end_group(leader: int = 0) -> None:
    """Kill a process group; 0: that of this process."""
    with suppress(OSError, AttributeError):
        os.killpg(leader, signal.SIGKILL)
