"""Figures on disk, drawn in another process than the one that computes."""

from collections.abc import Sequence
from itertools import chain, islice
from pathlib import Path

import numpy as np

from ..core.check import Result
from ..core.text import say
from ..experiments import EXPERIMENTS, functions
from ..report import images
from ..report.verdict import Figure, Section
from ..robots import Robot


def draw(
    experiment: str, result: Result, robot: Robot, folder: Path, others: dict[str, Result], few: bool = False
) -> list[Figure]:
    """The figures of an experiment on disk.

    others: the results for the picture of the first screen, see `results_needed`.
    few: this picture alone; the first figure of an experiment that has none.
    """
    of_experiment, most = functions(experiment), 0 if picture_of(experiment) else 1
    overview = of_experiment.overview({**others, experiment: result}, robot) if others else ()
    drawn: list[Figure] = []
    with quiet(robot):
        for call in chain(islice(of_experiment.figures(result, robot), most if few else None), overview):
            file, figure, caption = call()
            while file.casefold() in {other.file.casefold() for other in drawn}:
                file += "_"  # names that differ in signs alone may give one file
            path = folder / f"{file}{getattr(figure, 'suffix', '.png')}"
            images.save_figure(figure, path)
            drawn.append(Figure(path.name.removesuffix(".png"), say(caption)))
    return drawn


def results_needed(experiment: str, names: Sequence[str], sections: Sequence[Section]) -> dict[str, Result]:
    """The rows of results for the picture of the first screen, if this is the last of its experiments."""
    picture = picture_of(experiment)
    needed = [name for name in names if picture and picture_of(name) == picture]
    if needed[-1:] != [experiment]:
        return {}
    results = [section.result for section in sections if section.name in needed]
    return {of.experiment: Result(of.experiment, rows=of.rows, label=of.label) for of in results}


def picture_of(experiment: str) -> str:
    return EXPERIMENTS[experiment].overview if experiment in EXPERIMENTS else ""


def quiet(robot: Robot) -> np.errstate:
    """A block in which NumPy does not warn of NaN of a user's own equations: checks report that."""
    return np.errstate(all="ignore" if robot.own else None)
