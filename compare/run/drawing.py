"""Figures on disk, drawn in another process than the one that computes."""

from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import AbstractContextManager, nullcontext
from itertools import chain, islice
from pathlib import Path

import numpy as np

from ..experiments import module
from ..judge.check import Result
from ..process.crash import described
from ..report import images, overview
from ..report.folder import writing
from ..report.text import say
from ..robots import Robot

FIRST = "the first"  # of the figures of an experiment
HALVES = ("like the first", "others")  # drawn side by side


def draw(
    experiment: str,
    result: Result,
    robot: Robot,
    folder: Path,
    others: Mapping[str, Result] | None = None,
    part: str | None = None,
) -> tuple[list, list]:
    """The figures of an experiment on disk: names (without .png) and captions; of those that could not be drawn: names and why.

    `figures(result, robot)` of the experiment's module yields calls that return (name, figure, caption): one that raises leaves
    the later ones alone. others: for the pictures of the first screen, see report.overview. part: FIRST, one of HALVES, or all.
    An error of the disk is raised.
    """
    drawn, failed = [], []
    try:
        own = islice(module(experiment).figures(result, robot), 1 if part == FIRST else None)
        figures = chain(own, overview.pictures_due(experiment, result, robot, others))
        for call in of_half(figures, part) if part in HALVES else figures:
            name, path = called(call), None
            try:
                with quiet(robot):
                    file, figure, caption = call()
                while file.casefold() in {other.casefold() for other, _ in drawn}:
                    file += "_"  # names that differ in signs alone may give one file
                path = folder / f"{file}{getattr(figure, 'suffix', '.png')}"
                with writing(path), quiet(robot):
                    images.save_figure(figure, path)
                drawn.append((path.name.removesuffix(".png"), say(caption)))
            except OSError:
                raise
            except Exception as error:
                if path:
                    path.unlink(missing_ok=True)
                failed.append((name, described(error)))
    except OSError:
        raise
    except Exception as error:
        failed.append((f"number {len(drawn) + len(failed) + 1}", described(error)))
    return drawn, failed


def of_half(figures: Iterable[Callable], half: str) -> Iterator[Callable]:
    """Those of the calls that draw by the same function as the first one, or by others: names are alike in the former alone."""
    first = None
    for call in figures:
        function = getattr(call, "func", call)
        first = first or function
        if (function is first) == (half == HALVES[0]):
            yield call


def called(call: Callable) -> str:
    """What a figure is called before it is drawn: by its function, and what that is asked to draw beside the result."""
    more = [getattr(value, "name", value) for value in getattr(call, "args", ())]
    more = [value for value in more if isinstance(value, str)]
    name = getattr(getattr(call, "func", call), "__name__", "without a name")
    return " ".join([name.removeprefix("draw_"), *more])


def quiet(robot: Robot) -> AbstractContextManager:
    """A block in which numpy says nothing of what is no number, where a user's own equations may give such: checks do."""
    return np.errstate(all="ignore") if getattr(robot, "own", ()) else nullcontext()
