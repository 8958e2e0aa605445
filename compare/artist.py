"""Two further processes that draw the figures of an experiment while the next one computes."""

import importlib
import signal
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from multiprocessing import get_context


@contextmanager
def artist():
    """Yields submit(experiment, result, folder), whose future is the list of (file name, caption) it has drawn."""
    with ProcessPoolExecutor(2, get_context("spawn"), ignore_interrupt) as pool:
        for _ in range(2):
            pool.submit(importlib.import_module, ".draw", __package__)  # matplotlib loads meanwhile
        try:
            yield lambda *work: pool.submit(draw, *work)
        finally:
            pool.shutdown(cancel_futures=True)


def ignore_interrupt():
    """Ctrl-C is the main process's business."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)


def draw(experiment, result, folder) -> list:
    """The figures of an experiment on disk; their names and captions."""
    drawn = []
    for name, figure, caption in importlib.import_module(f".{experiment}", __package__).figures(result):
        figure.savefig(folder / f"{name}.png")
        drawn.append((name, caption))
    return drawn
