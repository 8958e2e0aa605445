"""Where names stand: as near as can be to what they name, and on nothing else."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from matplotlib.figure import Figure

from compare.report import style


@pytest.mark.parametrize(
    "values, places",
    [
        ([0.0, 5.0], [0.0, 5.0]),  # nothing meets
        ([2.0, 2.0], [1.5, 2.5]),  # both give way
        ([4.0, 2.0, 2.2], [4.0, 1.6, 2.6]),
        ([2.0, 2.0, 3.0, 3.0], [1.0, 2.0, 3.0, 4.0]),  # groups that meet become one
        ([-3.0, 9.0], [0.0, 5.0]),  # within the ends
        ([9.0, 9.0], [4.0, 5.0]),
        ([], []),
    ],
)
def test_labels_are_spread_about_what_they_name(values, places):
    assert style.spread(values, 1.0, 0.0, 5.0) == pytest.approx(places)


@given(st.lists(st.floats(-2.0, 12.0), max_size=11))
def test_spread_labels_keep_their_order_their_distance_and_their_ends(values):
    places = style.spread(values, 1.0, 0.0, 10.0)
    assert (np.diff(np.sort(places)) > 1.0 - 1e-9).all() and ((places > -1e-9) & (places < 10.0 + 1e-9)).all()
    assert np.array_equal(np.argsort(places, kind="stable"), np.argsort(values, kind="stable"))


def test_a_name_stands_beside_its_point_or_has_a_line_to_it():
    fig = Figure(figsize=(style.WIDTH, 3.0))
    ax = fig.subplots()
    ax.plot([0.0, 0.2], [0.2, 0.2])
    wall = ax.plot(np.linspace(0.5, 0.6, 400), np.tile([0.3, 0.9], 200))  # right of the second point
    ax.set(xlim=(0, 1), ylim=(0, 1))
    style.name_ends(ax, [(0.2, 0.2, "free", "black"), (0.48, 0.6, "against a wall of lines", "black")])
    boxes = {text.get_text(): text.get_window_extent() for text in ax.texts}
    free, hindered = boxes.values()
    if next(iter(boxes)) != "free":
        free, hindered = hindered, free
    x, y = ax.transData.transform((0.2, 0.2))
    assert 0.0 < free.x0 - x < 15.0 and free.y0 < y < free.y1
    assert not style.points_in(np.array([hindered.extents]), ax.transData.transform(wall[0].get_xydata())).any()
    assert len([line for line in ax.lines if line.get_label() == "_leader"]) <= 1


def test_letters_are_dark_enough_to_be_read_on_white():
    for colour in (style.BLUE, style.ORANGE, style.GREEN, style.RED, style.GREY, style.PINK, style.SKY, "black"):
        dark = np.array(style.in_letters(colour))
        assert dark @ style.BRIGHTNESS <= style.BRIGHTEST_LETTERS + 1e-12 and (dark >= 0.0).all()
    assert style.in_letters(style.BLUE) == pytest.approx(style.to_rgb(style.BLUE))


def test_the_mark_of_zero_is_at_the_end_of_its_axis():
    fig = Figure()
    ax = fig.subplots()
    ax.semilogy([0, 1], [1e-18, 3e-3])
    style.zero_at_the_end(ax.yaxis, 1e-18, 3e-3, most=6)
    labels = {label.get_position()[1]: label.get_text() for label in ax.get_yticklabels()}
    assert labels[1e-18] == "0" and len(labels) <= 6 and set(labels.values()) >= {"0", "$10^{-14}$", "$10^{-2}$"}
