"""The pictures of the first screen: of which experiments each is, and when it can be drawn.

`engines_apart` and `methods_compared` take from results what they show; `figures_overview` draws that.
"""

import importlib
from collections.abc import Callable, Iterator, Mapping, Sequence

from ..experiments import EXPERIMENTS
from ..judge.check import Result
from .verdict import Section

PICTURES = {  # the pictures in their order, and the experiments whose results they need
    picture: tuple(name for name, record in EXPERIMENTS.items() if record.overview == picture)
    for picture in dict.fromkeys(record.overview for record in EXPERIMENTS.values() if record.overview)
}
BEGINNING = "overview_"  # of the names of their files


def results_needed(experiment: str, names: Sequence[str], sections: Sequence[Section]) -> dict[str, Result]:
    """The results, rows alone, that pictures need which can be drawn once this experiment is done, its own among them.

    names: of the experiments that run, in their order; sections: of those that are done. A picture of two experiments is drawn
    with the later one.
    """
    results = {section.name: section.result for section in sections}
    of_pictures = [[name for name in names if name in needs] for needs in PICTURES.values() if experiment in needs]
    others = [name for ran in of_pictures if ran[-1:] == [experiment] for name in ran if name in results]
    return {name: Result(name, rows=results[name].rows, label=results[name].label) for name in others}


def pictures_due(
    experiment: str, result: Result, robot: object, others: Mapping[str, Result] | None
) -> Iterator[Callable]:
    """Calls that draw the pictures that can be drawn now. others: `results_needed` of this experiment."""
    if others:
        pictures = importlib.import_module(".figures_overview", __package__).pictures  # where figures are drawn
        yield from pictures(experiment, {**others, experiment: result}, robot)


def drawn_with(experiment: str, results: Mapping[str, Result]) -> list[str]:
    """The pictures that can be drawn of these results, the last of which is this experiment's."""
    return [name for name, needs in PICTURES.items() if experiment in needs and any(need in results for need in needs)]


def times_in_print(ratio: float) -> str:
    """A ratio in print, two digits of it, without a power of ten where none is needed."""
    return f"{float(f'{ratio:.2g}'):g}"
