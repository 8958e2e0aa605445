"""What an MJCF file needs beside itself: it is found, its change changes the hash, and it is sent along."""

import os
import struct
import zlib
from pathlib import Path

import numpy as np
import pytest
from mujoco import MjModel

from compare.engines.mujoco import ModelError, read
from compare.fleet.models import bundle, found_models, unpacked
from compare.fleet.parts import needed_by

TETRAHEDRON = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 {}\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n"


def png(level):
    """One pixel."""

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    header = struct.pack(">IIBBBBB", 4, 4, 8, 0, 0, 0, 0)
    rows = zlib.compress((b"\0" + bytes([level, 9, 200, 30])) * 4)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", rows) + chunk(b"IEND", b"")


@pytest.fixture
def write(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)

    def write(name, content):
        path = Path(name)
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(content if isinstance(content, bytes) else content.encode())

    return write


def robot(assets, geoms, more=""):
    return (f"<mujoco>{more}<asset>{assets}</asset><worldbody><body name='b'><joint name='j' axis='0 1 0'/>{geoms}</body>"
            "</worldbody></mujoco>")  # fmt: skip


def collection(write):
    """A model with everything, below and above its folder."""
    write("shared/meshes/above.obj", TETRAHEDRON.format(1))
    write("robots/r/assets/inside.obj", TETRAHEDRON.format(2))
    write("robots/r/assets/stripped.obj", TETRAHEDRON.format(3))
    write("robots/r/assets/ground.png", png(100))
    write("robots/r/pictures/wood.png", png(20))
    for side in ("right", "left", "up", "down", "front", "back"):
        write(f"robots/r/pictures/{side}.png", png(len(side)))
    write("robots/r/parts/defaults.xml", "<mujocoinclude><default><geom density='500'/></default>"
          "<include file='deeper/settings.xml'/></mujocoinclude>")  # fmt: skip
    write("robots/r/deeper/settings.xml", "<mujocoinclude><option timestep='0.003'/></mujocoinclude>")
    write("robots/r/hand/hand.xml", robot("<mesh name='m' file='finger.obj'/>", "<geom type='mesh' mesh='m'/>",
          "<compiler meshdir='shapes'/>"))  # fmt: skip
    write("robots/r/hand/shapes/finger.obj", TETRAHEDRON.format(4))
    sides = " ".join(f"file{side}='{side}.png'" for side in ("right", "left", "up", "down", "front", "back"))
    assets = (
        "<mesh name='a' file='../../../shared/meshes/above.obj'/><mesh name='i' file='inside.obj'/>"
        "<hfield name='h' file='ground.png' size='1 1 0.1 0.1'/><texture name='t' type='2d' file='wood.png'/>"
        f"<texture name='c' type='cube' {sides}/><model name='hand' file='hand/hand.xml'/>"
    )
    geoms = "<geom type='mesh' mesh='a'/><geom type='mesh' mesh='i'/><attach model='hand' body='b' prefix='h_'/>"
    more = "<compiler meshdir='assets' texturedir='pictures'/><include file='parts/defaults.xml'/>"
    write("robots/r/r.xml", robot(assets, geoms, more))
    return Path("robots/r/r.xml")


def test_everything_is_found_and_compiles_to_the_same_elsewhere(write, tmp_path):
    path = collection(write)
    write("robots/r/assets/unused.obj", TETRAHEDRON.format(9))
    (model,) = (m for m in found_models(["robots"]).models if m.path.name == "r.xml")
    names = {os.path.basename(part) for part in model.parts}
    assert {"above.obj", "inside.obj", "ground.png", "wood.png", "back.png", "defaults.xml", "settings.xml", "hand.xml",
            "finger.obj"} <= names  # fmt: skip
    assert "unused.obj" not in names
    here = MjModel.from_xml_path(str(path))
    (tmp_path / "elsewhere").mkdir()
    files = bundle(model)
    os.rename("robots", "gone")
    os.rename("shared", "gone_too")
    there = MjModel.from_xml_path(str(unpacked(files, tmp_path / "elsewhere")))
    assert (there.opt.timestep, there.nmesh, there.nhfield) == (0.003, 3, 1)
    for name in ("body_mass", "body_inertia", "mesh_vert", "hfield_data", "dof_armature"):
        assert np.array_equal(getattr(here, name), getattr(there, name)), name


@pytest.mark.parametrize("changed", ["shared/meshes/above.obj", "robots/r/assets/inside.obj", "robots/r/assets/ground.png",
    "robots/r/pictures/up.png", "robots/r/deeper/settings.xml", "robots/r/hand/shapes/finger.obj", "robots/r/r.xml"])  # fmt: skip
def test_a_change_of_a_part_changes_the_hash(changed, write):
    path = collection(write)

    def hash_now():
        (model,) = found_models([str(path)]).models
        return model.hash, model.sha256

    before = hash_now()
    write("robots/r/assets/unused.obj", TETRAHEDRON.format(9))
    write("robots/other.xml", "<mujoco/>")
    assert hash_now() == before
    write(changed, Path(changed).read_bytes() + b"\n")
    after = hash_now()
    assert after[0] != before[0] and (after[1] != before[1]) == changed.endswith("r.xml")


def test_paths_are_stripped_where_the_file_asks_for_it(write, tmp_path):
    write("assets/s.obj", TETRAHEDRON.format(1))
    write("m.xml", robot("<mesh name='s' file='C:\\far\\away/s.obj'/>", "<geom type='mesh' mesh='s'/>",
          "<compiler assetdir='assets' strippath='true'/>"))  # fmt: skip
    (model,) = found_models(["m.xml"]).models
    assert [part.name for part in model.parts] == ["m.xml", "s.obj"]
    (tmp_path / "elsewhere").mkdir()
    assert MjModel.from_xml_path(str(unpacked(bundle(model), tmp_path / "elsewhere"))).nmesh == 1


def test_what_is_missing_is_left_to_the_compiler(write, tmp_path):
    write("m.xml", robot("<mesh name='s' file='none.obj'/>", "<geom type='mesh' mesh='s'/>"))
    (model,) = found_models(["m.xml"]).models
    assert list(model.parts) == [Path("m.xml")]
    with pytest.raises(ModelError, match=r"none\.obj"):
        read(unpacked(bundle(model), tmp_path / "elsewhere"))


def test_an_absolute_path_is_part_of_the_hash(write, tmp_path):
    write("far/s.obj", TETRAHEDRON.format(1))
    write("m/m.xml", robot(f"<mesh name='s' file='{tmp_path}/far/s.obj'/>", "<geom type='mesh' mesh='s'/>"))
    before = found_models(["m"]).models[0].hash
    write("far/s.obj", TETRAHEDRON.format(2))
    assert found_models(["m"]).models[0].hash != before


def test_files_that_include_themselves_and_many_folders_come_to_an_end(write):
    folders = "".join(f"<compiler meshdir='d{k}' texturedir='d{k}' assetdir='d{k}'/>" for k in range(40))
    write("a.xml", f"<mujoco>{folders}<include file='b.xml'/><include file='a.xml'/></mujoco>")
    write("b.xml", f"<mujoco>{folders}<include file='a.xml'/><mesh file='x.obj'/></mujoco>")
    write("d39/x.obj", "")
    Path("loop").symlink_to(".")
    write("c.xml", "<mujoco><include file='loop/c.xml'/></mujoco>")
    assert [part.as_posix() for part in needed_by(Path("a.xml"))] == ["a.xml", "b.xml", "d39/x.obj"]
    assert needed_by(Path("c.xml"))[0] == Path("c.xml")


def test_names_that_no_file_can_have_are_passed_over(write):
    write(
        "m.xml",
        "<mujoco><mesh file='" + "x" * 5000 + "'/><mesh file=''/><mesh file='/dev/zero'/><mesh file='.'/></mujoco>",
    )
    assert needed_by(Path("m.xml")) == (Path("m.xml"),)
