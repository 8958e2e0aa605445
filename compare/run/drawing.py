"""Figures on disk, drawn in another process than the one that computes."""

from collections.abc import Mapping, Sequence
from itertools import chain, islice
from pathlib import Path

import numpy as np

from ..core.check import Result
from ..core.text import say
from ..experiments import EXPERIMENTS, module
from ..report import images
from ..report.folder import writing
from ..report.verdict import Section
from ..robots import Robot


def draw(
    experiment: str,
    result: Result,
    robot: Robot,
    folder: Path,
    others: Mapping | None = None,
    few: bool = False,
) -> list[tuple[str, str]]:
    """The figures of an experiment on disk: names (without .png) and captions.

    others: the results for the picture of the first screen, see `results_needed`. few: this picture alone; the first figure of
    an experiment that has none.
    """
    many = (0 if EXPERIMENTS[experiment].overview else 1) if few else None
    own = getattr(module(experiment), "figures", lambda *_: ())
    drawn, calls = [], islice(own(result, robot), many)
    if others and hasattr(module(experiment), "overview"):
        calls = chain(calls, module(experiment).overview({**others, experiment: result}, robot))
    with quiet(robot):
        for call in calls:
            file, figure, caption = call()
            while file.casefold() in {other.casefold() for other, _ in drawn}:
                file += "_"  # names that differ in signs alone may give one file
            path = folder / f"{file}{getattr(figure, 'suffix', '.png')}"
            with writing(path):
                images.save_figure(figure, path)
            drawn.append((path.name.removesuffix(".png"), say(caption)))
    return drawn


def results_needed(experiment: str, names: Sequence[str], sections: Sequence[Section]) -> dict[str, Result]:
    """The results, rows alone, for the picture of the first screen, if this is the last of its experiments.

    names: of the experiments that run, in their order; sections: of those that are done.
    """
    picture = EXPERIMENTS[experiment].overview if experiment in EXPERIMENTS else ""
    needed = [name for name in names if picture and EXPERIMENTS[name].overview == picture]
    if needed[-1:] != [experiment]:
        return {}
    results = [section.result for section in sections if section.name in needed]
    return {of.experiment: Result(of.experiment, rows=of.rows, label=of.label) for of in results}


def quiet(robot: Robot) -> np.errstate:
    """A block in which NumPy does not warn of NaN where a user's own equations may give it: checks report that."""
    return np.errstate(all="ignore" if getattr(robot, "own", ()) else None)
