"""Figures on disk and in the page: small, and as they were drawn; where names stand in them."""

import base64
import io

import numpy as np
import pytest
from matplotlib.figure import Figure
from PIL import Image

from compare.report import images, style


def pixels(source):
    with Image.open(source) as image:
        return np.asarray(image.convert("RGB"), dtype=int)


def test_a_figure_is_small_and_its_colours_are_not_visibly_changed(tmp_path):
    chart = Figure(figsize=(4, 3), dpi=100)
    axes = chart.subplots()
    axes.set_facecolor("#f9f9f9")  # nearly as white as the paper
    for k in range(9):
        axes.plot(np.sin(np.linspace(0, 9, 400) + k), color=(style.BLUE, style.RED)[k % 2], linewidth=3)
    chart.savefig(tmp_path / "whole.png")
    images.save_figure(chart, tmp_path / "few.png")
    whole, few = pixels(tmp_path / "whole.png"), pixels(tmp_path / "few.png")
    off = np.abs(whole - few).max(axis=2)
    assert whole.shape == few.shape and off.mean() < 3 and np.mean(off > 24) < 0.005
    paper = (whole == 255).all(axis=2)
    assert paper.sum() > 9999 and (few[paper] == 255).all()
    sizes = [(tmp_path / name).stat().st_size for name in ("few.webp", "few.png", "whole.png")]
    assert sizes == sorted(sizes)
    address, width, height = images.embedded(tmp_path / "few.png")  # in the page, without loss
    kind, data = address.split(",", 1)
    found = pixels(io.BytesIO(base64.b64decode(data)))
    assert kind == "data:image/webp;base64" and found.shape == (height, width, 3) and (found == few).all()
    (tmp_path / "few.webp").write_bytes((tmp_path / "few.webp").read_bytes() + bytes(100_000))
    assert images.embedded(tmp_path / "few.png")[0].startswith("data:image/png;base64,")


@pytest.mark.parametrize("values", [[], [5.0], [-2.0, -2.0, 3.0], [4.0, 4.1, 4.2, 12.0, 9.9], [5.0] * 11, [*range(11)]])
def test_spread_labels_keep_their_order_their_distance_and_their_ends(values):
    places = style.spread(values, 1.0, 0.0, 10.0)
    assert (np.diff(np.sort(places)) > 1.0 - 1e-9).all() and ((places > -1e-9) & (places < 10.0 + 1e-9)).all()
    assert np.array_equal(np.argsort(places, kind="stable"), np.argsort(values, kind="stable"))
