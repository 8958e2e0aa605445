"""A run in a child process, where a user's own code may end, hang or start what it wants.

The child leads a process group, which ends with it. That it has come to its end is a message, which an exit
status cannot forge.
"""

import os
import shutil
import signal
import threading
import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from math import inf
from multiprocessing import connection, get_context, parent_process
from multiprocessing.process import BaseProcess
from pathlib import Path
from typing import Any

from ..core.errors import how_ended
from . import interrupt, streams

ANSWER, ENDING = 1.0, 60.0  # s for a child to answer an interrupt, and then to write what is finished


def in_child(run: Callable[[], int]) -> int:
    """The exit status of a run in a child; 2, with a line, if the child ends otherwise or does not answer."""
    context = get_context("spawn")
    ours, theirs = context.Pipe()
    child = context.Process(target=as_child, args=(run, theirs))
    interrupt.shield()
    child.start()
    interrupt.shield(False)
    theirs.close()
    told: dict[str, Any] = {"outcome": interrupt.Now.outcome}
    asked, until = 0, inf
    while "end" not in told and time.monotonic() < until:
        ready = connection.wait([ours, child.sentinel], interrupt.POLL)
        try:
            if ours in ready:
                kind, what = ours.recv()
                told[kind] = what
            elif ready:
                break
        except (EOFError, OSError):
            break
        if interrupt.Now.asked > asked:
            child.terminate()  # it hears that as Ctrl-C
            asked, until = interrupt.Now.asked, time.monotonic() + ANSWER
        if "ending" in told and asked == 1:
            until = time.monotonic() + ENDING
            del told["ending"]
    if "end" in told:
        child.join(ANSWER)
    end_group(child)
    if "end" in told:
        return int(told["end"])
    if "folder" in told:
        folder, made = told["folder"]
        clear(folder, made)
    if asked:
        streams.say_error(f"interrupted; {told['outcome']}")
    else:
        how = how_ended(child.exitcode or 0)
        streams.say_error(
            f"the run ended before its end, perhaps by your equations: {how}; {told['outcome']}"
        )
    return 2


def end_group(child: BaseProcess) -> None:
    with suppress(OSError, AttributeError):
        os.killpg(child.pid or 0, signal.SIGKILL)
    child.kill()
    child.join()


def clear(folder: Path, made: Sequence[Path]) -> None:
    """Delete the unfinished report of a run, and the folders that it made for it, if they are empty."""
    shutil.rmtree(folder, ignore_errors=True)
    with suppress(OSError):
        for path in made:
            path.rmdir()


def as_child(run: Callable[[], int], parent: connection.Connection) -> None:
    if hasattr(os, "setpgrp"):
        os.setpgrp()
    threading.Thread(target=end_with_parent, daemon=True).start()
    interrupt.Now.parent = parent
    streams.prepare()
    interrupt.listen()
    interrupt.tell("end", interrupt.answered(run))
    interrupt.leave(0)


def end_with_parent() -> None:
    process = parent_process()
    if process:
        process.join()
    with suppress(AttributeError):
        os.killpg(0, signal.SIGKILL)
    os._exit(1)
