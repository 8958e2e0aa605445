"""The motion in the page: small, whole, with nothing to fetch, and what was computed; figures: small, as they were drawn."""

import base64
import io
import json
import re
import shutil
import subprocess
from dataclasses import replace

import numpy as np
import pytest
from markupsafe import Markup
from matplotlib.figure import Figure
from PIL import Image
from sections import section

from compare.core.check import About
from compare.core.pictures import Pictures
from compare.core.text import environment
from compare.report import images, motion, style
from compare.robots.arm import ARM


def drawn(scene="held", pictures=129, points=3, apart=0.0, rng=None, ended=None) -> Pictures:
    """A scene in which the points of the first engine go round, those of MuJoCo beside them; or any way that rng chooses."""
    turn = np.linspace(0.0, 1.0, pictures)[:, None] * 3.0 + np.arange(points)
    path = np.stack([np.cos(turn), np.sin(turn)], axis=-1) * np.arange(1, points + 1)[None, :, None]
    ways = [path, path + apart] if rng is None else [rng.normal(size=path.shape) for _ in range(2)]
    t, off = np.linspace(0.0, 5.0, pictures), np.full(pictures, apart)
    if ended is not None:
        ways[1] = np.where((t >= ended)[:, None, None], np.nan, ways[1])
        off = np.where(t >= ended, np.nan, off)
    links = [(k, k + 1) for k in range(points - 1)]
    paths, left = dict(zip(("tmt", "mujoco"), ways)), dict.fromkeys(("tmt", "mujoco"))
    return Pictures(scene, "RK4, dt = 5/128 s", t, paths, links, off, "rad", left, "What is seen.", True)


def page_of(*scenes, label="TMT") -> str:
    of = section("trajectory")
    of.scenes, of.result.label = scenes, label
    return motion.motion_in_html([section("mass"), of], ARM.noun)


def data_of(text) -> dict:
    return json.loads(re.search(r'<script type="application/json">(.*?)</script>', text, re.DOTALL)[1])


def pictures_of(scene) -> list:
    """As the script unfolds them."""
    found = []
    for path in scene["paths"]:
        found.append([])
        for k, picture in enumerate(path):
            found[-1].append(found[-1][k - 1] if picture == 0 else found[0][k] if picture == 1 else picture)
    return found


def test_it_opens_on_the_scene_that_differs():
    drift = "drift", 2.0, 1.0, "at most", False, About.PREDICTION
    of = section("trajectory", ("open loop", 2.0, 1.0, "at most", True), drift)
    scenes = zip(of.result.checks, ("let go", "held"))
    of.result.checks = [replace(check, scene=f"{scene}, RK4") for check, scene in scenes]
    of.scenes = drawn("held"), drawn("let"), drawn("let go")
    names = [scene["name"] for scene in data_of(motion.motion_in_html([of], ARM.noun))["scenes"]]
    assert names == ["let go", "held", "let"]


@pytest.mark.parametrize("apart, ended", [(0.0, None), (1e-9, 2.0), (0.3, None)])
def test_the_pictures_are_those_that_were_computed(apart, ended):
    one = drawn(apart=apart, ended=ended)
    scene = data_of(page_of(one))["scenes"][0]
    found = pictures_of(scene)
    every = np.concatenate([*one.points.values()]).reshape(-1, 2)
    low, high = np.nanmin(every, axis=0), np.nanmax(every, axis=0)
    scale = min((np.array([motion.WIDE, motion.HIGH]) - 2 * motion.BORDER) / (high - low))
    for picture, path in zip(found, one.points.values()):
        for values, points in zip(picture, path):
            assert (values is None) == np.isnan(points).any()
            if values is not None:
                right, up = (scale * (points - (low + high) / 2)).T
                there = np.column_stack([motion.WIDE / 2 + right, motion.HIGH / 2 - up])
                np.testing.assert_allclose(np.reshape(values, (-1, 2)), there, atol=0.51)
    assert (scene["dt"], scene["links"]) == (5.0 / 128, [[0, 1], [1, 2]])
    assert scene["apart"][0] == apart and (scene["apart"][-1] is None) == (ended is not None)
    assert found[1][scene["still"]] is not None and (scene["still"] == 128) == (ended is None)


def test_it_fetches_nothing_is_there_without_script_and_no_name_can_break_it():
    text = page_of(drawn("</script><b>&amp;\u2028", apart=0.3), drawn("let go"), label="yours")
    data = data_of(text)
    scene, engines = data["scenes"][0], data["engines"]
    assert not re.search(r"https?:|src=|href=|@import|fetch\(|import\(|url\((?!#motion-ring\))", text)
    assert text.count("<option>") == 2 and '<div class="controls" hidden>' in text
    for name, pictures in zip(("ours", "theirs"), pictures_of(scene)):
        x, y, *_ = pictures[-1]
        assert f'<path class="{name}" d="M{x} {y}L' in text
    x, y = pictures_of(scene)[0][0][:2]
    assert scene["base"].startswith(f"M{x} {y}m") and scene["base"] in text  # where the robot is fixed
    assert data_of(page_of(drawn()._replace(fixed=False)))["scenes"][0]["base"] == ""
    assert "<b>" not in text and text.count("</script>") == 1 and "&lt;/script&gt;&lt;b&gt;" in text
    assert (scene["name"], engines) == ("</script><b>&amp;\u2028", ["Yours", "MuJoCo"])


@pytest.mark.slow
def test_a_large_robot_has_fewer_pictures_and_then_fewer_scenes(rng):
    text = page_of(*(drawn(f"scene {k}", points=400, rng=rng) for k in range(6)))
    found = data_of(text)["scenes"]
    assert len(text.encode()) <= 300_000 and len(found) < 6 and found[0]["dt"] == pytest.approx(5.0 / 16)
    assert len(found[0]["paths"][0]) == len(found[0]["apart"]) == 17
    assert all(f"scene {k}" in text for k in range(6))  # also those that are not shown


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("chromium") is None, reason="there is no Chromium to run the script")
def test_the_script_draws_each_engine_where_it_is(tmp_path):
    values = {"title": "", "good": True, "links": (), "script": motion.SCRIPT}
    attack = "<img src=x onerror=document.title=1><script>document.title=1</script>"
    values["body"] = Markup(page_of(drawn(apart=0.3)) + attack)  # as if nothing were escaped
    text = environment().get_template("page.html.jinja").render(values)  # whose policy allows the script
    script = text.index("<script")
    page = tmp_path / "page.html"
    page.write_text(re.sub(r' d="M[^"]*"', ' d=""', text[:script]) + text[script:], encoding="utf-8")
    asked = ["--headless=new", "--no-sandbox", "--disable-gpu", "--force-prefers-reduced-motion", "--dump-dom",
             f"--user-data-dir={tmp_path / 'profile'}", "--virtual-time-budget=2000", page.as_uri()]  # fmt: skip
    run = subprocess.run(["chromium", *asked], capture_output=True, text=True, timeout=120)
    for name, pictures in zip(("ours", "theirs"), pictures_of(data_of(text)["scenes"][0])):
        assert f'class="{name}" d="{motion.outline(pictures[-1], [(0, 1), (1, 2)])}"' in run.stdout, name
    parts = "5.00 s", "0.3 rad", '<div class="controls">', "<title></title>"
    assert all(part in run.stdout for part in parts)


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
    address, width, height = images.embedded(tmp_path / "few.png")  # in the page, without loss
    kind, data = address.split(",", 1)
    found = pixels(io.BytesIO(base64.b64decode(data)))
    assert kind == "data:image/png;base64" and found.shape == (height, width, 3) and (found == few).all()
