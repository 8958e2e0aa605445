"""What is said of how a file is compared, and only where it is so; URDF files with meshes by packages and floating bases."""

import struct

import numpy as np
import pytest
from files import mjcf

import compare
from compare.engines.mujoco import ModelError, read
from compare.engines.mujoco.remarks import remarks
from compare.report.text import say

BODY = '<body name="b"><joint name="j" axis="0 1 0"/><inertial pos="0.1 0 0" mass="1" diaginertia="1 1.5 {}"/></body>'
INERTIAL = '<inertial><mass value="2"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>'
MESH = '<collision><geometry><mesh filename="{}"/></geometry></collision>'


def urdf(base: str, kind: str = "continuous", inertial: str = "", mesh: str = "") -> str:
    links = f'<link name="{base}">{inertial}</link><link name="rod">{INERTIAL}{mesh}</link>'
    joint = f'<parent link="{base}"/><child link="rod"/><axis xyz="0 0 1"/>'
    return f'<robot name="r">{links}<joint name="j" type="{kind}">{joint}</joint></robot>'


def said(text, has_scenes=True) -> dict:
    """The values of each remark on a file or text, by kind; each can be said."""
    found = remarks(read(text), has_scenes)
    assert all(say(one) for one in found)
    return {one.kind: one.values for one in found}


@pytest.mark.parametrize("option, moment, changed", [
    ('balanceinertia="true"', 3, {"inertia": ["b"]}), ('balanceinertia="true"', 2, None),
    ('settotalmass="3"', 2, {"mass": ["b"], "inertia": ["b"]}), ('settotalmass="1"', 2, None),
    ('boundmass="2"', 2, {"mass": ["b"]}), ('boundmass="0.5"', 2, None),
    ('boundinertia="1.2"', 2, {"inertia": ["b"]}), ('boundinertia="0.5"', 2, None),
    ('fusestatic="true"', 2, None), ('inertiafromgeom="true"', 2, None),
])  # fmt: skip
def test_an_option_of_the_compiler_is_named_if_it_changes_a_number(option, moment, changed):
    found = said(mjcf(BODY.format(moment), f"<compiler {option}/>")).get("changed")
    assert found == (changed and {"why": option.partition("=")[0], "places": changed})


def test_what_is_off_is_said_where_equations_differ_and_nothing_where_they_agree():
    text = mjcf(BODY.format(2).replace('name="b"', 'name="b" gravcomp="1"'))
    M, g = [[[1.51]]], [[0.0]]
    assert list(said(text)) == ["switched_off"] and said(mjcf(BODY.format(2))) == {}
    compare.assert_agrees(text, mass_matrix=M, q=[[0.3]])
    with pytest.raises(AssertionError, match="gravcomp"):
        compare.assert_agrees(text, gravity=g, q=[[0.3]])


@pytest.mark.parametrize("base, kind, inertial, joints, fixed", [
    ("trunk", "continuous", INERTIAL, 1, {"link": "trunk", "mass": 2.0}), ("trunk", "continuous", "", 1, None),
    ("world", "continuous", INERTIAL, 1, None), ("world", "floating", "", 4, None), ("trunk", "floating", "", 4, None),
    ("trunk", "planar", "", 3, None),
])  # fmt: skip
def test_a_base_of_a_urdf_is_free_if_a_joint_frees_it_else_it_is_said_to_be_fixed(
    base, kind, inertial, joints, fixed, tmp_path
):
    (tmp_path / "r.urdf").write_text(urdf(base, kind, inertial))
    assert len(read(tmp_path / "r.urdf").tree.hinge_names) == joints
    assert said(tmp_path / "r.urdf").get("fixed_base") == fixed


def tetrahedron() -> bytes:
    corners = np.vstack([np.zeros(3), 0.1 * np.eye(3)])
    faces = [np.concatenate([np.zeros(3), *corners[list(of)]]) for of in ((0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3))]
    return b"\0" * 80 + struct.pack("<I", 4) + b"".join(struct.pack("<12fH", *face, 0) for face in faces)


@pytest.mark.parametrize("folder, place", [
    ("robot/urdf", "robot/meshes/a.stl"), ("robot", "robot/meshes/a.stl"), (".", "robot/meshes/a.stl"), ("mine", "mine/a.stl"),
])  # fmt: skip
def test_a_mesh_of_a_package_is_found_above_the_file_or_beside_it(folder, place, tmp_path):
    file = tmp_path / folder / "r.urdf"
    for path in (file, tmp_path / place):
        path.parent.mkdir(parents=True, exist_ok=True)
    (tmp_path / place).write_bytes(tetrahedron())
    file.write_text(urdf("base", mesh=MESH.format("package://robot/meshes/a.stl")))
    assert read(file).model.nmesh == 1


@pytest.mark.parametrize("name, help", [("package://robot/a.stl", "beside the file"), ("a.dae", "STL")])
def test_a_mesh_that_cannot_be_read_is_one_line_with_what_helps(name, help, tmp_path):
    (tmp_path / "a.dae").write_text("<COLLADA/>")
    (tmp_path / "r.urdf").write_text(urdf("base", mesh=MESH.format(name)))
    with pytest.raises(ModelError, match=help) as error:
        read(tmp_path / "r.urdf")
    assert "\n" not in str(error.value)
