"""Figures on disk and in the page: small, and as they were drawn."""

import base64
import io

import numpy as np
import pytest
from matplotlib.figure import Figure
from PIL import Image

from compare.report import images
from compare.report.style import BLUE, RED


@pytest.fixture
def chart():
    figure = Figure(figsize=(4, 3), dpi=100)
    axes = figure.subplots()
    axes.set_facecolor("#f9f9f9")  # nearly as white as the paper
    for k in range(9):
        axes.plot(np.sin(np.linspace(0, 9, 400) + k), color=(BLUE, RED)[k % 2], linewidth=3)
    return figure


def pixels(source):
    with Image.open(source) as image:
        return np.asarray(image.convert("RGB"), dtype=int)


def test_a_figure_is_small_and_its_colours_are_not_visibly_changed(chart, tmp_path):
    chart.savefig(tmp_path / "whole.png")
    images.save_figure(chart, tmp_path / "few.png")
    whole, few = pixels(tmp_path / "whole.png"), pixels(tmp_path / "few.png")
    off = np.abs(whole - few).max(axis=2)
    assert whole.shape == few.shape and off.mean() < 3 and np.mean(off > 24) < 0.005
    paper = (whole == 255).all(axis=2)
    assert paper.sum() > 9999 and (few[paper] == 255).all()
    sizes = [(tmp_path / name).stat().st_size for name in ("few.webp", "few.png", "whole.png")]
    assert sizes == sorted(sizes)


def test_the_page_has_the_smaller_file_whole(chart, tmp_path):
    images.save_figure(chart, tmp_path / "a.png")
    address, width, height = images.embedded(tmp_path / "a.png")
    kind, data = address.split(",", 1)
    assert kind == "data:image/webp;base64" and base64.b64decode(data) == (tmp_path / "a.webp").read_bytes()
    assert pixels(io.BytesIO(base64.b64decode(data))).shape == (height, width, 3)
    assert (pixels(io.BytesIO(base64.b64decode(data))) == pixels(tmp_path / "a.png")).all()  # without loss
    (tmp_path / "a.webp").write_bytes((tmp_path / "a.webp").read_bytes() + bytes(100_000))
    assert images.embedded(tmp_path / "a.png")[0].startswith("data:image/png;base64,")
    images.clear_webp(tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["a.png"]
    assert images.embedded(tmp_path / "a.png")[0].startswith("data:image/png;base64,")
    with pytest.raises(OSError):
        images.embedded(tmp_path / "b.png")


def test_a_map_of_many_colours_keeps_them(tmp_path):
    figure = Figure(figsize=(4, 3), dpi=100)
    figure.subplots().pcolormesh(np.add.outer(np.arange(60.0), np.arange(60.0)), cmap="viridis")
    figure.savefig(tmp_path / "whole.png")
    images.save_figure(figure, tmp_path / "few.png")
    whole, few = pixels(tmp_path / "whole.png"), pixels(tmp_path / "few.png")
    drawn = (whole != 255).any(axis=2)
    assert np.abs(whole - few).max(axis=2)[drawn].mean() < 1
