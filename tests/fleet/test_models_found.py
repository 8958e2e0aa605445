"""Which files a fleet has: folders, patterns, files and lists, what is left out, and what a file needs beside itself."""

import os
from pathlib import Path

import pytest

from compare.core.errors import Refused
from compare.fleet.models import found_models

MODEL = "<mujoco><worldbody><body><joint/><geom size='1'/></body></worldbody></mujoco>"


@pytest.fixture
def here(tmp_path, monkeypatch):
    """An empty folder, and a function that writes files there by their names."""
    monkeypatch.chdir(tmp_path)

    def write(names, content=MODEL):
        for path in map(Path, [names] if isinstance(names, str) else names):
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(content if isinstance(content, bytes) else content.encode())

    return write


def names(*asked):
    return [model.shown for model in found_models(asked)[0]]


def left_out(*asked):
    return dict(found_models(asked)[1])


def test_a_folder_gives_its_mjcf_at_any_depth_and_nothing_else(here):
    here(["m/a.xml", "m/b/c/d.XML", "m/e.mjcf", "m/folder.xml/h.xml"])
    here(["m/.git/f.xml", "m/b/.g.xml", "m/mesh.obj"])
    here(["m/robot.urdf", "m/robot.urdf.xml"], "<robot name='x'/>")
    here(["m/robot.urdf.xacro", "m/world.sdf.xml"], "<sdf/>")  # the second is refused
    here("m/part.xml", "<mujocoinclude><body>")
    here(["m/none.xml", "m/words.xml"], "alpha turns")  # these are refused
    if hasattr(os, "mkfifo"):
        os.mkfifo("m/pipe.xml")
    found = ["m/a.xml", "m/b/c/d.XML", "m/e.mjcf", "m/folder.xml/h.xml", "m/none.xml", "m/robot.urdf",
             "m/robot.urdf.xml", "m/words.xml", "m/world.sdf.xml"]  # fmt: skip
    assert names("m") == found and left_out("m") == {"m/part.xml": "root element <mujocoinclude>"}
    assert names("m/part.xml") == ["m/part.xml"]  # what is named is a model
    if hasattr(os, "mkfifo"):
        with pytest.raises(Refused, match="not a regular file"):
            names("m/pipe.xml")


def test_patterns_and_lists(here):
    here(["m/a.xml", "m/b/c.xml", "m/b/d/e.xml", "n/a[1].xml", "m/b c.xml"])
    assert names("m/*.xml") == ["m/a.xml", "m/b c.xml"]
    assert names("m/**/*.xml") == ["m/a.xml", "m/b c.xml", "m/b/c.xml", "m/b/d/e.xml"] == names("m/**")
    assert names("n/a[1].xml") == ["n/a[1].xml"]  # a file of that name comes before the pattern
    here("list.txt", "\ufeff# what is released\r\n\r\n  m/b c.xml  \r\nn/a[1].xml\r\n@more.txt\r\n")
    assert names("@list.txt") == ["m/b c.xml", "n/a[1].xml"]


def test_a_part_that_is_named_is_a_model_too(here):
    here("m/part.xml")
    here("m/whole.xml", "<mujoco><include file='part.xml'/></mujoco>")
    assert names("m") == ["m/whole.xml"] and left_out("m") == {"m/part.xml": "included by m/whole.xml"}
    assert names("m/whole.xml", "m/part.xml") == ["m/part.xml", "m/whole.xml"] == names("m", "m/part.xml")
    assert left_out("m", "m/part.xml") == {}


@pytest.mark.parametrize("asked, says", [
    (["m/a.xml", "m/*.mjcf"], r"m/\*.mjcf"), (["m\n\0"], r"m\\n\\x00"), (["@m"], "list m"), (["@bad.txt"], "m/c.xml"),
])  # fmt: skip
def test_a_word_that_names_nothing_is_refused_in_one_line(asked, says, here):
    here("m/a.xml")
    here("bad.txt", "m/c.xml\n")
    with pytest.raises(Refused, match=says) as refused:
        found_models(asked)
    assert len(str(refused.value).splitlines()) == 1


TETRAHEDRON = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 {}\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n"
GEOM, MESH = "<geom type='mesh' mesh='m'/>", "<mesh name='m' file='{}'/>"


def robot(assets, geoms=GEOM, more=""):
    return (f"<mujoco>{more}<asset>{assets}</asset><worldbody><body name='b'><joint name='j' axis='0 1 0'/>{geoms}</body>"
            "</worldbody></mujoco>")  # fmt: skip


@pytest.fixture
def collection(here):
    """A model with parts below and above its folder."""
    hand = robot(MESH.format("finger.obj"), more="<compiler meshdir='shapes'/>")
    defaults = "<default><geom density='500'/></default><include file='deeper/settings.xml'/>"
    assets = MESH.format("../../../shared/meshes/above.obj") + "<model name='hand' file='hand/hand.xml'/>"
    more = "<compiler meshdir='assets'/><include file='parts/defaults.xml'/>"
    files = {
        "shared/meshes/above.obj": TETRAHEDRON.format(1), "robots/r/hand/hand.xml": hand,
        "robots/r/parts/defaults.xml": f"<mujocoinclude>{defaults}</mujocoinclude>",
        "robots/r/deeper/settings.xml": "<mujocoinclude><option timestep='0.003'/></mujocoinclude>",
        "robots/r/hand/shapes/finger.obj": TETRAHEDRON.format(4),
        "robots/r/r.xml": robot(assets, f"{GEOM}<attach model='hand' body='b' prefix='h_'/>", more),
    }  # fmt: skip
    for name, content in files.items():
        here(name, content)
    here("robots/r/assets/unused.obj", TETRAHEDRON.format(9))
    return files


def test_everything_that_a_model_needs_is_known_and_its_content(collection, here):
    (model,) = found_models(["robots/r/r.xml"])[0]
    names = [os.path.normpath(os.path.join("robots/r", name)) for name, _ in model.contents]
    assert {*names} == set(collection) and names[0] == "robots/r/r.xml"
    before = dict(model.contents)
    here("robots/r/hand/shapes/finger.obj", TETRAHEDRON.format(5))
    changed = [name for name, content in model.contents if content != before[name]]
    assert changed == ["hand/shapes/finger.obj"]
