"""Two further processes: they draw the figures of an experiment while the next one computes, and follow scenes."""

import importlib
import os
import signal
import threading
from concurrent.futures import ProcessPoolExecutor, wait
from contextlib import contextmanager
from multiprocessing import get_context, parent_process


class Workers(ProcessPoolExecutor):
    """A pool of processes that knows when nothing is under way."""

    def __init__(self, *arguments):
        super().__init__(*arguments)
        self.futures = []

    def submit(self, *arguments, **named):
        self.futures.append(super().submit(*arguments, **named))
        return self.futures[-1]

    def quiet(self):
        """Wait until all that was submitted is done: a timing needs the machine for itself."""
        wait(self.futures)


@contextmanager
def start_workers():
    """Yields a pool of two processes, for `draw` and for scenes that can run side by side."""
    with Workers(2, get_context("spawn"), watch_parent) as pool:
        # Ctrl-C is this process's business: the others are started deaf to it
        hearing = signal.signal(signal.SIGINT, signal.SIG_IGN)
        for _ in range(2):
            pool.submit(importlib.import_module, ".draw", __package__)  # matplotlib loads meanwhile
        signal.signal(signal.SIGINT, hearing)
        try:
            yield pool
        finally:
            pool.shutdown(cancel_futures=True)


def watch_parent():
    """End with the main process, however that ends."""

    def wait():
        parent_process().join()
        os._exit(1)

    threading.Thread(target=wait, daemon=True).start()


def draw(experiment, result, folder) -> list:
    """The figures of an experiment on disk; their names and captions."""
    drawn = []
    for name, figure, caption in importlib.import_module(f".{experiment}", __package__).figures(result):
        figure.savefig(folder / f"{name}.png")
        drawn.append((name, caption))
    return drawn
