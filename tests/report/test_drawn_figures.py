"""Every figure of a small run as it lies on the paper: nothing cut, nothing over anything, no factor at the end of an axis."""

from types import SimpleNamespace

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.legend import Legend
from matplotlib.text import Text

from compare.core.check import Result
from compare.core.finding import Finding
from compare.experiments import EXPERIMENTS, module
from compare.robots.arm import ARM
from compare.run import drawing

SLACK = 1.0  # pixels
SMALLEST = 7.0  # points: letters that are still read where a page is 950 pixels wide


def flaws(figure) -> list[str]:
    """Each in words, found where matplotlib puts things on the paper. Inside a panel in space nothing is looked at."""
    figure.draw_without_rendering()
    panels = [ax for ax in figure.findobj(Axes) if ax.get_visible()]
    flat = [ax for ax in panels if ax.name != "3d"]
    texts = texts_of(figure, panels, flat)
    written = [(text.get_text(), Text.get_window_extent(text).extents) for text in texts]
    found = [f"too small: {text.get_text()!r}" for text in texts if text.get_fontsize() < SMALLEST]
    found += [f"cut: {text!r}" for text, box in written if cut(box, figure.bbox.extents)]
    for k, (text, box) in enumerate(written):
        others = [other for other, its_box in written[:k] if overlap(box, its_box)]
        found += [f"on each other: {text!r} and {other!r}" for other in others]
    for ax in flat:
        offsets = (axis.get_offset_text().get_text() for axis in (ax.xaxis, ax.yaxis))
        found += [f"a factor at the end of an axis: {text}" for text in offsets if text]
    return found


def test_no_figure_overwrites_one_whose_name_differs_in_its_case_alone(tmp_path, monkeypatch):
    caption = Finding("mass", "summary", {})
    calls = [lambda file=file: (file, None, caption) for file in ("m_a", "M_A", "m_a")]
    experiment = SimpleNamespace(figures=lambda result, robot: calls, overview=lambda results, robot: ())
    monkeypatch.setattr(drawing, "functions", lambda name: experiment)
    monkeypatch.setattr(drawing.images, "save_figure", lambda figure, path: path.touch())
    drawn = drawing.draw("mass", Result("mass"), ARM, tmp_path, {})
    assert len({figure.file.casefold() for figure in drawn}) == len([*tmp_path.iterdir()]) == 3


def texts_of(figure, panels, flat) -> list[Text]:
    """All text that is seen."""
    texts = [*figure.texts, *(ax.title for ax in panels)]
    texts += [text for legend in figure.findobj(Legend) for text in legend.get_texts()]
    for ax in flat:
        texts += ax.texts
        for k, axis in enumerate((ax.xaxis, ax.yaxis)):
            low, high = sorted(axis.get_view_interval())  # numbers beyond it are not drawn
            numbers = [*axis.get_ticklabels(), *axis.get_ticklabels(minor=True)]
            places = [text.get_position()[k] for text in numbers]
            seen = [low < place < high or np.isclose(place, (low, high), 1e-9, 0.0).any() for place in places]
            numbers = [text for text, is_seen in zip(numbers, seen) if is_seen]
            texts += [axis.label, axis.get_offset_text(), *numbers]
    return [text for text in dict.fromkeys(texts) if text.get_visible() and text.get_text().strip()]


def cut(box, page) -> bool:
    return bool((box[:2] < page[:2] - SLACK).any() or (box[2:] > page[2:] + SLACK).any())


def overlap(box, other) -> bool:
    return bool((box[:2] + SLACK < other[2:] - SLACK).all() and (other[:2] + SLACK < box[2:] - SLACK).all())


@pytest.mark.slow
def test_no_text_of_a_figure_is_cut_or_covered(small):
    drawing = [name for name in EXPERIMENTS if hasattr(module(name), "figures")]
    drawn = [call() for name in drawing for call in module(name).figures(small(name), ARM)]
    found = {name: flaws(figure) for name, figure, _ in drawn if hasattr(figure, "axes")}
    assert len(found) > 16 and {name: of for name, of in found.items() if of} == {}
