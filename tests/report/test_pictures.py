"""Figures: small, as they were drawn, and whole in the page; animations too."""

import base64

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
    sizes = [(tmp_path / name).stat().st_size for name in ("few.png", "whole.png")]
    assert sizes == sorted(sizes)


@pytest.mark.parametrize("name, kind", [("a.png", "png"), ("a.gif", "gif")])
def test_a_picture_in_the_page_is_its_file(name, kind, tmp_path):
    others = [Image.new("L", (3, 2), 200)] * (kind == "gif")
    Image.new("L", (3, 2)).save(tmp_path / name, save_all=bool(others), append_images=others)
    address, *size = images.embedded(tmp_path / name)
    head, data = address.split(",", 1)
    assert (head, size) == (f"data:image/{kind};base64", [3, 2])
    assert base64.b64decode(data) == (tmp_path / name).read_bytes()
